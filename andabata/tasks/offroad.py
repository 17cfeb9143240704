"""Off-road navigation as Gymnasium environments (Sanchez et al. 2023, section 5)."""

import math
from typing import Any, Literal, Self

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine.sensor_readings import SensorReadings, VehicleState, WheelSpeeds
from andabata.machine.simulator import SensingConfig
from andabata.models import Models
from andabata.navigation.controller import ControllerInput, Steering
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.policy_controller import observation_of, twist_of
from andabata.tasks.episode_monitor import EpisodeMonitor
from andabata.tasks.own_reward import RewardInput, offroad_reward
from andabata.tasks.rewards import RewardConfig
from andabata.tasks.terminations import Outcome, TerminationConfig
from rl.gym_spaces import action_box, observation_box
from rl.spaces import (
    ActionSpec,
    ObservationSpec,
    steering_actions,
    steering_observations,
    steering_points,
)
from worlds.scenes import SceneCache
from worlds.splits import TRAINING_SEEDS, VALIDATION_SEEDS, refuse_judging
from worlds.world import choose_task, jittered


class OffroadConfig(BaseModel):
    """Settings of one stage's environment.

    Attributes:
        task: Name of the kind of task.
        preset: World preset.
        seeds: World seeds that episodes draw from.
        difficulty: Difficulty of the worlds, None for the preset's own.
        simulated_robot: Robot.
        scan: Form of the scan in the observation: a vector of ``ranges`` (paper), or ``points``
            beside it for a policy that reads a set.
        heading: Reference of the heading error: the ``goal`` (paper), or the ``subgoal`` of the
            robot's local planner.
        terminations: Rules that end an episode.
        reward: Constants of the reward.
        start_jitter: Largest uniform shift of the start in x and in y [m].
        heading_jitter: Largest uniform turn of the start's heading [rad].
        perception_decimation: Number of control steps between two virtual scans. In between the
            robot localises itself and keeps the last scan: an action that is held as long needs no
            more.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: Literal["offroad"] = "offroad"
    preset: str = "natural"
    seeds: tuple[int, ...] = TRAINING_SEEDS
    difficulty: float | None = Field(default=None, ge=0, le=1)
    simulated_robot: SimulatedRobotConfig = Field(default_factory=SimulatedRobotConfig)
    scan: Literal["ranges", "points"] = "ranges"
    heading: Literal["goal", "subgoal"] = "subgoal"
    terminations: TerminationConfig = Field(default_factory=TerminationConfig)
    reward: RewardConfig = Field(default_factory=RewardConfig)
    start_jitter: float = Field(default=0.2, ge=0, le=5)
    heading_jitter: float = Field(default=0.3, ge=0, le=np.pi)
    perception_decimation: int = Field(default=1, ge=1)

    @field_validator("seeds")
    @classmethod
    def _check_seeds(cls, seeds: tuple[int, ...]) -> tuple[int, ...]:
        """Refuse worlds that judge a release before anything is learned in them."""
        for seed in seeds:
            refuse_judging(seed)
        return seeds

    @property
    def observations(self) -> ObservationSpec:
        """Space of the observations."""
        grid, limit = self.simulated_robot.grid, self.simulated_robot.robot.max_steering
        make = steering_points if self.scan == "points" else steering_observations
        return make(grid.n_sectors, grid.outer_radius, limit)

    @property
    def actions(self) -> ActionSpec:
        """Space of the actions."""
        return steering_actions(self.simulated_robot.robot.max_steering)

    @property
    def unseen(self) -> Self:
        """The same in the worlds that are kept for validation."""
        return self.model_copy(update={"seeds": VALIDATION_SEEDS})


class OffroadEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Drive a skid-steer robot at constant speed to a goal by steering it.

    ## Action space
    ``Box(-1, 1, (1,), float32)``: wanted yaw rate as a share of the robot's limit (0.5 rad/s),
    positive to the left. Wanted rates inside the dead zone of 0.15 rad/s drive straight on.

    ## Observation space
    ``Box((35,), float32)``, SI units:

    | index | what | range |
    |---|---|---|
    | 0-31 | free distance of each sector of the virtual scan, as in ``VirtualScan`` | 0 to 10 m |
    | 32-33 | the last two executed yaw rates, newest first | -0.5 to 0.5 rad/s |
    | 34 | heading error to the goal, or to the planner's sub-goal | -pi to pi rad |

    ## Reward
    The sum of the named terms in ``info["reward_terms"]`` (``andabata.tasks.rewards``):
    attraction, repulsion and the terminal penalties, or those of a function of one's own
    (``reward.function``). What attracts is the goal, or the sub-goal that the robot headed for
    before the step, as far as it knows.

    ## Start and end
    A world is drawn from the pool of seeds and a task from the world. An episode terminates at the
    goal (d < 1 m), on physical contact, on tip-over and when stuck, with ``collision_range`` also
    at a nearer range of the virtual scan, and is truncated at the time limit. The last step's info
    holds ``is_success``, ``outcome``, ``turns`` and ``contact``, which tells who drove into whom.

    ## Options of reset
    ``{"world_seed": int, "difficulty": float, "task": int}`` choose the world and the task.

    ## Version history
    v0: first release.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own form.

    def __init__(
        self,
        config: OffroadConfig,
        models: Models | None = None,
        scenes: SceneCache | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Prepare a stage.

        Args:
            config: Stage.
            models: Classifiers; None for the shipped ones.
            scenes: Scenes to share with other environments of this process.
            render_mode: None, the only one: pictures are drawn from records.
        """
        self.render_mode = render_mode
        self.config = config
        self._scene_cache = scenes or SceneCache()
        sees_clouds = config.simulated_robot.sensing.scanner == "rotating"
        self._models = (models or Models()) if sees_clouds else None
        self._kept: SimulatedRobot | None = None
        self._planner: LocalPlanner | None = None
        if config.heading == "subgoal":
            robot = config.simulated_robot
            settings = robot.local_planner.decimated(config.perception_decimation)
            self._planner = LocalPlanner(robot.grid, settings, robot.robot)
        self._reward, self._yaw_rates = offroad_reward(config.reward), (0.0, 0.0)
        self._observations, self._actions = config.observations, config.actions
        self.observation_space: gym.spaces.Space[Any] = observation_box(self._observations)
        self.action_space: gym.spaces.Space[Any] = action_box(self._actions)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Put the robot down in a world of the pool and wait for the first scan."""
        super().reset(seed=seed)
        options, config = options or {}, self.config
        world_seed = int(options.get("world_seed", self.np_random.choice(config.seeds)))
        robot = self._robot_in(world_seed, options.get("difficulty", config.difficulty))
        task = choose_task(robot.scene.world.tasks, options.get("task", self.np_random))
        goal = np.array(task.goals[0])
        start = jittered(task.start, self.np_random, config.start_jitter, config.heading_jitter)
        readings = robot.place(start, goal, self.np_random)
        self._monitor = EpisodeMonitor(robot.scene.world, config.terminations, sees_scan=True)
        self._monitor.begin(_truth(readings), goal)
        robot.navigator.update(readings)
        while (situation := robot.navigator.observe(readings)) is None:
            readings = robot.simulator.step(WheelSpeeds(0.0, 0.0))
            robot.navigator.update(readings)
        self._goal_distance = self._monitor.goal_distance(_truth(readings))
        self._position = robot.localizer.odometry.position[:2]
        self._steps, self._yaw_rates = 0, (0.0, 0.0)
        self._observe(situation)
        return self._state, {"world_seed": world_seed}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Steer for one control period."""
        robot = self._simulated_robot
        # Shares of the limits to a command; the robot applies limits and dead zone.
        values = self._actions.scaled(action)
        command = twist_of(self._actions, values, self.config.simulated_robot.robot.speed)
        twist, wheels = robot.navigator.execute(command)
        self._yaw_rates = (twist.angular, self._yaw_rates[0])
        readings = robot.simulator.step(wheels)
        robot.navigator.update(readings)
        before, after = self._distances(_truth(readings))
        self._steps += 1
        if self._steps % self.config.perception_decimation == 0:
            situation = robot.navigator.observe(readings)
            # Where the laser is silent or not believed the robot stands, and learns nothing new.
            if situation is not None:
                self._observe(situation)
        outcome = self._monitor.update(_truth(readings), scan=robot.navigator.perceived)
        terms = self._reward_terms(before, after)
        info: dict[str, Any] = {"reward_terms": terms}
        if outcome is not None:
            info |= {"is_success": outcome is Outcome.GOAL, "outcome": str(outcome)}
            info |= {"turns": abs(self._monitor.turns), "contact": self._monitor.contact.label}
        endings = np.array([self._monitor.ending])
        truncated = bool(self.config.terminations.truncated(endings)[0])
        terminated = outcome is not None and not truncated
        return self._state, float(sum(terms.values())), terminated, truncated, info

    def _observe(self, situation: ControllerInput) -> None:
        """Renew the ranges that repel and the observation."""
        self._ranges = situation.perceived.finite()
        self._state = observation_of(self._observations, situation)

    def _reward_terms(self, before: float, after: float) -> dict[str, float]:
        """Return the terms of a step's reward for distances before and after it [m]."""
        step = RewardInput(
            ranges=self._ranges[None],
            distance_before=np.array([before]),
            distance=np.array([after]),
            yaw_rates=np.array([self._yaw_rates]),
            endings=np.array([self._monitor.ending]),
        )
        terms = self._reward(step)
        return {name: float(term[0]) for name, term in terms.items()}

    def _distances(self, truth: VehicleState) -> tuple[float, float]:
        """Return the distances before and after the step to what attracts [m].

        That is the goal, or the sub-goal that the robot headed for, as far as it knows.
        """
        if self._planner is None:
            before, self._goal_distance = self._goal_distance, self._monitor.goal_distance(truth)
            return before, self._goal_distance
        position = self._simulated_robot.localizer.odometry.position[:2]
        target = self._planner.target
        before, self._position = math.dist(self._position, target), position
        return before, math.dist(position, target)

    def close(self) -> None:
        """Free the plants."""
        if self._kept is not None:
            self._kept.close()
            self._kept = None

    @property
    def _simulated_robot(self) -> SimulatedRobot:
        """Return the robot in the episode's world.

        Raises:
            ValueError: Before the first episode.
        """
        if self._kept is None:
            raise ValueError("reset: expected it before the first step, got none")
        return self._kept

    def _robot_in(self, world_seed: int, difficulty: float | None) -> SimulatedRobot:
        """Return the robot in a world: the last episode's, where the world is the same."""
        scene = self._scene_cache.get(self.config.preset, world_seed, difficulty)
        if self._kept is None or self._kept.scene is not scene:
            self.close()
            steering = Steering() if self._planner is None else Steering(planner=self._planner)
            self._kept = SimulatedRobot(scene, self.config.simulated_robot, self._models, steering)
        return self._kept


def _truth(readings: SensorReadings) -> VehicleState:
    """Return the true state, which a simulation always gives."""
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    return readings.truth


def stage_config(stage: str) -> OffroadConfig:
    """Return the environment of one of the paper's stages: ``Maze2D``, ``Maze3D`` or ``Natural``.

    Training drives the kinematic plant; published results are those of bullet. The first stage has
    no sensors but its beams: it drives by the true pose with correlated errors (assumption).

    Raises:
        ValueError: If there is no such stage.
    """
    # Without rollouts in training a plan a second is enough.
    simulated_robot = SimulatedRobotConfig(
        plant="kinematic", local_planner=LocalPlannerConfig(replan_every=10)
    )
    if stage == "Maze2D":
        sensing = SensingConfig(scanner="horizontal", proprioception=None)
        flat = simulated_robot.model_copy(update={"sensing": sensing, "localizer": "truth"})
        return OffroadConfig(
            preset="maze", simulated_robot=flat, terminations=TerminationConfig(time_limit=180.0)
        )
    if stage == "Maze3D":
        return OffroadConfig(
            preset="maze",
            simulated_robot=simulated_robot,
            terminations=TerminationConfig(time_limit=180.0),
        )
    if stage == "Natural":
        return OffroadConfig(
            preset="natural",
            seeds=TRAINING_SEEDS[:48],  # A natural world takes a second.
            simulated_robot=simulated_robot,
            terminations=TerminationConfig(time_limit=300.0),
        )
    raise ValueError(f"stage: expected Maze2D, Maze3D or Natural, got {stage!r}")


def make_offroad(
    stage: str,
    config: OffroadConfig | None = None,
    models: Models | None = None,
    scenes: SceneCache | None = None,
    render_mode: str | None = None,
) -> OffroadEnv:
    """Make a stage's environment: the entry point of the registered ids.

    Args:
        stage: ``Maze2D``, ``Maze3D`` or ``Natural``.
        config: Instead of the stage's own.
        models: Classifiers and policy; None for the shipped ones.
        scenes: Scenes to share with other environments of this process.
        render_mode: ``rgb_array`` or None.
    """
    return OffroadEnv(config or stage_config(stage), models, scenes, render_mode)
