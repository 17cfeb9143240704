"""What does the robot's map know of low rocks when it gets near them, and what does it make up?

Run with ``python -m tests.benchmarks.bench_rocks [WORLD] [FIRST] [COUNT] [GOALS] [A.B=C ...]``:
drives of ``learned`` in so many worlds from that seed on, kinematic plant, settings of the robot as
given. The map that steers is asked once for each rock of 5 to 25 cm that lies ahead, when the
robot's middle comes nearer than each distance: is its cell, or one beside it, a wall? And every 3 s
for the cells from 0.8 to 2.5 m away with more than 0.5 m of true clearance.
"""

import sys
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.app.settings import resolve
from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.engine import run_tasks
from andabata.evaluation.trial import run_trial
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import shipped_forest
from andabata.navigation.guided import GuidedController
from andabata.tasks.episode_monitor import TerminationConfig
from terrain.classes import TRAITS
from worlds.scenes import SceneCache
from worlds.world import World

DISTANCES = (2.0, 1.6, 1.3, 1.0, 0.8)
HEIGHTS = (0.05, 0.07, 0.09, 0.13, 0.25)
DEFAULTS = ("natural-test", "7300", "30", "2")


def low_rocks(world: World) -> NDArray[np.float64]:
    """Return the middles and heights [m] of the solid things that are low and small, (n, 3)."""
    found = []
    for thing in world.objects:
        traits = TRAITS[thing.semantic]
        low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
        x, y = ((low + high) / 2)[:2]
        height = float(high[2] - world.ground.height_at(x, y))
        small = HEIGHTS[0] < height < HEIGHTS[-1] and (high - low)[:2].max() < 0.6
        if traits.solid and not traits.traversable and small:
            found.append((x, y, height))
    return np.array(found).reshape(-1, 3)


class Asker:
    """Asks the map that steers a robot."""

    def __init__(self, simulated_robot: SimulatedRobot, controller: GuidedController) -> None:
        self._simulated_robot = simulated_robot
        self._evidence = controller.local_planner.evidence
        self._truth = simulated_robot.scene.world.truth
        self._rocks = low_rocks(simulated_robot.scene.world)
        self._asked: set[tuple[int, float]] = set()
        self._steps = 0
        self.known: list[tuple[float, float, bool]] = []
        self.clear = np.zeros(2, dtype=np.int64)

    def __call__(self, readings: SensorReadings) -> None:
        """Ask after a control step."""
        true = self._simulated_robot.simulator.vehicle.state.pose
        here = true.position[:2]
        away = self._rocks[:, :2] - here
        ahead = away @ [np.cos(true.yaw), np.sin(true.yaw)]
        for k, far in enumerate(np.hypot(*away.T)):
            for distance in DISTANCES:
                if far < distance and (k, distance) not in self._asked:
                    self._asked.add((k, distance))
                    if ahead[k] > distance / 2:
                        wall = bool(self._walls(self._rocks[k : k + 1, :2], 1)[0])
                        self.known.append((distance, float(self._rocks[k, 2]), wall))
        self._steps += 1
        if self._steps % 30 == 0:
            x, y = here[:, None, None] + np.mgrid[-12:13, -12:13] * 0.2
            far = np.hypot(x - here[0], y - here[1])
            clear = (far > 0.8) & (far < 2.5) & (self._truth.clearance_at(x, y) > 0.5)
            walls = self._walls(np.stack([x[clear], y[clear]], axis=1), 0)
            self.clear += [len(walls), int(walls.sum())]

    def _walls(self, places: NDArray[np.float64], around: int) -> NDArray[np.bool_]:
        """Return whether places of the true map, shape (n, 2), or cells around are walls."""
        there, true = (
            self._simulated_robot.localizer.odometry,
            self._simulated_robot.simulator.vehicle.state.pose,
        )
        c, s = np.cos(there.yaw - true.yaw), np.sin(there.yaw - true.yaw)
        dx, dy = (places - true.position[:2]).T
        spots = np.stack([c * dx - s * dy, s * dx + c * dy], axis=1) + there.position[:2]
        i, j = np.floor(spots / self._evidence.config.cell).astype(int).T
        found, last = np.zeros(len(places), dtype=bool), len(self._evidence.values) - 1
        for a in range(-around, around + 1):
            for b in range(-around, around + 1):
                values = self._evidence.values[(i + a) & last, (j + b) & last]
                found |= values > self._evidence.config.wall
        return found


@dataclass(frozen=True)
class Drive:
    """What was asked on a drive, and how it went.

    Attributes:
        known: Distance [m], height [m], and whether that rock was a wall.
        clear: Clear cells that were asked for, and those that were walls.
        attempts: Outcome, time [s] and SPL of each.
    """

    known: list[tuple[float, float, bool]]
    clear: NDArray[np.int64]
    attempts: list[tuple[str, float, float]]


def drive(config: SimulatedRobotConfig, goals: int, place: tuple[str, int]) -> Drive:
    """Drive in the world of a preset and seed."""
    scene = SceneCache().get(*place)
    controller = make_controller("learned", scene.world, config)
    assert isinstance(controller, GuidedController)
    simulated_robot = SimulatedRobot(scene, config, shipped_forest(), controller)
    asker = Asker(simulated_robot, controller)
    task = scene.world.tasks[0]
    task = replace(task, goals=task.goals[:goals])
    attempts = run_trial(
        simulated_robot, task, TerminationConfig(), np.random.default_rng([place[1], 1]), asker
    )
    simulated_robot.close()
    return Drive(
        asker.known,
        asker.clear,
        [(str(attempt.outcome), attempt.time, attempt.spl) for attempt in attempts],
    )


def main() -> None:
    """Drive, ask and print."""
    given = sys.argv[1:]
    settings = [word for word in given if "=" in word]
    preset, first, count, goals = [
        *given[: len(given) - len(settings)],
        *DEFAULTS[len(given) - len(settings) :],
    ]
    config = resolve(SimulatedRobotConfig, None, settings, SimulatedRobotConfig(plant="kinematic"))
    places = [(preset, seed) for seed in range(int(first), int(first) + int(count))]
    drives = [found for _, found in run_tasks(partial(drive, config, int(goals)), places, 2)]
    known = np.array([row for each in drives for row in each.known]).reshape(-1, 3)
    for low, high in pairwise(HEIGHTS):
        sized = known[(known[:, 1] >= low) & (known[:, 1] < high)]
        shares = []
        for distance in DISTANCES:
            walls = sized[sized[:, 0] == distance, 2]
            shares.append(f"{distance} m {walls.sum():.0f} of {len(walls)}")
        sys.stdout.write(f"rocks of {low} to {high} m known: {', '.join(shares)}\n")
    cells, walls = sum(each.clear for each in drives)
    attempts = [attempt for each in drives for attempt in each.attempts]
    sys.stdout.write(
        f"clear cells {cells}, walls {walls / cells:.4f}; goals "
        f"{sum(attempt[0] == 'goal' for attempt in attempts)} of {len(attempts)}, time "
        f"{np.mean([attempt[1] for attempt in attempts]):.1f} s, SPL {np.mean([attempt[2] for attempt in attempts]):.3f}\n"
    )


if __name__ == "__main__":
    main()
