"""Evaluation off-road, as a command runs it."""

from collections.abc import Sequence
from typing import Any

from andabata.app.evaluation_run import Evaluation
from andabata.app.plots.drives import failure_picture
from andabata.engine import Engine
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.evaluation.offroad_table import failure_causes, summarise
from andabata.evaluation.trial import OffroadAttempt
from andabata.models import Models


def offroad_evaluation(
    config: EvaluationConfig, models: Models, seed: int, has_pictures: bool
) -> Evaluation:
    """Return the evaluation of controllers off-road.

    Args:
        config: Worlds, trials and controllers.
        models: Classifiers and policy.
        seed: Seed of the command.
        has_pictures: True to draw failures, for a folder.
    """

    def tabulate(attempts: Sequence[OffroadAttempt], _: Engine) -> dict[str, Any]:
        rows = summarise(attempts, config.controllers)
        return {"rows": rows, "failures": failure_causes(attempts)}

    draw = failure_picture if has_pictures else None
    comparison = OffroadComparison.of(config, models, draw)
    return Evaluation("evaluate", config, seed, comparison, tabulate, {"task": "offroad"})
