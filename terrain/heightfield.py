"""The ground as a regular grid of heights, triangulated alike for physics and rays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

Floats = NDArray[np.floating]
"""Array of any float type and shape."""


@dataclass(frozen=True)
class Heightfield:
    """Ground heights on a square grid centred on the origin of the map frame.

    ``heights[ix, iy]`` is at ``x = ix * cell - width / 2`` and ``y = iy * cell - depth / 2``. Each
    grid cell is split along the diagonal from ``(i + 1, j)`` to ``(i, j + 1)``, as in pybullet, so
    that contacts and rays have the same surface.

    Attributes:
        heights: Heights [m], float32, shape (nx, ny), at least 2 x 2, finite.
        cell: Distance between grid lines [m].
    """

    heights: NDArray[np.float32]
    cell: float

    def __post_init__(self) -> None:
        """Check shape and values, and make the heights read-only.

        Raises:
            ValueError: If a field is not as documented.
        """
        if self.heights.ndim != 2 or min(self.heights.shape) < 2:
            shape = self.heights.shape
            raise ValueError(f"heights: expected shape (nx, ny) of at least 2 x 2, got {shape}")
        if self.heights.dtype != np.float32:
            raise ValueError(f"heights: expected float32, got {self.heights.dtype}")
        if not np.isfinite(self.heights).all():
            raise ValueError("heights: expected finite values, got NaN or infinity")
        if not self.cell > 0:
            raise ValueError(f"cell: expected a positive length [m], got {self.cell}")
        self.heights.setflags(write=False)

    @property
    def width(self) -> float:
        """Extent along x [m]."""
        return (self.heights.shape[0] - 1) * self.cell

    @property
    def depth(self) -> float:
        """Extent along y [m]."""
        return (self.heights.shape[1] - 1) * self.cell

    @property
    def x(self) -> NDArray[np.float64]:
        """Grid lines along x [m], shape (nx,)."""
        return np.arange(self.heights.shape[0], dtype=np.float64) * self.cell - self.width / 2

    @property
    def y(self) -> NDArray[np.float64]:
        """Grid lines along y [m], shape (ny,)."""
        return np.arange(self.heights.shape[1], dtype=np.float64) * self.cell - self.depth / 2

    def height_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.float64]:
        """Return the height of the triangulated surface; beyond the border, that of the border.

        Args:
            x: Map x [m], any shape.
            y: Map y [m], same shape.

        Returns:
            Heights [m], same shape; NaN where a coordinate is NaN.
        """
        along, across = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if along.shape != across.shape:
            along, across = np.broadcast_arrays(along, across)
        heights = np.empty(along.shape)
        _interpolate(self.heights, self.cell, along.ravel(), across.ravel(), heights.ravel())
        return heights

    def refined(self, factor: int) -> "Heightfield":
        """Return the same surface on a finer grid, up to the rounding of float32.

        Args:
            factor: Number of new cells along the edge of one.

        Raises:
            ValueError: If the factor is less than 1.
        """
        if factor < 1:
            raise ValueError(f"factor: expected 1 or more, got {factor}")
        if factor == 1:
            return self
        nx, ny = ((n - 1) * factor + 1 for n in self.heights.shape)
        cell = self.cell / factor
        x, y = np.arange(nx) * cell - self.width / 2, np.arange(ny) * cell - self.depth / 2
        return Heightfield(self.height_at(x[:, None], y[None, :]).astype(np.float32), cell)

    def triangles(self) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """Return the surface as triangles that face upwards.

        Returns:
            Vertices [m], float32, shape (nx * ny, 3), and vertex indices, uint32, shape
            (2 * (nx - 1) * (ny - 1), 3). Grid cell ``(i, j)`` has triangles ``2 k`` and
            ``2 k + 1`` with ``k = i * (ny - 1) + j``.
        """
        nx, ny = self.heights.shape
        grid_x, grid_y = np.meshgrid(self.x, self.y, indexing="ij")
        vertices = np.stack(
            [grid_x, grid_y, self.heights], axis=-1, dtype=np.float32, casting="same_kind"
        ).reshape(-1, 3)
        index = np.arange(nx * ny, dtype=np.uint32).reshape(nx, ny)
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]
        faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([b, d, c], axis=-1)], axis=2)
        return vertices, np.ascontiguousarray(faces.reshape(-1, 3))


@kernel
def _interpolate(
    heights: NDArray[np.float32],
    cell: float,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    result: NDArray[np.float64],
) -> None:
    """Write the heights of the triangulated surface at places.

    Args:
        heights: Heights at the grid's corners [m], shape (nx, ny).
        cell: Distance between grid lines [m].
        x: Map x of the places [m], shape (k,).
        y: Map y of the places [m], shape (k,).
        result: Output: heights [m], shape (k,).
    """
    nx, ny = heights.shape
    half_x, half_y = (nx - 1) * cell / 2, (ny - 1) * cell / 2
    for k in range(len(x)):
        if np.isnan(x[k]) or np.isnan(y[k]):
            result[k] = np.nan
            continue
        u = min(max((x[k] + half_x) / cell, 0.0), nx - 1.0)
        v = min(max((y[k] + half_y) / cell, 0.0), ny - 1.0)
        i, j = min(int(u), nx - 2), min(int(v), ny - 2)
        u, v = u - i, v - j
        a, b, c, d = heights[i, j], heights[i + 1, j], heights[i, j + 1], heights[i + 1, j + 1]
        # Each cell is two triangles; the place decides between them.
        if u + v <= 1.0:
            result[k] = a + u * (b - a) + v * (c - a)
        else:
            result[k] = d + (1 - u) * (c - d) + (1 - v) * (b - d)
