"""A promise: trials by time, its row, and the call of its check."""

from andabata.bench.studies.soak.outcome import Outcome, not_run
from andabata.bench.studies.soak.promise import Promise

LAW = Promise(
    "x", "it holds", "filter_laws:filter_is_the_kalman_filter", "steps", 100, 1000, "1e-8", 2.0
)


def test_trials_follow_the_time():
    """Those of ten minutes are the short ones; none are more than all, or less than one."""
    counts = [LAW.count(minutes) for minutes in (None, 10.0, 5.0, 0.01, 1e6)]
    assert counts == [1000, 100, 50, 1, 1000]
    assert LAW._replace(least=6).count(0.01) == 6


def test_a_check_has_time_enough():
    """At least five minutes, as many as all, or its hours in full."""
    assert [LAW.time_limit(each) for each in (None, 1.0, 10.0)] == [7200.0, 300.0, 600.0]


def test_the_row_has_both_numbers_of_trials(tmp_path):
    """Of what was run, and of the full version."""
    outcome = LAW.run(20, tmp_path)
    assert outcome.trials == 20
    assert LAW.row(Outcome(trials=3, figure="3", failed=1), 100) == {
        "promise": "it holds",
        "checked": "100 steps",
        "in_full": "1,000 steps",
        "figure": "3",
        "limit": "1e-8",
        "kept": "no",
    }


def test_what_was_not_run_counts_nothing():
    """The verdict has the reason, and no number is claimed."""
    row = LAW.row(not_run("no atheris"), 100)
    assert (row["checked"], row["figure"], row["kept"]) == ("-", "-", "not run: no atheris")
