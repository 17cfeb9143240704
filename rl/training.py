"""Whole episodes as training data: each one is a function of a policy and its own seed.

Nothing of an environment has to be stored for a resume, and the result does not depend on how many
processes play the episodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.environment import Environment, Robots
from rl.policy import Policy


@dataclass(frozen=True)
class Episode:
    """One episode at the pace of decisions, each held for several control steps.

    Attributes:
        states: State at each decision, float32, shape (t, n).
        actions: Shares of the steering limit, -1 to 1, float32, shape (t,).
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


Seed = tuple[int, ...]

Sampler = Callable[[int, Policy, int, Sequence[Seed]], list[Episode]]
"""Plays an episode for each seed in a stage's environment: (stage, policy, hold, seeds)."""


def play(
    environment: Environment, policy: Policy, hold: int, seed: Seed, explore: bool = True
) -> Episode:
    """Play one episode.

    Args:
        environment: Where.
        policy: Chooses the actions.
        hold: Control steps that an action is held.
        seed: Of the episode: environment and noise.
        explore: Whether actions are drawn at random around the policy's best.
    """
    rng = np.random.default_rng(seed)
    state, _ = environment.reset(seed=int(rng.integers(2**31)))
    states, actions, rewards = [], [], []
    steps, over, terminated = 0, False, False
    info: dict[str, Any] = {}
    while not over:
        action = policy.explore(state, rng) if explore else policy.act(state) / policy.limit
        states.append(state)
        actions.append(action)
        executed = np.array([action], dtype=np.float32)
        total = 0.0
        for _ in range(hold):
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


class _Lane:
    """One robot's episode as it is played."""

    def __init__(self, number: int, seed: Seed) -> None:
        """Begin the episode of a seed, which is to be the ``number``-th of the result."""
        self.number, self.rng = number, np.random.default_rng(seed)
        self.first_seed = int(self.rng.integers(2**31))
        self.states: list[NDArray[np.float32]] = []
        self.actions: list[float] = []
        self.rewards: list[float] = []
        self.steps = 0


def play_together(
    robots: Robots, policy: Policy, hold: int, seeds: Sequence[Seed], explore: bool = True
) -> list[Episode]:
    """Play an episode for each seed, as ``play`` does, with many robots side by side.

    Args:
        robots: Where; see ``Robots``.
        policy: Chooses the actions.
        hold: Control steps that an action is held.
        seeds: Of the episodes.
        explore: As for ``play``.
    """
    waiting = list(enumerate(seeds))[::-1]
    found: dict[int, Episode] = {}
    lanes: list[_Lane | None] = [None] * robots.num_envs
    states = np.zeros((robots.num_envs, policy.layout.size), dtype=np.float32)
    actions = np.zeros((robots.num_envs, 1), dtype=np.float32)
    while len(found) < len(seeds):
        idle = np.array([lane is None for lane in lanes])
        for k in np.flatnonzero(idle)[: len(waiting)].tolist():
            lanes[k] = _Lane(*waiting.pop())
        begun = idle & np.array([lane is not None for lane in lanes])
        if begun.any():
            first = [lane.first_seed if lane else None for lane in lanes]
            states, _ = robots.reset(seed=first, options={"reset_mask": begun})
        for k, lane in enumerate(lanes):
            if lane is None:
                continue
            state = states[k]
            action = (
                policy.explore(state, lane.rng) if explore else policy.act(state) / policy.limit
            )
            lane.states.append(state)
            lane.actions.append(action)
            lane.rewards.append(0.0)
            actions[k] = action
        for _ in range(hold):
            states, rewards, terminated, truncated, info = robots.step(actions)
            over = terminated | truncated
            for k, lane in enumerate(lanes):
                if lane is None:
                    continue
                lane.rewards[-1] += float(rewards[k])
                lane.steps += 1
                if over[k]:
                    found[lane.number] = _finished(lane, states[k], bool(terminated[k]), info, k)
                    lanes[k] = None
    return [found[number] for number in range(len(seeds))]


def _finished(
    lane: _Lane, last: NDArray[np.float32], terminated: bool, info: dict[str, Any], robot: int
) -> Episode:
    """Return a robot's episode that has ended."""
    return Episode(
        states=np.array(lane.states, dtype=np.float32),
        actions=np.array(lane.actions, dtype=np.float32),
        rewards=np.array(lane.rewards),
        last_state=last,
        terminated=terminated,
        outcome=str(info["outcome"][robot]),
        is_success=bool(info["is_success"][robot]),
        steps=lane.steps,
    )


def serial_sampler(environments: Sequence[Environment]) -> Sampler:
    """Return a sampler that plays in this process; one environment a stage."""

    def sample(stage: int, policy: Policy, hold: int, seeds: Sequence[Seed]) -> list[Episode]:
        return [play(environments[stage], policy, hold, seed) for seed in seeds]

    return sample
