"""The loop of all comparisons: journal, going on after a kill, files, order."""

import pytest

from andabata.engine import SerialEngine
from andabata.evaluation import comparison as loop
from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.table import Table
from tests.support.toy_benchmark import TOY_TABLE, WORLDS, ToyComparison


class Backwards(SerialEngine):
    """Engine whose last task ends first."""

    def run(self, work, tasks):
        """Yield results from the last to the first."""
        return reversed(list(super().run(work, tasks)))


def test_attempts_come_by_cell_whatever_ends_first():
    """The order in which workers end changes nothing."""
    attempts = run_comparison(ToyComparison())
    assert [each.scenario for each in attempts] == list(WORLDS)
    assert run_comparison(ToyComparison(), engine=Backwards()) == attempts


def test_a_killed_run_goes_on(tmp_path, monkeypatch):
    """Cells that stand whole in the journal are told at once and not driven again."""
    told, driven = [], []
    first = run_comparison(ToyComparison(), folder=tmp_path, on_cell=told.append)
    assert told == list(WORLDS)
    journal = tmp_path / "toy.jsonl"
    whole = journal.read_text()
    lines = whole.splitlines()
    assert len(lines) == 1 + 3
    journal.write_text("\n".join([*lines[:2], lines[2][:20]]))  # A kill in the second world.
    told.clear()
    drive = ToyComparison.drive
    monkeypatch.setattr(
        ToyComparison, "drive", lambda self, cell: driven.append(cell) or drive(self, cell)
    )
    again = run_comparison(ToyComparison(), folder=tmp_path, on_cell=told.append)
    assert (again, told, driven) == (first, list(WORLDS), ["hill", "moor"])
    assert journal.read_text() == whole


def test_a_journal_of_another_run_is_refused(tmp_path):
    """The heading is all that the attempts depend on; the error names what differs."""
    run_comparison(ToyComparison(), folder=tmp_path)
    with pytest.raises(ValueError, match="one that differs in seed; take another --out"):
        run_comparison(ToyComparison(seed=1), folder=tmp_path)


def test_files_are_written_before_the_journal_knows(tmp_path, monkeypatch):
    """A kill in between drives the cell again; without a folder nothing is written."""

    def kill(journal, entry):
        assert (tmp_path / "maps/plain.txt").read_bytes() == b"plain"
        raise KeyboardInterrupt

    monkeypatch.setattr(loop.Journal, "append", kill)
    with pytest.raises(KeyboardInterrupt):
        run_comparison(ToyComparison(), folder=tmp_path)
    assert len((tmp_path / "toy.jsonl").read_text().splitlines()) == 1
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    run_comparison(ToyComparison())
    assert not list(tmp_path.rglob("hill*"))


def test_a_cell_counts_once_it_was_told(tmp_path):
    """A cell whose news failed is driven again."""

    def fail(cell):
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        run_comparison(ToyComparison(), folder=tmp_path, on_cell=fail)
    assert len((tmp_path / "toy.jsonl").read_text().splitlines()) == 1


def test_attempts_are_those_that_the_journal_keeps(tmp_path, monkeypatch):
    """What an entry leaves out is missing from a run that was never killed, too."""
    decode = ToyComparison.decode
    monkeypatch.setattr(
        ToyComparison, "decode", lambda self, entry: decode(self, {**entry, "distances": {"w": 9}})
    )
    assert [each.distance for each in run_comparison(ToyComparison())] == [9.0] * 3


def test_a_toy_benchmark_has_its_table():
    """Two of three worlds are reached, and equal controllers gain nothing."""
    attempts = run_comparison(ToyComparison(("walker", "runner")))
    assert isinstance(TOY_TABLE, Table)
    first, second = TOY_TABLE.rows(attempts)
    assert (first["controller"], second["controller"]) == ("walker", "runner")
    assert first["success_rate"] == pytest.approx(2 / 3)
    assert first["success_low"] < 2 / 3 < first["success_high"]
    (gain,) = TOY_TABLE.differences(attempts)
    assert (gain["gain"], gain["distance"]) == (0.0, 0.0)
