"""Journal of a run: whole lines, on the disk, of one run."""

import os

import pytest

from andabata.runs import journal as journals
from andabata.runs.journal import Journal

ABOUT = {"config": {"trials": 2}, "commit": "one"}


def test_entries_are_there_again(tmp_path):
    """A second journal of the same run has the entries of the first, and goes on."""
    path = tmp_path / "journal.jsonl"
    first = Journal(path, ABOUT)
    first.append({"trial": 0, "rate": 0.1})
    again = Journal(path, ABOUT)
    assert again.entries == first.entries == [{"trial": 0, "rate": 0.1}]
    again.append({"trial": 1})
    assert Journal(path, ABOUT).entries == [{"trial": 0, "rate": 0.1}, {"trial": 1}]


def test_a_line_that_a_kill_cut_short_is_dropped(tmp_path):
    """The part of a line is dropped, and the next entry begins a line of its own."""
    path = tmp_path / "journal.jsonl"
    Journal(path, ABOUT).append({"trial": 0})
    with path.open("a") as file:
        file.write('{"trial": 1, "ra')
    again = Journal(path, ABOUT)
    assert again.entries == [{"trial": 0}]
    again.append({"trial": 1})
    assert Journal(path, ABOUT).entries == [{"trial": 0}, {"trial": 1}]


def test_a_journal_begins_whole_or_not_at_all(tmp_path, monkeypatch):
    """A write that fails leaves no journal: a cut head would pass for another run's."""

    def fail(descriptor):
        raise OSError("power cut")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="power cut"):
        Journal(tmp_path / "journal.jsonl", ABOUT)
    assert list(tmp_path.iterdir()) == []


def test_an_entry_counts_once_its_line_is_on_the_disk(tmp_path, monkeypatch):
    """Each line is synced to the disk before ``append`` returns."""
    path, synced = tmp_path / "journal.jsonl", []
    journal = Journal(path, ABOUT)
    sync = os.fsync
    monkeypatch.setattr(os, "fsync", lambda descriptor: (sync(descriptor), synced.append(1)))
    journal.append({"trial": 0})
    assert synced == [1]
    assert path.read_text().splitlines()[1:] == ['{"trial": 0, "crc32": "a17131e1"}']


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ('{"config": {}, "commit": "one"}', "differs in config; take another --out"),
        ('{"config": {"trials": 2}, "commit": "two"}', "differs in commit; take another --out"),
        ("[1]", "differs in kind; take another --out"),
        ("no JSON", "differs in kind; take another --out"),
    ],
)
def test_a_journal_of_another_run_is_refused(tmp_path, head, message):
    """The error names the parts of the description that differ."""
    path = tmp_path / "journal.jsonl"
    path.write_text(f"{head}\n")
    with pytest.raises(ValueError, match=f"expected a journal of this run.*{message}"):
        Journal(path, ABOUT)


def test_without_a_path_nothing_is_written(tmp_path, monkeypatch):
    """A journal without a file remembers its entries alone."""
    monkeypatch.setattr(journals, "append_line", None)
    journal = Journal(None, ABOUT)
    journal.append({"trial": 0})
    assert journal.entries == [{"trial": 0}]


@pytest.mark.parametrize(("before", "after"), [(b"12.5", b"92.5"), (b"soft", b"s\xffft")])
def test_a_changed_line_is_refused(tmp_path, before, after):
    """The error names the line to delete; without it the other entries are read."""
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, ABOUT)
    for trial, time in enumerate((1.5, 12.5, 2.0)):
        journal.append({"trial": trial, "time": time, "ground": "soft"})
    head, *lines = path.read_bytes().splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if before in line)
    lines[at] = lines[at].replace(before, after, 1)
    path.write_bytes(head + b"".join(lines))
    with pytest.raises(ValueError, match=rf"line {at + 2}: expected an entry with its CRC-32"):
        Journal(path, ABOUT)
    assert path.read_bytes() == head + b"".join(lines)
    path.write_bytes(head + b"".join(lines[:at] + lines[at + 1 :]))
    assert Journal(path, ABOUT).entries == [e for e in journal.entries if e["trial"] != at]


def test_a_journal_without_checksums_is_read(tmp_path):
    """Those of older releases have none; new entries of theirs have one."""
    path = tmp_path / "journal.jsonl"
    Journal(path, ABOUT)
    with path.open("a") as file:
        file.write('{"trial": 0}\n')
    journal = Journal(path, ABOUT)
    journal.append({"trial": 1})
    assert Journal(path, ABOUT).entries == [{"trial": 0}, {"trial": 1}]
