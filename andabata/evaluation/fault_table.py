"""What faults of senses cost: trials with each alone and without it, in pairs, and the response."""

from collections import Counter
from collections.abc import Hashable, Sequence

import numpy as np

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.offroad_pairs import has_all
from andabata.evaluation.offroad_table import TRIALS
from andabata.evaluation.perturbation import Arm
from andabata.evaluation.table import (
    Row,
    Sample,
    Table,
    by_contender,
    mcnemar_test,
    row_of,
    share_difference,
)
from andabata.evaluation.trial import OffroadAttempt, OffroadMeasures
from andabata.navigation.fault_watch import FaultResponse

SOON = 2.0
"""Time within which a fault should be flagged [s]."""


def fault_rows(attempts: Sequence[OffroadAttempt], driven: Sequence[Arm]) -> list[Row]:
    """Return what each fault costs each controller, over all worlds, ready for JSON.

    The first row of a controller is the robot without a fault, watched from the first onset on;
    ``fault`` is empty and its differences are None. A trial counts as a success if it reached all
    of its goals in a row. All that follows ``faulty`` counts trials that went on beyond the onset.

    Args:
        attempts: Attempts of all trials; those with disturbances are passed over.
        driven: Arms that drove them.

    Raises:
        ValueError: If two arms did not drive the same trials.
    """
    by_name = {arm.name: arm for arm in driven if arm.fault is not None or arm.is_base}
    chosen = [attempt for attempt in attempts if attempt.contender in by_name]

    def controller(attempt: Attempt[OffroadMeasures]) -> Hashable:
        return by_name[attempt.contender].controller

    def head(sample: Sample) -> Row:
        arm = by_name[sample.attempts[0].contender]
        fault = arm.fault
        return {
            "controller": arm.controller,
            "fault": "" if fault is None else str(fault),
            "sense": None if fault is None else fault.sense,
            "kind": None if fault is None else fault.kind,
            "onset_s": None if fault is None else fault.onset,
        }

    comparators = (share_difference("difference", has_all), mcnemar_test("mcnemar", has_all))
    table = Table(by_contender, TRIALS, (head, _ends, _responses), comparators, controller)
    differences = dict(
        zip(
            (other.attempts[0].contender for _, other in table.pairs(chosen)),
            table.differences(chosen),
            strict=True,
        )
    )
    none = dict.fromkeys(next(iter(differences.values()), {}))
    return [
        row_of(table.columns, sample) | differences.get(sample.attempts[0].contender, none)
        for sample in table.samples(chosen)
    ]


def _ends(sample: Sample) -> Row:
    """Return the number of trials and of those that reached all of their goals."""
    return {"trials": len(sample.clusters), "successes": sample.count(has_all)}


def _responses(sample: Sample) -> Row:
    """Return what the robot's health said, what it commanded, and what it touched."""
    last = [each for each in sample.attempts if each.detail.response is not None]
    faulty = [each for each in last if each.detail.response.was_faulty]
    responses: list[FaultResponse] = [each.detail.response for each in faulty]
    flags = [each.flagged_after_s for each in responses if each.flagged_after_s is not None]
    errors = [each.detail.position_error for each in faulty]
    return {
        "faulty": len(responses),
        "flagged": len(flags),
        "flagged_within_2_s": sum(each.is_flagged_within(SOON) for each in responses),
        "flagged_after_s": float(np.median(flags)) if flags else None,
        "contacts": sum(each.contact_after_s is not None for each in responses),
        "contacts_after_flag": sum(each.has_contact_after_flag for each in responses),
        "bad_commands": sum(each.bad_commands for each in responses),
        "health_at_end": dict(Counter(each.health_at_end for each in responses)),
        "position_error_m": float(np.mean(errors)) if errors else None,
    }
