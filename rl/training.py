"""Whole episodes as training data: each one is a function of a policy and its own seed.

Nothing of an environment has to be stored for a resume, and the result does not depend on how many
processes play the episodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.environment import Environment, VectorEnvironment
from rl.policy import Policy

Seed = tuple[int, ...]


@dataclass(frozen=True)
class EpisodeSpec:
    """An episode that is to be played.

    Attributes:
        stage: Index of the stage.
        seed: Seed of everything random in it.
        difficulty: Difficulty of its world from 0 to 1, None for the stage's own.
    """

    stage: int
    seed: Seed
    difficulty: float | None = None


@dataclass(frozen=True)
class Episode:
    """A finished episode, one row a decision; a decision is held for several control steps.

    Attributes:
        states: Observation at each decision, float32, shape (t, n_observations).
        actions: Actions as shares from -1 to 1, float32, shape (t, n_actions).
        rewards: Sum over each decision's steps, unscaled, float64, shape (t,).
        last_state: Observation after the last decision, float32, shape (n_observations,).
        terminated: True if it ended for good; a time-out only cuts it short.
        outcome: Name of its end.
        is_success: True if the goal was reached.
        steps: Number of control steps.
        terms: Sum of each term of the reward.
        turns: Number of whole turns, left less right, that the robot made; a robot that circles
            makes many.
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
    turns: float = 0.0


RolloutFunction = Callable[[Policy, int, Sequence[EpisodeSpec], bool], list[Episode]]
"""Plays episodes: (policy, action_repeat, specs, explore) -> episodes in the order of the specs."""


def play(
    environment: Environment,
    policy: Policy,
    action_repeat: int,
    spec: EpisodeSpec,
    explore: bool = True,
) -> Episode:
    """Play one episode.

    Args:
        environment: Environment of the episode's stage.
        policy: Actor.
        action_repeat: Number of control steps that an action is held for.
        spec: Stage, seed and difficulty.
        explore: True to draw actions at random around the policy's best.
    """
    recorder = EpisodeRecorder(0, spec)
    state, _ = environment.reset(seed=recorder.first_seed, options=_options(spec))
    policy.reset()
    over, terminated = False, False
    info: dict[str, Any] = {}
    while not over:
        action = recorder.decide(policy, state, explore)
        for _ in range(action_repeat):
            state, reward, terminated, truncated, info = environment.step(action)
            recorder.add(reward, info.get("reward_terms", {}))
            over = terminated or truncated
            if over:
                break
    return recorder.finished(state, terminated, info)


def _options(spec: EpisodeSpec) -> dict[str, Any]:
    """Return the options of a reset."""
    return {} if spec.difficulty is None else {"difficulty": spec.difficulty}


class EpisodeRecorder:
    """One robot's episode as it is played.

    Attributes:
        number: Index of the episode in the result.
        difficulty: Difficulty of its world, None for the stage's own.
        first_seed: Seed of the environment's reset.
    """

    def __init__(self, number: int, spec: EpisodeSpec) -> None:
        """Begin an episode, the ``number``-th of the result."""
        self.number, self.difficulty = number, spec.difficulty
        self._rng = np.random.default_rng(spec.seed)
        self.first_seed = int(self._rng.integers(2**31))
        self._states: list[NDArray[np.float32]] = []
        self._actions: list[NDArray[np.float32]] = []
        self._rewards: list[float] = []
        self._steps = 0
        self._terms: dict[str, float] = {}

    def decide(
        self, policy: Policy, state: NDArray[np.float32], explore: bool
    ) -> NDArray[np.float32]:
        """Return the actions for a state, float32, shape (n_actions,), and keep both."""
        shares = policy.explore(state, self._rng) if explore else policy.best(state)
        action = shares.astype(np.float32)
        self._states.append(state)
        self._actions.append(action)
        self._rewards.append(0.0)
        return action

    def add(self, reward: float, terms: dict[str, float]) -> None:
        """Add the reward of a control step to the present decision."""
        self._rewards[-1] += reward
        self._steps += 1
        for name, value in terms.items():
            self._terms[name] = self._terms.get(name, 0.0) + value

    def finished(
        self, last_state: NDArray[np.float32], terminated: bool, info: dict[str, Any]
    ) -> Episode:
        """Return the episode that has ended; ``info`` is that of its last step."""
        return Episode(
            states=np.array(self._states, dtype=np.float32),
            actions=np.array(self._actions, dtype=np.float32),
            rewards=np.array(self._rewards),
            last_state=last_state,
            terminated=terminated,
            outcome=str(info["outcome"]),
            is_success=bool(info["is_success"]),
            steps=self._steps,
            terms=self._terms,
            turns=float(info.get("turns", 0.0)),
        )


def play_together(
    environments: VectorEnvironment,
    policy: Policy,
    action_repeat: int,
    specs: Sequence[EpisodeSpec],
    explore: bool = True,
) -> list[Episode]:
    """Play episodes of one stage, as ``play`` does, with many robots side by side.

    Args:
        environments: Vector environment of the stage.
        policy: Actor without a memory: it is shared by all robots.
        action_repeat: Number of control steps that an action is held for.
        specs: Seed and difficulty of each episode.
        explore: True to draw actions at random around the policy's best.
    """
    count = environments.num_envs
    waiting = list(enumerate(specs))[::-1]
    found: dict[int, Episode] = {}
    recorders: list[EpisodeRecorder | None] = [None] * count
    states = np.zeros((count, policy.observations.size), dtype=np.float32)
    actions = np.zeros((count, policy.actions.size), dtype=np.float32)
    while len(found) < len(specs):
        idle = np.array([recorder is None for recorder in recorders])
        for k in np.flatnonzero(idle)[: len(waiting)].tolist():
            recorders[k] = EpisodeRecorder(*waiting.pop())
        begun = idle & np.array([recorder is not None for recorder in recorders])
        if begun.any():
            states = _begin(environments, recorders, begun)
        for k, recorder in enumerate(recorders):
            if recorder is not None:
                actions[k] = recorder.decide(policy, states[k], explore)
        for _ in range(action_repeat):
            states, rewards, terminated, truncated, info = environments.step(actions)
            for k, recorder in enumerate(recorders):
                if recorder is None:
                    continue
                terms = {name: float(part[k]) for name, part in info["reward_terms"].items()}
                recorder.add(float(rewards[k]), terms)
                if terminated[k] or truncated[k]:
                    end = {key: info[key][k] for key in ("outcome", "is_success", "turns")}
                    found[recorder.number] = recorder.finished(states[k], bool(terminated[k]), end)
                    recorders[k] = None
    return [found[number] for number in range(len(specs))]


def _begin(
    environments: VectorEnvironment,
    recorders: Sequence[EpisodeRecorder | None],
    begun: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """Begin the episodes of some robots and return the states of all, shape (n, m)."""
    seeds = [recorder.first_seed if recorder else None for recorder in recorders]
    levels = [recorder.difficulty if recorder else None for recorder in recorders]
    options = {"reset_mask": begun, "difficulty": levels}
    return environments.reset(seed=seeds, options=options)[0]


def serial_rollouts(environments: Sequence[Environment]) -> RolloutFunction:
    """Return a function that plays episodes in this process; one environment a stage."""

    def rollout(
        policy: Policy, action_repeat: int, specs: Sequence[EpisodeSpec], explore: bool
    ) -> list[Episode]:
        return [play(environments[one.stage], policy, action_repeat, one, explore) for one in specs]

    return rollout
