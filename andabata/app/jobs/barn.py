"""Evaluation by the rules of the BARN benchmark, as a command runs it."""

from collections.abc import Sequence
from typing import Any

from andabata.app.jobs.evaluation import Evaluation
from andabata.app.options.evaluation import (
    BarnEvaluationOptions,
    RoomPolicyOptions,
    TrialOptions,
)
from andabata.app.run_kinds import BARN, EvaluationRequest
from andabata.engine import Engine
from andabata.evaluation.barn import BarnComparison, BarnEvaluationConfig, world_notes
from andabata.evaluation.barn_table import BARN_TABLE, BarnAttempt, barn_failures

_ABOUT = "light simulator: no place in a competition"


def barn_evaluation(request: EvaluationRequest) -> Evaluation:
    """Return the evaluation of navigators in fields of cylinders.

    Args:
        request: Worlds, controllers and trials.

    Raises:
        UsageError: If a value of an option is none.
        BarnFileError: If a folder of worlds is not as the benchmark has it.
    """
    given = request.given
    driven, policies = given(TrialOptions), given(RoomPolicyOptions).policy
    base = given(BarnEvaluationOptions).base(request.seed, driven, policies)
    config = request.settings.resolve(BarnEvaluationConfig, base)

    def tabulate(runs: Sequence[BarnAttempt], _: Engine) -> dict[str, Any]:
        return {
            "rows": BARN_TABLE.rows(runs),
            "differences": BARN_TABLE.differences(runs),
            "failures": barn_failures(runs),
            "worlds": config.worlds,
            "about": _ABOUT,
            "official": config.official,
            "notes": world_notes(config),
        }

    comparison, about = BarnComparison(config), {"task": BARN}
    return Evaluation("evaluate", config, config.seed, comparison, tabulate, about)
