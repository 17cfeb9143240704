"""Fields of cylinders after the published rules of the BARN benchmark, each the same for its seed.

A field is a grid of 30 x 30 cells of 0.15 m. Each cell is filled at random, then a cellular
automaton smooths the grid a few times: a cell with many filled neighbours is filled, one with few
is cleared. The first and the last row are walls. A field counts only if a square of free cells can
pass it. Every filled cell is an upright cylinder (Perille et al. 2020, "Benchmarking Metric Ground
Navigation", section III; the rest are assumptions).

The robot starts in a corridor before the field and has its goal behind it, 10 m ahead.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import convolve, minimum_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from worlds.rooms.room import Room, RoomPlan, RoomTask
from worlds.splits import refuse_judging
from worlds.world import Start

RADIUS = 0.075
"""Radius of a cylinder [m]."""

OPTIMAL_SPEED = 2.0
"""Speed at which the path would take the optimal time [m/s]."""

MIDDLE = (-2.25, 7.0)
"""Place of the room's middle in the benchmark's own frame [m]."""

HALF = (2.25, 7.0)
"""Half of the extent of corridor, field and goal area [m]."""

TASK = RoomTask(Start(0.0, -4.0, math.pi / 2), (0.0, 6.0))
"""Start and goal in the room's frame: (-2.25, 3) and 10 m ahead in the benchmark's own."""

_CELLS = 30
_CELL = 2 * RADIUS

_FIRST = (-2.175, -1.825)
"""Middle of the first cell in the room's frame [m]."""

_CORRIDOR = 34
"""Number of cells of the side walls before the field."""

_ATTEMPTS = 100_000
"""Number of grids that are tried until one can be passed: of the densest, one in thousands can."""

Cells = NDArray[np.bool_]


class BarnFieldConfig(BaseModel):
    """Rules of the generator.

    Attributes:
        fills: Shares of filled cells before smoothing, of which one is drawn.
        smoothings: Numbers of smoothings, of which one is drawn.
        fill_from: Number of filled neighbours, of eight, from which on a cell is filled.
        clear_to: Number of filled neighbours up to which a cell is cleared.
        passage: Width of the square of free cells that has to pass the field [cells].
        is_widest: True to take only fields that no wider square passes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    fills: tuple[float, ...] = (0.15, 0.20, 0.25, 0.30)
    smoothings: tuple[int, ...] = (2, 3, 4)
    fill_from: int = Field(default=5, ge=0, le=8)
    clear_to: int = Field(default=1, ge=0, le=8)
    passage: int = Field(default=5, ge=1, le=_CELLS - 2)
    is_widest: bool = False


PUBLISHED = BarnFieldConfig()
"""Rules as published: squares of five free cells, ways of 0.75 m, pass."""

NARROW = BarnFieldConfig(passage=4, is_widest=True)
"""Harder fields, whose widest way is 0.60 m."""


@dataclass(frozen=True, eq=False)
class BarnWorld:
    """A world of the benchmark.

    Attributes:
        room: Obstacles, start and goal; nothing stands around it.
        path: Places of the path through the field, from its first row to its last [m], shape
            (k, 2).
    """

    room: Room
    path: NDArray[np.float64]

    @property
    def optimal_time(self) -> float:
        """Time of the way from the start along the path to the goal at 2 m/s [s]."""
        (task,) = self.room.tasks
        corners = np.vstack([[(task.start.x, task.start.y)], self.path, [task.goal]])
        return float(np.hypot(*np.diff(corners, axis=0).T).sum()) / OPTIMAL_SPEED


def barn_world(seed: int, config: BarnFieldConfig = PUBLISHED) -> BarnWorld:
    """Return a random world, the same for the same seed.

    Args:
        seed: Seed.
        config: Rules.

    Raises:
        JudgingSeedError: If the seed judges a release.
        ValueError: If no field can be passed as the rules ask.
    """
    refuse_judging(seed)
    cells, ways = _field(seed, config)
    return BarnWorld(
        Room(f"{_kind(config)}-{seed}", HALF, np.zeros((0, 4)), _circles(cells), (TASK,)),
        _middles(_path(ways)),
    )


def barn_room(seed: int, config: BarnFieldConfig = PUBLISHED) -> Room:
    """Return a world of ``barn_world`` as a closed room, to train in.

    The boundary walls stand at the outer edge of the side walls and 1 m behind the goal.
    """
    cells, _ = _field(seed, config)
    plan = {"about": "random field of cylinders", "half": HALF, "circles": _circles(cells).tolist()}
    start, goal = TASK.start, TASK.goal
    plan |= {"start": (start.x, start.y, start.yaw), "goals": [goal]}
    return Room.of(f"{_kind(config)}-{seed}", RoomPlan.model_validate(plan))


def _kind(config: BarnFieldConfig) -> str:
    """Return the first part of a world's name."""
    return {PUBLISHED: "barn", NARROW: "barn-narrow"}.get(config, "barn-other")


def _field(seed: int, config: BarnFieldConfig) -> tuple[Cells, Cells]:
    """Return the filled cells of a field, and those that a square's middle can pass, (30, 30)."""
    rng = np.random.default_rng(seed)
    # Drawn once: taken anew with each try, dense fields, which are harder to pass, would be rare.
    fill, smoothings = rng.choice(config.fills), int(rng.choice(config.smoothings))
    for _ in range(_ATTEMPTS):
        cells = _grid(rng, config, fill, smoothings)
        ways = _ways(cells, config.passage)
        if _is_passed(ways) and not (
            config.is_widest and _is_passed(_ways(cells, config.passage + 1))
        ):
            return cells, ways
    raise ValueError(
        f"barn: expected a field that {config.passage} free cells can pass, got none in "
        f"{_ATTEMPTS} tries; fewer filled cells, or a narrower passage"
    )


def _grid(rng: np.random.Generator, config: BarnFieldConfig, fill: float, smoothings: int) -> Cells:
    """Return one random grid with a share of filled cells, smoothed some times."""
    cells = rng.random((_CELLS, _CELLS)) < fill
    for _ in range(smoothings):
        cells[[0, -1]] = True
        # Beyond the first and the last column the corridor and the goal area are free.
        around = convolve(cells.astype(np.int64), np.ones((3, 3), int), mode="constant") - cells
        cells = (around >= config.fill_from) | (cells & (around > config.clear_to))
    cells[[0, -1]] = True
    return cells


def _ways(cells: Cells, width: int) -> Cells:
    """Return the cells that are the middle, or right above it, of a square of free cells."""
    free = np.pad(~cells, ((0, 0), (width, width)), constant_values=True)
    inside = minimum_filter(free, size=width, mode="constant", cval=0)
    return np.asarray(inside[:, width:-width], dtype=np.bool_)


def _is_passed(ways: Cells) -> bool:
    """Return True if there is a way from the first column to the last."""
    return bool(np.isfinite(_search(ways)[0]))


def _search(ways: Cells) -> tuple[float, list[tuple[int, int]]]:
    """Return the length of the shortest way from the start to the goal [m], and its cells.

    The length is infinite without a way. Steps go to the eight neighbours.
    """
    number = np.arange(_CELLS**2).reshape(_CELLS, _CELLS)
    start, goal = _CELLS**2, _CELLS**2 + 1
    links = []
    for di, dj in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = (slice(0, _CELLS - di), slice(max(-dj, 0), _CELLS - max(dj, 0)))
        there = (slice(di, _CELLS), slice(max(dj, 0), _CELLS + min(dj, 0)))
        both = ways[here] & ways[there]
        length = np.full(int(both.sum()), _CELL * math.hypot(di, dj))
        links.append((number[here][both], number[there][both], length))
    for end, place, column in (
        (start, (TASK.start.x, TASK.start.y), 0),
        (goal, TASK.goal, _CELLS - 1),
    ):
        rows = np.flatnonzero(ways[:, column])
        away = np.hypot(*(_middles(np.column_stack([rows, np.full_like(rows, column)])) - place).T)
        links.append((number[rows, column], np.full_like(rows, end), away))
    first, second, lengths = (np.concatenate(parts) for parts in zip(*links, strict=True))
    graph = coo_array((lengths, (first, second)), shape=(goal + 1, goal + 1)).tocsr()
    far, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    cells: list[tuple[int, int]] = []
    if np.isfinite(far[goal]):
        at = int(before[goal])
        while at != start:
            cells.append(divmod(at, _CELLS))
            at = int(before[at])
    return float(far[goal]), cells[::-1]


def _path(ways: Cells) -> NDArray[np.int64]:
    """Return the cells of the shortest way through a field, shape (k, 2)."""
    return np.array(_search(ways)[1], dtype=np.int64)


def _middles(cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the middles of cells in the room's frame [m], shape (k, 2)."""
    return np.asarray(np.array(_FIRST) + _CELL * cells)


def _circles(cells: Cells) -> NDArray[np.float64]:
    """Return the cylinders of a field, of its corridor and of the back wall, shape (m, 3)."""
    columns = np.arange(-_CORRIDOR, 0)
    sides = [np.column_stack([np.full(_CORRIDOR, row), columns]) for row in (0, _CELLS - 1)]
    back = np.column_stack([np.arange(1, _CELLS - 1), np.full(_CELLS - 2, -_CORRIDOR)])
    places = _middles(np.concatenate([np.argwhere(cells), *sides, back]))
    return np.column_stack([places, np.full(len(places), RADIUS)])
