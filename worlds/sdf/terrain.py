"""Heights of ground in worlds of Gazebo: planes, heightmaps, models that are named as ground."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from scipy.ndimage import map_coordinates

from terrain.classes import SemanticClass
from terrain.objects import hull
from worlds.sdf.elements import SdfError
from worlds.sdf.footprints import facing
from worlds.sdf.shapes import Heightmap, Plane
from worlds.sdf.solids import parts_of
from worlds.sdf.world import Solid

_MAX_PIXELS = 8193
"""Largest number of pixels along an edge of an image."""

_ABOVE = 10.0
"""Height over a shape from which it is looked at [m]."""

_TOLERANCE = 0.01
"""Depth at which round shapes may be cut [m]."""

_TURNED = 1e-6
"""Sine of the angle by which a heightmap may be turned."""

Floats = NDArray[np.float64]


class Terrain(Protocol):
    """Heights of one shape of the ground."""

    @property
    def bounds(self) -> tuple[float, float, float, float] | None:
        """Rectangle in which it is, x_min, y_min, x_max, y_max [m]; None if it has no end."""

    @property
    def spacing(self) -> float:
        """Distance between its own heights [m], infinite if it has none."""

    def heights(self, x: Floats, y: Floats) -> Floats:
        """Return heights at places [m], same shape; minus infinite where it is not."""


def terrain_of(solid: Solid) -> Terrain | None:
    """Return the ground that a shape is; None for a ceiling.

    Raises:
        SdfError: If an image or a mesh cannot be read, or a heightmap is turned.
    """
    if isinstance(solid.shape, Heightmap):
        return _Hills(solid, solid.shape)
    if isinstance(solid.shape, Plane):
        return _Slope(solid) if facing(solid)[2] > 0 else None
    return _Seen(solid)


class _Slope:
    """Plane, level or not."""

    bounds = None
    spacing = np.inf

    def __init__(self, solid: Solid) -> None:
        """Take a plane."""
        self._point, self._normal = solid.pose[:3, 3], facing(solid)

    def heights(self, x: Floats, y: Floats) -> Floats:
        """Return the plane's heights [m]."""
        a, b, c = self._normal
        px, py, pz = self._point
        return np.asarray(pz - (a * (x - px) + b * (y - py)) / c)


class _Hills:
    """Heightmap."""

    def __init__(self, solid: Solid, shape: Heightmap) -> None:
        """Read the image of a heightmap."""
        turn = solid.pose[:3, :3]
        if max(abs(turn[1, 0]), abs(turn[2, 0]), abs(turn[2, 1])) > _TURNED or turn[0, 0] < 0:
            raise SdfError(f"{solid.where}: expected a heightmap that is not turned, got one")
        values = _image(shape, solid.where)
        x, y, z = (solid.pose[:3, 3] + shape.position).tolist()
        width, depth, height = shape.size
        # The brightest place has the full height, whatever its value.
        self._heights = z + height * values / max(float(values.max()), 1e-9)
        self._low = np.array([x - width / 2, y - depth / 2])
        n, m = values.shape
        self._cells = np.array([width / (n - 1), depth / (m - 1)])
        self.spacing = float(self._cells.min())
        self.bounds = (x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)

    def heights(self, x: Floats, y: Floats) -> Floats:
        """Return heights between the four nearest pixels [m]."""
        u, v = (x - self._low[0]) / self._cells[0], (y - self._low[1]) / self._cells[1]
        n, m = self._heights.shape
        # Rounding at the border must not open it.
        inside = (u > -1e-6) & (u < n - 1 + 1e-6) & (v > -1e-6) & (v < m - 1 + 1e-6)
        heights = map_coordinates(self._heights, [u, v], order=1, mode="nearest")
        return np.where(inside, heights, -np.inf)


class _Seen:
    """Shape that is named as ground: what is seen of it from above."""

    spacing = np.inf

    def __init__(self, solid: Solid) -> None:
        """Prepare a shape to be looked at."""
        import open3d

        parts = parts_of(solid, _TOLERANCE)
        meshes = [
            (each.vertices.astype(np.float32), each.triangles.astype(np.uint32))
            for each in parts.surfaces
        ]
        wholes = [hull(SemanticClass.GROUND, points) for points in parts.convex]
        meshes += [(each.vertices, each.triangles) for each in wholes]
        self._from_numpy = open3d.core.Tensor.from_numpy
        self._scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        for vertices, triangles in meshes:
            self._scene.add_triangles(self._from_numpy(vertices), self._from_numpy(triangles))
        corners = np.concatenate([vertices for vertices, _ in meshes])
        (x0, y0, _), (x1, y1, top) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        self.bounds = (x0, y0, x1, y1)
        self._top = top + _ABOVE

    def heights(self, x: Floats, y: Floats) -> Floats:
        """Return the highest point over each place [m]."""
        rays = np.zeros((x.size, 6), dtype=np.float32)
        rays[:, 0], rays[:, 1], rays[:, 2], rays[:, 5] = x.ravel(), y.ravel(), self._top, -1.0
        ranges = self._scene.cast_rays(self._from_numpy(rays), nthreads=1)["t_hit"].numpy()
        return np.asarray(self._top - ranges.astype(np.float64)).reshape(x.shape)


def _image(shape: Heightmap, where: str) -> Floats:
    """Return the values of an image, first along x, then along y, shape (n, m).

    Raises:
        SdfError: If it cannot be read, holds elevations instead of grey values, or is smaller than
            2 or larger than 8193 pixels.
    """
    try:
        with Image.open(shape.path) as image:
            if not 2 <= min(image.size) <= max(image.size) <= _MAX_PIXELS:
                raise SdfError(
                    f"{where}: expected an image of 2 to {_MAX_PIXELS} pixels a side, got "
                    f"{image.size[0]} x {image.size[1]} in {shape.path}"
                )
            if image.mode == "F":
                raise SdfError(f"{where}: expected whole numbers in {shape.path}, got elevations")
            # 16 bits come as modes I and I;16; colours count by their brightness.
            grey = image if image.mode.startswith("I") else image.convert("L")
            values = np.asarray(grey, dtype=np.float64)
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, SyntaxError) as error:
        raise SdfError(
            f"{where}: expected an image such as a PNG in {shape.path}, got {error}; other "
            f"elevation data have to be converted"
        ) from error
    return values[::-1].T
