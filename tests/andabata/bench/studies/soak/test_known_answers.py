"""Known answers: the tests of the checkout are counted, and their failures named."""

import subprocess

import pytest

from andabata.bench.studies.soak import known_answers
from andabata.bench.studies.soak.known_answers import (
    collisions_stay_collisions,
    live_view_refuses_strangers,
)

CHECKS = (live_view_refuses_strangers, collisions_stay_collisions)


@pytest.mark.parametrize("check", CHECKS)
def test_results_of_tests_are_counted(check, tmp_path, monkeypatch):
    """Those that passed, and those that failed by their names."""
    lines = "..F\nFAILED tests/a.py::b - assert 1\n1 failed, 12 passed in 3.21s\n"

    def run(words, **_):
        assert all((known_answers._ROOT / name).is_file() for name in words[6:])
        return subprocess.CompletedProcess(words, 1, lines, "")

    monkeypatch.setattr(subprocess, "run", run)
    outcome = check(1, tmp_path)
    assert outcome.trials == 13
    assert outcome.figure == "1 tests failed, 12 tests passed"
    assert outcome.failures == ("FAILED tests/a.py::b - assert 1",)


@pytest.mark.parametrize("check", CHECKS)
def test_without_a_checkout_nothing_is_claimed(check, tmp_path, monkeypatch):
    """An installed package has no tests."""
    monkeypatch.setattr(known_answers, "_ROOT", tmp_path)
    assert check(1, tmp_path).verdict == "not run: it needs the tests of a checkout"
