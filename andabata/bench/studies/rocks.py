"""Measures what the robot's map knows of low rocks before it reaches them, and its false alarms.

``python -m andabata.bench.studies.rocks`` drives in development worlds with the kinematic plant and
prints two Markdown tables. The map that the planner uses is read once for each rock of 5 to 25 cm
ahead, when the robot's centre comes nearer than each distance: is the rock's cell, or one of its
eight neighbours, an obstacle to the planner? Every 3 s it is also read for the cells from 0.8 to
2.5 m away with more than 0.5 m of true clearance.
"""

import argparse
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import run_tasks
from andabata.evaluation.trial import OffroadAttempt, run_trial
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import Models
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.occupancy_grid import OccupancyGrid
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import TRAITS
from worlds.scenes import SceneCache
from worlds.world import World

DISTANCES = (2.0, 1.6, 1.3, 1.0, 0.8)
"""Distances from the robot's centre at which a rock is looked up in the map [m]."""

HEIGHTS = (0.05, 0.07, 0.09, 0.13, 0.25)
"""Edges of the classes of rock heights [m]."""

_WIDEST = 0.6
"""Largest extent of a small rock [m]."""

_CLEAR_EVERY = 30
"""Control steps between two readings of clear cells: 3 s."""

_CELL = 0.2
"""Edge of the cells whose clearance is checked [m]."""


def low_rocks(world: World) -> NDArray[np.float64]:
    """Return x, y and height [m] of the low and small solid objects, shape (n, 3)."""
    rocks = []
    for object_ in world.objects:
        traits = TRAITS[object_.semantic]
        low, high = object_.vertices.min(axis=0), object_.vertices.max(axis=0)
        x, y = ((low + high) / 2)[:2]
        height = float(high[2] - world.ground.height_at(x, y))
        small = HEIGHTS[0] < height < HEIGHTS[-1] and (high - low)[:2].max() < _WIDEST
        if traits.solid and not traits.traversable and small:
            rocks.append((x, y, height))
    return np.array(rocks).reshape(-1, 3)


@dataclass(frozen=True)
class MapReading:
    """Entry of the robot's map for one rock at one distance.

    Attributes:
        distance: Distance at which the map was read, one of ``DISTANCES`` [m].
        height: Height of the rock [m].
        known: True if the rock is an obstacle to the planner.
    """

    distance: float
    height: float
    known: bool


@dataclass(frozen=True)
class RockDrive:
    """Readings of one drive, and its attempts.

    Attributes:
        readings: Readings of rocks.
        clear_cells: Number of clear cells that were read.
        false_walls: Number of these that the map holds for obstacles.
        attempts: Attempts to reach the goals.
    """

    readings: tuple[MapReading, ...]
    clear_cells: int
    false_walls: int
    attempts: tuple[OffroadAttempt, ...]


class MapProbe:
    """Reads the planner's map during a drive, and compares it with the true world.

    Attributes:
        readings: Readings of rocks so far.
        clear_cells: Number of clear cells read so far.
        false_walls: Number of these that the map holds for obstacles.
    """

    def __init__(self, simulated_robot: SimulatedRobot, occupancy: OccupancyGrid) -> None:
        """Attach to a robot and its planner's map."""
        self._simulated_robot = simulated_robot
        self._occupancy = occupancy
        self._truth = simulated_robot.scene.world.truth
        self._rocks = low_rocks(simulated_robot.scene.world)
        self._done: set[tuple[int, float]] = set()
        self._steps = 0
        self.readings: list[MapReading] = []
        self.clear_cells = 0
        self.false_walls = 0

    def __call__(self, readings: SensorReadings) -> None:
        """Read the map after a control step."""
        self._read_rocks()
        self._steps += 1
        if self._steps % _CLEAR_EVERY == 0:
            self._read_clear_cells()

    def _read_rocks(self) -> None:
        """Read the rocks ahead that have come nearer than a distance for the first time."""
        pose = self._simulated_robot.simulator.vehicle.state.pose
        offsets = self._rocks[:, :2] - pose.position[:2]
        ahead = offsets @ [np.cos(pose.yaw), np.sin(pose.yaw)]
        for k, far in enumerate(np.hypot(*offsets.T)):
            for distance in DISTANCES:
                if far < distance and (k, distance) not in self._done:
                    self._done.add((k, distance))
                    if ahead[k] > distance / 2:
                        known = bool(self._walls(self._rocks[k : k + 1, :2], 1)[0])
                        self.readings.append(MapReading(distance, float(self._rocks[k, 2]), known))

    def _read_clear_cells(self) -> None:
        """Count the cells around that are clear in truth, and those of them that are obstacles."""
        here = self._simulated_robot.simulator.vehicle.state.pose.position[:2]
        x, y = here[:, None, None] + np.mgrid[-12:13, -12:13] * _CELL
        far = np.hypot(x - here[0], y - here[1])
        clear = (far > 0.8) & (far < 2.5) & (self._truth.clearance_at(x, y) > 0.5)
        walls = self._walls(np.stack([x[clear], y[clear]], axis=1), 0)
        self.clear_cells += len(walls)
        self.false_walls += int(walls.sum())

    def _walls(self, positions: NDArray[np.float64], radius: int) -> NDArray[np.bool_]:
        """Return which positions are obstacles to the planner, bool, shape (n,).

        Args:
            positions: Positions in the true map [m], shape (n, 2).
            radius: Number of neighbouring cells on each side that count, too.
        """
        # The map lies in the filter's odometry frame, the world in the true one.
        odometry = self._simulated_robot.localizer.odometry
        true = self._simulated_robot.simulator.vehicle.state.pose
        c, s = np.cos(odometry.yaw - true.yaw), np.sin(odometry.yaw - true.yaw)
        dx, dy = (positions - true.position[:2]).T
        spots = np.stack([c * dx - s * dy, s * dx + c * dy], axis=1) + odometry.position[:2]
        i, j = np.floor(spots / self._occupancy.config.cell).astype(int).T
        is_blocked, last = np.zeros(len(positions), dtype=bool), len(self._occupancy.log_odds) - 1
        for a in range(-radius, radius + 1):
            for b in range(-radius, radius + 1):
                log_odds = self._occupancy.log_odds[(i + a) & last, (j + b) & last]
                is_blocked |= log_odds > self._occupancy.config.lethal_log_odds
        return is_blocked


def drive_among_rocks(
    config: SimulatedRobotConfig, goals: int, world: tuple[str, int]
) -> RockDrive:
    """Drive to the first goals of a world and read the map on the way.

    Args:
        config: Configuration of the robot.
        goals: Number of goals.
        world: Preset and seed.
    """
    preset, seed = world
    scene = SceneCache().get(preset, seed)
    models = Models()
    steering = make_steering("policy+planner", scene.world, config, models)
    if not isinstance(steering.planner, LocalPlanner):
        raise TypeError(f"planner: expected one with a map, got {type(steering.planner).__name__}")
    simulated_robot = SimulatedRobot(scene, config, models, steering)
    probe = MapProbe(simulated_robot, steering.planner.occupancy)
    task = scene.world.tasks[0]
    task = replace(task, goals=task.goals[:goals])
    rng = np.random.default_rng([seed, 1])
    attempts = run_trial(simulated_robot, task, TerminationConfig(), rng, probe)
    simulated_robot.close()
    return RockDrive(tuple(probe.readings), probe.clear_cells, probe.false_walls, attempts)


def rock_rows(drives: Sequence[RockDrive]) -> list[Row]:
    """Return known rocks of all rocks, one row a class of heights, one column a distance."""
    readings = [reading for drive in drives for reading in drive.readings]
    rows: list[Row] = []
    for low, high in pairwise(HEIGHTS):
        row: Row = {"height [m]": f"{low} to {high}"}
        for distance in DISTANCES:
            known = [
                reading.known
                for reading in readings
                if low <= reading.height < high and reading.distance == distance
            ]
            row[f"{distance} m"] = f"{sum(known)} of {len(known)}"
        rows.append(row)
    return rows


def drive_row(drives: Sequence[RockDrive]) -> Row:
    """Return the share of clear cells that are obstacles to the planner, and how drives ended."""
    attempts = [attempt for drive in drives for attempt in drive.attempts]
    clear = sum(drive.clear_cells for drive in drives)
    return {
        "clear cells": clear,
        "false walls": sum(drive.false_walls for drive in drives) / clear if clear else None,
        "goals": f"{sum(a.outcome is Outcome.GOAL for a in attempts)} of {len(attempts)}",
        "mean time [s]": float(np.mean([attempt.time for attempt in attempts])),
        "SPL": float(np.mean([attempt.spl for attempt in attempts])),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Drive and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", default="natural-test", help="World preset.")
    parser.add_argument("--first-world", type=int, default=7300, help="First world seed.")
    parser.add_argument("--worlds", type=int, default=30, help="Number of worlds.")
    parser.add_argument("--goals", type=int, default=2, help="Number of goals in each world.")
    parser.add_argument("--workers", type=int, default=2, help="Number of processes.")
    parser.add_argument(
        "--set", action="append", default=[], metavar="A.B=C", help="Setting of the robot, TOML."
    )
    options = parser.parse_args(argv)
    settings = tomllib.loads("\n".join(options.set))
    config = SimulatedRobotConfig.model_validate({"plant": "kinematic"} | settings)
    worlds = [(options.world, options.first_world + k) for k in range(options.worlds)]
    work = run_tasks(partial(drive_among_rocks, config, options.goals), worlds, options.workers)
    bar = track(work, "drives", total=len(worlds), console=Console(stderr=True))
    drives = [drive for _, drive in bar]
    sys.stdout.write(markdown_table(rock_rows(drives)) + "\n")
    sys.stdout.write(markdown_table([drive_row(drives)]))


if __name__ == "__main__":
    main()
