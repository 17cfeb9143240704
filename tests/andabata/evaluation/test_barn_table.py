"""Scores of BARN, and rows with intervals and differences."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.barn_table import (
    BARN_TABLE,
    BarnMeasures,
    barn_failures,
    failure,
    ot_over_t,
    run_of,
    run_row,
    score,
)
from andabata.evaluation.statistics import clustered_mean
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome


def run(time=10.0, outcome=Outcome.GOAL, controller="a", world="w0", trial=0, best=5.0):
    """Return a run in a world whose optimal time is 5 s."""
    contact = Contact.OBSTACLE if outcome is Outcome.COLLISION else Contact.NONE
    measures, unknown = BarnMeasures(best, 0.9, 1.0), np.nan
    return Attempt(controller, world, trial, outcome, contact, time, unknown, unknown, measures)


@pytest.mark.parametrize(
    ("time", "official", "ratio"),
    [
        (4.0, 0.5, 1.25),
        (5.0, 0.5, 1.0),
        (8.0, 0.5, 0.625),
        (20.0, 0.25, 0.25),
        (80.0, 0.125, 0.0625),
    ],
)
def test_scores_of_times(time, official, ratio):
    """The official one is clipped from 2 to 8 optimal times, the ratio at neither end."""
    assert score(run(time)) == pytest.approx(official)
    assert ot_over_t(run(time)) == pytest.approx(ratio)


@pytest.mark.parametrize("outcome", [Outcome.COLLISION, Outcome.TIMEOUT])
def test_failures_score_nothing(outcome):
    """Whatever the time."""
    assert score(run(1.0, outcome)) == ot_over_t(run(1.0, outcome)) == 0.0
    assert ot_over_t(run(0.0)) == 0.0


def test_failures_have_kinds():
    """A robot that never left its start is told apart from one that is late."""
    runs = [
        run(),
        run(3.0, Outcome.COLLISION),
        run(100.0, Outcome.TIMEOUT),
        run(0.0, Outcome.TIMEOUT),
    ]
    kinds = [None, "collision", "timeout", "never_left"]
    assert [failure(each) for each in runs] == kinds
    (row,) = BARN_TABLE.rows(runs[:1])
    assert (row["success_rate"], row["collisions"]) == (1.0, 0)
    assert [each["failure"] for each in barn_failures(runs)] == kinds[1:]


def test_who_hit_whom_is_told_and_kept():
    """Columns of the row, of a failure, and of the journal; older journals knew what stands."""
    runs = [
        replace(run(3.0, Outcome.COLLISION, trial=k), contact=contact)
        for k, contact in enumerate(
            (Contact.MOVER, Contact.HIT, Contact.HIT, Contact.HIT_AT_REST, Contact.OBSTACLE)
        )
    ]
    (row,) = BARN_TABLE.rows(runs)
    columns = ("collisions", "hit_mover", "hit_by_mover", "hit_at_rest")
    assert [row[name] for name in columns] == [5, 1, 2, 1]
    assert [each["contact"] for each in barn_failures(runs)][:2] == ["mover", "hit"]
    rows = [json.loads(json.dumps(run_row(each))) for each in runs]
    assert [run_of(each).contact for each in rows] == [each.contact for each in runs]
    for each in rows:
        del each["contact"]
    assert {run_of(each).contact for each in rows} == {Contact.OBSTACLE}


def grid(controller, times):
    """Return runs of times by world and trial; None is a collision."""
    return [
        run(time or 1.0, Outcome.GOAL if time else Outcome.COLLISION, controller, f"w{w}", t)
        for w, row in enumerate(times)
        for t, time in enumerate(row)
    ]


def test_rows_count_by_controller_and_spread_by_world():
    """Means over all runs; the interval is Student's over the means of the worlds."""
    runs = [*grid("a", [[10, 20], [None, None], [20, 20]]), *grid("b", [[10, 10]] * 3)]
    first, second = BARN_TABLE.rows(runs)
    assert (first["controller"], first["worlds"], first["runs"]) == ("a", 3, 6)
    assert (first["successes"], first["collisions"], first["timeouts"]) == (4, 2, 0)
    assert first["score"] == pytest.approx((0.5 + 0.25 + 0.25 + 0.25) / 6)
    means = np.array([0.375, 0.0, 0.25])
    reach = 4.302653 * means.std(ddof=1) / np.sqrt(3)
    assert reach > 0.4
    # As wide as the scores themselves: three worlds say little.
    assert (first["score_low"], first["score_high"]) == (0.0, 0.5)
    narrow = np.array([means, means + 0.01, means + 0.02]).ravel()[None] / 2 + 0.1
    found = clustered_mean(narrow)
    reach = 2.306004 * narrow.std(ddof=1) / 3
    assert found.high - found.mean == found.mean - found.low == pytest.approx(reach, rel=1e-5)
    assert first["mean_time_s"] == pytest.approx(17.5)
    # 0.5 and 0.25 of two runs, none of the collisions, 0.25 twice; no bound from above.
    assert first["ot_over_t"] == pytest.approx((0.5 + 0.25 + 0.25 + 0.25) / 6)
    assert first["ot_over_t_high"] > 0.6 > first["ot_over_t"] > first["ot_over_t_low"] == 0.0
    assert (second["score"], second["score_low"], second["score_high"]) == (0.5, 0.5, 0.5)


def test_one_world_has_no_spread():
    """No interval is made up."""
    (row,) = BARN_TABLE.rows(grid("a", [[10, 20]]))
    assert (row["score_low"], row["score_high"]) == (None, None)


def test_differences_are_of_the_same_worlds_and_trials():
    """The order of runs does not matter; a constant gain has no spread."""
    base = grid("a", [[20, 40], [20, 20], [40, 20]])
    better = grid("b", [[10, 20], [10, 10], [20, 10]])
    (row,) = BARN_TABLE.differences([*base, *better])
    assert (row["controller"], row["against"], row["worlds"]) == ("b", "a", 3)
    # 0.5 for 0.25, and 0.25 for 0.125: 0.1875, 0.25 and 0.1875 in the three worlds.
    assert row["score"] == pytest.approx((0.1875 + 0.25 + 0.1875) / 3)
    # Half of the time is twice the ratio, which has no cap at 0.5.
    fast = BARN_TABLE.differences([*grid("a", [[8, 8]] * 2), *grid("b", [[4, 4]] * 2)])[0]
    assert (fast["score"], fast["ot_over_t"]) == (0.0, pytest.approx(0.625))
    assert row["success"] == 0.0
    assert row["success_low"] < 0 < row["success_high"]
    assert BARN_TABLE.differences(base) == []


def test_runs_go_through_json():
    """What is written is read."""
    for each in (run(), run(0.0, Outcome.TIMEOUT), run(2.0, Outcome.COLLISION)):
        assert run_of(json.loads(json.dumps(run_row(each)))) == each
