"""Table of an evaluation off-road: goals in a row, by world and controller."""

from collections import Counter
from collections.abc import Mapping, Sequence

from andabata.evaluation.table import (
    Column,
    Design,
    Row,
    Sample,
    average,
    by_repetition,
    counts,
    hit_counts,
    row_of,
    share,
)
from andabata.evaluation.trial import OffroadAttempt, is_strict_success
from andabata.tasks.terminations import Outcome

TRIALS = Design(cluster=by_repetition, repeat=lambda _: None)
"""Each trial has a world of its own."""


def summarise(attempts: Sequence[OffroadAttempt], controllers: Sequence[str]) -> list[Row]:
    """Return the table: one row a world, controller and goal, and one for all goals in a row.

    A goal counts as tried in every trial, so that the figures are those of goals in a row
    (Sanchez et al. 2023, Table 4).

    Args:
        attempts: Attempts of all trials.
        controllers: Names of the controllers in the order of their rows.
    """
    rows: list[Row] = []
    for world in dict.fromkeys(attempt.scenario for attempt in attempts):
        there = [attempt for attempt in attempts if attempt.scenario == world]
        goals = max(attempt.detail.goals for attempt in there)
        for name in controllers:
            mine = tuple(attempt for attempt in there if attempt.contender == name)
            rows += [_goal_row(mine, goals, label) for label in (*range(1, goals + 1), "all")]
    return rows


def success_text(within: Mapping[str, float]) -> str:
    """Return in words how near a robot has to be when it declares a goal reached.

    Args:
        within: Radius of a goal ``radius_m``, and ``tolerance_m`` beyond it [m].
    """
    return (
        "success: the robot declares the goal reached when it is within "
        f"{within['radius_m']:.1f} m + {within['tolerance_m']:.2f} m of it in truth"
    )


def failure_causes(attempts: Sequence[OffroadAttempt]) -> list[Row]:
    """Return the failures of each controller by cause: one row a world, outcome and cause."""
    counts = Counter(
        (attempt.scenario, attempt.contender, str(attempt.outcome), attempt.detail.cause)
        for attempt in attempts
        if not attempt.is_success
    )
    names = ("world", "controller", "outcome", "cause")
    return [dict(zip(names, key, strict=True)) | {"count": n} for key, n in counts.most_common()]


def _goal_row(trials: Sequence[OffroadAttempt], goals: int, label: int | str) -> Row:
    """Return one row of the table; ``all`` counts the last goal and all failures."""
    goal = label if isinstance(label, int) else goals
    tried = tuple(each for each in trials if label in ("all", each.detail.goal))

    def is_reached(attempt: OffroadAttempt) -> bool:
        return attempt.is_success and attempt.detail.goal == goal

    def head(sample: Sample) -> Row:
        first = trials[0]
        return {
            **{"controller": first.contender, "world": first.scenario, "goal": label},
            **{"trials": len(sample.clusters), "successes": sample.count(is_reached)},
        }

    def spl(sample: Sample) -> Row:
        # Goals that were never tried count as 0: a trial is over at its first failure.
        whole = len(sample.clusters) * (goals if label == "all" else 1)
        return {"spl": sum(attempt.spl for attempt in sample.attempts) / whole}

    reached = share(is_reached, ends="wilson")
    columns = (head, *_ENDS, reached, _strict_successes(goal), spl, *_MEASURES)
    return row_of(columns, Sample(tried, TRIALS, trials))


def _strict_successes(goal: int) -> Column:
    """Return a column of the trials whose goals up to one were all reached with a clean outline.

    It is None where one of them has no strict verdict, as in journals of earlier versions.
    """

    def column(sample: Sample) -> Row:
        trials: dict[int, list[bool]] = {}
        for attempt in sample.of or sample.attempts:
            verdict = is_strict_success(attempt)
            if verdict is None:
                return {"strict_successes": None}
            if attempt.detail.goal <= goal:
                trials.setdefault(attempt.repetition, []).append(verdict)
        return {"strict_successes": sum(len(t) == goal and all(t) for t in trials.values())}

    return column


def _trespass_share(sample: Sample) -> Row:
    """Return the share of all that was driven where the true map forbids it."""
    # Sums, not the mean of shares: a drive of a metre that ends on a slope would weigh like a long
    # one.
    driven = sum(attempt.distance for attempt in sample.attempts)
    there = sum(attempt.detail.forbidden_distance for attempt in sample.attempts)
    return {"trespass_share": there / driven if driven else None}


_ENDS: Sequence[Column] = (
    counts(collisions=Outcome.COLLISION),
    hit_counts,
    counts(tipovers=Outcome.TIPOVER, timeouts=Outcome.TIMEOUT, stuck=Outcome.STUCK),
    counts(false_arrivals=Outcome.FALSE_ARRIVAL, left_world=Outcome.LEFT_WORLD),
)

_MEASURES: Sequence[Column] = (
    average("trespass_m", lambda attempt: attempt.detail.forbidden_distance),
    _trespass_share,
    average("distance_m", lambda attempt: attempt.distance),
    average("steering_variation", lambda attempt: attempt.detail.steering_variation),
    average("energy_j", lambda attempt: attempt.detail.energy),
    average("min_clearance_m", lambda attempt: attempt.detail.min_clearance),
    average("arrival_error_m", lambda attempt: attempt.detail.arrival_error),
    average("position_error_m", lambda attempt: attempt.detail.position_error),
    average("overridden_share", lambda attempt: attempt.detail.overridden),
    average("mean_time_s", lambda attempt: attempt.time),
)
