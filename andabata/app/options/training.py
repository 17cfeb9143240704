"""Group of options of ``andabata train``; see ``shared``."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.app.options.shared import RobotOptions, SettingsOptions, reality_level

if TYPE_CHECKING:
    from andabata.training.plans import TrainingPlan


@dataclass(frozen=True)
class TrainingOptions:
    """What is trained and how a run goes on.

    Options: ``--stages``, ``--resume``, ``--algorithm``, ``--k``, ``--reward``, ``--changed``,
    ``--seeds``, ``--tensorboard``.
    """

    stages: Annotated[
        str | None, typer.Option(help="Stages to run, as 1 or 1-3; all by default.")
    ] = None
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False
    algorithm: Annotated[
        str | None,
        typer.Option(
            "--algorithm",
            "--variant",
            metavar="NAME",
            help="Plan of the task. Off-road sac, the default, paper, the paper's scheme, "
            "actor-critic, the same on many worlds, or sac-points; spn: sac, sac-paper, sac-1d or "
            "td3; td3: td3, td3-improved, td3-improved-scaled, gdae or gdae-trainable.",
        ),
    ] = None
    k: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number K of features of an actor on points: learner.actor.features."
        ),
    ] = None
    reward: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.py:NAME",
            help="Function of your own that gives the terms of the off-road reward.",
        ),
    ] = None
    changed: Annotated[
        bool, typer.Option("--changed", help="Resume even with other code or classifier.")
    ] = False
    seeds: Annotated[
        int,
        typer.Option(
            min=1, help="Number of runs, from --seed on, each in a folder of its own in --out."
        ),
    ] = 1
    tensorboard: Annotated[
        bool,
        typer.Option(
            "--tensorboard", help="Write TensorBoard's event files into the folder of each run."
        ),
    ] = False

    def plan(self, task: str, robot: RobotOptions, settings: SettingsOptions) -> "TrainingPlan":
        """Return the plan of a task, with the settings that were given.

        Raises:
            UsageError: If there is no such plan, setting, or actor on points.
            OwnCodeError: If a reward of the user's own cannot be used.
        """
        from andabata.app.jobs.training import with_features, with_reward
        from andabata.training.plans import TrainingPlan, load_plan

        level = reality_level(robot.reality)
        base = load_plan(self.algorithm, robot.sensor, robot.robot, task, level)
        changed = with_reward(with_features(base, self.k), self.reward)
        return settings.resolve(TrainingPlan, changed)

    def chosen(self, plan: "TrainingPlan") -> range:
        """Return the indices of the stages to run, from 0.

        Raises:
            UsageError: If they are none of the plan's.
        """
        from andabata.configuration.usage import span

        count = len(plan.stages)
        return range(count) if self.stages is None else span(self.stages, count, "--stages")
