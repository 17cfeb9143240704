"""Fuzzing: skipped with a reason without atheris; with it, what readers raise is found."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

from andabata.bench.studies.soak import fuzzing, outcome
from andabata.bench.studies.soak.fuzzing import NO_ATHERIS, fuzzed_readers_raise_named_errors
from andabata.bench.studies.soak.readers import READERS
from andabata.runs import journal


def test_without_atheris_nothing_is_claimed(tmp_path, monkeypatch):
    """The row says why it was not run."""
    monkeypatch.setattr(fuzzing, "find_spec", lambda name: None)
    assert fuzzed_readers_raise_named_errors(10, tmp_path).verdict == f"not run: {NO_ATHERIS}"


def ended(code, error):
    """Return a function that stands for a fuzzer's process."""

    def run(words, **options):
        assert words[1:3] == ["-m", fuzzing.__name__]
        if code:
            (fuzzing.Path(words[-1]) / "crash-1234").write_bytes(b"bad")
        return subprocess.CompletedProcess(words, code, "", error)

    return run


def test_inputs_that_failed_are_kept_and_named(tmp_path, monkeypatch):
    """The first line that names an error is the reason; tries are counted."""
    monkeypatch.setattr(fuzzing, "find_spec", lambda name: True)
    monkeypatch.setattr(fuzzing, "READERS", {"VTK cloud": READERS["VTK cloud"]})
    text = "stat::number_of_executed_units: 1200\n"
    monkeypatch.setattr(subprocess, "run", ended(0, text))
    (tmp_path / "a/files").mkdir(parents=True)
    (tmp_path / "b/files").mkdir(parents=True)
    whole = fuzzed_readers_raise_named_errors(9, tmp_path / "a/files")
    assert (whole.trials, whole.failed) == (1200, 0)
    assert whole.figure == "1,200 inputs, 9 s each of 1 readers"
    uncaught = (
        "noise\n === Uncaught Python exception: ===\nKeyError: 'x'\nERROR: libFuzzer: exited\n"
    )
    monkeypatch.setattr(subprocess, "run", ended(77, f"{uncaught}{text}"))
    assert (
        fuzzing._reason("a\n==1== ERROR: libFuzzer: timeout\nb")
        == "==1== ERROR: libFuzzer: timeout"
    )
    assert fuzzing._reason("Traceback\nImportError: x\n") == "ImportError: x"
    (failure,) = fuzzed_readers_raise_named_errors(9, tmp_path / "b/files").failures
    kept = tmp_path / "b/inputs/crash-1234"
    assert failure == f"VTK cloud: KeyError: 'x'; input {kept}"
    assert kept.read_bytes() == b"bad"


def test_functions_of_a_module_are_those_written_in_it():
    """Of its classes, too: methods, class methods and properties; imported ones are none."""
    found = {each.__qualname__ for each in fuzzing._functions(journal, journal.__name__)}
    assert {"Journal.append", "Journal.__init__", "_read", "checked_entry"} <= found
    assert "append_line" not in found
    outcome_names = {each.__qualname__ for each in fuzzing._functions(outcome, outcome.__name__)}
    assert "Outcome.verdict" in outcome_names


@pytest.mark.skipif(find_spec("atheris") is None, reason=NO_ATHERIS)
def test_a_reader_is_fuzzed_for_a_second(tmp_path):
    """It begins with good files, tries others, and ends by itself."""
    words = [sys.executable, "-m", fuzzing.__name__, "VTK cloud", "1", str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "stat::number_of_executed_units:" in done.stderr
    assert (tmp_path / "corpus/seed-0").is_file()
