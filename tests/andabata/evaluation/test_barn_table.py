"""Scores of BARN, and rows with intervals and differences."""

import numpy as np
import pytest

from andabata.evaluation.barn_table import (
    BarnRun,
    barn_differences,
    barn_failures,
    barn_rows,
)
from andabata.tasks.terminations import Outcome


def run(time=10.0, outcome=Outcome.GOAL, controller="a", world="w0", trial=0, best=5.0):
    """Return a run in a world whose optimal time is 5 s."""
    return BarnRun(controller, world, trial, outcome, time, best, 0.9, 1.0)


@pytest.mark.parametrize(
    ("time", "score", "uncapped"),
    [(4.0, 0.5, 1.0), (5.0, 0.5, 1.0), (8.0, 0.5, 0.625), (20.0, 0.25, 0.25), (90.0, 0.125, 0.125)],
)
def test_scores_of_times(time, score, uncapped):
    """Clipped from 2 and from 1 to 8 optimal times."""
    assert run(time).score == pytest.approx(score)
    assert run(time).uncapped == pytest.approx(uncapped)


@pytest.mark.parametrize("outcome", [Outcome.COLLISION, Outcome.TIMEOUT])
def test_failures_score_nothing(outcome):
    """Whatever the time."""
    assert run(1.0, outcome).score == run(1.0, outcome).uncapped == 0.0


def test_failures_have_kinds():
    """A robot that never left its start is told apart from one that is late."""
    runs = [
        run(),
        run(3.0, Outcome.COLLISION),
        run(100.0, Outcome.TIMEOUT),
        run(0.0, Outcome.TIMEOUT),
    ]
    kinds = [None, "collision", "timeout", "never_left"]
    assert [each.failure for each in runs] == kinds
    (row,) = barn_rows(runs[:1])
    assert (row["success_rate"], row["collisions"]) == (1.0, 0)
    assert [each["failure"] for each in barn_failures(runs)] == kinds[1:]


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
    first, second = barn_rows(runs)
    assert (first["controller"], first["worlds"], first["runs"]) == ("a", 3, 6)
    assert (first["successes"], first["collisions"], first["timeouts"]) == (4, 2, 0)
    assert first["score"] == pytest.approx((0.5 + 0.25 + 0.25 + 0.25) / 6)
    means = np.array([0.375, 0.0, 0.25])
    reach = 4.302653 * means.std(ddof=1) / np.sqrt(3)
    assert first["score_high"] - first["score"] == pytest.approx(reach, rel=1e-5)
    assert first["mean_time_s"] == pytest.approx(17.5)
    assert (second["score"], second["score_low"], second["score_high"]) == (0.5, 0.5, 0.5)


def test_one_world_has_no_spread():
    """No interval is made up."""
    (row,) = barn_rows(grid("a", [[10, 20]]))
    assert (row["score_low"], row["score_high"]) == (None, None)


def test_differences_are_of_the_same_worlds_and_trials():
    """The order of runs does not matter; a constant gain has no spread."""
    base = grid("a", [[20, 40], [20, 20], [40, 20]])
    better = grid("b", [[10, 20], [10, 10], [20, 10]])
    (row,) = barn_differences([*base, *better])
    assert (row["controller"], row["against"], row["worlds"]) == ("b", "a", 3)
    # 0.5 for 0.25, and 0.25 for 0.125: 0.1875, 0.25 and 0.1875 in the three worlds.
    assert row["score"] == pytest.approx((0.1875 + 0.25 + 0.1875) / 3)
    assert row["success"] == 0.0
    assert row["success_low"] < 0 < row["success_high"]
    assert barn_differences(base) == []


def test_runs_go_through_json():
    """What is written is read."""
    for each in (run(), run(0.0, Outcome.TIMEOUT)):
        assert BarnRun.from_json(each.to_json()) == each
