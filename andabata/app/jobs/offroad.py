"""Evaluation off-road, as a command runs it."""

from collections.abc import Sequence
from typing import Any

from andabata.app.jobs.evaluation import Evaluation
from andabata.app.options.evaluation import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    TrialOptions,
)
from andabata.app.options.shared import RobotOptions
from andabata.app.run_kinds import OFFROAD, EvaluationRequest
from andabata.engine import Engine
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.evaluation.offroad_table import failure_causes, summarise
from andabata.evaluation.perturbation import perturbation_rows
from andabata.evaluation.trial import OffroadAttempt
from andabata.report.plots.drives import failure_picture


def offroad_evaluation(request: EvaluationRequest) -> Evaluation:
    """Return the evaluation of controllers off-road, with pictures of failures in its folder.

    Args:
        request: Worlds, trials, controllers and models.

    Raises:
        UsageError: If a value of an option is none.
    """
    given = request.given
    robot, driven = given(RobotOptions).base(), given(TrialOptions)
    base = given(OffroadEvaluationOptions).base(robot, request.seed, driven)
    config = request.settings.resolve(EvaluationConfig, base)
    models, reality = given(EvaluationModelOptions).load(), config.simulated_robot.reality.name

    def tabulate(attempts: Sequence[OffroadAttempt], _: Engine) -> dict[str, Any]:
        rows = summarise(attempts, [arm.name for arm in config.arms])
        data: dict[str, Any] = {
            "rows": rows,
            "failures": failure_causes(attempts),
            "reality": reality,
            "success_within": {
                "radius_m": config.terminations.goal_radius,
                "tolerance_m": config.tolerance,
            },
        }
        if config.perturb:
            data["perturbations"] = perturbation_rows(attempts, config.arms)
        return data

    draw = failure_picture if request.has_folder else None
    comparison = OffroadComparison.of(config, models, draw)
    about = {"task": OFFROAD, "reality": reality}
    return Evaluation("evaluate", config, request.seed, comparison, tabulate, about)
