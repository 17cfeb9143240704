"""Training plans as data: ``plans/TASK/ALGORITHM.toml``."""

import tomllib
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.lidar_models import sensor_settings
from andabata.machine.reality import Reality
from andabata.machine.robot import RobotModel
from andabata.tasks.offroad import (
    OffroadConfig,
    stage_config,
)
from andabata.tasks.rooms.catalogue import ROOM_TASKS
from andabata.tasks.rooms.config import JudgingRoomError, RoomConfig, refuse_judging_rooms
from andabata.tasks.vector import TaskConfig
from rl.curriculum_config import CurriculumConfig, Stage
from rl.learners import LearnerConfig
from worlds.rooms.room import RoomTask

DEFAULTS = {"offroad": "sac", "spn": "sac", "td3": "td3"}
"""Name of the default plan of each task."""

TASKS = tuple(DEFAULTS)
"""Kinds of task that there are plans for."""


class StagePlan(Stage):
    """A stage with its environment.

    Attributes:
        environment: Worlds or rooms, sensors, plant, reward and time limit.
    """

    environment: Annotated[TaskConfig, Field(discriminator="task")]


class TrainingPlan(BaseModel):
    """Settings of ``andabata train``.

    Attributes:
        learner: Settings of the learner.
        final_lr_scale: Share of the learning rate at the end; see ``CurriculumConfig``.
        validation: Number of validation episodes; see ``CurriculumConfig``.
        validate_every: Number of iterations between validations; see ``CurriculumConfig``.
        collision_weight: Weight of collisions in validations; see ``CurriculumConfig``.
        validation_tolerance: Loss of score for a later policy; see ``CurriculumConfig``.
        test_every: Number of control steps between tests on fixed tasks, 0 for none; see
            ``CurriculumConfig``.
        checkpoint_every: Number of iterations between two checkpoints; the last one is always
            written.
        stages: Stages by name, in their order.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    learner: LearnerConfig
    final_lr_scale: float = Field(default=0.2, gt=0, le=1)
    validation: int = Field(default=0, ge=0)
    validate_every: int = Field(default=0, ge=0)
    collision_weight: float | None = Field(default=None, ge=1)
    validation_tolerance: float = Field(default=0.0, ge=0)
    test_every: int = Field(default=0, ge=0)
    checkpoint_every: int = Field(default=1, ge=1)
    stages: dict[str, StagePlan]

    @model_validator(mode="after")
    def _check_tests(self) -> Self:
        """Refuse tests of stages that have no fixed tasks."""
        last = list(self.stages.values())[-1].environment
        if self.test_every and not isinstance(last, RoomConfig):
            raise ValueError(f"test_every: expected 0 for the task {last.task}, got others")
        return self

    @model_validator(mode="after")
    def _check_rooms(self) -> Self:
        """Refuse stages in rooms that judge."""
        for name, stage in self.stages.items():
            if isinstance(stage.environment, RoomConfig):
                try:
                    refuse_judging_rooms(stage.environment)
                except JudgingRoomError as error:
                    raise ValueError(f"stages.{name}.environment.{error}") from error
        return self

    @model_validator(mode="after")
    def _check_driving_repeat(self) -> Self:
        """Refuse held actions where a policy drives in every step."""
        for environment in (stage.environment for stage in self.stages.values()):
            if self.learner.driving_repeat > 1 and isinstance(environment, RoomConfig):
                raise ValueError(
                    f"learner.driving_repeat: expected 1 for the task {environment.task}, whose "
                    f"robot decides in every step, got {self.learner.driving_repeat}; leave it out"
                )
        return self

    @model_validator(mode="after")
    def _check_decimation(self) -> Self:
        """Refuse decisions on scans of earlier decisions."""
        for name, stage in self.stages.items():
            if not isinstance(stage.environment, OffroadConfig):
                continue
            every = stage.environment.perception_decimation
            repeat = self.learner.action_repeat
            if repeat % every:
                raise ValueError(
                    f"stages.{name}.environment.perception_decimation: expected a divisor of "
                    f"learner.action_repeat, "
                    f"{repeat}, got {every}"
                )
        return self

    def curriculum(self, chosen: range, seed: int) -> CurriculumConfig:
        """Return the curriculum of some of the stages, by their indices."""
        plans = [list(self.stages.values())[k] for k in chosen]
        return CurriculumConfig(
            stages=tuple(
                Stage.model_validate(plan.model_dump(exclude={"environment"})) for plan in plans
            ),
            learner=self.learner,
            seed=seed,
            observations=plans[0].environment.observations,
            actions=plans[0].environment.actions,
            final_lr_scale=self.final_lr_scale,
            validation=self.validation,
            validate_every=self.validate_every,
            collision_weight=self.collision_weight,
            validation_tolerance=self.validation_tolerance,
            test_every=self.test_every,
            test_tasks=max(len(self.tested(chosen)), 1),
        )

    def tested(self, chosen: range) -> list[RoomTask]:
        """Return the fixed tasks that the last of some stages is tested on; none off-road."""
        environment = list(self.stages.values())[chosen[-1]].environment
        if not (self.test_every and isinstance(environment, RoomConfig)):
            return []
        return [task for _, task in environment.fixed_tasks]


def algorithms(task: str = "offroad") -> tuple[str, ...]:
    """Return the names of a task's plans, the default first.

    Raises:
        ValueError: If there is no such task.
    """
    if task not in TASKS:
        raise ValueError(f"--task: expected {', '.join(TASKS)}, got {task!r}")
    names = (entry.name.removesuffix(".toml") for entry in _plans(task).iterdir())
    # The default comes first: it is taken where no plan is named.
    return tuple(sorted(names, key=lambda name: (name != DEFAULTS[task], name)))


def load_plan(
    algorithm: str | None = None,
    sensor: str = "utm-30lx",
    robot: str = "andabata",
    task: str = "offroad",
    reality: Reality | None = None,
) -> TrainingPlan:
    """Return the plan of a task and an algorithm.

    Args:
        algorithm: Name of the plan; None for the task's default.
        sensor: Laser of off-road tasks; their stage 1 keeps its 32 beams.
        robot: Body of off-road tasks.
        task: Kind of task.
        reality: Reality of the robots of off-road tasks but stage 1, whose robot has no senses;
            None for the ideal one.

    Raises:
        ValueError: If there is no task, algorithm or body of that name.
        UnknownSensorError: If there is no laser of that name.
    """
    known = algorithms(task)
    name = known[0] if algorithm is None else algorithm
    if name not in known:
        raise ValueError(f"--algorithm: expected {', '.join(known)}, got {name!r}")
    data = tomllib.loads(_plans(task).joinpath(f"{name}.toml").read_text())
    parts = {**sensor_settings(sensor), "robot": RobotModel.load(robot)}
    parts["reality"] = reality or Reality()
    stages = {}
    for stage, rules in data["stages"].items():
        changes = rules.pop("environment", {})
        environment: TaskConfig
        if task == "offroad":
            environment = _offroad(stage, changes, parts)
        else:
            environment = ROOM_TASKS[task].model_validate(changes)
        stages[stage] = StagePlan(name=stage, environment=environment, **rules)
    return TrainingPlan(**{**data, "stages": stages})


def _plans(task: str) -> Traversable:
    """Return the folder of a task's plans."""
    return files("andabata.training").joinpath("plans", task)


def _offroad(stage: str, changes: dict[str, Any], parts: dict[str, Any]) -> OffroadConfig:
    """Return a stage's environment with a plan's changes and a robot's parts."""
    base = stage_config(stage)
    flat = base.simulated_robot.sensing.scanner == "horizontal"
    # Stage 1 has beams in the plane alone: laser and senses begin to count in stage 2.
    fitting = {"robot": parts["robot"]} if flat else parts
    simulated_robot = SimulatedRobotConfig.model_validate(
        {**base.simulated_robot.model_dump(), **fitting}
    )
    data = base.model_copy(update={"simulated_robot": simulated_robot}).model_dump()
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return OffroadConfig.model_validate(data)
