"""Many robots in the plane: the seam of batch simulators, and the base of the tasks on them.

A ``PlanarBatch`` moves robots and measures their beams, in a form of its own; it knows no goal.
``PlanarVectorEnv`` is a drive to one goal on it: a task adds where drives begin, what is rewarded
and what is observed, as functions over arrays. Each robot does what it does alone, with the same
draws.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from andabata.tasks.terminations import Drives, Ending, TerminationConfig, Terminations
from rl.gym_spaces import action_box, observation_box
from rl.spaces import ActionSpec, ObservationSpec

State = NDArray[np.float32]


@dataclass(frozen=True)
class PlanarState:
    """What a batch gives after a step.

    Attributes:
        poses: True x, y [m] and yaw [rad], shape (n, 3).
        contacts: True where the body touched something, shape (n,).
        tipped: True where it has rolled over, shape (n,).
    """

    poses: NDArray[np.float64]
    contacts: NDArray[np.bool_]
    tipped: NDArray[np.bool_]


class PlanarBatch(Protocol):
    """A batch simulator: n robots, each in one of several worlds, with beams in the plane."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """True x, y [m] and yaw [rad], shape (n, 3)."""

    @property
    def stamps(self) -> NDArray[np.float64]:
        """Time since each robot was put down [s], shape (n,)."""

    def step(self, twists: NDArray[np.float64], chosen: NDArray[np.bool_]) -> PlanarState:
        """Drive robots for one control period.

        Args:
            twists: Speed [m/s] and yaw rate [rad/s] of each, shape (n, 2).
            chosen: True for robots that move; the others stand still, shape (n,).
        """

    def observe(self, chosen: NDArray[np.bool_]) -> PlanarState:
        """Measure the beams of some robots and return the state of all."""


class PlanarVectorEnv(gym.vector.VectorEnv[State, NDArray[np.float32], Any], ABC):
    """Many robots that drive to a goal each, in one process.

    With ``autoreset`` a robot whose episode ends begins the next one in the same step: its last
    state is in ``info["final_obs"]``. Without, a ``reset(seed=..., options={"reset_mask": ...})``
    begins it, and until then the robot stands still. A task that can render its observations anew
    gives what it needs for that in ``info["situations"]``, float32, shape (n, m).
    """

    def __init__(
        self,
        batch: PlanarBatch,
        observations: ObservationSpec,
        actions: ActionSpec,
        terminations: TerminationConfig,
        num_envs: int,
        autoreset: bool = True,
        sees_scan: bool = False,
    ) -> None:
        """Prepare a task for a number of robots.

        Args:
            batch: Batch simulator of as many robots.
            observations: Space of the observations.
            actions: Space of the actions.
            terminations: Rules that end an episode.
            num_envs: Number of robots.
            autoreset: True to begin the next episode in the step that ends one.
            sees_scan: True for a task that gives ``_nearest``.

        Raises:
            ValueError: If the rules need a scan and none is seen.
        """
        self.num_envs = num_envs
        mode = AutoresetMode.SAME_STEP if autoreset else AutoresetMode.DISABLED
        self.metadata = {"autoreset_mode": mode, "render_modes": []}
        self._observations, self._actions = observations, actions
        self.single_observation_space = observation_box(observations)
        self.single_action_space = action_box(actions)
        batch_space = gym.vector.utils.batch_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._autoreset = autoreset
        self._batch = batch
        self._rules = terminations
        self._terminations = Terminations(terminations, num_envs, sees_scan)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._is_begun = False
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._goals = np.zeros((num_envs, 2))
        self._goal_distances = np.zeros(num_envs)
        self._turns = np.zeros(num_envs)
        self._states = np.zeros((num_envs, observations.size), dtype=np.float32)

    @abstractmethod
    def _place(self, k: int, rng: np.random.Generator, options: dict[str, Any]) -> int:
        """Put robot ``k`` down, set its goal in ``_goals``, and return the number of its world."""

    @abstractmethod
    def _executed(
        self, actions: NDArray[np.float32], going: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the twists that actions become, zero for robots that stand, shape (n, 2)."""

    @abstractmethod
    def _reward_terms(
        self,
        state: PlanarState,
        before: NDArray[np.float64],
        endings: NDArray[np.int64],
        going: NDArray[np.bool_],
    ) -> dict[str, NDArray[np.float64]]:
        """Return the terms of a step's reward, float64, shape (n,) each.

        Args:
            state: State after the step.
            before: Distances to the goals before the step [m], shape (n,); those after it are
                ``_goal_distances``.
            endings: ``Ending`` of each drive with this step, shape (n,).
            going: True for robots that drove, shape (n,).
        """

    @abstractmethod
    def _observe(self, state: PlanarState, chosen: NDArray[np.bool_]) -> None:
        """Renew the observations of some robots in ``_states``."""

    def _end_details(self) -> dict[str, NDArray[Any]]:
        """Return further infos of episodes that end, arrays of shape (n,); here none."""
        return {}

    @property
    def _nearest(self) -> NDArray[np.float64] | None:
        """Smallest range of each robot's virtual scan [m], shape (n,); None without such a scan."""
        return None

    @property
    def _situations(self) -> NDArray[np.float32] | None:
        """What observations can be rendered from, shape (n, m); None where they are kept."""
        return None

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[State, dict[str, Any]]:
        """Begin an episode of each robot, or of those in ``options["reset_mask"]``.

        Raises:
            ValueError: If there is not one seed for each robot.
        """
        if seed is None or isinstance(seed, int):
            first = seed
            seed = [None if first is None else first + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: expected {self.num_envs} of them, got {len(seed)}")
        options = options or {}
        chosen = options.get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        worlds = np.zeros(self.num_envs, dtype=np.int64)
        for k in np.flatnonzero(chosen).tolist():
            worlds[k] = self._begin(k, seed[k], _options_of(k, options))
        self._is_begun = True
        self._observe(self._batch.observe(chosen), chosen)
        info = {"world_seed": worlds, "_world_seed": chosen.copy()}
        return self._states.copy(), self._with_situations(info)

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive every robot for one control period.

        Args:
            actions: Shares of the limits from -1 to 1, shape (n, n_actions).

        Raises:
            ValueError: If an action is not a finite number, or nothing was reset yet.
        """
        if not self._is_begun:
            raise ValueError("reset: expected before the first step, got none")
        if not np.isfinite(actions).all():
            raise ValueError("actions: expected finite shares of the limits, got others")
        going = ~self._over
        yaws = self._batch.poses[:, 2].copy()
        state = self._batch.step(self._executed(actions, going), going)
        turned = state.poses[:, 2] - yaws
        self._turns += np.where(going, (turned + np.pi) % (2 * np.pi) - np.pi, 0.0) / (2 * np.pi)
        endings = self._endings(state)
        before = self._goal_distances.copy()
        self._goal_distances = np.hypot(*(self._goals - state.poses[:, :2]).T)
        terms = self._reward_terms(state, before, endings, going)
        terms = {name: np.where(going, term, 0.0) for name, term in terms.items()}
        self._observe(state, going)
        over = going & (endings != Ending.NONE)
        truncated = over & self._rules.truncated(endings)
        info: dict[str, Any] = {"reward_terms": terms}
        rewards = np.sum(list(terms.values()), axis=0)
        if over.any():
            self._end(over, endings, info)
        return (
            self._states.copy(),
            rewards,
            over & ~truncated,
            truncated,
            self._with_situations(info),
        )

    def _endings(self, state: PlanarState) -> NDArray[np.int64]:
        """Return the ending of each drive."""
        distances = np.hypot(*(self._goals - state.poses[:, :2]).T)
        stamps = self._batch.stamps
        drives = Drives(
            positions=state.poses[:, :2],
            goal_distances=distances,
            collided=state.contacts,
            tipped=state.tipped,
            stamps=stamps,
            times=stamps,
            nearest=self._nearest,
        )
        return self._terminations.endings(drives)

    def _with_situations(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return an info with what observations can be rendered from, if there is such a thing."""
        situations = self._situations
        return info if situations is None else info | {"situations": situations}

    def _end(
        self, over: NDArray[np.bool_], endings: NDArray[np.int64], info: dict[str, Any]
    ) -> None:
        """Report how episodes ended and, with autoreset, begin the next ones."""
        outcomes = [Ending(int(k)).outcome for k in endings]
        info["is_success"] = over & (endings == Ending.GOAL)
        info["outcome"] = np.array([str(outcome or "") for outcome in outcomes], dtype=object)
        info["turns"] = np.abs(self._turns)
        info["_is_success"] = info["_outcome"] = info["_turns"] = over.copy()
        for name, values in self._end_details().items():
            info[name], info[f"_{name}"] = values, over.copy()
        self._over |= over
        if self._autoreset:
            info["final_obs"], info["_final_obs"] = self._states.copy(), over.copy()
            for k in np.flatnonzero(over).tolist():
                self._begin(k, None, {})
            self._observe(self._batch.observe(over), over)

    def _begin(self, k: int, seed: int | None, options: dict[str, Any]) -> int:
        """Begin an episode of a robot; return the number of its world."""
        if seed is not None:
            self._rngs[k] = gym.utils.seeding.np_random(seed)[0]
        world = self._place(k, self._rngs[k], options)
        position = self._batch.poses[k, :2]
        self._goal_distances[k] = np.hypot(*(self._goals[k] - position))
        self._terminations.begin(k, position)
        self._turns[k] = 0.0
        self._over[k] = False
        return world

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's own form.
        """Nothing has to be freed."""


def _options_of(k: int, options: dict[str, Any]) -> dict[str, Any]:
    """Return the options of robot ``k``: lists hold one value each, None the task's own."""
    own = {name: value[k] if isinstance(value, list) else value for name, value in options.items()}
    return {name: value for name, value in own.items() if value is not None}
