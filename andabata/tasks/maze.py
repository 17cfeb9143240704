"""Stage 1 for many robots at once: the maze's task on the batch simulator of terrain."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematic_vehicle import contact_map
from andabata.machine.kinematics import Twist, executed_twist
from andabata.machine.pose import wrap
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.tasks.offroad import OffroadConfig
from andabata.tasks.own_reward import RewardInput, offroad_reward
from andabata.tasks.planar import PlanarState, PlanarVectorEnv
from andabata.tasks.terrain_batch import PlanarLidar, TerrainBatch
from andabata.tasks.terrain_kernel import TerrainObstacles
from rl.spaces import points_of
from traversability.virtual_scan import VirtualScan
from worlds.scenes import SceneCache
from worlds.world import Task, choose_task, jittered


class MazeVectorEnv(PlanarVectorEnv):
    """Many robots of stage 1 in one process; see ``OffroadEnv`` for actions, states and rewards."""

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
        self.config = config
        grid, body = robot.grid, robot.robot
        lidar = PlanarLidar(grid.bearings, body.lidar_height, grid.outer_radius)
        self._terrain = TerrainBatch(num_envs, body, lidar, robot.errors)
        spaces = config.observations, config.actions
        rules = config.terminations
        super().__init__(self._terrain, *spaces, rules, num_envs, autoreset, sees_scan=True)
        self._scene_cache = scenes or SceneCache()
        # The worlds are not kept: a true map takes 3 MB, and a batch sees a hundred worlds.
        self._tasks: list[tuple[Task, ...]] = []
        self._indices: dict[tuple[int, float | None], int] = {}
        self._planners: list[LocalPlanner] = []
        if config.heading == "subgoal":
            planner = robot.local_planner
            self._planners = [LocalPlanner(grid, planner, body) for _ in range(num_envs)]
        self._believed = np.zeros((num_envs, 2))
        self._previous = np.zeros((num_envs, 2))
        self._reward = offroad_reward(config.reward)

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

    @property
    def _nearest(self) -> NDArray[np.float64]:
        """Shortest beam of each robot [m]: they are its virtual scan."""
        return self._terrain.ranges.min(axis=1).astype(np.float64)

    def _reward_terms(
        self,
        state: PlanarState,
        before: NDArray[np.float64],
        endings: NDArray[np.int64],
        going: NDArray[np.bool_],
    ) -> dict[str, NDArray[np.float64]]:
        """Return the terms: what attracts is the goal, or the sub-goal headed for."""
        after = self._goal_distances
        if self._planners:
            before, after = self._distances_to_targets(going)
        ranges, yaw_rates = self._terrain.ranges, self._previous.copy()
        return self._reward(RewardInput(ranges, before, after, yaw_rates, endings))

    def _distances_to_targets(
        self, going: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances to the sub-goals before and after the step, as the robots know them.

        Returns:
            Both [m], shape (n,) each; 0 for robots that stand.
        """
        before, after = np.zeros(self.num_envs), np.zeros(self.num_envs)
        believed = self._terrain.believed_positions
        for k in np.flatnonzero(going).tolist():
            target = self._planners[k].target
            before[k] = math.dist(self._believed[k], target)
            after[k] = math.dist(believed[k], target)
        return before, after

    def _observe(self, state: PlanarState, chosen: NDArray[np.bool_]) -> None:
        """Renew the observations of some robots."""
        ranges = self._terrain.ranges.copy()
        bearings = self._terrain.heading_errors(self._goals)
        positions = self._terrain.believed_positions
        for k in np.flatnonzero(chosen).tolist() if self._planners else ():
            self._believed[k] = positions[k]
            bearings[k], ranges[k] = self._guided(k, ranges[k], positions[k], float(bearings[k]))
        parts = {
            "ranges": ranges,
            "previous_actions": self._previous,
            "heading_error": bearings[:, None],
        }
        if self.config.scan == "points":
            parts["points"], parts["mask"] = points_of(ranges)
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

    def _place(self, k: int, rng: np.random.Generator, options: dict[str, Any]) -> int:
        """Put a robot down as ``OffroadEnv.reset`` does; return the world's seed."""
        config = self.config
        world_seed = int(options.get("world_seed", rng.choice(config.seeds)))
        level = options.get("difficulty")
        index = self._index_of(world_seed, config.difficulty if level is None else level)
        task = choose_task(self._tasks[index], options.get("task", rng))
        start = jittered(task.start, rng, config.start_jitter, config.heading_jitter)
        self._terrain.place(k, index, start, rng.spawn(1)[0])
        self._goals[k] = task.goals[0]
        self._previous[k] = 0.0
        if self._planners:
            self._planners[k].reset()
        return world_seed

    def _index_of(self, world_seed: int, difficulty: float | None) -> int:
        """Return the index of a world in the batch, which is added the first time."""
        key = (world_seed, difficulty)
        if key not in self._indices:
            scene = self._scene_cache.get(self.config.preset, world_seed, difficulty)
            truth = scene.world.truth
            contact = contact_map(truth, self._terrain.outline)
            raster = (truth.x_min, truth.y_min, truth.cell)
            obstacles = TerrainObstacles(scene.rays.layout, contact, raster)
            self._indices[key] = self._terrain.add_world(obstacles)
            self._tasks.append(scene.world.tasks)
        return self._indices[key]


def is_planar(config: OffroadConfig) -> bool:
    """Return True if a stage is one that the batch simulator drives."""
    robot = config.simulated_robot
    kind = (config.preset, robot.sensing.scanner, robot.plant, robot.localizer)
    plain = robot.sensing.proprioception is None and robot.sensing.grid == robot.grid
    plain &= config.perception_decimation == 1
    return plain and kind == ("maze", "horizontal", "kinematic", "truth")
