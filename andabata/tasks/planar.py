"""Stage 1 for many robots at once: a batch simulator in the plane, and the maze's task on it.

``PlanarBatch`` moves robots and measures their beams; it knows no goal. ``PlanarVectorEnv`` is the
task: what ends a drive, what is rewarded and what is observed are functions over arrays, the same
that a single ``OffroadEnv`` uses. Each robot does what it does alone, with the same draws.
"""

import math
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.clock import CONTROL_PERIOD, TICK_HZ, TICKS_PER_STEP
from andabata.machine.kinematic_vehicle import KinematicConfig, contact_map, plant_parameters
from andabata.machine.kinematics import SkidSteer, Twist, executed_twist
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import reseed
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.tasks.offroad import OffroadConfig, offroad_actions, offroad_observations
from andabata.tasks.planar_kernel import (
    AHEAD,
    Beams,
    Body,
    Movers,
    Obstacles,
    Robots,
    Worlds,
    heading_errors,
    lay_out,
    measure,
    move,
)
from andabata.tasks.rewards import paper_reward
from andabata.tasks.terminations import Drives, Ending, Terminations
from rl.gym_spaces import action_box, observation_box
from traversability.virtual_scan import VirtualScan
from worlds.scenes import Scene, SceneCache
from worlds.world import Start, Task, choose_task, jittered

State = NDArray[np.float32]


@dataclass(frozen=True)
class PlanarLidar:
    """A laser in the plane, fixed on the robot.

    Attributes:
        bearings: Bearing of each beam from the robot's heading [rad], shape (b,).
        z: Height [m].
        max_range: Largest range; free beams return it [m].
        x: Position on the robot [m].
        y: Position on the robot [m].
    """

    bearings: NDArray[np.float64]
    z: float
    max_range: float
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True)
class PlanarState:
    """What a batch gives after a step.

    Attributes:
        poses: True x, y [m] and yaw [rad], shape (n, 3).
        ranges: Range of each beam [m], float32, shape (n, b).
        contacts: True where the body touched something, shape (n,).
        tipped: True where it has rolled over, shape (n,).
    """

    poses: NDArray[np.float64]
    ranges: NDArray[np.float32]
    contacts: NDArray[np.bool_]
    tipped: NDArray[np.bool_]


class PlanarBatch:
    """Many robots of one kind in static worlds with moving obstacles: plant, beams, pose errors.

    Attributes:
        robots: State of all robots.
        movers: Moving obstacles of each robot's world; see ``Movers``.
    """

    def __init__(
        self, count: int, robot: RobotModel, lidar: PlanarLidar, errors: NoisyGroundTruthConfig
    ) -> None:
        """Prepare for a number of robots.

        Args:
            count: Number of robots.
            robot: Body of all of them.
            lidar: Laser of all of them.
            errors: Errors of the poses that they believe to have.
        """
        self.robots = Robots.make(count)
        self.movers = Movers.none(count)
        self._kinematics = SkidSteer(robot)
        self._body = _body(robot, errors)
        directions = np.stack([np.cos(lidar.bearings), np.sin(lidar.bearings)], axis=1)
        self._beams = Beams(directions, lidar.x, lidar.y, lidar.z, lidar.max_range)
        self._ranges = np.zeros((count, len(lidar.bearings)), dtype=np.float32)
        self._slips = [np.random.default_rng(0) for _ in range(count)]
        self._wanders = [np.random.default_rng(0) for _ in range(count)]
        self._obstacles: list[Obstacles] = []
        self._worlds: Worlds | None = None

    @property
    def outline(self) -> NDArray[np.float64]:
        """Outline of the body, as ``contact_map`` takes it."""
        return self._body.outline

    def add_world(self, obstacles: Obstacles) -> int:
        """Add a static world and return its index."""
        self._obstacles.append(obstacles)
        self._worlds = None
        return len(self._obstacles) - 1

    def place(self, k: int, world: int, start: Start, rng: np.random.Generator) -> None:
        """Put a robot down at rest.

        Args:
            k: Index of the robot.
            world: Index of its world.
            start: Pose.
            rng: Source of its streams of noise, in the order of ``SimulatedRobot.place``.
        """
        robots = self.robots
        reseed(self._slips[k], rng)
        rng.integers(2**63)  # The beams' stream: there is nothing porous in a maze.
        reseed(self._wanders[k], rng)
        robots.worlds[k] = world
        robots.motions[k] = 0.0
        robots.motions[k, :3] = start.x, start.y, start.yaw
        robots.flags[k] = False
        robots.steps[k] = 0
        robots.errors[k] = self._body.spread[0] * self._wanders[k].standard_normal(5)

    def step(self, twists: NDArray[np.float64], chosen: NDArray[np.bool_]) -> PlanarState:
        """Drive robots for one control period.

        Args:
            twists: Executed speed [m/s] and yaw rate [rad/s] of each, shape (n, 2).
            chosen: True for robots that move; the others stand still, shape (n,).
        """
        robots = self.robots
        # Wheels have limits of their own, which scale both speeds down together.
        driven = twists.copy()
        for k in np.flatnonzero(chosen).tolist():
            wheels = self._kinematics.wheel_speeds(float(twists[k, 0]), float(twists[k, 1]))
            driven[k] = self._kinematics.twist(wheels)
            if robots.steps[k] % AHEAD == 0:
                self._slips[k].standard_normal(out=robots.slip[k])
                self._wanders[k].standard_normal(out=robots.wander[k])
        worlds = self._laid_out()
        move(driven, chosen, robots, self.movers, worlds, self._body, CONTROL_PERIOD)
        return self.observe(chosen)

    def observe(self, chosen: NDArray[np.bool_]) -> PlanarState:
        """Measure the beams of some robots and return the state of all."""
        worlds = self._laid_out()
        measure(chosen, self.robots, self.movers, worlds, self._beams, self._ranges)
        robots = self.robots
        return PlanarState(
            robots.motions[:, :3], self._ranges, robots.flags[:, 0], robots.flags[:, 1]
        )

    @property
    def stamps(self) -> NDArray[np.float64]:
        """Time since each robot was put down [s], shape (n,)."""
        return np.asarray(self.robots.steps * TICKS_PER_STEP / TICK_HZ)

    @property
    def believed_positions(self) -> NDArray[np.float64]:
        """Positions that the robots believe to have [m], shape (n, 2)."""
        return np.asarray(self.robots.motions[:, :2] + self.robots.errors[:, :2])

    def heading_errors(self, goals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the bearings of goals [m] as the robots believe them, shape (n,) [rad]."""
        return heading_errors(self.robots.motions, self.robots.errors, goals)

    def _laid_out(self) -> Worlds:
        """Return the static worlds behind each other."""
        if self._worlds is None:
            self._worlds = lay_out(self._obstacles)
        return self._worlds


def _body(robot: RobotModel, errors: NoisyGroundTruthConfig) -> Body:
    """Return the numbers of a plant and of its believed pose."""
    plant = plant_parameters(robot, KinematicConfig())
    sigma = np.array([errors.position_sigma] * 2 + [errors.yaw_sigma] + [errors.tilt_sigma] * 2)
    times = np.array([errors.position_time] * 2 + [errors.yaw_time] * 3)
    keep = np.exp(-TICKS_PER_STEP / TICK_HZ / times)
    return Body(
        slip=plant.slip,
        limits=plant.limits,
        sliding=plant.sliding,
        wheels=plant.wheels,
        outline=plant.outline,
        radius=robot.half_radius,
        keep=keep,
        spread=np.stack([sigma, sigma * np.sqrt(1 - keep * keep)]),
    )


class PlanarVectorEnv(gym.vector.VectorEnv[State, NDArray[np.float32], Any]):
    """Many robots of stage 1 in one process; see ``OffroadEnv`` for actions, states and rewards.

    With ``autoreset`` a robot whose episode ends begins the next one in the same step: its last
    state is in ``info["final_obs"]``. Without, a ``reset(seed=..., options={"reset_mask": ...})``
    begins it, and until then the robot stands still.
    """

    def __init__(
        self,
        config: OffroadConfig,
        num_envs: int,
        scenes: SceneCache | None = None,
        autoreset: bool = True,
    ) -> None:
        """Prepare a stage for a number of robots.

        Args:
            config: A stage with the horizontal scanner, the kinematic plant and the true pose.
            num_envs: Number of robots.
            scenes: Scenes to share.
            autoreset: True to begin the next episode in the step that ends one.

        Raises:
            ValueError: If the stage is another.
        """
        robot = config.simulated_robot
        if not is_planar(config):
            raise ValueError(
                "simulated_robot: expected a maze, horizontal scanner, kinematic plant and true "
                f"pose, got {config.preset}, {robot.sensing.scanner}, {robot.plant}, "
                f"{robot.localizer}; use OffroadVectorEnv"
            )
        self.config, self.num_envs = config, num_envs
        mode = AutoresetMode.SAME_STEP if autoreset else AutoresetMode.DISABLED
        self.metadata = {"autoreset_mode": mode, "render_modes": []}
        self._observations, self._actions = offroad_observations(config), offroad_actions(config)
        self.single_observation_space = observation_box(self._observations)
        self.single_action_space = action_box(self._actions)
        batch = gym.vector.utils.batch_space
        self.observation_space = batch(self.single_observation_space, num_envs)
        self.action_space = batch(self.single_action_space, num_envs)
        self._autoreset = autoreset
        self._scene_cache = scenes or SceneCache()
        grid, body = robot.grid, robot.robot
        lidar = PlanarLidar(grid.bearings, body.lidar_height, grid.outer_radius)
        self._batch = PlanarBatch(num_envs, body, lidar, robot.errors)
        self._terminations = Terminations(config.terminations, num_envs)
        self._scenes: list[Scene] = []
        self._indices: dict[tuple[int, float | None], int] = {}
        self._planners: list[LocalPlanner] = []
        if config.heading == "subgoal":
            planner = robot.local_planner
            self._planners = [LocalPlanner(grid, planner, body) for _ in range(num_envs)]
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._goals = np.zeros((num_envs, 2))
        self._goal_distances = np.zeros(num_envs)
        self._believed = np.zeros((num_envs, 2))
        self._previous = np.zeros((num_envs, 2))
        self._turns = np.zeros(num_envs)
        self._states = np.zeros((num_envs, self._observations.size), dtype=np.float32)

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
        levels = options.get("difficulty")
        if not isinstance(levels, list):
            levels = [levels] * self.num_envs
        worlds = np.zeros(self.num_envs, dtype=np.int64)
        for k in np.flatnonzero(chosen).tolist():
            worlds[k] = self._begin(k, seed[k], {**options, "difficulty": levels[k]})
        self._observe(self._batch.observe(chosen), chosen)
        return self._states.copy(), {"world_seed": worlds, "_world_seed": chosen.copy()}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Steer every robot for one control period.

        Args:
            actions: Shares of the steering limit, shape (n, 1).

        Raises:
            ValueError: If an action is not a finite number, or nothing was reset yet.
        """
        if not self._scenes:
            raise ValueError("reset: expected before the first step, got none")
        if not np.isfinite(actions).all():
            raise ValueError("actions: expected finite shares of the steering limit, got others")
        going = ~self._over
        yaws = self._batch.robots.motions[:, 2].copy()
        state = self._batch.step(self._executed(actions, going), going)
        turned = state.poses[:, 2] - yaws
        self._turns += np.where(going, (turned + np.pi) % (2 * np.pi) - np.pi, 0.0) / (2 * np.pi)
        endings = self._endings(state)
        before, after = self._distances(state, going)
        reward = self.config.reward
        terms = paper_reward(reward, state.ranges, before, after, endings)
        terms = {name: np.where(going, term, 0.0) for name, term in terms.items()}
        self._observe(state, going)
        over = going & (endings != Ending.NONE)
        truncated = over & (endings == Ending.TIMEOUT)
        info: dict[str, Any] = {"reward_terms": terms}
        rewards = np.sum(list(terms.values()), axis=0)
        if over.any():
            self._end(over, endings, info)
        return self._states.copy(), rewards, over & ~truncated, truncated, info

    def _executed(
        self, actions: NDArray[np.float32], going: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the twists of actions after limits and dead zone, and remember them, (n, 2)."""
        robot = self.config.simulated_robot.robot
        rates = self._actions.scaled(actions)[:, 0]
        twists = np.zeros((self.num_envs, 2))
        for k in np.flatnonzero(going).tolist():
            twist = executed_twist(Twist(robot.speed, float(rates[k])), robot)
            twists[k] = twist.linear, twist.angular
            self._previous[k] = twist.angular, self._previous[k, 0]
        return twists

    def _endings(self, state: PlanarState) -> NDArray[np.int64]:
        """Return the ending of each drive."""
        distances = np.hypot(*(self._goals - state.poses[:, :2]).T)
        stamps = self._batch.stamps
        drives = Drives(state.poses[:, :2], distances, state.contacts, state.tipped, stamps, stamps)
        return self._terminations.endings(drives)

    def _distances(
        self, state: PlanarState, going: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances before and after the step to what attracts [m], shape (n,) each.

        That is the goal, or the sub-goal that the robot headed for, as far as it knows.
        """
        before = self._goal_distances.copy()
        self._goal_distances = np.hypot(*(self._goals - state.poses[:, :2]).T)
        if not self._planners:
            return before, self._goal_distances
        after, believed = np.zeros(self.num_envs), self._batch.believed_positions
        for k in np.flatnonzero(going).tolist():
            target = self._planners[k].target
            before[k] = math.dist(self._believed[k], target)
            after[k] = math.dist(believed[k], target)
        return before, after

    def _observe(self, state: PlanarState, chosen: NDArray[np.bool_]) -> None:
        """Renew the observations of some robots."""
        ranges = state.ranges.copy()
        bearings = self._batch.heading_errors(self._goals)
        positions = self._batch.believed_positions
        for k in np.flatnonzero(chosen).tolist() if self._planners else ():
            self._believed[k] = positions[k]
            bearings[k], ranges[k] = self._guided(k, ranges[k], positions[k], float(bearings[k]))
        parts = {
            "ranges": ranges,
            "previous_actions": self._previous,
            "heading_error": bearings[:, None],
        }
        self._states[chosen] = self._observations.vector(parts)[chosen]

    def _guided(
        self, k: int, ranges: NDArray[np.float32], position: NDArray[np.float64], bearing: float
    ) -> tuple[float, NDArray[np.float32]]:
        """Return the bearing of a robot's sub-goal and the ranges as its planner ends them."""
        grid, planner = self.config.simulated_robot.grid, self._planners[k]
        to_goal = self._goals[k] - position
        yaw = wrap(math.atan2(to_goal[1], to_goal[0]) - bearing)
        odds = VirtualScan(ranges, grid.outer_radius).log_odds_of(grid)
        distance = float(np.hypot(*to_goal))
        subgoal = planner.bearing(odds, position, yaw, bearing, distance)
        reach = planner.config.max_lookahead
        return subgoal, planner.occupancy.end_ranges(ranges, position, yaw, reach)

    def _end(
        self, over: NDArray[np.bool_], endings: NDArray[np.int64], info: dict[str, Any]
    ) -> None:
        """Report how episodes ended and, with autoreset, begin the next ones."""
        outcomes = [Ending(int(k)).outcome for k in endings]
        info["is_success"] = over & (endings == Ending.GOAL)
        info["outcome"] = np.array([str(outcome or "") for outcome in outcomes], dtype=object)
        info["turns"] = np.abs(self._turns)
        info["_is_success"] = info["_outcome"] = info["_turns"] = over.copy()
        self._over |= over
        if self._autoreset:
            info["final_obs"], info["_final_obs"] = self._states.copy(), over.copy()
            for k in np.flatnonzero(over).tolist():
                self._begin(k, None, {})
            self._observe(self._batch.observe(over), over)

    def _begin(self, k: int, seed: int | None, options: dict[str, Any]) -> int:
        """Put a robot down as ``OffroadEnv.reset`` does; return the world's seed."""
        config = self.config
        if seed is not None:
            self._rngs[k] = gym.utils.seeding.np_random(seed)[0]
        rng = self._rngs[k]
        world_seed = int(options.get("world_seed", rng.choice(config.seeds)))
        level = options.get("difficulty")
        index = self._index_of(world_seed, config.difficulty if level is None else level)
        scene = self._scenes[index]
        task: Task = choose_task(scene.world.tasks, options.get("task", rng))
        start = jittered(task.start, rng, config.start_jitter, config.heading_jitter)
        self._batch.place(k, index, start, rng.spawn(1)[0])
        self._goals[k] = task.goals[0]
        position = np.array([start.x, start.y])
        self._goal_distances[k] = np.hypot(*(self._goals[k] - position))
        self._terminations.begin(k, position)
        self._previous[k] = 0.0
        self._turns[k] = 0.0
        if self._planners:
            self._planners[k].reset()
            self._planners[k].keep_inside(scene.geofence)
        self._over[k] = False
        return world_seed

    def _index_of(self, world_seed: int, difficulty: float | None) -> int:
        """Return the index of a world in the batch, which is added the first time."""
        key = (world_seed, difficulty)
        if key not in self._indices:
            scene = self._scene_cache.get(self.config.preset, world_seed, difficulty)
            truth = scene.world.truth
            contact = contact_map(truth, self._batch.outline)
            raster = (truth.x_min, truth.y_min, truth.cell)
            obstacles = Obstacles(scene.rays.layout, contact, raster)
            self._indices[key] = self._batch.add_world(obstacles)
            self._scenes.append(scene)
        return self._indices[key]

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's own form.
        """Nothing has to be freed."""


def is_planar(config: OffroadConfig) -> bool:
    """Return True if a stage is one that the batch simulator drives."""
    robot = config.simulated_robot
    kind = (config.preset, robot.sensing.scanner, robot.plant, robot.localizer)
    plain = robot.sensing.proprioception is None and robot.sensing.grid == robot.grid
    plain &= config.perception_decimation == 1
    return plain and kind == ("maze", "horizontal", "kinematic", "truth")
