"""A world of your own: heights from a function, trees and a wall on them, and a drive in it.

It writes ``own_world.safetensors``, which every command takes where it takes a world: ``andabata
world show own_world.safetensors``, ``andabata drive --world own_world.safetensors``.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.models import Models
from andabata.tasks.episode_monitor import TerminationConfig
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from terrain.plants import tree
from worlds.goals import task_to
from worlds.rays.scene import RayScene
from worlds.scenes import Scene
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, World
from worlds.world_files import world_to_bytes

SIZE, CELL = 40.0, 0.25
"""Edge of the ground and distance between its grid lines [m]."""

SECONDS = 120.0
"""Longest time to the goal [s]."""


def height(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height [m] at places [m], x to the east, y to the north."""
    return 0.8 * np.sin(x / 6.0) * np.cos(y / 8.0)


def make() -> World:
    """Return the world: ground, objects, the true map that follows from both, and a task."""
    lines = np.arange(-SIZE / 2, SIZE / 2 + CELL / 2, CELL)
    ground = Heightfield(height(*np.meshgrid(lines, lines, indexing="ij")).astype(np.float32), CELL)
    rng = np.random.default_rng(1)
    objects = [box(SemanticClass.WALL, (0.0, 2.0, 0.0), (0.4, 6.0, 4.0))]
    for x, y in [(-6, -4), (5, 5), (7, -3)]:
        objects += tree(ground, x, y, rng)
    truth = build_truth(ground, tuple(objects), TruthConfig())
    task = task_to(truth, Start(-12.0, 0.0, 0.0), [(12.0, 2.0)])
    surface = np.full(np.subtract(ground.heights.shape, 1), SemanticClass.GROUND, dtype=np.uint8)
    return World("own", 0, 0.0, ground, surface, tuple(objects), (task,), truth)


def main() -> None:
    """Write the world, drive to its goal, and print what came of it."""
    world = make()
    Path("own_world.safetensors").write_bytes(world_to_bytes(world))
    scene, config = Scene(world, RayScene(world)), SimulatedRobotConfig(plant="kinematic")
    robot = SimulatedRobot(scene, config, Models(), make_steering("planner", world, config))
    rules = TerminationConfig(time_limit=SECONDS)
    for attempt in run_trial(robot, world.tasks[0], rules, np.random.default_rng(0)):
        print(f"{attempt.outcome}: {attempt.distance:.1f} m in {attempt.time:.1f} s")
    robot.close()


if __name__ == "__main__":
    main()
