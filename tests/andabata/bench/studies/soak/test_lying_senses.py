"""Senses that lie: the checks pass in their short form, and notice what is not flagged."""

from dataclasses import replace

import pytest

from andabata.bench.studies.soak import lying_senses
from andabata.bench.studies.soak.lying_senses import (
    faults_of_senses,
    faults_of_senses_are_flagged,
    jumps_of_fixes_move_nothing,
    lost_fixes_stop_the_robot,
)
from andabata.machine.faults import KINDS, SENSES
from andabata.navigation.fault_watch import FaultResponse


def test_each_kind_of_each_sense_comes_once_a_round():
    """In the first world, then in the next."""
    found = list(faults_of_senses(80))
    first = {(fault.sense, fault.kind) for fault, _ in found[:40]}
    assert len(first) == len(SENSES) * len(KINDS) == 40
    assert [fault for fault, _ in found[:40]] == [fault for fault, _ in found[40:]]
    assert len({seed for _, seed in found}) == 2


def test_a_drive_says_what_became_of_a_fault(tmp_path, monkeypatch):
    """The laser falls silent: flagged in time, and nothing else."""
    monkeypatch.setattr(lying_senses, "_ONSET", 3.0)
    monkeypatch.setattr(lying_senses, "_LASTS", 2.5)
    outcome = faults_of_senses_are_flagged(1, tmp_path)
    assert outcome.failures == ()
    assert outcome.figure == "1 of 1 flagged within 2 s, 0 contacts, 0 bad commands"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"flagged_after_s": 2.1}, "flagged after 2.1 s"),
        ({"flagged_after_s": None}, "flagged after None s"),
        ({"contact_after_s": 3.0}, "contact after 3.0 s"),
        ({"bad_commands": 2}, "2 commands out of range"),
    ],
)
def test_late_flags_contacts_and_bad_commands_fail(changes, words, tmp_path, monkeypatch):
    """Each of them."""
    response = replace(FaultResponse(10.0, 1.0, 0, "ok"), **changes)
    monkeypatch.setattr(lying_senses, "_response", lambda *_: response)
    (failure,) = faults_of_senses_are_flagged(1, tmp_path).failures
    assert failure.endswith(words)


def test_fixes_that_jump_move_nothing(tmp_path, monkeypatch):
    """One drive of each size; one with a smaller limit fails."""
    assert jumps_of_fixes_move_nothing(1, tmp_path).failures == ()
    monkeypatch.setattr(lying_senses, "SPEED", -10.0)
    failures = jumps_of_fixes_move_nothing(1, tmp_path).failures
    assert all(": off by " in text for text in failures)
    assert len(failures) == 3
    monkeypatch.setattr(lying_senses, "SPEED", 0.3)
    monkeypatch.setattr(lying_senses, "JUMPS", (1.0,))
    assert "health ok after 1 fixes" in jumps_of_fixes_move_nothing(1, tmp_path).failures[0]


def test_a_robot_without_fixes_is_lost_and_finds_a_way_out(tmp_path, monkeypatch):
    """It is degraded, later lost, stands, and is well again; each limit is one."""
    outcome = lost_fixes_stop_the_robot(1, tmp_path)
    assert outcome.failures == ()
    for name, value, words in (
        ("_DEGRADED", 1.0, "not degraded within 1.0 s"),
        ("_LOST_BY", 60.0, "never lost in 60 s"),
    ):
        with monkeypatch.context() as changed:
            changed.setattr(lying_senses, name, value)
            assert words in lost_fixes_stop_the_robot(1, tmp_path).failures[0]
    monkeypatch.setattr(lying_senses, "command_of", lambda _: lambda: 0.3)
    assert "after it is lost" in lost_fixes_stop_the_robot(1, tmp_path).failures[0]
