"""Measures what walkers cost in a control step: their own motion, and the whole simulator.

``python -m andabata.bench.studies.walker_cost`` prints a Markdown table.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row, markdown_table
from andabata.machine.clock import TICK_HZ, TICKS_PER_STEP
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from worlds.agents import MOST
from worlds.catalogue import make_world, presets
from worlds.natural import NaturalConfig
from worlds.rays.scene import RayScene
from worlds.splits import DEVELOPMENT_SEED
from worlds.walkers import draw_walkers, solids_room
from worlds.walking import Walkers
from worlds.world import World

COUNTS = (0, 24, 100, MOST)
"""Numbers of walkers."""

_RUN_IN = 20
"""Control steps before the clock starts: compilation, and people who begin to walk."""

_RADIUS = 0.45
"""Radius of the robot [m]."""


def with_walkers(world: World, count: int) -> World:
    """Return a world with about as many walkers, in the shares of the preset natural-walkers.

    Args:
        world: World without walkers.
        count: Number of walkers; groups are of random size, and some may find no place.
    """
    preset = presets()["natural-walkers"]
    assert isinstance(preset, NaturalConfig)
    # Groups have three people on average, and four at most.
    usual = preset.walkers.most_at(0.5) - preset.walkers.people.groups
    share = count / usual
    room = solids_room(world.ground, world.objects)
    rng = np.random.default_rng(world.seed)
    movers = draw_walkers(preset.walkers.scaled(share), room, world.tasks, rng, world.truth)
    return replace(world, movers=movers[:MOST])


def time_steps(world: World, counts: Sequence[int] = COUNTS, steps: int = 300) -> list[Row]:
    """Return the cost of a control step by the number of walkers, the robot standing at its start.

    Args:
        world: World without walkers.
        counts: Numbers of walkers, about.
        steps: Number of control steps of each measurement.
    """
    scene = RayScene(world)
    rows: list[Row] = []
    for count in counts:
        peopled = with_walkers(world, count)
        found = len(peopled.movers)
        motion = _motion_times(peopled, steps) if found else np.zeros(steps)
        rows.append(
            {
                "walkers": found,
                "motion, median [ms]": 1e3 * float(np.median(motion)),
                "motion, 95 % [ms]": 1e3 * float(np.quantile(motion, 0.95)),
                "simulator with laser, median [ms]": 1e3
                * float(np.median(_simulator_times(peopled, scene, steps))),
            }
        )
    return rows


def _motion_times(world: World, steps: int) -> NDArray[np.float64]:
    """Return the durations of the walkers' control steps [s], shape (steps,)."""
    walkers, start = Walkers(world, TICK_HZ), world.tasks[0].start
    return _times(lambda: walkers.step(TICKS_PER_STEP, (start.x, start.y), _RADIUS), steps)


def _simulator_times(world: World, rays: RayScene, steps: int) -> NDArray[np.float64]:
    """Return the durations of control steps of a robot that stands [s], shape (steps,)."""
    rng = np.random.default_rng(world.seed)
    simulator = Simulator(world, rays, RobotModel(), "kinematic", SensingConfig(), rng)
    simulator.reset(world.tasks[0].start)
    found = _times(lambda: simulator.step(WheelSpeeds(0.0, 0.0)), steps)
    simulator.close()
    return found


def _times(work: Callable[[], object], steps: int) -> NDArray[np.float64]:
    """Return the durations of some calls after a run-in [s], shape (steps,)."""
    for _ in range(_RUN_IN):
        work()
    marks = [time.perf_counter()]
    for _ in range(steps):
        work()
        marks.append(time.perf_counter())
    return np.diff(marks)


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=300, help="control steps of a measurement")
    steps = parser.parse_args(argv).steps
    rows = time_steps(make_world("natural-test", DEVELOPMENT_SEED), steps=steps)
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
