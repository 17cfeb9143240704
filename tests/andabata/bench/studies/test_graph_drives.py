"""Drives over a graph beside those without: goals are counted in pairs, and a run goes on."""

import pytest

from andabata.bench.studies import graph_drives
from andabata.bench.studies.graph_drives import Drive, compare, drive_alone, main, summary


def test_goals_are_counted_in_pairs():
    """A goal after a failed one is not reached; wins and losses are of the same world."""
    rows = [
        {"alone": ["goal", "goal", "goal"], "graph": ["goal", "stuck"]},
        {"alone": ["collision"], "graph": ["goal", "goal", "timeout"]},
    ]
    found = summary(rows)
    assert [row["without a graph"] for row in found] == [1, 1, 1]
    assert [row["over the graph"] for row in found] == [2, 1, 0]
    assert [row["only without"] for row in found] == [0, 1, 1]
    assert [row["only over it"] for row in found] == [1, 1, 0]
    assert [row["difference"] for row in found] == pytest.approx([0.5, 0.0, -0.5])


def test_a_run_goes_on_and_is_of_its_level_alone(tmp_path, monkeypatch):
    """What is in the journal is not driven again; another level needs another folder."""
    driven = []

    def drive(task):
        driven.append(task.seed)
        return {"seed": task.seed, "alone": ["goal"], "graph": ["goal"]}

    monkeypatch.setattr(graph_drives, "drive", drive)
    drives = [Drive(seed, "ideal") for seed in (5, 6, 7)]
    assert len(compare(drives[:2], tmp_path / "a", 1)) == 2
    assert [row["seed"] for row in compare(drives, tmp_path / "a", 1)] == [5, 6, 7]
    assert driven == [5, 6, 7]
    with pytest.raises(ValueError, match="journal of this run"):
        compare([Drive(5, "field")], tmp_path / "a", 1)


def test_a_drive_without_a_graph_ends(monkeypatch):
    """A time limit of half a second is over before the first goal."""
    monkeypatch.setattr(graph_drives, "_TIME_LIMIT", 0.5)
    assert drive_alone(Drive(7300, "ideal")) == ["timeout"]


def test_the_table_has_a_row_for_each_goal(monkeypatch, capsys):
    """Three goals, as text."""
    row = {"seed": 7300, "alone": ["goal"], "graph": ["goal"]}
    monkeypatch.setattr(graph_drives, "compare", lambda *given: [row])
    main(["--drives", "1"])
    lines = capsys.readouterr().out.splitlines()
    assert len([line for line in lines if line.startswith(("| 1 ", "| 2 ", "| 3 "))]) == 3
