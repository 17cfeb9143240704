"""Whole episodes as training data: each one is a function of a policy and its own seed.

Nothing of an environment has to be stored for a resume, and the result does not depend on how many
processes play the episodes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.driving import driven, driven_many
from rl.environment import Environment, VectorEnvironment
from rl.policy import Policy

Seed = tuple[int, ...]

SITUATIONS = "situations"
"""Name of the info from which observations can be rendered again; see ``rl.replay.Renderer``."""

WORLD = "world_seed"
"""Name of the info of a reset that says which world was drawn."""

_ENDS = ("outcome", "is_success", "turns")


@dataclass(frozen=True)
class EpisodeSpec:
    """An episode that is to be played.

    Attributes:
        stage: Index of the stage.
        seed: Seed of everything random in it.
        difficulty: Difficulty of its world from 0 to 1, None for the stage's own.
        task: Index of a task of the stage's fixed list, None for one drawn by the seed.
    """

    stage: int
    seed: Seed
    difficulty: float | None = None
    task: int | None = None


@dataclass(frozen=True)
class Episode:
    """A finished episode, one row a decision; a decision is held for several control steps.

    Attributes:
        states: Observation at each decision, float32, shape (t, n_observations), or where the
            environment gives situations, those in their place, shape (t, m).
        actions: Actions as shares from -1 to 1, float32, shape (t, n_actions).
        rewards: Sum over each decision's steps, unscaled, float64, shape (t,).
        last_state: Observation or situation after the last decision, float32, shape (size,).
        terminated: True if it ended for good; a time-out only cuts it short.
        outcome: Name of its end.
        is_success: True if the goal was reached.
        steps: Number of control steps.
        terms: Sum of each term of the reward.
        turns: Number of whole turns, left less right, that the robot made; a robot that circles
            makes many.
        world: Number of its world, which the environment gave; None where it gave none.
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
    world: int | None = None


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
    state, info = environment.reset(seed=recorder.first_seed, options=_options(spec))
    recorder.world = info.get(WORLD)
    policy.reset()
    over, terminated = False, False
    while not over:
        act = policy.explore if explore else partial(driven, policy)
        shares = act(state, recorder.rng)
        action = shares.astype(np.float32)
        recorder.decide(info.get(SITUATIONS, state), action)
        for _ in range(action_repeat):
            state, reward, terminated, truncated, info = environment.step(action)
            recorder.add(reward, info.get("reward_terms", {}))
            over = terminated or truncated
            if over:
                break
    return recorder.finished(info.get(SITUATIONS, state), terminated, info)


def _options(spec: EpisodeSpec) -> dict[str, Any]:
    """Return the options of a reset."""
    options = {"difficulty": spec.difficulty, "task": spec.task}
    return {name: value for name, value in options.items() if value is not None}


class EpisodeRecorder:
    """One robot's episode as it is played.

    Attributes:
        number: Index of the episode in the result.
        spec: Episode that is played.
        first_seed: Seed of the environment's reset.
        rng: Draws of the policy.
        world: Number of its world, None where the environment gives none.
    """

    def __init__(self, number: int, spec: EpisodeSpec) -> None:
        """Begin an episode, the ``number``-th of the result."""
        self.number, self.spec = number, spec
        self.rng = np.random.default_rng(spec.seed)
        self.world: int | None = None
        self.first_seed = int(self.rng.integers(2**31))
        self._states: list[NDArray[np.float32]] = []
        self._actions: list[NDArray[np.float32]] = []
        self._rewards: list[float] = []
        self._steps = 0
        self._terms: dict[str, float] = {}

    def decide(self, state: NDArray[np.float32], action: NDArray[np.float32]) -> None:
        """Keep the state or situation of a decision, and its actions; both must not change."""
        self._states.append(state)
        self._actions.append(action)
        self._rewards.append(0.0)

    def add(self, reward: float, terms: Mapping[str, float]) -> None:
        """Add the reward of a control step to the present decision."""
        self._rewards[-1] += reward
        self._steps += 1
        for name, value in terms.items():
            self._terms[name] = self._terms.get(name, 0.0) + value

    def finished(
        self, last_state: NDArray[np.float32], terminated: bool, info: Mapping[str, Any]
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
            world=None if self.world is None else int(self.world),
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
    waiting = list(enumerate(specs))[::-1]
    episodes_by_index: dict[int, Episode] = {}
    playing: dict[int, EpisodeRecorder] = {}
    actions = np.zeros((environments.num_envs, policy.actions.size), dtype=np.float32)
    states, info = np.zeros((0, 0), dtype=np.float32), dict[str, Any]()
    while len(episodes_by_index) < len(specs):
        idle = [k for k in range(environments.num_envs) if k not in playing][: len(waiting)]
        if idle:
            playing |= {k: EpisodeRecorder(*waiting.pop()) for k in idle}
            states, info = _begin(environments, playing, idle)
        _decide(policy, playing, states, info.get(SITUATIONS, states), actions, explore)
        for _ in range(action_repeat):
            states, rewards, terminated, truncated, info = environments.step(actions)
            _add(playing, rewards, info["reward_terms"])
            for k in np.flatnonzero(terminated | truncated).tolist():
                if k in playing:
                    end = {key: info[key][k] for key in _ENDS if key in info}
                    last = info.get(SITUATIONS, states)[k]
                    recorder = playing.pop(k)
                    episodes_by_index[recorder.number] = recorder.finished(
                        last, bool(terminated[k]), end
                    )
    return [episodes_by_index[number] for number in range(len(specs))]


def _begin(
    environments: VectorEnvironment, playing: Mapping[int, EpisodeRecorder], begun: Sequence[int]
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """Begin the episodes of some robots and return the states of all, shape (n, m), and infos."""
    robots = [playing.get(k) for k in range(environments.num_envs)]
    mask = np.zeros(len(robots), dtype=np.bool_)
    mask[list(begun)] = True
    options: dict[str, Any] = {
        "reset_mask": mask,
        "difficulty": [None if one is None else one.spec.difficulty for one in robots],
    }
    tasks = [None if one is None else one.spec.task for one in robots]
    if any(task is not None for task in tasks):
        options["task"] = tasks
    seeds = [None if one is None else one.first_seed for one in robots]
    states, info = environments.reset(seed=seeds, options=options)
    for k in begun if WORLD in info else ():
        playing[k].world = info[WORLD][k]
    return states, info


def _decide(
    policy: Policy,
    playing: Mapping[int, EpisodeRecorder],
    states: NDArray[np.float32],
    kept: NDArray[np.float32],
    actions: NDArray[np.float32],
    explore: bool,
) -> None:
    """Write the actions of the robots that play, and record them with ``kept``, their states."""
    rows = list(playing)
    rngs = [recorder.rng for recorder in playing.values()]
    act = policy.explore_many if explore else partial(driven_many, policy)
    shares = act(states[rows], rngs)
    chosen = shares.astype(np.float32)
    actions[rows] = chosen
    for (k, recorder), action in zip(playing.items(), chosen, strict=True):
        recorder.decide(kept[k], action)


def _add(
    playing: Mapping[int, EpisodeRecorder],
    rewards: NDArray[np.float64],
    terms: Mapping[str, NDArray[np.float64]],
) -> None:
    """Add the rewards of a control step to the decisions of the robots that play."""
    # Lists once a step: taking single numbers from arrays costs more than all else here.
    totals, names = rewards.tolist(), tuple(terms)
    parts = list(zip(*(part.tolist() for part in terms.values()), strict=True))
    for k, recorder in playing.items():
        recorder.add(totals[k], dict(zip(names, parts[k], strict=True)) if parts else {})
