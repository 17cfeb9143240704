"""Fields of moving cylinders after DynaBARN's published rules, each the same for its seed.

A field is a square of 20 m with walls on three sides; the robot comes in from the open one and has
its goal 20 m ahead, before the wall behind. Cylinders of 0.5 m radius cross it on curves: a
polynomial of a drawn order through random points, of which the part inside of the square is taken,
from border to border. Between two places of a curve a cylinder goes straight, at a speed that is
drawn anew each time around one of its own; at the end it is at the begin again. It minds nothing
(Nair et al. 2022, "DynaBARN: Benchmarking Metric Ground Navigation in Dynamic Environments", and
its generator).

The rules of the generator that are not stated, and what the levels differ in, are assumptions; see
``LEVELS``.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from worlds.rooms.barn import BarnWorld
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomTask
from worlds.splits import refuse_judging
from worlds.world import Start

Level = Literal["easy", "medium", "hard"]

SIDE = 10.0
"""Half of the edge of the square [m]."""

MOVER_RADIUS = 0.5
"""Radius of a cylinder [m]."""

_HALF_WALL = 0.25
"""Half of the thickness of the walls [m]."""

HALF = (12.0, SIDE + _HALF_WALL)
"""Half of the extent of the square with its walls and of the ground before it [m]."""

WALLS = (
    (-SIDE - _HALF_WALL, -SIDE, -SIDE + _HALF_WALL, SIDE),
    (-SIDE, SIDE - _HALF_WALL, SIDE, SIDE + _HALF_WALL),
    (-SIDE, -SIDE - _HALF_WALL, SIDE, -SIDE + _HALF_WALL),
)
"""Walls behind, left and right, as x_min, y_min, x_max, y_max [m]."""

TASK = RoomTask(Start(11.0, 0.0, math.pi), (-9.0, 0.0))
"""Start and goal, in the frame of the square's middle."""

_PLACES = 10
"""Number of places of a curve, evenly spaced along x."""

_DRAWS = 1000
"""Number of curves that are drawn until one is long enough: half of the edge at least (assumption).
"""


class MovingFieldConfig(BaseModel):
    """Rules of the generator.

    Attributes:
        count: Least and largest number of cylinders.
        orders: Least and largest order of a curve's polynomial.
        speeds: Least and largest speed of a cylinder [m/s].
        spread: Least and largest standard deviation of a cylinder's speeds [m/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    count: tuple[int, int]
    orders: tuple[int, int] = Field(default=(1, 4))
    speeds: tuple[float, float]
    spread: tuple[float, float]


LEVELS: dict[Level, MovingFieldConfig] = {
    "easy": MovingFieldConfig(count=(5, 11), orders=(1, 2), speeds=(0.5, 1.0), spread=(0.01, 0.1)),
    "medium": MovingFieldConfig(
        count=(15, 18), orders=(2, 3), speeds=(0.5, 1.5), spread=(0.05, 0.15)
    ),
    "hard": MovingFieldConfig(count=(20, 23), orders=(3, 4), speeds=(1.0, 2.0), spread=(0.1, 0.2)),
}
"""Levels by name. Numbers of cylinders are those of the published worlds, as far as they were
counted (5 to 11, 17 to 18, 21 to 23); the largest orders and speeds are those that the generator
names; what is between is an assumption."""


def moving_field(seed: int, level: Level) -> BarnWorld:
    """Return a random field, the same for the same seed; its path is the straight line.

    Args:
        seed: Seed.
        level: Difficulty.

    Raises:
        JudgingSeedError: If the seed judges a release.
    """
    refuse_judging(seed)
    # Levels differ in more than their numbers: no field is one of another level, made faster.
    rng = np.random.default_rng([seed, tuple(LEVELS).index(level)])
    config = LEVELS[level]
    count = int(rng.integers(config.count[0], config.count[1] + 1))
    movers = tuple(_mover(config, rng) for _ in range(count))
    return field_world(f"barn-moving-{level}-{seed}", movers)


def field_world(
    name: str, movers: tuple[MoverPlan, ...], judges: bool = False, walls: object = WALLS
) -> BarnWorld:
    """Return a field with movers; its path is the straight line from start to goal.

    Args:
        name: Name.
        movers: Movers with their courses.
        judges: True for a field that judges alone.
        walls: Walls as x_min, y_min, x_max, y_max [m].
    """
    boxes = np.array(walls, dtype=np.float64).reshape(-1, 4)
    room = Room(name, HALF, boxes, np.zeros((0, 3)), (TASK,), movers=movers, judges=judges)
    return BarnWorld(room, np.zeros((0, 2)))


def _mover(config: MovingFieldConfig, rng: np.random.Generator) -> MoverPlan:
    """Return a random cylinder with its course."""
    places = _curve(int(rng.integers(config.orders[0], config.orders[1] + 1)), rng)
    slowest, fastest = config.speeds
    usual, spread = rng.uniform(slowest, fastest), rng.uniform(*config.spread)
    ways = np.hypot(*np.diff(places, axis=0).T)
    speeds = np.clip(rng.normal(usual, spread, len(ways)), slowest, fastest)
    times = np.concatenate([[0.0], np.cumsum(ways / speeds)])
    rows = np.column_stack([times, places]).tolist()
    return MoverPlan(
        radius=MOVER_RADIUS,
        place=(rows[0][1], rows[0][2]),
        course=tuple((time, x, y) for time, x, y in rows),
    )


def _curve(order: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the places of a curve across the square [m], shape (k, 2), either way round."""
    for _ in range(_DRAWS):
        through = rng.uniform(-SIDE, SIDE, (order + 1, 2))
        factors = np.polynomial.polynomial.polyfit(through[:, 0], through[:, 1], order)
        xs = np.linspace(-SIDE, SIDE, 20 * _PLACES + 1)
        ys = np.polynomial.polynomial.polyval(xs, factors)
        inside = _longest_run(np.abs(ys) <= SIDE)
        if inside is None:
            continue
        chosen = np.unique(np.linspace(inside.start, inside.stop - 1, _PLACES).astype(int))
        places = np.column_stack([xs[chosen], ys[chosen]])
        if len(chosen) == _PLACES and np.hypot(*np.diff(places, axis=0).T).sum() >= SIDE:
            return places if rng.random() < 0.5 else places[::-1]
    raise ValueError(
        f"moving field: expected a curve of order {order} across the square, got none in {_DRAWS} "
        "draws; take a lower order"
    )


def _longest_run(flags: NDArray[np.bool_]) -> slice | None:
    """Return the longest run of true flags, None without any."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    runs = edges.reshape(-1, 2)
    if not len(runs):
        return None
    begin, end = runs[np.diff(runs, axis=1)[:, 0].argmax()]
    return slice(int(begin), int(end))
