"""Labels of a teacher that knows the true map: prices of all actions in each state of drives.

A drive is steered by turns of the teacher and of a student that sees the robot's map alone; every
decision is labelled, whoever makes it.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose
from andabata.machine.reality import level
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import Models
from andabata.navigation.controller import ControllerInput, Steering
from andabata.navigation.map_observation import (
    action_table,
    goal_in_robot,
    map_observations,
)
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.policy_controller import PolicyController, observation_of
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from andabata.training.action_prices import ActionPrices, ActionPricesConfig
from rl.policy import policy_from_bytes
from rl.spaces import ObservationSpec
from worlds.scenes import SceneCache
from worlds.world import choose_task, jittered

DECISION_STEPS = 5
"""Number of control steps between two decisions."""

DECISION_TIME = DECISION_STEPS * CONTROL_PERIOD
"""Time between two decisions [s]."""

_BELIEVED_WITHIN = 10.0
"""Distance from the goal within which the teacher heads for where the robot believes it [m]."""

_MOVED = 0.2
"""Distance by which it has to have moved for the teacher to head for it anew [m]."""


def student_robot() -> SimulatedRobotConfig:
    """Return the robot that students learn on: the whole chain with the plant of training."""
    return SimulatedRobotConfig(plant="kinematic", reality=level("field"))


class MapLabelsConfig(BaseModel):
    """Settings of drives that are labelled.

    Attributes:
        simulated_robot: Robot.
        teacher: Settings of the prices.
        has_subgoal: True to show the student the planner's sub-goal.
        presets: World presets, one drawn for each drive.
        difficulty: Least and largest difficulty of the worlds.
        first_seed: Seed of the first world; each drive has the next one.
        goals: Largest number of goals of a drive.
        heading_jitter: Largest uniform turn of the start's heading [rad].
        random_share: Share of the decisions that are drawn at random.
        switch_time: Mean time for which one of the two steers [s].
        terminations: Rules that end a drive to a goal; the radius is large, so that an estimate
            that is off ends no drive.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    simulated_robot: SimulatedRobotConfig = Field(default_factory=student_robot)
    teacher: ActionPricesConfig = Field(default_factory=ActionPricesConfig)
    has_subgoal: bool = True
    presets: tuple[str, ...] = Field(default=("natural", "natural-test", "natural-far"))
    difficulty: tuple[float, float] = (0.2, 1.0)
    first_seed: int = Field(default=8_000, ge=0)
    goals: int = Field(default=3, ge=1)
    heading_jitter: float = Field(default=np.pi, ge=0, le=np.pi)
    random_share: float = Field(default=0.1, ge=0, le=1)
    switch_time: float = Field(default=10.0, gt=0)
    terminations: TerminationConfig = Field(
        default_factory=partial(TerminationConfig, time_limit=200.0, goal_radius=2.5)
    )

    @property
    def observations(self) -> ObservationSpec:
        """Space of the student's observations."""
        return map_observations(self.simulated_robot.robot, self.has_subgoal)


class MapLabels(NamedTuple):
    """States with the prices of all actions in them.

    Attributes:
        observations: Observations; crops, which are most of them, as float16, shape (n, size).
        prices: Price of each action [s], float32, shape (n, a).
    """

    observations: NDArray[np.float16]
    prices: NDArray[np.float32]


class DriveSummary(NamedTuple):
    """What a labelled drive came to.

    Attributes:
        labels: Labelled decisions.
        outcomes: Outcome of each goal that was tried.
    """

    labels: MapLabels
    outcomes: tuple[str, ...]


class LabelledController:
    """Steers by turns of the teacher and of a student, and keeps every decision's label.

    Attributes:
        observations: Observation of each decision.
        prices: Prices of all actions in each decision [s].
    """

    def __init__(
        self,
        config: MapLabelsConfig,
        teacher: ActionPrices,
        student: PolicyController | None,
        teacher_share: float,
        rng: np.random.Generator,
    ) -> None:
        """Prepare a drive.

        Args:
            config: Settings.
            teacher: Prices of the actions.
            student: Student, None while there is none.
            teacher_share: Share of the time that the teacher steers.
            rng: Source of chance.
        """
        self._config, self._teacher, self._student = config, teacher, student
        self._share, self._rng = teacher_share, rng
        self._spec = config.observations
        self._table = action_table(config.simulated_robot.robot)
        self._is_teacher = True
        self._goal = self._heads_for = np.full(2, np.inf)
        self.observations: list[NDArray[np.float16]] = []
        self.prices: list[NDArray[np.float32]] = []

    def reset(self) -> None:
        """Begin a drive."""
        self._is_teacher = self._rng.random() < self._share
        if self._student is not None:
            self._student.reset()

    def act(self, situation: ControllerInput) -> Twist:
        """Return the command of whoever steers, and keep what the teacher says.

        Raises:
            ValueError: If the situation holds no true state.
        """
        if situation.truth is None:
            raise ValueError("truth: expected the true state (simulation only), got none")
        truth = situation.truth
        self._teacher.head_for(self._teachers_goal(situation, truth.pose))
        speed, rate = situation.previous_speed, situation.previous_steering[0]
        prices = self._teacher.prices(truth.pose.position[:2], truth.pose.yaw, speed, rate)
        self.observations.append(observation_of(self._spec, situation).astype(np.float16))
        self.prices.append(prices.astype(np.float32))
        switch = DECISION_TIME / self._config.switch_time
        if self._rng.random() < switch:
            self._is_teacher = self._rng.random() < self._share
        if self._rng.random() < self._config.random_share:
            return Twist(*self._table[self._rng.integers(len(self._table))].tolist())
        if self._student is not None and not self._is_teacher:
            return self._student.act(situation)
        return Twist(*self._table[int(np.argmin(prices))].tolist())

    def _teachers_goal(self, situation: ControllerInput, pose: Pose) -> NDArray[np.float64]:
        """Return where the teacher heads for in the map [m], shape (2,).

        Near the goal that is where the robot believes it, since the robot stops by its own
        estimate; the goal itself where that place is forbidden.
        """
        ahead, aside = goal_in_robot(situation).tolist()
        is_far = math.hypot(ahead, aside) > _BELIEVED_WITHIN
        if is_far or not np.array_equal(situation.goal, self._goal):
            self._goal = self._heads_for = situation.goal
        if is_far:
            return self._heads_for
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        believed = pose.position[:2] + np.array([c * ahead - s * aside, s * ahead + c * aside])
        has_moved = np.hypot(*(believed - self._heads_for)) > _MOVED
        if has_moved and self._teacher.truth.at(*believed.tolist())[1] > 0.0:
            self._heads_for = believed
        return self._heads_for

    def labels(self) -> MapLabels:
        """Return all labels so far."""
        table = len(self._table)
        return MapLabels(
            np.array(self.observations, dtype=np.float16).reshape(-1, self._spec.size),
            np.array(self.prices, dtype=np.float32).reshape(-1, table),
        )


def drive_and_label(
    config: MapLabelsConfig,
    seed: int,
    student: bytes | None,
    teacher_share: float,
    number: int,
    models: Models | None = None,
) -> DriveSummary:
    """Return the labels of one drive, and what it came to.

    Args:
        config: Settings.
        seed: Seed of all drives.
        student: File of the policy that steers by turns, None while there is none.
        teacher_share: Share of the time that the teacher steers.
        number: Number of the drive, from which its world and its noise are drawn.
        models: Classifiers; None for the shipped ones.
    """
    rng = np.random.default_rng([seed, number])
    noise, turns, draw = rng.spawn(3)
    preset = config.presets[int(draw.integers(len(config.presets)))]
    difficulty = float(draw.uniform(*config.difficulty))
    robot = config.simulated_robot
    scene = SceneCache().get(preset, config.first_seed + number, difficulty)
    task = choose_task(scene.world.tasks, draw)
    teacher = ActionPrices(
        scene.world.truth,
        robot.robot,
        action_table(robot.robot),
        config.teacher,
    )
    policy = None
    if student is not None:
        policy = PolicyController(policy_from_bytes(student), robot.robot.speed)
    controller = LabelledController(config, teacher, policy, teacher_share, turns)
    planner = LocalPlanner(robot.grid, robot.local_planner.decimated(DECISION_STEPS), robot.robot)
    steering = Steering(controller, planner, DECISION_STEPS)
    simulated = SimulatedRobot(scene, robot, models or Models(), steering)
    start = jittered(task.start, draw, turn=config.heading_jitter)
    readings = simulated.place(start, np.array(task.goals[0]), noise)
    goals = [np.array(goal) for goal in task.goals[: config.goals]]
    outcomes = _drive(simulated, readings, goals, config.terminations)
    simulated.close()
    return DriveSummary(controller.labels(), outcomes)


def _drive(
    robot: SimulatedRobot,
    readings: SensorReadings,
    goals: list[NDArray[np.float64]],
    terminations: TerminationConfig,
) -> tuple[str, ...]:
    """Drive to goals in a row until one is not reached, and return the outcome of each."""
    monitor = EpisodeMonitor(robot.scene.world, terminations)
    outcomes: list[str] = []
    for goal in goals:
        assert readings.truth is not None
        monitor.begin(readings.truth, goal)
        robot.navigator.set_goal(goal)
        outcome: Outcome | None = None
        while outcome is None:
            readings = robot.step(readings)
            assert readings.truth is not None
            outcome = monitor.update(readings.truth, robot.navigator.has_arrived)
        outcomes.append(str(outcome))
        if outcome is not Outcome.GOAL:
            break
    return tuple(outcomes)
