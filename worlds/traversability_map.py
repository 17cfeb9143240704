"""A grid map of where a world may be driven on, and why not elsewhere."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from terrain.kernel import kernel
from worlds.paths import shortest_path

Floats = NDArray[np.floating]


_BY_HEIGHT = np.zeros(256, dtype=np.bool_)
"""True for the semantic classes that are crossed where they are low enough."""
_BY_HEIGHT[[kind for kind, traits in TRAITS.items() if traits.by_height]] = True


class Reason(IntEnum):
    """The reason why a place is forbidden.

    ``LOW`` is a solid object that ends below the body's floor: it can pass between the wheels.
    """

    FREE = 0
    SOLID = 1
    VEGETATION = 2
    SLOPE = 3
    STEP = 4
    BORDER = 5
    WATER = 6
    LOW = 7


@dataclass(frozen=True)
class TraversabilityMap:
    """A grid map of the reasons why places are forbidden.

    Cell ``[ix, iy]`` is centred at ``x_min + (ix + 0.5) * cell``, ``y_min + (iy + 0.5) * cell``.

    Attributes:
        cell: Edge of a cell [m].
        x_min: Least map x [m].
        y_min: Least map y [m].
        reason: ``Reason`` of each cell, uint8, shape (n, m).
        severity: Excess of slope or step of the bare ground over its limit, the worse of the two,
            in units of the margins of ``TruthConfig``: more than 0 is forbidden, -1 to 1 is
            borderline. float32, shape (n, m).
        clearance: Distance to the nearest forbidden cell [m], float32, shape (n, m).
    """

    cell: float
    x_min: float
    y_min: float
    reason: NDArray[np.uint8]
    severity: NDArray[np.float32]
    clearance: NDArray[np.float32]

    def _index(self, x: Floats | float, y: Floats | float) -> tuple[NDArray[np.intp], ...]:
        """Return the cell indices of places [m]; beyond the border, those of the border."""
        n, m = self.reason.shape
        i = np.clip((np.asarray(x) - self.x_min) / self.cell, 0, n - 1).astype(np.intp)
        j = np.clip((np.asarray(y) - self.y_min) / self.cell, 0, m - 1).astype(np.intp)
        return i, j

    def reason_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.uint8]:
        """Return the ``Reason`` at map places [m], same shape as ``x``."""
        return self.reason[self._index(x, y)]

    def forbidden_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.bool_]:
        """Return True at each forbidden map place [m], same shape as ``x``."""
        return self.reason_at(x, y) != Reason.FREE

    def clearance_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.float32]:
        """Return the distance from map places [m] to the nearest forbidden cell [m]."""
        return self.clearance[self._index(x, y)]

    def at(self, x: float, y: float) -> tuple[bool, float]:
        """Return True if one place [m] is forbidden, and its clearance [m].

        Much faster for one place than ``forbidden_at`` and ``clearance_at``.
        """
        n, m = self.reason.shape
        i = min(max(int((x - self.x_min) / self.cell), 0), n - 1)
        j = min(max(int((y - self.y_min) / self.cell), 0), m - 1)
        # Whole numbers: comparing an array's own with a member of an enumeration takes far longer.
        return int(self.reason[i, j]) != int(Reason.FREE), float(self.clearance[i, j])

    def severity_of(
        self, points: NDArray[np.floating], classes: NDArray[np.integer]
    ) -> NDArray[np.float32]:
        """Return the severity of points, by their class and, on ground, by slope and step.

        Args:
            points: Points in the map frame [m], shape (n, 3).
            classes: Semantic class of each point, uint8, shape (n,).

        Returns:
            Severity of each point, float32, shape (n,): more than 0 is non-traversable. On ground
            it is interpolated between the cells' centres; on other classes it is infinite, or
            minus infinite if the class is traversable. Plants that may be low enough to be crossed
            are traversable where the map forbids neither their cell nor one beside it.
        """
        table = np.full(256, np.float32(np.inf))
        for semantic, traits in TRAITS.items():
            table[semantic] = -np.inf if traits.traversable else np.inf
        table[[SemanticClass.GROUND, SemanticClass.PATH]] = np.nan
        severity = table[classes]
        _fill_severity(points, (self.x_min, self.y_min, self.cell), self.severity, severity)
        plants = np.flatnonzero(_BY_HEIGHT[classes])
        if len(plants):
            severity[plants[~self._forbidden_beside(points[plants])]] = -np.inf
        return severity

    def _forbidden_beside(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Return which points have a forbidden cell under them or beside that, shape (n,)."""
        n, m = self.reason.shape
        i, j = self._index(points[:, 0], points[:, 1])
        is_forbidden = np.zeros(len(points), dtype=np.bool_)
        for di in (-1, 0, 1):
            for dj in (-1, 0, 1):
                beside = self.reason[np.clip(i + di, 0, n - 1), np.clip(j + dj, 0, m - 1)]
                is_forbidden |= beside != Reason.FREE
        return is_forbidden

    def forbidden_under(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Return which points lie at forbidden places, as ``forbidden_at`` does, and faster.

        Args:
            points: Points in the map frame [m], shape (n, 3).
        """
        is_forbidden = np.empty(len(points), dtype=np.bool_)
        _fill_forbidden(points, (self.x_min, self.y_min, self.cell), self.reason, is_forbidden)
        return is_forbidden

    def shortest_path(
        self, start: Floats, goal: Floats, clearance: float
    ) -> NDArray[np.float64] | None:
        """Return the shortest safe path from ``start`` to ``goal`` [m], or None.

        Args:
            start: Map coordinates [m], shape (2,).
            goal: Map coordinates [m], shape (2,).
            clearance: Least distance to forbidden cells [m].

        Returns:
            Corners of the path [m], float64, shape (k, 2), from ``start`` to ``goal``, or None if
            there is no path.
        """
        origin = np.array([self.x_min, self.y_min])
        path = shortest_path(
            self.clearance,
            self.cell,
            (np.asarray(start, dtype=np.float64) - origin) / self.cell,
            (np.asarray(goal, dtype=np.float64) - origin) / self.cell,
            clearance,
        )
        return None if path is None else path * self.cell + origin


@kernel
def _fill_severity(
    points: NDArray[np.floating],
    frame: tuple[float, float, float],
    known: NDArray[np.float32],
    severity: NDArray[np.float32],
) -> None:
    """Replace NaN by the bilinear interpolation between the centres of a map's cells.

    Args:
        points: Points in the map frame [m], shape (k, 3).
        frame: Least map x and y, and edge of a cell [m].
        known: Severity of the map's cells, shape (n, m).
        severity: Severity of the points, changed in place, shape (k,).
    """
    x_min, y_min, cell = frame
    n, m = known.shape
    for k in range(len(points)):
        if not np.isnan(severity[k]):
            continue
        # Beyond the border, that of the border.
        u = min(max(0.0, (points[k, 0] - x_min) / cell - 0.5), n - 1.0)
        v = min(max(0.0, (points[k, 1] - y_min) / cell - 0.5), m - 1.0)
        i, j = min(int(u), n - 2), min(int(v), m - 2)
        u, v = u - i, v - j
        near = known[i, j] * (1 - u) * (1 - v) + known[i, j + 1] * (1 - u) * v
        severity[k] = near + known[i + 1, j] * u * (1 - v) + known[i + 1, j + 1] * u * v


@kernel
def _fill_forbidden(
    points: NDArray[np.floating],
    frame: tuple[float, float, float],
    reason: NDArray[np.uint8],
    is_forbidden: NDArray[np.bool_],
) -> None:
    """Write which points lie in cells with a reason to be forbidden.

    Args:
        points: Points in the map frame [m], shape (k, 3).
        frame: Least map x and y, and edge of a cell [m].
        reason: ``Reason`` of the map's cells, shape (n, m).
        is_forbidden: Output, shape (k,).
    """
    x_min, y_min, cell = frame
    n, m = reason.shape
    free = np.uint8(Reason.FREE)
    for k in range(len(points)):
        # Beyond the border, that of the border.
        i = np.uint64(min(max(0.0, (points[k, 0] - x_min) / cell), n - 1.0))
        j = np.uint64(min(max(0.0, (points[k, 1] - y_min) / cell), m - 1.0))
        is_forbidden[k] = reason[i, j] != free
