"""Killed recorders and damaged recordings, in their short form, and that damage is noticed."""

import pytest

from andabata.bench.studies.soak import recordings
from andabata.bench.studies.soak.recordings import (
    FORMATS,
    damaged_recordings_are_noticed,
    killed_recorders_lose_a_second,
    messages,
    write_recording,
)
from andabata.records.bags import Bag


@pytest.mark.parametrize("kind", FORMATS)
def test_the_recording_is_the_drive(tmp_path, kind):
    """Every message comes back, in the order of the stamps."""
    path, file = write_recording(tmp_path, kind, 1.0)
    drive = messages(1 if kind == "bag" else 2, 1.0)
    with Bag(path) as bag:
        assert [raw.stamp_ns for raw in bag.raw_messages()] == [sent.stamp_ns for sent in drive]
    assert file.is_file()
    assert len(drive) == 301


def test_a_killed_recorder_loses_a_second(tmp_path, monkeypatch):
    """One kill of each format."""
    monkeypatch.setattr(recordings, "_DRIVEN", 4.0)
    outcome = killed_recorders_lose_a_second(3, tmp_path)
    assert (outcome.trials, outcome.failures) == (3, ())
    assert list(tmp_path.iterdir()) == []


def test_damaged_recordings_are_noticed(tmp_path, monkeypatch):
    """Some truncations and flipped bits of each format."""
    monkeypatch.setattr(recordings, "_SECONDS", 0.2)
    folder = tmp_path / "files"
    folder.mkdir()
    outcome = damaged_recordings_are_noticed(12, folder)
    assert (outcome.trials, outcome.failures) == (36, ())
    assert outcome.figure == "30 flipped bits and 6 truncations of 3 formats, 0 unnoticed"


def test_damage_that_nobody_reports_fails(tmp_path, monkeypatch):
    """Without checksums a changed payload is other messages, and no word of it."""
    folder = tmp_path / "files"
    folder.mkdir()
    monkeypatch.setattr(recordings, "_SECONDS", 0.2)
    monkeypatch.setattr(recordings, "FORMATS", ("bag",))
    monkeypatch.setattr(recordings, "write_manifest", lambda path, about: None)
    outcome = damaged_recordings_are_noticed(24, folder)
    assert outcome.failed > 0
    assert outcome.failures[0] == "bag: other messages, and no word of it"
    assert list((tmp_path / "inputs").iterdir())
