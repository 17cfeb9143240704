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
    models = given(EvaluationModelOptions).load()

    def tabulate(attempts: Sequence[OffroadAttempt], _: Engine) -> dict[str, Any]:
        rows = summarise(attempts, config.controllers)
        return {"rows": rows, "failures": failure_causes(attempts)}

    draw = failure_picture if request.has_folder else None
    comparison = OffroadComparison.of(config, models, draw)
    return Evaluation("evaluate", config, request.seed, comparison, tabulate, {"task": OFFROAD})
