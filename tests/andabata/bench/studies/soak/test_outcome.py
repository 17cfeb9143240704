"""Outcomes of checks: trials and failures are counted, inputs that failed are kept."""

from andabata.bench.studies.soak.outcome import Outcome, Tally, not_run


def test_results_and_failures_are_counted():
    """The figure is the numbers of each result, unless there is another one."""
    tally = Tally()
    for result in ("read", "refused", "read"):
        tally.add(result)
    tally.expect(True, "never")
    assert tally.outcome() == Outcome(trials=3, figure="2 read, 1 refused")
    tally.expect(False, "a hang")
    outcome = tally.outcome("12 s")
    assert (outcome.figure, outcome.failed, outcome.failures) == ("12 s", 1, ("a hang",))
    assert (outcome.verdict, tally.outcome().verdict, Outcome(trials=1, figure="").verdict) == (
        "no",
        "no",
        "yes",
    )


def test_all_failures_count_and_the_first_are_described():
    """A check that fails a thousand times has a short outcome."""
    tally = Tally()
    for number in range(1000):
        tally.fail(f"{number}")
    assert (tally.outcome().failed, tally.outcome().failures) == (1000, ("0", "1", "2", "3", "4"))


def test_an_exception_is_a_failure_whose_input_is_kept(tmp_path):
    """The text has the kind of the error, its place and the path of the input."""
    tally = Tally()
    with tally.guarded("PLY", b"some bytes", tmp_path / "inputs"):
        raise KeyError("x")
    (kept,) = (tmp_path / "inputs").iterdir()
    assert kept.read_bytes() == b"some bytes"
    (text,) = tally.failures
    assert text.startswith("PLY: KeyError at test_outcome.py:")
    assert text.endswith(f"kept as {kept}")


def test_what_was_not_run_was_not_kept():
    """The verdict says why."""
    outcome = not_run("no atheris")
    assert (outcome.verdict, outcome.failed) == ("not run: no atheris", 0)
