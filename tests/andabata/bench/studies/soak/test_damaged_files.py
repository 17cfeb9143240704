"""Damaged files: named errors pass; foreign ones and hangs fail, and their input is kept."""

import pytest

from andabata.bench.studies.soak import damaged_files
from andabata.bench.studies.soak.damaged_files import damaged_files_are_refused
from andabata.bench.studies.soak.readers import READERS, Reader


@pytest.mark.parametrize("name", READERS)
def test_damaged_files_are_read_or_refused_by_name(name, tmp_path):
    """A few of every kind."""
    outcome = damaged_files_are_refused({name: READERS[name]}, 15, tmp_path)
    assert (outcome.trials, outcome.failures) == (15, ())


def reader(read):
    """Return a reader whose named error is a ValueError."""
    return Reader("x", ".x", lambda: [b"good"], read, lambda: (ValueError,), ())


def test_foreign_errors_and_hangs_fail(tmp_path, monkeypatch):
    """A KeyError is foreign, and so is no end; the named error and OSError are not."""
    monkeypatch.setattr(damaged_files, "_LONGEST", 0.05)
    folder = tmp_path / "files"
    folder.mkdir()

    def missing(path):
        raise KeyError("y")

    def endless(path):
        while True:
            pass

    def refused(path):
        raise ValueError("no")

    def unreadable(path):
        raise OSError("no")

    for read, failed, word in (
        (missing, 2, "KeyError"),
        (endless, 2, "TimeoutError"),
        (refused, 0, ""),
        (unreadable, 0, ""),
    ):
        outcome = damaged_files_are_refused({"x": reader(read)}, 2, folder)
        assert outcome.failed == failed
        assert all(f"x: {word}" in text for text in outcome.failures)
    assert list((tmp_path / "inputs").iterdir())
