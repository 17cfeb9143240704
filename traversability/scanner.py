"""Virtual 2D traversability scanner: turns a cloud into free ranges in one compiled pass."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters, make_quarters, polar_tables
from traversability.cells.columns import CellWorkspace, make_workspace
from traversability.cells.shape import describe_cells
from traversability.features import ALL_FEATURES, gather_neighbours
from traversability.forest import Exit, Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.trees.flat import TreeNodes, add_leaves
from traversability.virtual_scan import VirtualScan

_EMPTY = int(CellState.EMPTY)
_FREE, _BLOCKED = int(CellState.TRAVERSABLE), int(CellState.NON_TRAVERSABLE)


class _Cascade(NamedTuple):
    """A forest laid out for the kernel: screen, trees in stages, and limits of their sums.

    Attributes:
        screen: Nodes of the screen's trees.
        screen_base: Start of the screen's sums.
        screen_limit: Sum below which a cell is free without a look at the trees; minus infinity
            without a screen.
        nodes: Nodes of the trees.
        base: Start of the trees' sums.
        stops: Number of trees after which each stage ends, int64, shape (k,); the last one is all.
        lows: Sum below which a cell is decided after each stage, shape (k,).
        highs: Sum above which a cell is decided after each stage, shape (k,).
        limits: Sum from which on a decided cell of each ring is blocked, shape (n_rings,).
    """

    screen: TreeNodes
    screen_base: float
    screen_limit: float
    nodes: TreeNodes
    base: float
    stops: NDArray[np.int64]
    lows: NDArray[np.float64]
    highs: NDArray[np.float64]
    limits: NDArray[np.float64]


class _Classified(NamedTuple):
    """Output of the classification of one cloud's cells.

    Attributes:
        states: ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).
        votes: Sum of leaves of each cell: NaN where it was not classified, minus infinity where
            the screen decided; float64, shape (n_sectors, n_rings).
        ranges: Free distance in each sector [m], as in ``VirtualScan``, float32, shape
            (n_sectors,).
        closed: True for sectors in which a blocked cell has been found, bool, shape (n_sectors,).
    """

    states: NDArray[np.uint8]
    votes: NDArray[np.float64]
    ranges: NDArray[np.float32]
    closed: NDArray[np.bool_]


class TraversabilityScanner:
    """Classifies the cells of clouds with a forest and returns virtual scans.

    ``scan`` equals ``virtual_scan`` of ``cells``, but classifies no cell behind the first blocked
    one of each sector. Its memory is allocated once, for the life of the scanner.

    Attributes:
        grid: Polar grid of cells.
    """

    def __init__(self, forest: Forest, grid: PolarGrid | None = None) -> None:
        """Allocate memory and compile the kernels, so that no cloud has to wait for them.

        Args:
            forest: Cell classifier.
            grid: Polar grid of cells; None for the one that the forest was trained for.

        Raises:
            ValueError: If the forest was not trained for such cells.
        """
        self.grid = grid or forest.grid
        forest.check_grid(self.grid)
        self._trees = forest.trees
        self._cascade = _lay_out(forest, self.grid)
        self._threshold_log_odds = self._trees.log_odds(self._cascade.limits)
        tables = polar_tables(self.grid)
        self._middles, self._halves = tables.middles, tables.halves
        self._quarters = make_quarters(self.grid, 65_536)
        self._cells = make_workspace(self.grid, len(ALL_FEATURES))
        shape = (self.grid.n_sectors, self.grid.n_rings)
        self._states, self._votes = np.zeros(shape, dtype=np.uint8), np.zeros(shape)
        self._closed = np.zeros(self.grid.n_sectors, dtype=np.bool_)
        self.scan(np.zeros((1, 3), dtype=np.float32))

    def cells(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Return the ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

        Args:
            points: Points in ``base_footprint`` [m], float32, shape (n, 3).

        Raises:
            ValueError: If ``points`` has another shape or type.
        """
        self._classify(points, every=True)
        return self._states.copy()

    def scan(self, points: NDArray[np.float32]) -> VirtualScan:
        """Return the free distance in every sector; see ``cells`` and ``virtual_scan``."""
        ranges = self._classify(points, every=False)
        log_odds = self._trees.log_odds(self._votes) - self._threshold_log_odds
        return VirtualScan(ranges, self.grid.outer_radius, log_odds.astype(np.float32))

    def _classify(self, points: NDArray[np.float32], every: bool) -> NDArray[np.float32]:
        """Classify all cells, or those up to the first blocked one per sector; return the ranges.

        Args:
            points: Points in ``base_footprint`` [m], float32, shape (n, 3).
            every: True to classify the cells behind the first blocked one of a sector, too.
        """
        # Cloud -> sums per quarter -> features per cell -> states and ranges.
        self._quarters = fill_quarters(points, self.grid, self._quarters)
        limit = self.grid.max_traversable_vegetation
        describe_cells(self._quarters, self._middles, self._halves, limit, self._cells)
        ranges = np.empty(self.grid.n_sectors, dtype=np.float32)
        classified = _Classified(self._states, self._votes, ranges, self._closed)
        edges, min_points = self.grid.ring_edges, self.grid.min_points
        classify_cells(self._cells, self._cascade, edges, min_points, every, classified)
        return ranges


def _lay_out(forest: Forest, grid: PolarGrid) -> _Cascade:
    """Return a forest as the kernel reads it.

    Args:
        forest: Cell classifier.
        grid: Polar grid of cells, whose rings have the thresholds.
    """
    trees, screen = forest.trees, forest.screen
    # All trees are the last stage, after which every cell is decided.
    stages = (*forest.exits, Exit(len(trees.roots), np.inf, -np.inf))
    first = trees if screen is None else screen.trees
    return _Cascade(
        screen=first.laid_out(ALL_FEATURES),
        screen_base=first.base,
        screen_limit=-np.inf if screen is None else screen.limit,
        nodes=trees.laid_out(ALL_FEATURES),
        base=trees.base,
        stops=np.array([stage.trees for stage in stages]),
        lows=np.array([stage.low for stage in stages]),
        highs=np.array([stage.high for stage in stages]),
        limits=trees.sum_at(forest.thresholds.of_rings(grid)),
    )


@kernel
def classify_cells(
    cells: CellWorkspace,
    cascade: _Cascade,
    edges: NDArray[np.float64],
    min_points: int,
    every: bool,
    out: _Classified,
) -> None:
    """Classify described cells ring by ring outwards; a blocked one closes its sector.

    Args:
        cells: Cells with their own features; neighbours' features are added where needed.
        cascade: Forest to classify with.
        edges: Ring edges [m], shape (n_rings + 1,).
        min_points: Number of points below which a cell is empty.
        every: True to classify the cells of closed sectors, too.
        out: Output; see ``_Classified``.
    """
    sectors, rings = cells.counts.shape
    rows, votes = np.empty(sectors, dtype=np.int64), np.empty(sectors)
    out.states[:] = _EMPTY
    out.votes[:] = np.nan
    out.ranges[:] = np.nan
    out.closed[:] = False
    for ring in range(rings):
        n = _select_cells(cells, ring, cascade.screen_base, min_points, every, out, rows, votes)
        n = _screen_cells(cells, ring, cascade, rows, votes, n)
        _vote(cells, ring, cascade, edges[ring], rows, votes, n, out)


@kernel
def _select_cells(
    cells: CellWorkspace,
    ring: int,
    base: float,
    min_points: int,
    every: bool,
    out: _Classified,
    rows: NDArray[np.int64],
    votes: NDArray[np.float64],
) -> int:
    """Return the number of a ring's cells that are classified, with their rows and first votes."""
    sectors, rings = cells.counts.shape
    n = 0
    for sector in range(sectors):
        if cells.counts[sector, ring] >= min_points and (every or not out.closed[sector]):
            rows[n], votes[n] = sector * rings + ring, base
            n += 1
            # Free, unless the trees find otherwise.
            out.states[sector, ring] = _FREE
            out.votes[sector, ring] = -np.inf
            if not out.closed[sector]:
                out.ranges[sector] = np.inf
    return n


@kernel
def _screen_cells(
    cells: CellWorkspace,
    ring: int,
    cascade: _Cascade,
    rows: NDArray[np.int64],
    votes: NDArray[np.float64],
    n: int,
) -> int:
    """Return the number of cells that pass the screen, moved to the front of ``rows``.

    Only these need their neighbours' features, which are gathered here.
    """
    sectors, rings = cells.counts.shape
    flat = cells.values.reshape(sectors * rings, cells.values.shape[2])
    if cascade.screen_limit > -np.inf:
        add_leaves(flat, rows, n, cascade.screen, 0, cascade.screen.n_trees, votes)
    kept = 0
    for k in range(n):
        if votes[k] >= cascade.screen_limit:
            gather_neighbours(rows[k] // rings, ring, cells.counts, cells.values)
            rows[kept], votes[kept] = rows[k], cascade.base
            kept += 1
    return kept


@kernel
def _vote(
    cells: CellWorkspace,
    ring: int,
    cascade: _Cascade,
    edge: float,
    rows: NDArray[np.int64],
    votes: NDArray[np.float64],
    n: int,
    out: _Classified,
) -> None:
    """Walk the trees stage by stage and write votes, blocked cells and the ranges that they end.

    After each stage, cells with clear sums are decided and leave (soft cascade, Bourdev and Brandt
    2005).
    """
    sectors, rings = cells.counts.shape
    flat = cells.values.reshape(sectors * rings, cells.values.shape[2])
    first = 0
    for stage in range(len(cascade.stops)):
        add_leaves(flat, rows, n, cascade.nodes, first, cascade.stops[stage], votes)
        first, kept = cascade.stops[stage], 0
        for k in range(n):
            sector = rows[k] // rings
            out.votes[sector, ring] = votes[k]
            if cascade.lows[stage] <= votes[k] <= cascade.highs[stage]:
                rows[kept], votes[kept] = rows[k], votes[k]
                kept += 1
            elif votes[k] >= cascade.limits[ring]:
                out.states[sector, ring] = _BLOCKED
                if not out.closed[sector]:
                    out.ranges[sector], out.closed[sector] = edge, True
        n = kept
