"""Evaluation by the rules of the BARN benchmark, as a command runs it."""

from collections.abc import Sequence
from typing import Any

from andabata.app.evaluation_run import Evaluation
from andabata.engine import Engine
from andabata.evaluation.barn import BarnComparison, BarnEvaluationConfig
from andabata.evaluation.barn_table import BARN_TABLE, BarnAttempt, barn_failures

_ABOUT = "light simulator: no place in a competition"


def barn_evaluation(config: BarnEvaluationConfig) -> Evaluation:
    """Return the evaluation of navigators in fields of cylinders.

    Args:
        config: Worlds, controllers and trials.
    """

    def tabulate(runs: Sequence[BarnAttempt], _: Engine) -> dict[str, Any]:
        return {
            "rows": BARN_TABLE.rows(runs),
            "differences": BARN_TABLE.differences(runs),
            "failures": barn_failures(runs),
            "worlds": config.worlds,
            "about": _ABOUT,
            "official": config.official,
        }

    comparison, about = BarnComparison(config), {"task": "barn"}
    return Evaluation("evaluate", config, config.seed, comparison, tabulate, about)
