"""The virtual 2D traversability scanner: a cloud in, ranges out, in one compiled pass."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters, make_quarters, polar_tables
from traversability.cell_shape import describe_cells
from traversability.features import ALL_FEATURES, gather_neighbours
from traversability.forest import Exit, Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.trees import add_leaves
from traversability.virtual_scan import VirtualScan

_GREEN, _RED = int(CellState.TRAVERSABLE), int(CellState.NON_TRAVERSABLE)


class TraversabilityScanner:
    """Judges clouds with a forest; its memory lives as long as it does.

    ``scan`` equals ``virtual_scan`` of ``cells``, but looks no further than the first red cell of
    each sector.
    """

    def __init__(self, forest: Forest, grid: PolarGrid | None = None) -> None:
        """Make ready, compiled code included, so that no cloud has to wait for it.

        Args:
            forest: The cell classifier.
            grid: The cells; None for those that the forest was trained for.

        Raises:
            ValueError: If the forest was not trained for such cells.
        """
        self.grid = grid or forest.grid
        forest.check_grid(self.grid)
        trees, screen = forest.trees, forest.screen
        self._nodes, self._base = trees.laid_out(ALL_FEATURES), trees.base
        stops = (*forest.exits, Exit(len(trees.roots), np.inf, -np.inf))
        self._stops = np.array([stop.trees for stop in stops])
        self._lows = np.array([stop.low for stop in stops])
        self._highs = np.array([stop.high for stop in stops])
        self._limits = trees.sum_at(forest.thresholds.of_rings(self.grid))
        self._trees, self._threshold_odds = trees, trees.log_odds(self._limits)
        first = trees if screen is None else screen.trees
        self._screen, self._screen_base = first.laid_out(ALL_FEATURES), first.base
        self._screen_limit = -np.inf if screen is None else screen.limit
        self._middles = polar_tables(self.grid).middles
        self._quarters = make_quarters(self.grid, 65_536)
        shape = (self.grid.n_sectors, self.grid.n_rings)
        self._means = np.zeros((2 * shape[0], 2 * shape[1], 6))
        self._planes = np.zeros((2 * shape[0], 2 * shape[1], 3))
        self._counts = np.zeros(shape, dtype=np.int32)
        self._values = np.zeros((*shape, len(ALL_FEATURES)), dtype=np.float32)
        self._states = np.zeros(shape, dtype=np.uint8)
        self._votes = np.zeros(shape)
        self.scan(np.zeros((1, 3), dtype=np.float32))

    def cells(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Return the ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

        Args:
            points: In ``base_footprint`` [m], float32, shape (n, 3).

        Raises:
            ValueError: If ``points`` has another shape or type.
        """
        self._look(points, every=True)
        return self._states.copy()

    def scan(self, points: NDArray[np.float32]) -> VirtualScan:
        """Return the free distance in every sector; see ``cells`` and ``virtual_scan``."""
        ranges = self._look(points, every=False)
        odds = self._trees.log_odds(self._votes) - self._threshold_odds
        return VirtualScan(ranges, self.grid.outer_radius, odds.astype(np.float32))

    def _look(self, points: NDArray[np.float32], every: bool) -> NDArray[np.float32]:
        """Judge all cells, or those up to the first red one of each sector; return the ranges."""
        self._quarters = fill_quarters(points, self.grid, self._quarters)
        describe_cells(
            points,
            self._quarters.bins,
            self._quarters.sums,
            self._means,
            self._planes,
            self._counts,
            self._middles,
            self._values,
        )
        ranges = np.empty(self.grid.n_sectors, dtype=np.float32)
        _judge(
            self._counts,
            self._values,
            self._screen,
            self._screen_base,
            self._screen_limit,
            self._nodes,
            self._base,
            self._stops,
            self._lows,
            self._highs,
            self._limits,
            self.grid.ring_edges,
            self.grid.min_points,
            every,
            self._states,
            self._votes,
            ranges,
        )
        return ranges


@kernel
def _judge(  # type: ignore[no-untyped-def]  # noqa: ANN202
    counts,  # noqa: ANN001
    values,  # noqa: ANN001
    screen,  # noqa: ANN001
    screen_base,  # noqa: ANN001
    screen_limit,  # noqa: ANN001
    nodes,  # noqa: ANN001
    base,  # noqa: ANN001
    stops,  # noqa: ANN001
    lows,  # noqa: ANN001
    highs,  # noqa: ANN001
    limits,  # noqa: ANN001
    edges,  # noqa: ANN001
    min_points,  # noqa: ANN001
    every,  # noqa: ANN001
    states,  # noqa: ANN001
    votes_of,  # noqa: ANN001
    ranges,  # noqa: ANN001
):
    """Judge described cells ring by ring; a red one closes its sector."""
    sectors, rings = counts.shape
    flat = values.reshape(sectors * rings, values.shape[2])
    rows, votes = np.empty(sectors, dtype=np.int64), np.empty(sectors)
    states[:] = 0
    votes_of[:] = np.nan
    ranges[:] = np.nan
    closed = np.zeros(sectors, dtype=np.bool_)
    for ring in range(rings):
        n = 0
        for sector in range(sectors):
            if counts[sector, ring] >= min_points and (every or not closed[sector]):
                rows[n], votes[n] = sector * rings + ring, screen_base
                n += 1
                states[sector, ring] = _GREEN
                votes_of[sector, ring] = -np.inf
                if not closed[sector]:
                    ranges[sector] = np.inf
        if screen_limit > -np.inf:
            add_leaves(flat, rows, n, screen, 0, len(screen[1]), votes)
        open_ = 0
        for k in range(n):
            if votes[k] >= screen_limit:
                gather_neighbours(rows[k] // rings, ring, counts, values)
                rows[open_], votes[open_] = rows[k], base
                open_ += 1
        first = 0
        for stop in range(len(stops)):
            add_leaves(flat, rows, open_, nodes, first, stops[stop], votes)
            first, still = stops[stop], 0
            for k in range(open_):
                votes_of[rows[k] // rings, ring] = votes[k]
                if lows[stop] <= votes[k] <= highs[stop]:
                    rows[still], votes[still] = rows[k], votes[k]
                    still += 1
                elif votes[k] >= limits[ring]:
                    sector = rows[k] // rings
                    states[sector, ring] = _RED
                    if not closed[sector]:
                        ranges[sector], closed[sector] = edges[ring], True
            open_ = still
