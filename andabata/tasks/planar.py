"""Stage 1 for many robots at once: the maze's plant, beams, errors and judge in one compiled pass.

Each robot does what it does in an ``OffroadEnv`` of stage 1, with the same draws: the plant and the
rays are the same compiled functions, called from ``flat_pass``.
"""

import math
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from andabata.machine.clock import TICK_HZ, TICKS_PER_STEP
from andabata.machine.kinematic_vehicle import (
    KinematicConfig,
    contact_map,
    plant_numbers,
)
from andabata.machine.pose import wrap
from andabata.machine.simulator import reseed
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.tasks.offroad import OffroadConfig, offroad_spaces
from andabata.tasks.planar_kernel import (
    AHEAD,
    GOAL,
    GOING,
    OUTCOMES,
    TIMEOUT,
    FlatRobots,
    FlatWorlds,
    Maze,
    Rules,
    advance,
    heading_error,
    lay_out,
)
from andabata.tasks.rewards import TERMS, repulsion_weights
from rl.spaces import N_EXTRAS
from traversability.virtual_scan import VirtualScan
from worlds.scenes import SceneCache
from worlds.world import Start, choose_task, jittered

State = NDArray[np.float32]


class FlatVectorEnv(gym.vector.VectorEnv[State, NDArray[np.float32], Any]):
    """Many robots of stage 1 in one process; see ``OffroadEnv`` for actions, states and rewards.

    With ``autoreset`` a robot whose episode ends begins the next one in the same step: its last
    state is in ``info["final_obs"]``. Without, whoever drives begins it with
    ``reset(seed=..., options={"reset_mask": ...})``, and until then the robot stands still.
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
            config: Of a stage with the horizontal scanner, the kinematic plant and the true pose.
            num_envs: Robots.
            scenes: Scenes to share.
            autoreset: See above.

        Raises:
            ValueError: If the stage is another.
        """
        simulated_robot = config.simulated_robot
        if not is_flat(config):
            raise ValueError(
                "simulated_robot: expected a maze, horizontal scanner, kinematic plant and true pose, got "
                f"{config.preset}, {simulated_robot.sensing.scanner}, {simulated_robot.plant}, {simulated_robot.localizer}; use "
                "OffroadVectorEnv"
            )
        self.config, self.num_envs = config, num_envs
        mode = AutoresetMode.SAME_STEP if autoreset else AutoresetMode.DISABLED
        self.metadata = {"autoreset_mode": mode, "render_modes": []}
        self.single_observation_space, self.single_action_space = offroad_spaces(config)
        self.observation_space = gym.vector.utils.batch_space(
            self.single_observation_space, num_envs
        )
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)
        self._autoreset = autoreset
        self._scenes = scenes or SceneCache()
        self._mazes: list[Maze] = []
        self._numbers: dict[tuple[int, float | None], int] = {}
        self._maps: list[LocalPlanner] = []
        self._places = np.zeros((num_envs, 2))
        if config.heading == "subgoal":
            self._maps = [
                LocalPlanner(
                    simulated_robot.grid, simulated_robot.local_planner, simulated_robot.robot
                )
                for _ in range(num_envs)
            ]
        self._robots = FlatRobots.make(num_envs)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._slips = [np.random.default_rng(0) for _ in range(num_envs)]
        self._wanders = [np.random.default_rng(0) for _ in range(num_envs)]
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._states = np.zeros(
            (num_envs, simulated_robot.grid.n_sectors + N_EXTRAS), dtype=np.float32
        )
        self._terms = np.zeros((num_envs, 4))
        self._outcomes = np.zeros(num_envs, dtype=np.int64)
        self._worlds: FlatWorlds | None = None
        self._rules = self._make_rules()

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
        self._look(chosen)
        return self._states.copy(), {"world_seed": worlds, "_world_seed": chosen.copy()}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Steer every robot for one control period of 0.1 s.

        Raises:
            ValueError: If an action is not a finite number, or nothing was reset yet.
        """
        if not self._mazes:
            raise ValueError("reset: expected before the first step, got none")
        if not np.isfinite(actions).all():
            raise ValueError("actions: expected finite shares of the steering limit, got others")
        going = ~self._over
        self._draw(going)
        steering = actions[:, 0].astype(np.float64) * self.config.simulated_robot.robot.max_steering
        self._pass(steering, going, True)
        self._terms[~going] = 0.0
        rewards = self._terms.sum(axis=1)
        over = going & (self._outcomes != GOING)
        truncated = over & (self._outcomes == TIMEOUT)
        terms = dict(zip(TERMS, self._terms.T.copy(), strict=True))
        info: dict[str, Any] = {"reward_terms": terms}
        if over.any():
            self._end(over, info)
        return self._states.copy(), rewards, over & ~truncated, truncated, info

    def _end(self, over: NDArray[np.bool_], info: dict[str, Any]) -> None:
        """Tell how episodes ended and, with autoreset, begin the next ones."""
        info["is_success"] = over & (self._outcomes == GOAL)
        info["outcome"] = np.array([str(OUTCOMES[k] or "") for k in self._outcomes], dtype=object)
        info["_is_success"] = info["_outcome"] = over.copy()
        self._over |= over
        if self._autoreset:
            info["final_obs"], info["_final_obs"] = self._states.copy(), over.copy()
            for k in np.flatnonzero(over).tolist():
                self._begin(k, None, {})
            self._look(over)

    def _begin(self, k: int, seed: int | None, options: dict[str, Any]) -> int:
        """Put a robot down as ``OffroadEnv.reset`` does; return the world's seed."""
        config = self.config
        if seed is not None:
            self._rngs[k] = gym.utils.seeding.np_random(seed)[0]
        rng = self._rngs[k]
        world_seed = int(options.get("world_seed", rng.choice(config.seeds)))
        level = options.get("difficulty")
        number = self._number_of(world_seed, config.difficulty if level is None else level)
        task = choose_task(self._mazes[number].tasks, options.get("task", rng))
        start = jittered(task.start, rng, config.start_jitter, config.heading_jitter)
        self._place(k, number, start, np.array(task.goals[0]), rng.spawn(1)[0])
        return world_seed

    def _place(
        self, k: int, number: int, start: Start, goal: NDArray[np.float64], rng: np.random.Generator
    ) -> None:
        """Put a robot down at rest; its streams come from ``rng`` in the order of ``SimulatedRobot.place``."""
        robots = self._robots
        reseed(self._slips[k], rng)
        rng.integers(2**63)  # The beams' stream: there is nothing porous in a maze.
        reseed(self._wanders[k], rng)
        robots.worlds[k] = number
        robots.motions[k] = 0.0
        robots.motions[k, :3] = start.x, start.y, start.yaw
        robots.flags[k] = False
        robots.commands[k] = 0.0
        robots.goals[k] = goal
        robots.anchors[k] = start.x, start.y, 0.0
        robots.steps[k] = 0
        if self._maps:
            self._maps[k].reset()
            self._maps[k].keep_inside(self._mazes[number].geofence)
        robots.errors[k] = self._rules.spread[0] * self._wanders[k].standard_normal(5)
        self._over[k] = False

    def _number_of(self, world_seed: int, difficulty: float | None) -> int:
        """Return the place of a world among those laid out, laying it out the first time."""
        key = (world_seed, difficulty)
        if key not in self._numbers:
            scene = self._scenes.get(self.config.preset, world_seed, difficulty)
            truth = scene.world.truth
            self._numbers[key] = len(self._mazes)
            self._mazes.append(
                Maze(
                    scene.rays.layout,
                    scene.world.tasks,
                    contact_map(truth, self._rules.outline),
                    (truth.x_min, truth.y_min, truth.cell),
                    scene.geofence,
                )
            )
            self._worlds = None
        return self._numbers[key]

    def _draw(self, going: NDArray[np.bool_]) -> None:
        """Make the draws of the next steps where they have run out."""
        robots = self._robots
        for k in np.flatnonzero(going & (robots.steps % AHEAD == 0)):
            self._slips[k].standard_normal(out=robots.slip[k])
            self._wanders[k].standard_normal(out=robots.wander[k])

    def _look(self, chosen: NDArray[np.bool_]) -> None:
        """Fill the states of robots that were put down."""
        self._pass(np.zeros(self.num_envs), chosen, False)

    def _pass(self, steering: NDArray[np.float64], chosen: NDArray[np.bool_], move: bool) -> None:
        """Let robots move and look, or only look."""
        if self._worlds is None:
            self._worlds = lay_out(self._mazes)
        advance(
            steering,
            chosen,
            move,
            self._robots,
            self._worlds,
            self._rules,
            self._states,
            self._terms,
            self._outcomes,
        )
        if self._maps:
            for k in np.flatnonzero(chosen).tolist():
                self._head_for_subgoal(k, move)

    def _head_for_subgoal(self, k: int, moved: bool) -> None:
        """Put the bearing of a robot's sub-goal into its state, as ``OffroadEnv`` does."""
        robots, state = self._robots, self._states[k]
        grid = self.config.simulated_robot.grid
        here = robots.motions[k, :2] + robots.errors[k, :2]
        bearing = float(heading_error(robots.motions[k], robots.errors[k], robots.goals[k]))
        to_goal = robots.goals[k] - here
        yaw = wrap(math.atan2(to_goal[1], to_goal[0]) - bearing)
        if moved:
            target = self._maps[k].target
            nearer = math.dist(self._places[k], target) - math.dist(here, target)
            self._terms[k, 0] = self.config.reward.attraction * nearer
        self._places[k] = here
        local_planner, ranges = self._maps[k], state[:-N_EXTRAS]
        odds = VirtualScan(ranges, grid.outer_radius).odds_of(grid)
        state[-1] = local_planner.bearing(odds, here, yaw, bearing, float(np.hypot(*to_goal)))
        ranges[:] = local_planner.evidence.shortened(ranges, here, yaw, local_planner.config.reach)

    def _make_rules(self) -> Rules:
        """Return every number that the compiled pass needs."""
        config, simulated_robot = self.config, self.config.simulated_robot
        robot, errors, judge, reward = (
            simulated_robot.robot,
            simulated_robot.errors,
            config.terminations,
            config.reward,
        )
        plant = plant_numbers(robot, KinematicConfig())
        sigma = np.array([errors.position_sigma] * 2 + [errors.yaw_sigma] + [errors.tilt_sigma] * 2)
        times = np.array([errors.position_time] * 2 + [errors.yaw_time] * 3)
        keep = np.exp(-TICKS_PER_STEP / TICK_HZ / times)
        return Rules(
            body=np.array(
                [
                    robot.speed,
                    robot.max_steering,
                    robot.dead_zone,
                    robot.effective_track / 2,
                    robot.wheel_radius,
                    robot.max_wheel_speed,
                    robot.lidar_height,
                    plant.slip,
                ]
            ),
            limits=plant.limits,
            sliding=plant.sliding,
            wheels=plant.wheels,
            outline=plant.outline,
            keep=keep,
            spread=np.stack([sigma, sigma * np.sqrt(1 - keep * keep)]),
            beams=np.stack(
                [np.cos(simulated_robot.grid.bearings), np.sin(simulated_robot.grid.bearings)],
                axis=1,
            ),
            judge=np.array(
                [judge.goal_radius, judge.time_limit, judge.stuck_time, judge.stuck_radius]
            ),
            reward=np.array(
                [
                    reward.attraction,
                    reward.max_range,
                    reward.collision,
                    reward.tipover,
                    simulated_robot.grid.outer_radius,
                ]
            ),
            weights=repulsion_weights(reward, simulated_robot.grid.n_sectors),
        )

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's own form.
        """There is nothing to free."""


def is_flat(config: OffroadConfig) -> bool:
    """Return whether a stage is one that the compiled pass drives."""
    simulated_robot = config.simulated_robot
    kind = (
        config.preset,
        simulated_robot.sensing.scanner,
        simulated_robot.plant,
        simulated_robot.localizer,
    )
    plain = (
        simulated_robot.sensing.proprioception is None
        and simulated_robot.sensing.grid == simulated_robot.grid
    )
    plain &= config.look_every == 1
    return plain and kind == ("maze", "horizontal", "kinematic", "truth")
