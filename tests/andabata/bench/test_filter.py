"""Times of the filter: each number calls a part of its own, which changes the belief."""

import numpy as np

from andabata.bench import filter as bench
from andabata.bench.filter import PARTS, best_of_seven, initial_belief
from andabata.localization.sigma_points import Workspace
from terrain.record import packed


def changed_by(part):
    """Return the change of the belief by one call of a part."""
    x, P = initial_belief()
    before = P.copy()
    records = (packed(bench.MODEL), packed(Workspace.allocate()))
    bench.repeat_part(part, 1, x, P, bench.STANDING_IMU, bench._FLUX, bench._FIX, *records)
    return P - before


def test_a_prediction_adds_uncertainty_and_corrections_remove_it():
    """The trace of the covariance grows or shrinks."""
    changes = {name: np.trace(changed_by(number)) for number, name in enumerate(PARTS)}
    assert changes.pop("predict") > 0
    assert all(change < 0 for change in changes.values())
    assert len(set(changes.values())) == len(changes)


def test_the_time_of_a_call_is_that_of_the_fastest_loop(monkeypatch):
    """Loops are divided by their number of calls, in microseconds."""
    now, loops = [0.0], iter([9.0, 3.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0])

    def call(calls):
        now[0] += next(loops)

    monkeypatch.setattr(bench.time, "perf_counter", lambda: now[0])
    assert best_of_seven(call, 1000) == 2000.0


def test_filterpy_has_a_row_for_each_of_its_two_parts(monkeypatch):
    """The peer's rows have the columns of ours."""
    monkeypatch.setattr(bench, "best_of_seven", lambda call, calls: (call(1) and 1.0) or 1.0)
    ours, theirs = bench.time_parts(), bench.time_filterpy()
    assert [row["part"] for row in theirs] == ["predict", "correct"]
    assert [row["part"] for row in ours] == list(PARTS)
    assert {tuple(row) for row in ours + theirs} == {("filter", "part", "time [us]")}
