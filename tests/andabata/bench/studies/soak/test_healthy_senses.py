"""Healthy senses: drives of each kind without a fault, and doubts that would be noticed."""

from collections import Counter
from itertools import product

import pytest

from andabata.bench.studies.soak import healthy_senses
from andabata.bench.studies.soak.healthy_senses import (
    PLANTS,
    PRESETS,
    healthy_drives,
    healthy_senses_are_believed,
)
from andabata.machine.reality import LEVELS
from worlds.splits import split_of


def test_each_preset_is_driven_at_each_level_in_each_plant():
    """Among 24 drives, each in a world of its own, none of which judges."""
    drives = list(healthy_drives(24))
    kinds = {(drive.preset, drive.reality, drive.plant) for drive in drives}
    assert kinds == set(product(PRESETS, LEVELS, PLANTS))
    assert len({drive.seed for drive in drives}) == 24
    assert {split_of(drive.seed) for drive in drives} == {"development"}


def test_a_drive_without_a_fault_has_no_doubt(tmp_path, monkeypatch):
    """A short one, in simulation."""
    monkeypatch.setattr(healthy_senses, "_LASTS", 5.0)
    outcome = healthy_senses_are_believed(1, tmp_path)
    assert outcome.failures == ()
    assert outcome.figure == "0 of 1 drives with a doubt in 0.0 h"


@pytest.mark.parametrize(
    ("cause", "is_doubt"),
    [
        ("gnss: off", False),
        ("gnss: not accepted", False),
        ("compass: not accepted", False),
        ("compass: fewer usable readings than usual", True),
        ("laser: silent", True),
        ("gnss: arrives late", True),
    ],
)
def test_a_doubt_fails_and_a_true_cause_is_told(cause, is_doubt, tmp_path, monkeypatch):
    """Simulated multipath and disturbances are there."""
    monkeypatch.setattr(healthy_senses, "_causes", lambda *_: (1800.0, Counter({cause: 3})))
    outcome = healthy_senses_are_believed(2, tmp_path)
    assert outcome.failed == (2 if is_doubt else 0)
    told = "2 of 2 drives with a doubt in 1.0 h"
    assert outcome.figure == (
        told if is_doubt else f"0 of 2 drives with a doubt in 1.0 h; 2 with {cause}"
    )
