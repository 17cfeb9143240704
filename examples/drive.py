"""A drive from Python: a world, a robot, goals in a row, and what came of each."""

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.models import Models
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache

SECONDS = 120.0
"""Longest time to a goal [s]."""


def main() -> None:
    """Drive to the goals of a task, and print the outcomes."""
    scene, models = SceneCache().get("natural-test", seed=7300), Models()
    config = SimulatedRobotConfig(plant="kinematic")
    robot = SimulatedRobot(scene, config, models, make_steering("planner", scene.world, config))
    task, rules = scene.world.tasks[0], TerminationConfig(time_limit=SECONDS)
    for attempt in run_trial(robot, task, rules, np.random.default_rng(0)):
        print(f"{attempt.outcome}: {attempt.distance:.1f} m in {attempt.time:.1f} s")
    robot.close()


if __name__ == "__main__":
    main()
