"""Contenders take turns, missing peers are named, ratios are relative to ours."""

from andabata.bench import contenders
from andabata.bench.contenders import Case, Contender, run_case


def test_rows_hold_medians_and_ratios_and_the_missing_are_named():
    """A call that returns a duration is not timed; ratios are of speeds."""

    def missing():
        raise ModuleNotFoundError("no module", name="absent")

    messages = []
    three = (
        Contender("ours", 10, lambda: lambda: 0.5),  # Half a second by its own clock.
        Contender("theirs", 10, lambda: lambda: 2.0),
        Contender("absent", 10, missing),
    )
    rows = run_case(Case("work", "units/s", three), 3, 0.0, messages.append)
    assert [row["subject"] for row in rows] == ["ours", "theirs"]
    assert [row["value"] for row in rows] == [20.0, 5.0]
    assert [row["ratio_to_ours"] for row in rows] == [1.0, 0.25]
    assert rows[0]["runs"] == 3
    assert messages == ["absent: left out, absent is not installed (extra `peers`)"]


def test_work_without_a_clock_of_its_own_is_timed(monkeypatch):
    """A turn repeats the call until its time is over."""
    now = [0.0]

    def work():
        now[0] += 0.25

    monkeypatch.setattr(contenders.time, "perf_counter", lambda: now[0])
    (row,) = run_case(Case("work", "units/s", (Contender("ours", 1, lambda: work),)), 1, 1.0, print)
    assert row["value"] == 4.0
