"""Controllers off-road in pairs: each against the first, in the same worlds with the same noise."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.offroad_table import TRIALS
from andabata.evaluation.table import (
    Row,
    Sample,
    Table,
    bootstrap_difference,
    by_contender,
    mcnemar_test,
    share_difference,
)
from andabata.evaluation.trial import OffroadAttempt


def has_all(attempt: OffroadAttempt) -> bool:
    """Return True for an attempt that reached the last goal of its trial."""
    return attempt.is_success and attempt.detail.goal == attempt.detail.goals


def controller_differences(
    attempts: Sequence[OffroadAttempt], controllers: Sequence[str]
) -> list[Row]:
    """Return how each controller differs from the first one, over all worlds, ready for JSON.

    A trial, which has a world of its own, is a pair. It counts as a success if it reached all of
    its goals in a row; its SPL is the mean over its goals, 0 for those that it did not reach. Times
    are compared in the trials alone that both have finished, since a failure ends early. Intervals
    are of 95 %: of the share after Agresti and Min, of SPL and time by resampled worlds.

    Args:
        attempts: Attempts of all trials.
        controllers: Names of the controllers, the one that others are compared with first.

    Raises:
        ValueError: If two of them did not drive the same trials.
    """
    driven = [each for each in attempts if each.contender in controllers]
    spl, time = _totals(driven, _spl_share), _totals(driven, lambda each: each.time)
    comparators = (
        _head,
        share_difference("difference", has_all),
        mcnemar_test("mcnemar", has_all),
        bootstrap_difference("spl_difference", spl),
        _of_both(bootstrap_difference("time_difference_s", time)),
    )
    return Table(by_contender, TRIALS, (), comparators).differences(driven)


def _head(base: Sample, other: Sample) -> Row:
    """Return what is compared, and both counts."""
    return {
        "controller": other.attempts[0].contender,
        "against": base.attempts[0].contender,
        "trials": len(other.clusters),
        "successes": other.count(has_all),
        "successes_against": base.count(has_all),
    }


def _totals(
    attempts: Sequence[OffroadAttempt], measure: Callable[[OffroadAttempt], float]
) -> Callable[[Attempt[Any]], float]:
    """Return the measure of an attempt's whole trial: the sum over its goals."""
    totals: dict[Hashable, float] = {}
    for attempt in attempts:
        key = attempt.contender, attempt.repetition
        totals[key] = totals.get(key, 0.0) + measure(attempt)
    return lambda attempt: totals[attempt.contender, attempt.repetition]


def _spl_share(attempt: OffroadAttempt) -> float:
    """Return the part of an attempt in the SPL of its trial."""
    return attempt.spl / attempt.detail.goals


def _of_both(
    compare: Callable[[Sample, Sample], Row],
) -> Callable[[Sample, Sample], Row]:
    """Return a comparator over the trials that both have finished, with their number."""

    def comparator(base: Sample, other: Sample) -> Row:
        both = set.intersection(
            *({*map(_trial, filter(has_all, s.attempts))} for s in (base, other))
        )
        if not both:
            names = ("time_difference_s", "time_difference_s_low", "time_difference_s_high")
            return {"both": 0, **dict.fromkeys(names)}
        some = (
            Sample(tuple(each for each in sample.attempts if _trial(each) in both), sample.design)
            for sample in (base, other)
        )
        return {"both": len(both), **compare(*some)}

    return comparator


def _trial(attempt: Attempt[Any]) -> int:
    """Return the trial of an attempt."""
    return attempt.repetition
