"""Whole episodes as training data: each one is a function of a policy and its own seed.

Nothing of an environment has to be stored for a resume, and the result does not depend on how many
processes play the episodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.environment import Environment, Robots
from rl.policy import Policy
from rl.spaces import N_EXTRAS

Seed = tuple[int, ...]

TURN_STEP = 0.1
"""Time of a control step [s]: the states hold yaw rates."""


@dataclass(frozen=True)
class EpisodeSpec:
    """An episode that is to be played.

    Attributes:
        stage: Index of the stage.
        seed: Of everything random in it.
        difficulty: Of its world, from 0 to 1; None for the stage's own.
    """

    stage: int
    seed: Seed
    difficulty: float | None = None


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
        terms: Sum of each term of the reward.
    """

    states: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float64]
    last_state: NDArray[np.float32]
    terminated: bool
    outcome: str
    is_success: bool
    steps: int
    terms: dict[str, float] = field(default_factory=dict)

    @property
    def turns(self) -> float:
        """Whole turns that the robot made, left less right: a robot that circles makes many."""
        rates = self.states[:, -N_EXTRAS].astype(np.float64)
        held = TURN_STEP * self.steps / max(len(rates), 1)
        return float(abs(rates.sum()) * held / (2 * np.pi))


Sampler = Callable[[Policy, int, Sequence[EpisodeSpec], bool], list[Episode]]
"""Plays what is assigned: (policy, hold, assignments, explore)."""


def play(
    environment: Environment,
    policy: Policy,
    hold: int,
    spec: EpisodeSpec,
    explore: bool = True,
) -> Episode:
    """Play one episode.

    Args:
        environment: Of the assignment's stage.
        policy: Chooses the actions.
        hold: Control steps that an action is held.
        spec: Which episode.
        explore: Whether actions are drawn at random around the policy's best.
    """
    lane = EpisodeRecorder(0, spec)
    state, _ = environment.reset(seed=lane.first_seed, options=_options(spec))
    over, terminated = False, False
    info: dict[str, Any] = {}
    while not over:
        executed = np.array([lane.decide(policy, state, explore)], dtype=np.float32)
        for _ in range(hold):
            state, reward, terminated, truncated, info = environment.step(executed)
            lane.take(reward, info.get("reward_terms", {}))
            over = terminated or truncated
            if over:
                break
    return lane.finished(state, terminated, str(info["outcome"]), bool(info["is_success"]))


def _options(spec: EpisodeSpec) -> dict[str, Any]:
    """Return the options of a reset."""
    return {} if spec.difficulty is None else {"difficulty": spec.difficulty}


class EpisodeRecorder:
    """One robot's episode as it is played."""

    def __init__(self, number: int, spec: EpisodeSpec) -> None:
        """Begin an episode, which is to be the ``number``-th of the result."""
        self.number, self.difficulty = number, spec.difficulty
        self._rng = np.random.default_rng(spec.seed)
        self.first_seed = int(self._rng.integers(2**31))
        self._states: list[NDArray[np.float32]] = []
        self._actions: list[float] = []
        self._rewards: list[float] = []
        self._steps = 0
        self._terms: dict[str, float] = {}

    def decide(self, policy: Policy, state: NDArray[np.float32], explore: bool) -> float:
        """Return the action for a state, -1 to 1, and keep both."""
        action = policy.explore(state, self._rng) if explore else policy.act(state) / policy.limit
        self._states.append(state)
        self._actions.append(action)
        self._rewards.append(0.0)
        return action

    def take(self, reward: float, terms: dict[str, float]) -> None:
        """Take in what a control step gave."""
        self._rewards[-1] += reward
        self._steps += 1
        for name, value in terms.items():
            self._terms[name] = self._terms.get(name, 0.0) + value

    def finished(
        self, last: NDArray[np.float32], terminated: bool, outcome: str, is_success: bool
    ) -> Episode:
        """Return the episode that has ended."""
        return Episode(
            states=np.array(self._states, dtype=np.float32),
            actions=np.array(self._actions, dtype=np.float32),
            rewards=np.array(self._rewards),
            last_state=last,
            terminated=terminated,
            outcome=outcome,
            is_success=is_success,
            steps=self._steps,
            terms=self._terms,
        )


def play_together(
    robots: Robots,
    policy: Policy,
    hold: int,
    specs: Sequence[EpisodeSpec],
    explore: bool = True,
) -> list[Episode]:
    """Play episodes of one stage, as ``play`` does, with many robots side by side.

    Args:
        robots: Where; see ``Robots``.
        policy: Chooses the actions.
        hold: Control steps that an action is held.
        specs: Which episodes.
        explore: As for ``play``.
    """
    waiting = list(enumerate(specs))[::-1]
    found: dict[int, Episode] = {}
    lanes: list[EpisodeRecorder | None] = [None] * robots.num_envs
    states = np.zeros((robots.num_envs, policy.layout.size), dtype=np.float32)
    actions = np.zeros((robots.num_envs, 1), dtype=np.float32)
    while len(found) < len(specs):
        idle = np.array([lane is None for lane in lanes])
        for k in np.flatnonzero(idle)[: len(waiting)].tolist():
            lanes[k] = EpisodeRecorder(*waiting.pop())
        begun = idle & np.array([lane is not None for lane in lanes])
        if begun.any():
            first = [lane.first_seed if lane else None for lane in lanes]
            levels = [lane.difficulty if lane else None for lane in lanes]
            options = {"reset_mask": begun, "difficulty": levels}
            states, _ = robots.reset(seed=first, options=options)
        for k, lane in enumerate(lanes):
            if lane is not None:
                actions[k] = lane.decide(policy, states[k], explore)
        for _ in range(hold):
            states, rewards, terminated, truncated, info = robots.step(actions)
            over = terminated | truncated
            for k, lane in enumerate(lanes):
                if lane is None:
                    continue
                terms = {name: float(part[k]) for name, part in info["reward_terms"].items()}
                lane.take(float(rewards[k]), terms)
                if over[k]:
                    found[lane.number] = lane.finished(
                        states[k],
                        bool(terminated[k]),
                        str(info["outcome"][k]),
                        bool(info["is_success"][k]),
                    )
                    lanes[k] = None
    return [found[number] for number in range(len(specs))]


def serial_sampler(environments: Sequence[Environment]) -> Sampler:
    """Return a sampler that plays in this process; one environment a stage."""

    def sample(
        policy: Policy, hold: int, specs: Sequence[EpisodeSpec], explore: bool
    ) -> list[Episode]:
        return [play(environments[one.stage], policy, hold, one, explore) for one in specs]

    return sample
