"""Training plans as data: ``plans/*.toml``, one for each algorithm (section 5)."""

import tomllib
from importlib.resources import files
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.lidar_models import sensor_settings
from andabata.machine.robot import RobotModel
from andabata.tasks.offroad import (
    OffroadConfig,
    offroad_actions,
    offroad_observations,
    stage_config,
)
from andabata.tasks.registration import STAGES
from rl.curriculum_config import CurriculumConfig, Stage
from rl.learners import LearnerConfig
from worlds.splits import VALIDATION_SEEDS


class StagePlan(Stage):
    """A stage with its environment.

    Attributes:
        environment: World family, sensors, plant, reward and time limit.
    """

    environment: OffroadConfig

    @property
    def unseen(self) -> OffroadConfig:
        """The same in the worlds that are kept for validation."""
        return self.environment.model_copy(update={"seeds": VALIDATION_SEEDS})


class TrainingPlan(BaseModel):
    """Settings of ``andabata train``.

    Attributes:
        learner: Settings of the learner.
        final_lr_scale: Share of the learning rate at the end; see ``CurriculumConfig``.
        validation: Number of validation episodes; see ``CurriculumConfig``.
        validate_every: Number of iterations between validations; see ``CurriculumConfig``.
        stages: Stages by name, in their order.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    learner: LearnerConfig
    final_lr_scale: float = Field(default=0.2, gt=0, le=1)
    validation: int = Field(default=0, ge=0)
    validate_every: int = Field(default=0, ge=0)
    stages: dict[str, StagePlan]

    @model_validator(mode="after")
    def _check_decimation(self) -> Self:
        """Refuse decisions on scans of earlier decisions."""
        for name, stage in self.stages.items():
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
            observations=offroad_observations(plans[0].environment),
            actions=offroad_actions(plans[0].environment),
            final_lr_scale=self.final_lr_scale,
            validation=self.validation,
            validate_every=self.validate_every,
        )


def algorithms() -> tuple[str, ...]:
    """Return the names of the plans."""
    folder = files("andabata.training").joinpath("plans")
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir()))


def load_plan(
    algorithm: str = "sac", sensor: str = "utm-30lx", robot: str = "andabata"
) -> TrainingPlan:
    """Return the plan of an algorithm, with a laser and a body; stage 1 keeps its 32 beams.

    Raises:
        ValueError: If there is no algorithm or body of that name.
        UnknownSensorError: If there is no laser of that name.
    """
    if algorithm not in algorithms():
        raise ValueError(f"--algorithm: expected {', '.join(algorithms())}, got {algorithm!r}")
    text = files("andabata.training").joinpath("plans", f"{algorithm}.toml").read_text()
    data = tomllib.loads(text)
    settings, body = sensor_settings(sensor), {"robot": RobotModel.load(robot)}
    stages = {}
    for name in STAGES:
        rules = dict(data["stages"][name])
        environment = _environment(name, rules.pop("environment", {}), settings | body)
        stages[name] = StagePlan(name=name, environment=environment, **rules)
    return TrainingPlan(**{**data, "stages": stages})


def _environment(stage: str, changes: dict[str, Any], parts: dict[str, Any]) -> OffroadConfig:
    """Return a stage's environment with a plan's changes and a robot's parts."""
    base = stage_config(stage)
    flat = base.simulated_robot.sensing.scanner == "horizontal"
    fitting = {"robot": parts["robot"]} if flat else parts
    simulated_robot = SimulatedRobotConfig.model_validate(
        {**base.simulated_robot.model_dump(), **fitting}
    )
    data = base.model_copy(update={"simulated_robot": simulated_robot}).model_dump()
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return OffroadConfig.model_validate(data)
