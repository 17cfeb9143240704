"""Whole episodes as training data: each one is a function of a policy and its own seed.

Nothing of an environment has to be stored for a resume, and the result does not depend on how many
processes play the episodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.environment import Environment
from rl.policy import Policy


@dataclass(frozen=True)
class Episode:
    """One episode at the pace of decisions, each held for several control steps.

    Attributes:
        states: State at each decision, float32, shape (t, n).
        actions: Drawn actions before clipping, float32, shape (t,).
        rewards: Sum over each decision's steps, unscaled, float64, shape (t,).
        last_state: State after the last decision, float32, shape (n,).
        terminated: Whether it ended for good; a time-out is only cut short.
        outcome: How it ended.
        is_success: Whether it reached the goal.
        steps: Control steps.
    """

    states: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float64]
    last_state: NDArray[np.float32]
    terminated: bool
    outcome: str
    is_success: bool
    steps: int


@dataclass(frozen=True)
class Exploration:
    """How a learner tries things out.

    Attributes:
        sigma: Standard deviation of the actions, a share of the steering limit.
        hold: Control steps that an action is held.
    """

    sigma: float
    hold: int


Sampler = Callable[[int, Policy, Exploration, Sequence[tuple[int, ...]]], list[Episode]]
"""Plays an episode for each seed in a stage's environment: (stage, policy, exploration, seeds)."""


def play(
    environment: Environment, policy: Policy, exploration: Exploration, seed: tuple[int, ...]
) -> Episode:
    """Play one episode.

    Args:
        environment: Where.
        policy: Mean of the actions.
        exploration: Spread and pace of the actions.
        seed: Of the episode: environment and noise.
    """
    rng = np.random.default_rng(seed)
    state, _ = environment.reset(seed=int(rng.integers(2**31)))
    states, actions, rewards = [], [], []
    steps, over, terminated = 0, False, False
    info: dict[str, Any] = {}
    while not over:
        wanted = np.float32(policy.mean(state) + exploration.sigma * rng.standard_normal())
        states.append(state)
        actions.append(wanted)
        executed = np.clip(np.array([wanted], dtype=np.float32), -1.0, 1.0)
        total = 0.0
        for _ in range(exploration.hold):
            state, reward, terminated, truncated, info = environment.step(executed)
            total += reward
            steps += 1
            over = terminated or truncated
            if over:
                break
        rewards.append(total)
    return Episode(
        states=np.array(states, dtype=np.float32),
        actions=np.array(actions, dtype=np.float32),
        rewards=np.array(rewards),
        last_state=state,
        terminated=terminated,
        outcome=str(info["outcome"]),
        is_success=bool(info["is_success"]),
        steps=steps,
    )


def serial_sampler(environments: Sequence[Environment]) -> Sampler:
    """Return a sampler that plays in this process; one environment a stage."""

    def sample(
        stage: int, policy: Policy, exploration: Exploration, seeds: Sequence[tuple[int, ...]]
    ) -> list[Episode]:
        return [play(environments[stage], policy, exploration, seed) for seed in seeds]

    return sample
