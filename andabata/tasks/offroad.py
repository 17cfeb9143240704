"""Off-road navigation as Gymnasium environments (Sanchez et al. 2023, section 5)."""

import math
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine.sensor_readings import SensorReadings, VehicleState
from andabata.machine.simulator import SensingConfig
from andabata.models import Models
from andabata.navigation.navigator import STANDSTILL
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from andabata.tasks.rewards import RewardConfig, paper_reward
from rl.spaces import ObservationLayout, observation
from worlds.scenes import SceneCache
from worlds.splits import TRAINING_SEEDS
from worlds.world import choose_task, jittered


class OffroadConfig(BaseModel):
    """One stage's environment.

    Attributes:
        preset: World preset.
        seeds: World seeds that episodes draw from.
        difficulty: Difficulty of the worlds, or None for the preset's own.
        simulated_robot: The robot.
        heading: What the state's heading error refers to: the ``goal`` (paper), or the ``subgoal``
            of the robot's local map.
        terminations: When an episode ends.
        reward: The reward's constants.
        start_jitter: Start positions vary uniformly by up to this [m] in x and in y.
        heading_jitter: Start headings vary uniformly by up to this [rad].
        look_every: Control steps between two looks at the virtual scan. In between the robot feels
            where it is and sees what it saw last: who holds an action as long needs no more.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: str = "natural"
    seeds: tuple[int, ...] = TRAINING_SEEDS
    difficulty: float | None = Field(default=None, ge=0, le=1)
    simulated_robot: SimulatedRobotConfig = Field(default_factory=SimulatedRobotConfig)
    heading: Literal["goal", "subgoal"] = "subgoal"
    terminations: TerminationConfig = Field(default_factory=TerminationConfig)
    reward: RewardConfig = Field(default_factory=RewardConfig)
    start_jitter: float = Field(default=0.2, ge=0, le=5)
    heading_jitter: float = Field(default=0.3, ge=0, le=np.pi)
    look_every: int = Field(default=1, ge=1)


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
    | 34 | heading error to the goal, or to the local map's sub-goal | -pi to pi rad |

    ## Reward
    The sum of the named terms in ``info["reward_terms"]`` (``andabata.tasks.rewards``):
    attraction, repulsion and the terminal penalties. What attracts is the goal, or the sub-goal
    that the robot headed for before the step: its own map says how far that is.

    ## Start and end
    A world is drawn from the pool of seeds and a task from the world. An episode terminates at the
    goal (d < 1 m), on physical contact, on tip-over and when stuck, and is truncated at the time
    limit. The last step's info holds ``is_success`` and ``outcome``.

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
            config: The stage.
            models: Classifiers of cells and squares; None for the shipped ones.
            scenes: Scenes to share with other environments of this process.
            render_mode: None, the only one: pictures are drawn from records.
        """
        self.render_mode = render_mode
        self.config = config
        self._scenes = scenes or SceneCache()
        self._models = models or Models()
        self._kept: SimulatedRobot | None = None
        self._limit = config.simulated_robot.robot.max_steering
        self._map: LocalPlanner | None = None
        if config.heading == "subgoal":
            simulated_robot, ground_classifier = (
                config.simulated_robot,
                self._models.ground_classifier,
            )
            local_planner = simulated_robot.local_planner.looking_every(config.look_every)
            self._map = LocalPlanner(
                simulated_robot.grid,
                local_planner,
                simulated_robot.robot,
                ground_classifier=ground_classifier,
            )
        self.observation_space, self.action_space = offroad_spaces(config)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Put the robot down in a world of the pool and wait for the first scan."""
        super().reset(seed=seed)
        options = options or {}
        world_seed = int(options.get("world_seed", self.np_random.choice(self.config.seeds)))
        simulated_robot = self._robot_in(
            world_seed, options.get("difficulty", self.config.difficulty)
        )
        task = choose_task(simulated_robot.scene.world.tasks, options.get("task", self.np_random))
        goal = np.array(task.goals[0])
        config = self.config
        start = jittered(task.start, self.np_random, config.start_jitter, config.heading_jitter)
        readings = simulated_robot.place(start, goal, self.np_random)
        self._monitor = EpisodeMonitor(simulated_robot.scene.world, self.config.terminations)
        self._monitor.begin(_truth(readings), goal)
        navigator = simulated_robot.navigator
        navigator.listen(readings)
        while navigator.look(readings) is None:
            readings = simulated_robot.simulator.step(STANDSTILL)
            navigator.listen(readings)
        self._goal_distance = self._monitor.goal_distance(_truth(readings))
        self._place = simulated_robot.localizer.odometry.position[:2]
        if self._map is not None:
            self._map.reset()
        self._steps = 0
        self._look(readings)
        return self._state, {"world_seed": world_seed}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Steer for one control period of 0.1 s."""
        wheels = self._simulated_robot.navigator.command(float(action[0]) * self._limit)
        readings = self._simulated_robot.simulator.step(wheels)
        self._simulated_robot.navigator.listen(readings)
        outcome = self._monitor.watch(_truth(readings))
        before, distance = self._nearer(_truth(readings))
        self._steps += 1
        if self._steps % self.config.look_every == 0:
            self._look(readings)
        terms = paper_reward(self.config.reward, self._ranges, before, distance, outcome)
        info: dict[str, Any] = {"reward_terms": terms}
        if outcome is not None:
            info |= {"is_success": outcome is Outcome.GOAL, "outcome": str(outcome)}
        truncated = outcome is Outcome.TIMEOUT
        terminated = outcome is not None and not truncated
        return self._state, float(sum(terms.values())), terminated, truncated, info

    def _look(self, readings: SensorReadings) -> None:
        """Renew the ranges that repel and the policy's state."""
        view = self._simulated_robot.navigator.look(readings)
        if view is None:
            raise ValueError("view: expected a scan after the first one, got None")
        self._ranges = view.scan.finite()
        seen = view if self._map is None else self._map.guide(view)
        self._state = observation(seen.scan.finite(), seen.previous_steering, seen.heading_error)

    def _nearer(self, truth: VehicleState) -> tuple[float, float]:
        """Return the distances before and after the step to what attracts [m]."""
        if self._map is None:
            before, self._goal_distance = self._goal_distance, self._monitor.goal_distance(truth)
            return before, self._goal_distance
        here, target = self._simulated_robot.localizer.odometry.position[:2], self._map.target
        before, self._place = math.dist(self._place, target), here
        return before, math.dist(here, target)

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
        scene = self._scenes.get(self.config.preset, world_seed, difficulty)
        if self._kept is None or self._kept.scene is not scene:
            self.close()
            sees = self.config.simulated_robot.sensing.scanner == "rotating"
            self._kept = SimulatedRobot(
                scene, self.config.simulated_robot, self._models.forest if sees else None
            )
        return self._kept


def offroad_spaces(config: OffroadConfig) -> tuple[gym.spaces.Space[Any], gym.spaces.Space[Any]]:
    """Return the spaces of states and actions; see ``OffroadEnv``."""
    layout = ObservationLayout(config.simulated_robot.grid.n_sectors)
    low, high = layout.bounds(
        config.simulated_robot.grid.outer_radius, config.simulated_robot.robot.max_steering
    )
    actions = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
    return gym.spaces.Box(low, high, dtype=np.float32), actions


def _truth(readings: SensorReadings) -> VehicleState:
    """Return the true state, which a simulation always gives."""
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    return readings.truth


def stage_config(stage: str) -> OffroadConfig:
    """Return the environment of one of the paper's stages: ``Maze2D``, ``Maze3D`` or ``Natural``.

    Training drives the kinematic plant; results are judged in bullet. The first stage has no senses
    but its beams: it drives by the true pose with wandering errors (assumption).

    Raises:
        ValueError: If there is no such stage.
    """
    # Nobody rolls out ways while training, so that a plan a second is enough.
    simulated_robot = SimulatedRobotConfig(
        plant="kinematic", local_planner=LocalPlannerConfig(plan_every=10)
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
        models: As for ``OffroadEnv``.
        scenes: As for ``OffroadEnv``.
        render_mode: As for ``OffroadEnv``.
    """
    return OffroadEnv(config or stage_config(stage), models, scenes, render_mode)
