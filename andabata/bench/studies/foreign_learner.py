"""Lets the SAC of Stable-Baselines3 learn on the registered environment of SPN, beside ours.

``python -m andabata.bench.studies.foreign_learner`` trains both for the same number of control
steps on ``andabata/SPN-v0``, with as many gradient steps, and drives the 16 fixed tasks of the
training rooms. The other learner has the conventional input, one vector; ours reads points. Needs
stable-baselines3 (extra ``dev``).
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row, markdown_table
from andabata.tasks.rooms.env import RoomVectorEnv
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.training.plans import load_plan
from rl.learners import make_learner
from rl.networks import use_one_thread
from rl.training import EpisodeSpec, play_together

_STEPS_PER_UPDATE = 16
"""Number of control steps for each gradient step, of both learners."""

Act = Callable[[NDArray[np.float32]], NDArray[np.floating]]


class _Taught:
    """A foreign policy as ``play_together`` asks for one: its best actions alone."""

    def __init__(self, config: SpnConfig, act: Act) -> None:
        """Take the task and the function from observations to shares, a row each."""
        self.observations, self.actions = config.observations, config.actions
        self.info: dict[str, Any] = {}
        self.best_many = act


def fixed_tasks_reached(config: SpnConfig, policy: Any) -> tuple[int, float]:  # noqa: ANN401 - any policy.
    """Return how many fixed tasks a policy does, and the mean steps of those.

    Args:
        config: Settings of the task.
        policy: Policy, of which ``best_many`` is called and ``info`` is read.
    """
    robots = RoomVectorEnv(config.fixed, 16, autoreset=False)
    specs = [EpisodeSpec(0, (0, k), None, k) for k in range(len(config.fixed_tasks))]
    episodes = play_together(robots, policy, 1, specs, explore=False)
    steps = [episode.steps for episode in episodes if episode.is_success]
    return len(steps), float(np.mean(steps)) if steps else float("nan")


def stable_baselines(steps: int, seed: int) -> Row:
    """Train the SAC of Stable-Baselines3 and return its row."""
    import torch
    from stable_baselines3 import SAC

    torch.set_num_threads(1)
    config = SpnConfig(points=36)
    env = gym.make("andabata/SPN-v0", config=config)
    learner = SAC(
        "MlpPolicy",
        env,
        seed=seed,
        gamma=0.98,
        batch_size=128,
        learning_rate=5e-4,
        train_freq=_STEPS_PER_UPDATE,
        gradient_steps=1,
        learning_starts=1000,
        policy_kwargs={"net_arch": [128, 128]},
        device="cpu",
    )
    began = time.perf_counter()
    learner.learn(steps)
    wall = time.perf_counter() - began
    policy = _Taught(config, lambda rows: learner.predict(rows, deterministic=True)[0])
    reached, mean = fixed_tasks_reached(config, policy)
    return _row("SAC of Stable-Baselines3, one vector", steps, wall, reached, mean)


def ours(steps: int, seed: int) -> Row:
    """Train our plan in the easiest order of rooms drawn alike, and return its row."""
    plan = load_plan(task="spn")
    config = SpnConfig()
    robots = RoomVectorEnv(config, 16, autoreset=False)
    spaces = config.observations, config.actions
    learner = make_learner(plan.learner, *spaces, seed, robots.renderer)
    began, done, number = time.perf_counter(), 0, 0
    while done < steps:
        specs = [EpisodeSpec(0, (seed, number + k)) for k in range(16)]
        played = play_together(robots, learner.behaviour_policy(), 1, specs)
        learner.update(played, np.random.default_rng((seed, number)))
        done, number = done + sum(episode.steps for episode in played), number + 16
    wall = time.perf_counter() - began
    reached, mean = fixed_tasks_reached(config, learner.policy({}))
    return _row("SAC of andabata, points", done, wall, reached, mean)


def _row(learner: str, steps: int, wall: float, reached: int, mean: float) -> Row:
    """Return a learner's row of the table."""
    return {
        "learner": learner,
        "control steps": steps,
        "steps/s": steps / wall,
        "fixed tasks of 16": reached,
        "mean steps of those": mean,
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Train both and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100_000, help="Control steps of each.")
    parser.add_argument("--seed", type=int, default=0, help="Seed of both.")
    options = parser.parse_args(argv)
    use_one_thread()
    rows = [learner(options.steps, options.seed) for learner in (ours, stable_baselines)]
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
