"""Trainings with cuts: one plan is equal to the bit, and a difference is noticed."""

import pytest

from andabata.bench.studies.soak import resuming
from andabata.bench.studies.soak.resuming import resumed_trainings_are_equal
from andabata.training.run import POLICY


@pytest.fixture
def one_plan(monkeypatch):
    """Let the check train by one plan."""
    monkeypatch.setattr(resuming, "TASKS", ("td3",))
    monkeypatch.setattr(resuming, "algorithms", lambda task: ("td3",))


def test_a_training_with_cuts_ends_with_the_same_bytes(tmp_path, one_plan):
    """Two cuts at random iterations."""
    outcome = resumed_trainings_are_equal(2, tmp_path)
    assert (outcome.trials, outcome.failures) == (2, ())


def test_a_resume_that_changes_a_byte_is_noticed(tmp_path, one_plan, monkeypatch):
    """The file that differs is named."""
    learn = resuming._learn_with_cuts

    def changed(folder, plan, cuts):
        learn(folder, plan, cuts)
        (folder / POLICY).write_bytes(b"other")

    monkeypatch.setattr(resuming, "_learn_with_cuts", changed)
    (failure,) = resumed_trainings_are_equal(1, tmp_path).failures
    assert failure.endswith(f"{POLICY} differs")
