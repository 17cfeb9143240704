"""Cell classifier: trees, a screen that decides most cells, and thresholds of probability."""

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from traversability.arrays import pack, unpack
from traversability.features import ALL_FEATURES, CellFeatures
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.trees.flat import Trees, add_leaves

_FORMAT = "andabata-forest"
_VERSION = 4
_MAX_BYTES = 1 << 26


class ForestFileError(ValueError):
    """A file that holds no forest that can be used."""


class Thresholds(BaseModel):
    """Probabilities from which on a cell is blocked.

    Attributes:
        near: Threshold in rings that begin nearer than ``near_range``, where a miss is costly.
        far: Threshold in the other rings.
        near_range: Distance up to which ``near`` holds [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    near: float = Field(default=0.5, gt=0, lt=1)
    far: float = Field(default=0.5, gt=0, lt=1)
    near_range: float = Field(default=5.0, ge=0)

    def of_rings(self, grid: PolarGrid) -> NDArray[np.float64]:
        """Return the threshold of each ring, shape (n_rings,).

        Args:
            grid: Polar grid with the rings.
        """
        return np.where(grid.ring_edges[:-1] < self.near_range, self.near, self.far)


@dataclass(frozen=True)
class Screen:
    """First stage of a few trees: a cell whose sum of leaves stays below the limit is free.

    Most cells are plain ground, which the screen decides at a tenth of the cost.

    Attributes:
        trees: Trees on a cell's own features.
        limit: Sum of leaves from which on a cell is passed to the forest.
    """

    trees: Trees
    limit: float


class Exit(NamedTuple):
    """Early exit of clear cells from the trees: a soft cascade (Bourdev and Brandt 2005).

    Attributes:
        trees: Number of trees after which cells may leave.
        low: Sum of leaves below which a cell is decided.
        high: Sum of leaves above which a cell is decided.
    """

    trees: int
    low: float
    high: float


@dataclass(frozen=True)
class Forest:
    """Classifier of polar cells as blocked or free.

    Attributes:
        trees: Trees on ``ALL_FEATURES`` or some of them.
        thresholds: Probabilities from which on a cell is blocked.
        grid: Polar grid that the forest was trained for.
        screen: First stage that decides plain cells, or None.
        exits: Early exits of clear cells, by growing number of trees.
        summary: Account of the training, ready for JSON.
    """

    trees: Trees
    thresholds: Thresholds
    grid: PolarGrid
    screen: Screen | None = None
    exits: tuple[Exit, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the exits.

        Raises:
            ValueError: If they are out of order, or hold no numbers.
        """
        after = [0, *(exit_.trees for exit_ in self.exits), len(self.trees.roots)]
        if any(here >= there for here, there in pairwise(after)):
            raise ValueError(f"exits after {after[1:-1]} of {after[-1]} trees")
        if self.exits and self.trees.vote != "logistic":
            raise ValueError("exits from trees whose leaves are averaged")
        if any(not exit_.low <= exit_.high for exit_ in self.exits):
            raise ValueError("an exit whose low is not below its high")

    def predict_proba(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the probability of cells to be blocked.

        Args:
            features: Features in the order of ``ALL_FEATURES``, float32, shape (n, f).

        Returns:
            float64, shape (n,).

        Raises:
            ValueError: If the features have another shape.
        """
        if features.ndim != 2 or features.shape[1] != len(ALL_FEATURES):
            expected = f"(n, {len(ALL_FEATURES)})"
            raise ValueError(f"features: expected shape {expected}, got {features.shape}")
        flat = np.ascontiguousarray(features, dtype=np.float32)
        rows = np.arange(len(flat))
        if self.screen is None:
            return self.trees.probability(self._sums(flat, rows))
        sums = leaf_sums(self.screen.trees, flat, rows)
        probability = self.screen.trees.probability(sums)
        rest = np.flatnonzero(sums >= self.screen.limit)
        probability[rest] = self.trees.probability(self._sums(flat, rest))
        return probability

    def _sums(self, features: NDArray[np.float32], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the sums of leaves of some rows, up to the exit that each one takes, shape (m,).

        Args:
            features: Features of all rows, float32, shape (n, f).
            rows: Rows to sum up, int64, shape (m,).
        """
        sums, open_, first = np.full(len(rows), self.trees.base), np.arange(len(rows)), 0
        nodes = self.trees.laid_out(ALL_FEATURES)
        # All trees are the last stage, after which every row is decided.
        for trees, low, high in (*self.exits, Exit(len(self.trees.roots), np.inf, -np.inf)):
            part = sums[open_]
            add_leaves(features, rows[open_], len(open_), nodes, first, trees, part)
            sums[open_], first = part, trees
            open_ = open_[(part >= low) & (part <= high)]
        return sums

    def classify(self, cells: CellFeatures, grid: PolarGrid) -> NDArray[np.uint8]:
        """Return the ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

        Args:
            cells: Features and number of points of each cell.
            grid: Polar grid of the cells.

        Raises:
            ValueError: If the grid is not the training's, but for its number of sectors.
        """
        self.check_grid(grid)
        limits = np.broadcast_to(self.thresholds.of_rings(grid), cells.counts.shape)
        states = np.zeros(cells.counts.shape, dtype=np.uint8)
        known = cells.counts >= grid.min_points
        blocked = self.predict_proba(cells.values[known]) >= limits[known]
        states[known] = np.where(blocked, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
        return states

    def check_grid(self, grid: PolarGrid) -> None:
        """Check that the forest was trained for a grid.

        The number of sectors may differ, and the limit of plants, which features are relative to.

        Args:
            grid: Polar grid to check.

        Raises:
            ValueError: If the grid is not the training's but for these.
        """
        free = {
            "n_sectors": self.grid.n_sectors,
            "max_traversable_vegetation": self.grid.max_traversable_vegetation,
        }
        if grid.model_copy(update=free) != self.grid:
            raise ValueError(
                f"grid: expected the {self.grid.n_rings} rings to {self.grid.outer_radius} m over "
                f"the {self.grid.cut} that the forest was trained for, got {grid.n_rings} to "
                f"{grid.outer_radius} m over the {grid.cut}; train a forest for this grid"
            )

    def to_bytes(self) -> bytes:
        """Return the forest as a file's bytes."""
        arrays, about = self.trees.packed("")
        header: dict[str, Any] = {
            "format": _FORMAT,
            "version": _VERSION,
            "trees": about,
            "thresholds": self.thresholds.model_dump(),
            "grid": self.grid.model_dump(),
            "summary": self.summary,
        }
        if self.exits:
            header["exits"] = [list(exit_) for exit_ in self.exits]
        if self.screen is not None:
            more, about = self.screen.trees.packed("screen_")
            arrays |= more
            header["screen"] = {"trees": about, "limit": self.screen.limit}
        return pack(arrays, header)

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "forest") -> Self:
        """Return the forest of a file's bytes, every index checked.

        Args:
            data: Bytes of the file.
            name: Name of the file, for errors.

        Raises:
            ForestFileError: If the bytes are no forest whose trees can be walked safely.
        """
        try:
            arrays, header = unpack(data, _MAX_BYTES)
            return cls(**_parts(arrays, header))
        except Exception as error:  # A hostile header raises many kinds.
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise ForestFileError(
                f"{name}: expected a forest written by andabata, got {reason}; train one with "
                "`andabata classifier train`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the forest of a file.

        Args:
            path: Path of the file.

        Raises:
            ForestFileError: If the file holds no forest.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


def leaf_sums(
    trees: Trees, features: NDArray[np.float32], rows: NDArray[np.int64] | None = None
) -> NDArray[np.float64]:
    """Return the sums of all leaves, ``base`` included.

    Args:
        trees: Trees to walk.
        features: Features in the order of ``ALL_FEATURES``, float32, shape (n, f).
        rows: Rows to sum up, int64; None for all.
    """
    rows = np.arange(len(features)) if rows is None else rows
    sums = np.full(len(rows), trees.base)
    nodes = trees.laid_out(ALL_FEATURES)
    flat = np.ascontiguousarray(features)
    add_leaves(flat, rows, len(rows), nodes, 0, len(trees.roots), sums)
    return sums


def _parts(arrays: dict[str, NDArray[Any]], header: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of the ``Forest`` in a file.

    Args:
        arrays: Arrays of the file by name.
        header: Header of the file.

    Raises:
        ValueError: If the file has another format or version, or holds no valid forest.
    """
    if header.get("format") != _FORMAT or header.get("version") != _VERSION:
        raise ValueError(
            f"format {header.get('format')!r} version {header.get('version')!r}, not {_VERSION}, "
            "whose gaps are those over their ring's median"
        )
    known = set(ALL_FEATURES)
    screen = None
    if "screen" in header:
        about, limit = header["screen"]["trees"], float(header["screen"]["limit"])
        if not np.isfinite(limit):
            raise ValueError(f"screen limit {limit}")
        screen = Screen(Trees.unpacked(arrays, about, "screen_", known), limit)
    exits = tuple(Exit(int(n), float(low), float(high)) for n, low, high in header.get("exits", ()))
    return {
        "exits": exits,
        "trees": Trees.unpacked(arrays, header["trees"], "", known),
        "thresholds": Thresholds.model_validate(header["thresholds"]),
        "grid": PolarGrid.model_validate(header["grid"]),
        "screen": screen,
        "summary": dict(header["summary"]),
    }
