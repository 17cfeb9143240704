"""Checks in processes of their own: outcomes come back, hangs and lost processes fail."""

import sys

import pytest

from andabata.bench.studies.soak import runner
from andabata.bench.studies.soak.promises import promise_of
from andabata.bench.studies.soak.runner import run_apart


def test_the_outcome_of_a_check_comes_back(tmp_path):
    """And its files are gone."""
    outcome = run_apart(promise_of("kalman"), 20, tmp_path / "x", 60.0)
    assert (outcome.trials, outcome.verdict) == (20, "yes")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("code", "seconds", "word"),
    [
        ("import time; time.sleep(60)", 0.3, "hangs: not done after 0 s"),
        ("import os; os.kill(os.getpid(), 9)", 60.0, "its process ended with -9"),
        ("raise KeyError('x')", 60.0, "its process ended with 1: KeyError: 'x'"),
    ],
)
def test_hangs_and_lost_processes_fail(tmp_path, monkeypatch, code, seconds, word):
    """The reason is named, and the files are kept."""
    popen = runner.subprocess.Popen

    def start(words, **options):
        return popen([sys.executable, "-c", code], **options)

    monkeypatch.setattr(runner.subprocess, "Popen", start)
    outcome = run_apart(promise_of("kalman"), 20, tmp_path / "x", seconds)
    (text,) = outcome.failures
    assert text.startswith(word)
    assert text.endswith(f"files kept in {tmp_path / 'x'}")
    assert (tmp_path / "x/output.txt").is_file()
