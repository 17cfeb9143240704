"""Kills while files are saved: atomic writers pass, others are noticed."""

import pytest

from andabata.bench.studies.soak import saving
from andabata.bench.studies.soak.saving import Kept, kept_kinds, kills_leave_whole_files


def test_killed_writers_leave_whole_files(tmp_path):
    """One kill of each kind of file."""
    outcome = kills_leave_whole_files(len(kept_kinds()), tmp_path)
    assert (outcome.trials, outcome.failures) == (len(kept_kinds()), ())


@pytest.mark.parametrize("name", kept_kinds())
def test_the_number_that_is_saved_is_read(name, tmp_path):
    """The last one, of each kind of file."""
    kind = kept_kinds()[name]
    save = kind.begin(tmp_path)
    for number in (1, 2, 3):
        save(number)
        assert kind.read(tmp_path) == number


def test_an_older_file_and_an_unreadable_one_are_noticed(tmp_path, monkeypatch):
    """Files that fall behind, and files that cannot be read."""

    def unreadable(folder):
        raise ValueError("half")

    kinds = {
        "old": Kept(lambda folder: lambda number: None, lambda folder: 0),
        "half": Kept(lambda folder: lambda number: None, unreadable),
    }
    monkeypatch.setattr(saving, "kept_kinds", lambda: kinds)
    old, half = kills_leave_whole_files(2, tmp_path).failures
    assert old.startswith("old: expected number ")
    assert half.startswith("half, kill 1: ValueError")
