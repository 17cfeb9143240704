"""What faults of senses cost: trials with each alone and without it, in pairs, and the response."""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace

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
    hit_counts,
    mcnemar_test,
    row_of,
    share_difference,
)
from andabata.evaluation.trial import OffroadAttempt, OffroadMeasures
from andabata.navigation.fault_watch import FaultResponse

SOON = 2.0
"""Time within which a fault should be flagged [s]."""

_SAME_TIME = 0.05
"""Difference of two times that counts as none: half a control period [s]."""


def fault_rows(attempts: Sequence[OffroadAttempt], driven: Sequence[Arm]) -> list[Row]:
    """Return what each fault costs each controller, over all worlds, ready for JSON.

    The first row of a controller is the robot without a fault, watched from the first onset on;
    ``fault`` is empty and its differences are None. A trial counts as a success if it reached all
    of its goals in a row. All that follows ``faulty`` counts trials that went on beyond the onset.
    A flag that the robot without a fault has in the same trial at the same time is none of the
    fault's, and does not count in its row.

    Args:
        attempts: Attempts of all trials; those with disturbances are passed over.
        driven: Arms that drove them.

    Raises:
        ValueError: If two arms did not drive the same trials.
    """
    by_name = {arm.name: arm for arm in driven if arm.fault is not None or arm.is_base}
    chosen = _with_own_flags(
        [attempt for attempt in attempts if attempt.contender in by_name], by_name
    )

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


def _with_own_flags(
    attempts: Sequence[OffroadAttempt], by_name: Mapping[str, Arm]
) -> list[OffroadAttempt]:
    """Return the attempts, those of faults without flags that have another cause."""
    onset = min((arm.fault.onset for arm in by_name.values() if arm.fault is not None), default=0)
    flags = {
        (by_name[each.contender].controller, each.repetition): onset + flag
        for each in attempts
        if by_name[each.contender].is_base and (flag := _flag(each)) is not None
    }

    def own(attempt: OffroadAttempt) -> OffroadAttempt:
        arm, flag = by_name[attempt.contender], _flag(attempt)
        other = flags.get((arm.controller, attempt.repetition))
        if arm.fault is None or flag is None or other is None:
            return attempt
        if abs(arm.fault.onset + flag - other) > _SAME_TIME or attempt.detail.response is None:
            return attempt
        response = replace(attempt.detail.response, flagged_after_s=None)
        return replace(attempt, detail=replace(attempt.detail, response=response))

    return [own(attempt) for attempt in attempts]


def _flag(attempt: OffroadAttempt) -> float | None:
    """Return the time from the onset to the flag of a trial [s], None without any."""
    response = attempt.detail.response
    return None if response is None else response.flagged_after_s


def _ends(sample: Sample) -> Row:
    """Return the numbers of trials, of those that reached all of their goals, and who hit whom."""
    ends = {"trials": len(sample.clusters), "successes": sample.count(has_all)}
    return ends | hit_counts(sample)


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
