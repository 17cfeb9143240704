"""Work of whole robots: the loop of one, training, and many in one world."""

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench.chain import driving
from andabata.bench.contenders import OURS, Case, Contender
from andabata.bench.speed_peers import Work
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.lidar import LidarConfig
from andabata.machine.plants import available_plants
from andabata.models import shipped_policy
from andabata.tasks.maze import MazeVectorEnv
from andabata.tasks.offroad import OffroadConfig, stage_config
from andabata.tasks.vector import OffroadVectorEnv, make_vector
from rl.sac import SacConfig, SoftActorCritic
from rl.spaces import steering_actions, steering_observations
from rl.training import EpisodeSpec, play_together
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world

_LOOP_STEPS = 300
"""Number of steps in one call of the whole loop."""


def loop_cases(scene: Scene, seed: int) -> Iterator[Case]:
    """Yield the whole control loop, from plant to policy, for all plants here."""
    for plant in reversed(available_plants()):
        yield Case(
            f"whole loop, {plant}",
            "robot-seconds/s",
            tuple(
                Contender(
                    f"{OURS}: {beams} beams",
                    _LOOP_STEPS * CONTROL_PERIOD,
                    partial(_loop, scene, plant, beams, seed),
                )
                for beams in (1081, 541)
            ),
        )


def _loop(scene: Scene, plant: str, beams: int, seed: int) -> Work:
    """Return a drive, whose time [s] does not include its run-in to the first clouds."""
    lidar = LidarConfig(beams=beams)
    config = SimulatedRobotConfig.model_validate({"plant": plant, "sensing": {"lidar": lidar}})

    def work() -> float:
        with driving(scene, config, "policy+planner", seed) as (_, advance):
            began = time.perf_counter()
            advance(_LOOP_STEPS)
            return time.perf_counter() - began

    return work


def training_case(scenes: SceneCache) -> Case:
    """Return the training of stage 1: control steps and the gradient steps after them."""
    config = stage_config("Maze2D").model_copy(update={"seeds": (0,)})

    def ours() -> Work:
        robots = MazeVectorEnv(config, 8, scenes, autoreset=False)
        robot, grid = config.simulated_robot.robot, config.simulated_robot.grid
        observations = steering_observations(grid.n_sectors, grid.outer_radius, robot.max_steering)
        actions = steering_actions(robot.max_steering)
        learner = SoftActorCritic(observations, actions, SacConfig(), 0)
        rng = np.random.default_rng(0)

        def work() -> float:
            began = time.perf_counter()
            tasks = [EpisodeSpec(0, (0, int(number))) for number in rng.integers(2**31, size=8)]
            behaviour = learner.behaviour_policy()
            played = play_together(robots, behaviour, learner.config.action_repeat, tasks)
            learner.update(played, rng)
            return (time.perf_counter() - began) / sum(episode.steps for episode in played)

        return work

    return Case("training, stage 1", "steps/s", (Contender(OURS, 1, ours),))


def many_robots_case(world: str, seed: int, scenes: SceneCache) -> Case:
    """Return many robots in one world, each with rotating laser, filter and classifier.

    They make a virtual scan at every control step, and in the last rows once a decision, as in the
    default training, with the planner and in the whole loop of one robot.

    Args:
        world: World preset.
        seed: Seed of the evaluation's world.
        scenes: Cache of scenes.
    """
    stage = stage_config("Natural")
    config = stage.model_copy(update={"preset": world, "seeds": (evaluation_world(seed, 0),)})
    every = config.simulated_robot.rollouts.action_repeat
    decimated = config.model_copy(update={"perception_decimation": every})

    def make_robots(count: int, workers: int, config: OffroadConfig = config) -> Work:
        if workers == 1:
            robots: VectorEnv[Any, Any, Any] = make_vector("Natural", count, config, 1, scenes)
        else:
            robots = OffroadVectorEnv(config, count, workers)
        states, _ = robots.reset(seed=0)
        # Whole decisions, so that each call holds as many scans.
        policy, steps = shipped_policy(), every * max(1, 12 // count)

        def work() -> float:
            nonlocal states
            began = time.perf_counter()
            for _ in range(steps):
                shares = [policy.best(state) for state in states]
                states, *_ = robots.step(np.array(shares, dtype=np.float32))
            return (time.perf_counter() - began) / steps

        return work

    sizes = ((1, 1), (4, 1), (16, 1), (64, 1), (16, 2), (64, 2))
    return Case(
        "robots in one world",
        "robot-seconds/s",
        (
            *(
                Contender(
                    f"{OURS}: {count} in {workers} process{'es' * (workers > 1)}",
                    count * CONTROL_PERIOD,
                    partial(make_robots, count, workers),
                )
                for count, workers in sizes
            ),
            *(
                Contender(
                    f"{OURS}: {count} in 1 process, a scan in {every} steps",
                    count * CONTROL_PERIOD,
                    partial(make_robots, count, 1, decimated),
                )
                for count in (1, 16)
            ),
        ),
    )
