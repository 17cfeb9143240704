"""Tables of attempts: grids, columns, differences of pairs."""

import numpy as np
import pytest

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.statistics import clustered_interval, clustered_mean, wilson_interval
from andabata.evaluation.table import (
    Design,
    Sample,
    Table,
    average,
    bootstrap_difference,
    by_contender,
    by_repetition,
    by_scenario,
    by_task,
    counts,
    hit_counts,
    is_success,
    mcnemar_test,
    mean,
    mean_difference,
    pair,
    share,
    share_difference,
)
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome

GOAL, HIT, LATE = Outcome.GOAL, Outcome.COLLISION, Outcome.TIMEOUT
RUNS = Design(cluster=by_scenario, repeat=by_repetition)


def attempt(contender, world, run, outcome=GOAL, time=1.0, contact=Contact.NONE):
    """Return an attempt."""
    return Attempt(contender, world, run, outcome, contact, time, 5.0, 4.0, None)


def grid(contender, outcomes, times=None):
    """Return attempts from outcomes by world and run."""
    return [
        attempt(contender, f"w{w}", k, outcome, 1.0 if times is None else times[w][k])
        for w, row in enumerate(outcomes)
        for k, outcome in enumerate(row)
    ]


def seconds(one):
    """Return the time of an attempt."""
    return one.time


TWO = [[GOAL, HIT], [GOAL, GOAL], [LATE, GOAL]]


def test_a_grid_has_a_row_a_repeat_and_a_column_a_cluster():
    """In the order of the first attempts; the order of the columns may be another's."""
    sample = Sample(grid("a", TWO, [[1, 2], [3, 4], [5, 6]]), RUNS)
    np.testing.assert_array_equal(sample.grid(seconds), [[1, 3, 5], [2, 4, 6]])
    np.testing.assert_array_equal(sample.grid(seconds, ("w2", "w0", "w1"))[0], [5, 1, 3])
    assert (sample.clusters, sample.repeats) == (("w0", "w1", "w2"), (0, 1))


def test_what_was_not_driven_has_not_succeeded():
    """Clusters of more attempts than those of the row count as 0; of several the last counts."""
    some = grid("a", [[GOAL], [GOAL], [GOAL]])
    again = attempt("a", "w0", 0, HIT)
    sample = Sample([some[0], again, some[2]], RUNS, some)
    np.testing.assert_array_equal(sample.grid(is_success), [[0, 0, 1]])


def test_a_share_has_the_interval_of_other_clusters():
    """Wilson's with one run of each, the clustered one with several."""
    one = Table(by_contender, RUNS, (share(ends="s"),)).rows(grid("a", [[GOAL], [HIT], [GOAL]]))[0]
    assert (one["s_low"], one["s_high"]) == wilson_interval(2, 3)
    assert one["success_rate"] == 2 / 3
    row = Table(by_contender, RUNS, (share(),)).rows(grid("a", TWO))[0]
    expected = clustered_interval(np.array([[1, 1, 0], [0, 1, 1]], dtype=bool))
    assert (row["success_low"], row["success_high"]) == expected


def test_columns_stand_in_their_order():
    """Counts by outcome, hits by movers among the collisions, means of those that have a value."""
    attempts = [
        attempt("a", "w", 0, GOAL, 2.0),
        attempt("a", "w", 1, HIT, 4.0, Contact.HIT),
        attempt("a", "w", 2, HIT, 9.0, Contact.HIT_AT_REST),
        attempt("a", "w", 3, LATE, 9.0, Contact.HIT),
    ]
    columns = (
        counts(late=LATE, crashes=HIT),
        hit_counts,
        average("goal_time", seconds, is_success),
        average("even", lambda one: one.time if one.time % 2 == 0 else None),
        average("none", lambda _: None),
    )
    (row,) = Table(by_contender, RUNS, columns).rows(attempts)
    assert list(row.items()) == [
        *(("late", 1), ("crashes", 2), ("hit_mover", 0), ("hit_by_mover", 1), ("hit_at_rest", 1)),
        *(("goal_time", 2.0), ("even", 3.0), ("none", None)),
    ]


def test_a_mean_keeps_within_its_bounds():
    """Student's interval over the clusters, from 0 to the largest value; one has no interval."""
    times = [[0.0, 0.2], [0.5, 0.9], [1.0, 1.0]]
    (row,) = Table(by_contender, RUNS, (mean("t", seconds, 1.0),)).rows(grid("a", TWO, times))
    found = clustered_mean(np.array(times).T)
    assert row["t"] == found.mean
    assert found.low < 0.0
    assert found.high > 1.0
    assert (row["t_low"], row["t_high"]) == (0.0, 1.0)
    (row,) = Table(by_contender, RUNS, (mean("t", seconds),)).rows(grid("a", TWO[:1], times))
    assert (row["t_low"], row["t_high"]) == (None, None)


def test_differences_are_of_the_same_clusters_whatever_their_order():
    """The second minus the first; who drove elsewhere is refused."""
    first = grid("a", [[HIT], [GOAL], [HIT]], [[1.0], [2.0], [3.0]])
    second = grid("b", [[GOAL], [GOAL], [HIT]], [[2.0], [4.0], [6.0]])[::-1]
    table = Table(
        by_contender,
        RUNS,
        (),
        (share_difference("gain"), mean_difference("time", seconds)),
    )
    (row,) = table.differences([*first, *second])
    assert row["gain"] == pytest.approx(1 / 3)
    assert row["gain_low"] < 1 / 3 < row["gain_high"]
    assert row["time"] == pytest.approx(2.0)
    found = clustered_mean(np.array([[1.0, 2.0, 3.0]]))
    assert (row["time_low"], row["time_high"]) == (found.low, found.high)
    with pytest.raises(ValueError, match="expected the same scenarios of both, got 1 of one"):
        table.differences([*first, *second[1:]])


def test_pairs_are_taken_within_a_key():
    """Each from the first row with the same key."""
    design = Design(cluster=by_task, repeat=by_contender)
    table = Table(lambda one: (one.contender, one.outcome), design, (), (), lambda one: one.outcome)
    attempts = [attempt(name, "w", 0, end) for end in (GOAL, HIT) for name in ("a", "b", "c")]
    names = [
        (base.attempts[0].contender, other.attempts[0].contender, other.attempts[0].outcome)
        for base, other in table.pairs(attempts)
    ]
    assert names == [("a", "b", GOAL), ("a", "c", GOAL), ("a", "b", HIT), ("a", "c", HIT)]


def test_wins_and_resampled_intervals():
    """McNemar counts the clusters that one alone reaches; the bootstrap resamples them."""
    ends = [[GOAL]] * 6 + [[HIT]] * 2
    first = grid("a", [[HIT]] * 6 + [[GOAL]] * 2, [[1.0]] * 8)
    second = grid("b", ends, [[k / 2] for k in range(8)])
    table = Table(
        by_contender, RUNS, (), (mcnemar_test("test"), bootstrap_difference("time", seconds))
    )
    (row,) = table.differences([*first, *second])
    assert (row["test_gained"], row["test_lost"]) == (6, 2)
    assert row["test_p"] == pytest.approx(2 * (1 + 8 + 28) / 2**8)
    assert row["time"] == pytest.approx(0.75)
    assert row["time_low"] < 0.75 < row["time_high"]
    one, other = table.pairs([*first, *second])[0]
    np.testing.assert_array_equal(pair(one, other, is_success)[1], [[1] * 6 + [0] * 2])
