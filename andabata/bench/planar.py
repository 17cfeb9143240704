"""Measures the speed of robots in rooms: rays, simulator, SPN's environment, and the oracle.

``python -m andabata.bench.planar`` prints a Markdown table. Loops last a few milliseconds, and the
fastest counts: what else runs on the core does not.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row, markdown_table
from andabata.machine.planar_lidar import PlanarLidarConfig
from andabata.tasks.lattice_oracle import oracle_drive
from andabata.tasks.movers import Movers
from andabata.tasks.room_batch import DiscRobotConfig, RoomBatch, laser_arrays, room_arrays
from andabata.tasks.room_kernel import cast
from andabata.tasks.spn import SpnConfig, SpnVectorEnv
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomPlan, random_task
from worlds.world import Start

BEAMS = (36, 180, 1080)
"""Numbers of beams all around that are timed."""

ROBOTS = (16, 64)
"""Numbers of robots that are timed."""

JUDGING_ROOMS = ("spn-env4", "spn-env5", "spn-env6", "spn-env7")
"""Rooms that the oracle is timed in."""


def cluttered_room() -> Room:
    """Return a room of 10 m with 25 boxes, the walls among them."""
    rng, boxes = np.random.default_rng(0), []
    centres = [(x, y) for x in (-3.4, -1.7, 0.0, 1.7, 3.4) for y in (-3.4, -1.1, 1.1, 3.4)]
    for x, y in [*centres, (0.0, -2.2)]:
        half = rng.uniform(0.1, 0.4, 2)
        boxes.append((x - half[0], y - half[1], x + half[0], y + half[1]))
    return Room.of("cluttered", RoomPlan(about="for timing", half=(5, 5), boxes=tuple(boxes)))


def all_around(beams: int) -> PlanarLidarConfig:
    """Return a laser that sees all around, with a number of beams."""
    return PlanarLidarConfig(resolution_deg=360.0 / beams)


def starts_in(room: Room, count: int) -> list[Start]:
    """Return random starts with clearance."""
    rng = np.random.default_rng(1)
    return [random_task(room, rng, 0.2).start for _ in range(count)]


def fastest(call: Callable[[], object], loops: int) -> float:
    """Return the duration of the fastest of some loops [us], after one that compiles."""
    call()
    times = []
    for _ in range(loops):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e6 * min(times)


def time_scans(beams: int, places: int = 64) -> float:
    """Return the time of one scan in the cluttered room, mean over places [us]."""
    room, zeros = cluttered_room(), np.zeros(places, dtype=np.int64)
    motions = np.array([(*_pose(start), 0.0, 0.0) for start in starts_in(room, places)])
    rooms, lasers = room_arrays([room]), laser_arrays([all_around(beams)])
    found, everyone = np.zeros((places, beams), dtype=np.float32), np.ones(places, dtype=np.bool_)

    def call() -> None:
        cast(motions, everyone, zeros, rooms, Movers.none(places), lasers, zeros, found)

    return fastest(call, 1000) / places


def _pose(start: Start) -> tuple[float, float, float]:
    """Return the numbers of a start."""
    return start.x, start.y, start.yaw


def time_simulator(robots: int, beams: int) -> float:
    """Return the number of robot steps a second of the simulator in the cluttered room."""
    room = cluttered_room()
    batch = RoomBatch(robots, [room], DiscRobotConfig(), all_around(beams))
    for k, start in enumerate(starts_in(room, robots)):
        batch.place(k, 0, start)
    # On circles of 0.2 m robots stay in the open, as long as the measurement takes.
    twists = np.tile([0.1, 0.5], (robots, 1))
    everyone = np.ones(robots, dtype=np.bool_)

    return 1e6 * robots / fastest(lambda: batch.step(twists, everyone), 1000)


def time_environment(robots: int, beams: int) -> float:
    """Return the number of robot steps a second of SPN's training environment.

    Loops are of ten steps, in which a share of the robots begins anew.
    """
    env = SpnVectorEnv(SpnConfig(lidar=all_around(beams)), robots)
    env.reset(seed=0)
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (10, robots, 2)).astype(np.float32)

    def call() -> None:
        for row in actions:
            env.step(row)

    return 1e6 * robots * len(actions) / fastest(call, 50)


def time_oracle(tasks: int = 20) -> NDArray[np.float64]:
    """Return the time of the oracle for random tasks in the judging rooms [ms], shape (n,)."""
    times = []
    for name in JUDGING_ROOMS:
        room, rng = make_room(name), np.random.default_rng(3)
        oracle_drive(room, random_task(room, rng, 0.2))  # Compiled code is compiled.
        for _ in range(tasks):
            task = random_task(room, rng, 0.2)
            began = time.perf_counter()
            oracle_drive(room, task)
            times.append(1e3 * (time.perf_counter() - began))
    return np.array(times)


def time_rooms() -> list[Row]:
    """Return the rows of the table."""
    rows: list[Row] = [_row("scan", "25 boxes", beams, time_scans(beams), "us") for beams in BEAMS]
    for name, measured in (("simulator", time_simulator), ("environment", time_environment)):
        for robots in ROBOTS:
            rows += [
                _row(name, f"{robots} robots", beams, measured(robots, beams), "robot steps/s")
                for beams in BEAMS
            ]
    oracle = time_oracle()
    for name, value in (("mean", oracle.mean()), ("slowest", oracle.max())):
        rows.append(_row("oracle", name, None, float(value), "ms"))
    return rows


def _row(part: str, subject: str, beams: int | None, value: float, unit: str) -> Row:
    """Return one row."""
    return {"part": part, "subject": subject, "beams": beams, "value": value, "unit": unit}


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    sys.stdout.write(markdown_table(time_rooms()))


if __name__ == "__main__":
    main()
