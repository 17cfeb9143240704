"""Many robots in rooms: the environment of every task that drives by a planar laser there.

Tasks differ in their settings alone (``RoomConfig``): rooms, body, laser, what is observed and
rewarded, and when an episode ends.
"""

import math
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.odometry import as_believed
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.lidar_map import LidarMap
from andabata.navigation.planar.mover_shield import MoverShield
from andabata.tasks.planar import PlanarState, PlanarVectorEnv
from andabata.tasks.rewards import (
    GdaeRewardConfig,
    GoalOffsets,
    ImprovedRewardConfig,
    gdae_reward,
    improved_reward,
    room_reward,
)
from andabata.tasks.rooms.batch import RoomBatch, room_arrays
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.kernel import V
from andabata.tasks.rooms.mover_terms import SeenMovers
from andabata.tasks.rooms.observations import RoomRenderer, noisy
from andabata.tasks.rooms.scan_history import ScanHistory
from andabata.tasks.rooms.terms import encoded_goals
from rl.environment import world_of_level
from worlds.rooms.catalogue import make_room
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.room import RoomTask, random_task

_BANK = 256
"""Number of lasers that are drawn at once for randomised observations."""


class RoomVectorEnv(PlanarVectorEnv):
    """Drive round robots to goals in rooms by what their lasers see.

    ## Action space
    ``Box(-1, 1, (2,), float32)``: speed from 0 to the robot's largest, and yaw rate, positive to
    the left, as shares of the limits.

    | task | speed [m/s] | yaw rate [rad/s] | period [s] |
    |---|---|---|---|
    | spn | 0 to 0.5 | -pi/3 to pi/3 | 0.2 |
    | td3 | 0 to 1 | -1 to 1 | 0.1 |

    ## Observation space
    Terms of ``room_observations``, one after the other, in the robot's frame.

    | task | terms |
    |---|---|
    | spn | points (120, 2), mask (120,), windows (36,), goal (3,), velocity (2,) |
    | td3 | windows (40,), goal (3,), velocity (2,) |
    | td3, printed | ranges (40,), goal (2,), velocity (2,) |
    | td3, gdae | ranges (20,), goal (2,), velocity (2,) |

    With ``earlier_scan`` the windows of an earlier scan stand behind those of the present, with
    ``tracked_movers`` the nearest movers behind all, by the tracker of the shield. With
    ``shield`` a command may be replaced by one that gets out of the way of movers. With ``drift``
    robots go by a pose that drifts, with ``noise`` their beams are not exact. An earlier scan is
    aligned by the true motion: in its few steps a pose hardly drifts.

    ## Reward
    Terms of ``room_reward``: +5 at the goal, -5 in a collision, else the progress in metres and the
    cost of a step. ``reward`` of the settings may name GDAE's or the improved TD3's instead.

    ## Start and end
    A room is drawn, then a start and a goal that can be reached, then its moving obstacles. An
    episode terminates at the goal (d < 0.3 m) and on contact, and is truncated after 400 steps
    (spn) or 500 (td3). ``info["outcome"]`` names the end, ``info["contact"]`` who drove into whom;
    see ``Contact``.

    ## Options of reset
    ``{"difficulty": float}`` from 0 to 1 names the main room, ``{"room": int}`` the room;
    ``{"task": int}`` chooses a fixed task, ``{"drive": RoomTask}`` gives one for the room. Each may
    be a list with one value a robot.

    ## Version history
    v0: first release.
    """

    def __init__(self, config: RoomConfig, num_envs: int, autoreset: bool = True) -> None:
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
        machine = config.robot, config.lidar, movers, config.odometry_errors
        self._in_rooms = RoomBatch(num_envs, self._rooms, *machine)
        spaces = config.observations, config.actions
        super().__init__(self._in_rooms, *spaces, config.terminations, num_envs, autoreset)
        self._bearings = config.lidar.bearings
        count = 0 if config.map is None else num_envs
        self._maps = [LidarMap(config.map, config.robot.radius) for _ in range(count)]
        self._shields = [] if config.shield is None else [_shield(config) for _ in range(num_envs)]
        seen = config.tracked_movers, config.lidar, config.robot.period
        self._seen = SeenMovers(num_envs, *seen, self._shields)
        self._targets = np.zeros((num_envs, 2))
        self._goal_bearings = np.zeros(num_envs)
        self._history: ScanHistory | None = None
        if config.earlier_scan:
            sizes = config.earlier_scan, config.lidar.count, movers
            self._history = ScanHistory(num_envs, *sizes)

    @property
    def renderer(self) -> RoomRenderer:
        """What renders the observations of situations anew."""
        return self._renderer

    @property
    def batch(self) -> RoomBatch:
        """Bodies, beams and movers of the robots."""
        return self._in_rooms

    @property
    def poses(self) -> NDArray[np.float64]:
        """Copy of the true x, y [m] and yaw [rad] of each robot, shape (n, 3)."""
        return self._in_rooms.poses.copy()

    @property
    def believed_poses(self) -> NDArray[np.float64]:
        """Copy of the x, y [m] and yaw [rad] that each robot believes in, shape (n, 3)."""
        return self._in_rooms.believed.copy()

    @property
    def _situations(self) -> NDArray[np.float32] | None:
        """Situations of all robots where a replay keeps them; see ``RoomRenderer``."""
        if not self.config.keeps_situations:
            return None
        batch, history = self._in_rooms, self._history
        earlier = None if history is None else history.earlier
        state = batch.places, batch.motions, self._targets, batch.movers
        return self._renderer.situations(*state, earlier, self._seen.rows)

    def _place(self, k: int, rng: np.random.Generator, options: dict[str, Any]) -> int:
        """Put a robot down in a room; return the room's index."""
        index, task = self._drawn(rng, options)
        movers = draw_movers(self._rooms[index], rng, task, self.config.robot.radius)
        self._in_rooms.place(k, index, task.start, movers)
        if self._in_rooms.odometry is not None:
            # Its own source: what is drawn besides does not depend on the drift.
            self._in_rooms.odometry.restart(k, self._in_rooms.poses[k], rng.spawn(1)[0])
        self._goals[k] = task.goal
        self._goal_bearings[k] = self._bearings_to_goals(slice(k, k + 1))[0]
        if self._maps:
            self._maps[k].reset()
        if self._shields:
            self._shields[k].reset()
        self._seen.restart(k)
        if self._history is not None:
            self._history.restart(k)
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
        if config.random_rooms and (count == 0 or rng.random() < config.random_share):
            return count + int(rng.integers(config.random_rooms))
        if difficulty is None or count == 1:
            return int(rng.integers(count))
        shares = np.full(count, (1 - config.main_room_share) / (count - 1))
        shares[world_of_level(difficulty, count)] = config.main_room_share
        return int(rng.choice(count, p=shares))

    def _executed(
        self, actions: NDArray[np.float32], going: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the twists of actions, or those of the shields, shape (n, 2)."""
        shares = np.clip(actions, -1.0, 1.0)
        twists = np.where(going[:, None], self._actions.scaled(shares), 0.0)
        for k in np.flatnonzero(going).tolist() if self._shields else ():
            safe = self._shields[k].safe(Twist(*twists[k].tolist()))
            twists[k] = safe.linear, safe.angular
        return twists

    def _reward_terms(
        self,
        state: PlanarState,
        before: NDArray[np.float64],
        endings: NDArray[np.int64],
        going: NDArray[np.bool_],
    ) -> dict[str, NDArray[np.float64]]:
        """Return the terms of the task's reward; the goal itself counts, with a map too."""
        reward, batch = self.config.reward, self._in_rooms
        if isinstance(reward, GdaeRewardConfig):
            # The beams of a robot that was never put down are 0.
            largest = batch.reciprocals.max(axis=1).astype(np.float64)
            far = np.full_like(largest, np.inf)
            nearest = np.divide(1.0, largest, out=far, where=largest > 0)
            return gdae_reward(reward, batch.motions[:, V:], nearest, endings)
        if isinstance(reward, ImprovedRewardConfig):
            bearings = self._goal_bearings.copy()
            self._goal_bearings = self._bearings_to_goals(slice(None))
            after = GoalOffsets(self._goal_distances, self._goal_bearings)
            return improved_reward(reward, GoalOffsets(before, bearings), after, endings)
        return room_reward(reward, before, self._goal_distances, endings)

    def _bearings_to_goals(self, numbers: slice) -> NDArray[np.float64]:
        """Return the bearings of some robots' goals, from -pi to pi [rad], shape (k,)."""
        return encoded_goals(self._in_rooms.poses[numbers], self._goals[numbers], "polar")[:, 1]

    def _observe(self, state: PlanarState, chosen: NDArray[np.bool_]) -> None:
        """Renew the observations of some robots."""
        batch, config = self._in_rooms, self.config
        numbers = np.flatnonzero(chosen)
        beams = batch.reciprocals[numbers]
        if config.noise > 0 and len(numbers):
            beams = np.stack(
                [self._noisy(int(k), row) for k, row in zip(numbers, beams, strict=True)]
            )
        self._targets[numbers] = self._goals[numbers]
        for row, k in zip(beams, numbers.tolist(), strict=True) if self._maps else ():
            self._targets[k] = self._subgoal(k, row)
        for row, k in zip(beams, numbers.tolist(), strict=True) if self._shields else ():
            self._shields[k].update(LaserPose(*batch.believed[k].tolist()), 1.0 / row)
        self._seen.update(numbers.tolist(), batch.believed, beams)
        if batch.odometry is not None:
            poses, believed = batch.poses[numbers], batch.believed[numbers]
            self._targets[numbers] = as_believed(self._targets[numbers], poses, believed)
        earlier = None
        if self._history is not None:
            self._history.update(numbers, beams, batch.poses, batch.movers)
            earlier = self._history.earlier.of(numbers)
        self._states[numbers] = self._renderer.observe(
            beams,
            batch.mounted[numbers],
            batch.motions[numbers],
            self._targets[numbers],
            earlier,
            self._seen.rows[numbers],
        )

    def _noisy(self, k: int, row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the reciprocals of a robot's beams with noise on their ranges, shape (b,)."""
        batch, sigma = self._in_rooms, np.array([self.config.noise])
        return noisy(row[None], batch.lasers, batch.mounted[k : k + 1], sigma, self._rngs[k])[0]

    def _subgoal(self, k: int, row: NDArray[np.float32]) -> NDArray[np.float64]:
        """Remember a robot's scan and return where it should head for [m], shape (2,)."""
        lidar, pose = self.config.lidar, self._in_rooms.believed[k]
        laser = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        # A beam that met nothing has the reciprocal of the largest range, rounded.
        reach = lidar.max_range * (1 - 1e-6)
        self._maps[k].update(pose, self._bearings, 1.0 / row, reach, laser)
        return self._maps[k].subgoal(pose[:2], self._goals[k])

    def _end_details(self) -> dict[str, NDArray[Any]]:
        """Return who drove into whom; see ``Contact``."""
        labels = [Contact(code).label for code in self._in_rooms.contacts.tolist()]
        return {"contact": np.array(labels, dtype=object)}


def _shield(config: RoomConfig) -> MoverShield:
    """Return the shield of a robot, for its own body."""
    robot = config.robot
    largest = Twist(robot.max_speed, robot.max_yaw_rate)
    return MoverShield(config.lidar, robot.radius, largest, robot.period, config.shield)


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


def room_renderer(config: RoomConfig) -> RoomRenderer:
    """Return what renders the observations of a task's situations."""
    rooms = [make_room(name) for name in config.all_rooms]
    lidars = [config.lidar]
    if config.randomization is not None:
        lidars += config.randomization.draw(np.random.default_rng(0), _BANK)
    return RoomRenderer(
        room_arrays(rooms),
        lidars,
        config.terms,
        max(len(room.movers) for room in rooms),
        config.randomization,
    )


class RoomEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One robot of ``RoomVectorEnv``; see there for actions, observations, rewards and options."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own form.

    def __init__(self, config: RoomConfig, render_mode: str | None = None) -> None:
        """Prepare the task.

        Args:
            config: Settings.
            render_mode: None, the only one: pictures are drawn from records.
        """
        self.config, self.render_mode = config, render_mode
        self._robots = RoomVectorEnv(config, 1, autoreset=False)
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
