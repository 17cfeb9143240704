"""Circular grid of named layers that follows the robot without copying its cells.

The grid covers a square window around the robot, in a fixed frame such as ``odom``. Cell ``(i, j)``
of that frame is stored at row ``i mod n`` and column ``j mod n``: while the robot moves, cells stay
where they are in memory, and only the rows and columns that enter the window are cleared. With a
power of two for ``n`` the remainder is a bit mask, for negative numbers, too. ANYbotics' grid_map
and elevation_mapping keep their layers in the same way.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator

from terrain.kernel import kernel


def _power_of_two(number: int) -> int:
    """Return a number if it is a power of two, so that indices wrap around by their lowest bits."""
    if number < 1 or number & (number - 1):
        raise ValueError(f"expected a power of 2, got {number}")
    return number


PowerOfTwo = Annotated[int, AfterValidator(_power_of_two)]
"""Number of cells along an edge of a circular grid, as a field of a configuration."""


class RollingGrid:
    """Square window of cells around the robot, stored in a circular buffer.

    The window covers the cells from ``centre - n_cells / 2`` up to, but not including,
    ``centre + n_cells / 2`` along either axis.

    Attributes:
        cell: Edge of a cell [m].
        n_cells: Number of cells along an edge of the window, a power of two.
        layers: Names of the layers, in the order of the last axis of ``values``.
        values: Contents of all layers, cell (i, j) at row ``i & (n_cells - 1)`` and column
            ``j & (n_cells - 1)``, float32, shape (n_cells, n_cells, n_layers). The memory stays the
            same for the life of the grid: views of it remain valid.
        centre: Cell of the robot, counted from the origin of the frame, int64, shape (2,).
    """

    def __init__(self, cell: float, n_cells: int, layers: tuple[str, ...]) -> None:
        """Make an empty grid around the origin of the frame.

        Args:
            cell: Edge of a cell [m].
            n_cells: Number of cells along an edge of the window, a power of two.
            layers: Names of the layers, each once.

        Raises:
            ValueError: If a cell has no size, the number of cells is no power of two, or there are
                no layers or two of one name.
        """
        if not cell > 0:
            raise ValueError(f"cell: expected an edge above 0 m, got {cell}")
        if not layers or len(set(layers)) != len(layers):
            raise ValueError(f"layers: expected one or more names, each once, got {layers}")
        self.cell = cell
        self.n_cells = _power_of_two(n_cells)
        self.layers = layers
        self.values = np.zeros((n_cells, n_cells, len(layers)), dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)

    def __getitem__(self, layer: str) -> NDArray[np.float32]:
        """Return a writable view of one layer, shape (n_cells, n_cells).

        Args:
            layer: Name of the layer.

        Raises:
            KeyError: If there is no layer of this name.
        """
        if layer not in self.layers:
            raise KeyError(f"layer: expected one of {', '.join(self.layers)}, got {layer!r}")
        return self.values[:, :, self.layers.index(layer)]

    @property
    def corner(self) -> NDArray[np.float64]:
        """Position of the window's corner with the smallest x and y [m], shape (2,)."""
        return np.asarray((self.centre - self.n_cells / 2) * self.cell, dtype=np.float64)

    def reset(self) -> None:
        """Set all layers to 0 and return to the origin of the frame."""
        self.values[:] = 0.0
        self.centre[:] = 0

    def follow(self, here: NDArray[np.float64]) -> None:
        """Move the window to the robot and clear the cells that enter it.

        Args:
            here: Position of the robot in the grid's frame [m], shape (2,).
        """
        follow(self.values, self.centre, here, self.cell)

    def cells_of(self, positions: NDArray[np.floating]) -> NDArray[np.int64]:
        """Return the cells that contain some positions, counted from the origin of the frame.

        Args:
            positions: Positions in the grid's frame [m], shape (..., 2).

        Returns:
            int64, shape (..., 2). They need not lie in the window.
        """
        return np.floor(positions / self.cell).astype(np.int64)

    def wrap(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the rows and columns in memory of some cells, shape (..., 2).

        Cells outside of the window get those of a cell inside.

        Args:
            cells: Cells, counted from the origin of the frame, shape (..., 2).
        """
        return cells & (self.n_cells - 1)


@kernel
def follow(
    values: NDArray[np.float32],
    centre: NDArray[np.int64],
    here: NDArray[np.float64],
    cell: float,
) -> None:
    """Move the centre of a circular grid to the robot and set cells that enter the window to 0.

    Args:
        values: Contents, changed in place; n, the length of the first two axes, is a power of two.
            float32, shape (n, n) or (n, n, n_layers).
        centre: Cell of the robot, counted from the origin of the frame, changed in place, shape
            (2,).
        here: Position of the robot [m], shape (2,).
        cell: Edge of a cell [m].
    """
    n = len(values)
    for axis in range(2):
        now = int(np.floor(here[axis] / cell))
        shift = now - centre[axis]
        # After n steps nothing of the old window is left; more would clear lines twice.
        for k in range(min(abs(shift), n)):
            # Lines enter at the end that the robot moves to, and take the memory of those that
            # leave at the other end.
            line = (now + n // 2 - 1 - k if shift > 0 else now - n // 2 + k) & (n - 1)
            if axis == 0:
                values[line, :] = 0.0
            else:
                values[:, line] = 0.0
        centre[axis] = now
