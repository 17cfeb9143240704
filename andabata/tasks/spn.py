"""Navigation in rooms by a planar laser: the task of SPN (Zhang et al., arXiv 2010.10209)."""

import math
from collections.abc import Sequence
from typing import Any, Literal, Self

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar_lidar import TRAINING_LIDAR, PlanarLidarConfig
from andabata.navigation.planning.hit_layer import LaserPose
from andabata.navigation.planning.lidar_map import LidarMap, LidarMapConfig
from andabata.tasks.planar import PlanarState, PlanarVectorEnv
from andabata.tasks.rewards import RoomRewardConfig, room_reward
from andabata.tasks.room_batch import DiscRobotConfig, RoomBatch, room_arrays
from andabata.tasks.room_observations import (
    GoalEncoding,
    LidarRandomization,
    RoomRenderer,
    noisy,
    room_observations,
)
from andabata.tasks.terminations import TerminationConfig
from rl.spaces import ActionSpec, ObservationSpec
from worlds.room_catalogue import make_room
from worlds.rooms import RoomTask, random_task

TRAINING_ROOMS = ("spn-env0", "spn-env1", "spn-env2", "spn-env3")
"""Rooms of the curriculum, the easiest first."""


_BANK = 256
"""Number of lasers that are drawn at once for randomised observations."""


class SpnConfig(BaseModel):
    """Settings of a drive in rooms.

    Attributes:
        task: Name of the kind of task.
        rooms: Names of the rooms.
        favourite: Share of the episodes in the room that the difficulty names; the others have the
            rest in equal parts (paper: 0.7 and 0.1 each).
        random_rooms: Number of random rooms beside the named ones, ``random-0`` and so on
            (assumption; the paper has four rooms in all).
        random_share: Share of the episodes in them.
        tasks: ``random`` starts and goals, or one of the rooms' ``fixed`` ones.
        clearance: Smallest distance of random starts and goals from obstacles [m] (assumption).
        min_distance: Smallest distance of a random goal from its start [m] (assumption).
        robot: Body.
        lidar: Laser.
        points: Number of points of an observation. A laser with more beams gives the nearest of as
            many neighbours as it takes; the paper takes all 1080 (assumption: the nearest of nine
            changes no outcome). None takes all beams.
        goal_encoding: ``cosine`` gives the goal as distance / 5, cosine and sine of its bearing
            (assumption), ``polar`` as distance and bearing (paper).
        noise: Standard deviation of a beam's range [m].
        randomization: Lasers of the observations that are learnt from; None keeps the task's own.
        map: Settings of a local map whose sub-goal takes the goal's place; None without a memory,
            as in the paper.
        terminations: Rules that end an episode.
        reward: Constants of the reward.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: Literal["spn"] = "spn"
    rooms: tuple[str, ...] = Field(default=TRAINING_ROOMS, min_length=1)
    favourite: float = Field(default=0.7, gt=0, le=1)
    random_rooms: int = Field(default=0, ge=0, le=1000)
    random_share: float = Field(default=0.5, ge=0, le=1)
    tasks: Literal["random", "fixed"] = "random"
    clearance: float = Field(default=0.3, ge=0)
    min_distance: float = Field(default=1.0, ge=0)
    robot: DiscRobotConfig = Field(default_factory=DiscRobotConfig)
    lidar: PlanarLidarConfig = TRAINING_LIDAR
    points: int | None = Field(default=120, ge=1)
    goal_encoding: GoalEncoding = "cosine"
    noise: float = Field(default=0.0, ge=0)
    randomization: LidarRandomization | None = None
    map: LidarMapConfig | None = None
    terminations: TerminationConfig = Field(
        default_factory=lambda: TerminationConfig(goal_radius=0.3, time_limit=80.0, stuck_time=1e3)
    )
    reward: RoomRewardConfig = Field(default_factory=RoomRewardConfig)

    @property
    def capacity(self) -> int:
        """Number of points of an observation."""
        return self.lidar.count if self.points is None else self.points

    @property
    def unseen(self) -> Self:
        """The same with every room as often as others: random tasks that snapshots compare on."""
        shares = {"favourite": 1 / len(self.rooms), "random_rooms": 0}
        return self.model_copy(update=shares | {"randomization": None})

    @property
    def fixed(self) -> Self:
        """The same on the rooms' fixed tasks, the paper's test."""
        shares = {"tasks": "fixed", "random_rooms": 0}
        return self.model_copy(update=shares | {"randomization": None})

    @property
    def fixed_tasks(self) -> list[tuple[int, RoomTask]]:
        """Fixed tasks of the rooms, each with its room's index."""
        rooms = enumerate(make_room(name) for name in self.rooms)
        return [(index, task) for index, room in rooms for task in room.tasks]

    @property
    def all_rooms(self) -> tuple[str, ...]:
        """Names of all rooms, the curriculum's own first."""
        return self.rooms + tuple(f"random-{k}" for k in range(self.random_rooms))

    @property
    def observations(self) -> ObservationSpec:
        """Space of the observations."""
        fastest = max(self.robot.max_speed, self.robot.max_yaw_rate)
        return room_observations(self.capacity, self.goal_encoding, fastest)

    @property
    def actions(self) -> ActionSpec:
        """Space of the actions: speed and yaw rate."""
        return room_actions(self.robot)


def room_actions(robot: DiscRobotConfig) -> ActionSpec:
    """Return the space of the actions: speed and yaw rate."""
    return ActionSpec(
        names=("linear", "angular"),
        low=(0.0, -robot.max_yaw_rate),
        high=(robot.max_speed, robot.max_yaw_rate),
        units=("m/s", "rad/s"),
    )


class SpnVectorEnv(PlanarVectorEnv):
    """Drive round robots to goals in rooms by the points that their lasers see.

    ## Action space
    ``Box(-1, 1, (2,), float32)``: speed from 0 to 0.5 m/s and yaw rate from -pi/3 to pi/3 rad/s,
    positive to the left, as shares.

    ## Observation space
    Terms of ``room_observations``, one after the other: points (n, 2), mask (n,), windows (36,),
    goal (3,) and velocity (2,), in the robot's frame.

    ## Reward
    Terms of ``room_reward``: +5 at the goal, -5 in a collision, else the progress in metres and the
    cost of a step.

    ## Start and end
    A room is drawn, then a start and a goal that can be reached. An episode terminates at the goal
    (d < 0.3 m) and on contact, and is truncated after 400 steps of 0.2 s.

    ## Options of reset
    ``{"difficulty": float}`` from 0 to 1 names the favourite room, ``{"room": int}`` the room;
    ``{"task": int}`` chooses a fixed task, ``{"drive": RoomTask}`` gives one for the room. Each may
    be a list with one value a robot.

    ## Version history
    v0: first release.
    """

    def __init__(self, config: SpnConfig, num_envs: int, autoreset: bool = True) -> None:
        """Prepare the task for a number of robots.

        Args:
            config: Settings.
            num_envs: Number of robots.
            autoreset: True to begin the next episode in the step that ends one.

        Raises:
            UnknownRoomError: If there is no room of a name.
        """
        self.config = config
        self._rooms = [make_room(name) for name in config.all_rooms]
        self._renderer = room_renderer(config)
        movers = self._renderer.movers
        self._in_rooms = RoomBatch(num_envs, self._rooms, config.robot, config.lidar, movers)
        spaces = config.observations, config.actions
        super().__init__(self._in_rooms, *spaces, config.terminations, num_envs, autoreset)
        self._bearings = config.lidar.bearings
        self._maps = [] if config.map is None else [LidarMap(config.map) for _ in range(num_envs)]
        self._targets = np.zeros((num_envs, 2))

    @property
    def renderer(self) -> RoomRenderer:
        """What renders the observations of situations anew."""
        return self._renderer

    @property
    def poses(self) -> NDArray[np.float64]:
        """Copy of the true x, y [m] and yaw [rad] of each robot, shape (n, 3)."""
        return self._in_rooms.poses.copy()

    @property
    def _situations(self) -> NDArray[np.float32]:
        """Situations of all robots; see ``RoomRenderer``."""
        batch = self._in_rooms
        return self._renderer.situations(batch.places, batch.motions, self._targets, batch.movers)

    def _place(self, k: int, rng: np.random.Generator, options: dict[str, Any]) -> int:
        """Put a robot down in a room; return the room's index."""
        index, task = self._drawn(rng, options)
        self._in_rooms.place(k, index, task.start)
        self._goals[k] = task.goal
        if self._maps:
            self._maps[k].reset()
        return index

    def _drawn(self, rng: np.random.Generator, options: dict[str, Any]) -> tuple[int, RoomTask]:
        """Return the room's index and the task of an episode."""
        config, rooms = self.config, self._rooms
        if "task" in options or config.tasks == "fixed":
            return _fixed_task(config.fixed_tasks, options.get("task"), rng)
        index = options.get("room")
        if index is None:
            index = self._drawn_room(rng, options.get("difficulty"))
        if "drive" in options:
            return int(index), options["drive"]
        robot = config.robot
        task = random_task(
            rooms[index],
            rng,
            robot.radius,
            max(config.clearance, robot.radius),
            config.min_distance,
        )
        return int(index), task

    def _drawn_room(self, rng: np.random.Generator, difficulty: float | None) -> int:
        """Return the index of a random room: mostly that of the difficulty, any without one."""
        config, count = self.config, len(self.config.rooms)
        if config.random_rooms and rng.random() < config.random_share:
            return count + int(rng.integers(config.random_rooms))
        if difficulty is None or count == 1:
            return int(rng.integers(count))
        shares = np.full(count, (1 - config.favourite) / (count - 1))
        shares[round(difficulty * (count - 1))] = config.favourite
        return int(rng.choice(count, p=shares))

    def _executed(
        self, actions: NDArray[np.float32], going: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the twists of actions, shape (n, 2); let what has to appear appear."""
        # Not in the step that came near: its observation is that of its situation.
        for k in np.flatnonzero(going).tolist() if self._in_rooms.movers.radii.size else ():
            self._let_appear(k)
        shares = np.clip(actions, -1.0, 1.0)
        return np.where(going[:, None], self._actions.scaled(shares), 0.0)

    def _reward_terms(
        self,
        state: PlanarState,
        before: NDArray[np.float64],
        endings: NDArray[np.int64],
        going: NDArray[np.bool_],
    ) -> dict[str, NDArray[np.float64]]:
        """Return the terms of equation 3; what counts is the goal itself, with a map too."""
        return room_reward(self.config.reward, before, self._goal_distances, endings)

    def _observe(self, state: PlanarState, chosen: NDArray[np.bool_]) -> None:
        """Renew the observations of some robots."""
        batch, config = self._in_rooms, self.config
        numbers = np.flatnonzero(chosen)
        found = batch.reciprocals[numbers]
        if config.noise > 0:
            found = np.stack(
                [self._noisy(int(k), row) for k, row in zip(numbers, found, strict=True)]
            )
        self._targets[numbers] = self._goals[numbers]
        for row, k in zip(found, numbers.tolist(), strict=True) if self._maps else ():
            self._targets[k] = self._subgoal(k, row)
        self._states[numbers] = self._renderer.observe(
            found,
            batch.lasers,
            batch.mounted[numbers],
            batch.motions[numbers],
            self._targets[numbers],
        )

    def _noisy(self, k: int, row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the reciprocals of a robot's beams with noise on their ranges, shape (b,)."""
        batch, sigma = self._in_rooms, np.array([self.config.noise])
        return noisy(row[None], batch.lasers, batch.mounted[k : k + 1], sigma, self._rngs[k])[0]

    def _subgoal(self, k: int, row: NDArray[np.float32]) -> NDArray[np.float64]:
        """Remember a robot's scan and return where it should head for [m], shape (2,)."""
        lidar, pose = self.config.lidar, self._in_rooms.poses[k]
        laser = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        # A beam that met nothing has the reciprocal of the largest range, rounded.
        reach = lidar.max_range * (1 - 1e-6)
        self._maps[k].update(pose, self._bearings, 1.0 / row, reach, laser)
        return self._maps[k].subgoal(pose[:2], self._goals[k])

    def _let_appear(self, k: int) -> None:
        """Put obstacles down whose time has come."""
        movers, position = self._in_rooms.movers, self._in_rooms.poses[k, :2]
        for m, one in enumerate(self._rooms[self._in_rooms.places[k]].appearances):
            if one.is_due(*position):
                movers.places[k, m], movers.radii[k, m] = one.circle[:2], one.circle[2]


def _fixed_task(
    tasks: Sequence[tuple[int, RoomTask]], number: int | None, rng: np.random.Generator
) -> tuple[int, RoomTask]:
    """Return a fixed task by its number, or a random one.

    Raises:
        ValueError: If there is no such task.
    """
    if not tasks:
        raise ValueError("rooms: expected fixed tasks, got rooms without any; draw random ones")
    chosen = int(rng.integers(len(tasks))) if number is None else int(number)
    if not 0 <= chosen < len(tasks):
        raise ValueError(f"task: expected 0 to {len(tasks) - 1}, got {chosen}")
    return tasks[chosen]


def room_renderer(config: SpnConfig) -> RoomRenderer:
    """Return what renders the observations of a task's situations."""
    rooms = [make_room(name) for name in config.all_rooms]
    lidars = [config.lidar]
    if config.randomization is not None:
        lidars += config.randomization.draw(np.random.default_rng(0), _BANK)
    return RoomRenderer(
        room_arrays(rooms),
        lidars,
        config.capacity,
        config.goal_encoding,
        max(len(room.appearances) for room in rooms),
        config.randomization,
    )


class SpnEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One robot of ``SpnVectorEnv``; see there for actions, observations, rewards and options."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own form.

    def __init__(self, config: SpnConfig, render_mode: str | None = None) -> None:
        """Prepare the task.

        Args:
            config: Settings.
            render_mode: None, the only one: pictures are drawn from records.
        """
        self.render_mode = render_mode
        self._robots = SpnVectorEnv(config, 1, autoreset=False)
        self.observation_space: gym.spaces.Space[Any] = self._robots.single_observation_space
        self.action_space: gym.spaces.Space[Any] = self._robots.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        states, info = self._robots.reset(seed=[seed], options=options)
        return states[0], _first(info)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drive for one control period."""
        states, rewards, terminated, truncated, info = self._robots.step(action[None])
        ends = bool(terminated[0]), bool(truncated[0])
        return states[0], float(rewards[0]), *ends, _first(info)


def _first(info: dict[str, Any]) -> dict[str, Any]:
    """Return the info of the only robot."""
    return {
        name: _first(value) if isinstance(value, dict) else value[0]
        for name, value in info.items()
        if not name.startswith("_")
    }


def make_spn(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
    render_mode: str | None = None,
) -> SpnEnv:
    """Make the environment: the entry point of ``andabata/SPN-v0``.

    Args:
        rooms: Name of a room, or several; None for the four of the curriculum.
        lidar: Name or label of a laser; None for the training laser.
        config: Settings to begin from.
        render_mode: None, the only one.
    """
    return SpnEnv(spn_config(rooms, lidar, config), render_mode)


def make_spn_vector(
    num_envs: int = 1,
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
) -> SpnVectorEnv:
    """Make the environment for many robots; arguments as for ``make_spn``."""
    return SpnVectorEnv(spn_config(rooms, lidar, config), num_envs)


def spn_config(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
) -> SpnConfig:
    """Return settings with rooms and a laser by their names; arguments as for ``make_spn``."""
    update: dict[str, Any] = {}
    if rooms is not None:
        update["rooms"] = (rooms,) if isinstance(rooms, str) else tuple(rooms)
    if lidar is not None:
        update["lidar"] = PlanarLidarConfig.parse(lidar)
    return (config or SpnConfig()).model_copy(update=update)
