"""Measures how fast disc robots in rooms are simulated: rays, and whole steps of a batch.

``python -m andabata.bench.studies.planar`` prints a Markdown table. The room has about 25 boxes. A
whole step drives, casts, and writes points and windows; in the last row among moving obstacles,
which the other caster leaves out. That caster intersects every beam with every box as slabs and
with every circle, in plain numpy, in the same run.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row, markdown_table
from andabata.machine.planar.lidar import TRAINING_LIDAR, PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch
from andabata.tasks.rooms.points import SECTORS, bearing_windows, take_points
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomPlan, RoomTask, free_places
from worlds.world import Start

BEAMS = (36, 180, 1080)
"""Numbers of beams of a step."""

_ROBOTS = 64
"""Number of robots of a step."""

_MOVERS = 4
"""Number of moving obstacles of each robot in the last row."""

_POINTS = 120
"""Largest number of points of an observation."""


def crowded_room(seed: int = 0, boxes: int = 21) -> Room:
    """Return a room of 10 m with random boxes, and four walls around.

    Args:
        seed: Seed of the layout.
        boxes: Number of boxes inside.
    """
    rng = np.random.default_rng(seed)
    low = rng.uniform(-4.5, 4.0, (boxes, 2))
    plan = RoomPlan.model_validate(
        {
            "about": "random boxes",
            "half": (5.0, 5.0),
            "boxes": np.concatenate([low, low + rng.uniform(0.2, 1.0, (boxes, 2))], 1).tolist(),
        }
    )
    return Room.of("crowded", plan)


def slab_ranges(
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    place: NDArray[np.float64],
    angles: NDArray[np.float64],
    max_range: float,
) -> NDArray[np.float64]:
    """Return the ranges of beams, each intersected with every obstacle [m], shape (b,).

    Args:
        boxes: x_min, y_min, x_max, y_max [m], shape (n, 4).
        circles: x, y, radius [m], shape (m, 3).
        place: Position of the laser [m], shape (2,).
        angles: Angle of each beam in the room [rad], shape (b,).
        max_range: Range of what returns nothing [m].
    """
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        one = (boxes[:, :2] - place) / directions[:, None]
        other = (boxes[:, 2:] - place) / directions[:, None]
    enter, leave = np.minimum(one, other).max(axis=2), np.maximum(one, other).min(axis=2)
    hits = np.where((enter <= leave) & (leave >= 0), np.maximum(enter, 0.0), np.inf)
    ranges = np.minimum(hits.min(axis=1), max_range)
    if len(circles):
        away = circles[:, :2] - place
        along = directions @ away.T
        squared = circles[:, 2] ** 2 - (away**2).sum(axis=1) + along**2
        hits = along - np.sqrt(np.maximum(squared, 0.0))
        hits[(squared < 0) | (along < 0)] = np.inf
        ranges = np.minimum(ranges, hits.min(axis=1))
    return np.asarray(ranges)


def least_time(work: Callable[[], object], runs: int = 20) -> float:
    """Return the least time of some runs [s]."""
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def standing_batch(room: Room, lidar: PlanarLidarConfig, robots: int, movers: int = 0) -> RoomBatch:
    """Return robots at random free places of a room.

    Args:
        room: Room.
        lidar: Laser of all robots.
        robots: Number of robots.
        movers: Number of moving obstacles of each.
    """
    rng = np.random.default_rng(1)
    batch = RoomBatch(robots, [room], DiscRobotConfig(), lidar, movers)
    crowded = replace(room, movers=(MoverPlan(radius=0.2, speed=0.5),) * movers)
    for k, (x, y) in enumerate(rng.choice(free_places(room, 0.2, 0.3), robots)):
        start = Start(x, y, rng.uniform(-np.pi, np.pi))
        batch.place(k, 0, start, draw_movers(crowded, rng, RoomTask(start, (0.0, 0.0)), 0.2))
    return batch


def cast_row(room: Room) -> Row:
    """Return the cost of one robot's 1080 beams beside that of the plain caster."""
    batch = standing_batch(room, TRAINING_LIDAR, _ROBOTS)
    everyone = np.ones(_ROBOTS, dtype=np.bool_)
    batch.observe(everyone)
    ours = least_time(lambda: batch.observe(everyone)) / _ROBOTS
    angles = TRAINING_LIDAR.bearings + batch.poses[0, 2]
    place, reach = batch.poses[0, :2], TRAINING_LIDAR.max_range
    plain = least_time(lambda: slab_ranges(room.boxes, room.circles, place, angles, reach))
    return _row(f"cast of 1080 beams, {len(room.boxes)} boxes", 1e6 * ours, "us", plain / ours)


def step_row(room: Room, beams: int, movers: int = 0) -> Row:
    """Return how many robots' steps are simulated in a second, beside those of the plain caster."""
    lidar = PlanarLidarConfig(resolution_deg=360 / beams)
    batch = standing_batch(room, lidar, _ROBOTS, movers)
    everyone, points = np.ones(_ROBOTS, dtype=np.bool_), min(beams, _POINTS)
    rows = np.zeros((_ROBOTS, 3 * points + SECTORS), dtype=np.float32)
    twists, windows = np.tile([0.0, 0.5], (_ROBOTS, 1)), bearing_windows(batch.lasers)

    def step() -> None:
        batch.step(twists, everyone)
        seen = batch.reciprocals, everyone, batch.lasers, batch.mounted
        take_points(*seen, points, windows, rows)

    step()
    ours = least_time(step) / _ROBOTS
    angles, reach = lidar.bearings, lidar.max_range
    plain = least_time(lambda: slab_ranges(room.boxes, room.circles, np.zeros(2), angles, reach))
    crowd = f", {movers} movers" if movers else ""
    return _row(f"step, {beams} beams{crowd}", 1 / ours, "robot-steps/s", plain / ours)


def _row(name: str, value: float, unit: str, ratio: float) -> Row:
    """Return a row of the table."""
    return {"work": name, "value": float(f"{value:.3g}"), "unit": unit, "plain / ours": ratio}


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    room = crowded_room()
    rows = [cast_row(room), *(step_row(room, beams) for beams in BEAMS)]
    rows.append(step_row(room, BEAMS[1], _MOVERS))
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
