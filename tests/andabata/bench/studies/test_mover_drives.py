"""Drives with tracks, without, and with the truth: what is counted, and a short drive of each."""

import pytest

from andabata.bench.studies.mover_drives import (
    ARMS,
    DriveJournal,
    arm_row,
    drive_arms,
    evaluation_of,
)
from tests.support.offroad_attempts import attempt


def test_contacts_are_counted_for_a_hundred_goals_and_goals_in_a_row():
    """Four goals tried in two drives, one of which ends by the robot's own motion."""
    drives = [
        [attempt(0, 1, "goal"), attempt(0, 2, "collision", contact="mover")],
        [attempt(1, 1, "goal"), attempt(1, 2, "collision", contact="hit")],
    ]
    row = arm_row("tracks", drives)
    assert (row["movers"], row["drives"], row["goals tried"]) == ("tracks", 2, 4)
    assert [row[f"goal {k}"] for k in (1, 2, 3)] == [2, 0, 0]
    assert (row["hit_mover a 100"], row["hit_by_mover a 100"]) == (25.0, 25.0)
    assert (row["hit_at_rest a 100"], row["obstacle a 100"], row["other failures"]) == (0, 0, 0)


def test_an_arm_without_a_name_is_refused():
    """The message lists them."""
    config = evaluation_of("plain", "utm-30lx", 7300, 1, {})
    with pytest.raises(ValueError, match="expected some of off, tracks, truth"):
        drive_arms(config, ["all"], 0)


def test_without_movers_all_arms_drive_the_same():
    """Nobody is there: the bits are those of a robot that looks for nobody."""
    config = evaluation_of("plain", "utm-30lx", 7300, 1, {})
    short = config.terminations.model_copy(update={"time_limit": 6.0})
    config = config.model_copy(update={"terminations": short})
    driven = drive_arms(config, ARMS, 0)
    ends = {tuple(driven[arm][-1].path[-1]) for arm in ARMS}
    assert len(ends) == 1


def test_a_journal_has_what_is_done_and_goes_on_after_half_a_line(tmp_path):
    """Rows come back as attempts; that of other drives is refused."""
    config, path = evaluation_of("plain", "utm-30lx", 7300, 2, {}), tmp_path / "journal"
    drives = {"off": (attempt(0, 1, "goal"),), "tracks": (attempt(0, 1, "goal", contact="hit"),)}
    DriveJournal(path, config, ("off", "tracks")).add(1, drives)
    whole = path.read_text()
    path.write_text(whole + whole.splitlines()[1][:40])
    journal = DriveJournal(path, config, ("off", "tracks"))
    journal.add(0, drives)
    found = DriveJournal(path, config, ("off", "tracks")).done
    assert list(found) == [1, 0]
    for arm in drives:
        assert arm_row(arm, [found[1][arm]]) == arm_row(arm, [drives[arm]])
    with pytest.raises(ValueError, match="expected the journal of these drives"):
        DriveJournal(path, config, ("off",))
    assert not DriveJournal(None, config, ("off",)).done
