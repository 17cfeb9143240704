"""Faults of a receiver, and what is said of the filter that meets them."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.outages import FAULTS, Fault, FaultyDrive, fault_row, outage_table

FIXES = np.array([[float(k), 37.0, -4.0, 50.0, 0.5] for k in range(10)])


def test_an_outage_removes_the_fixes_of_its_span():
    """Fixes from the begin on are gone, that of the end is there again."""
    assert Fault("", outage=(3.0, 6.0)).apply(FIXES)[:, 0].tolist() == [0, 1, 2, 6, 7, 8, 9]


def test_a_jump_moves_the_fixes_of_its_span_700_m_north():
    """A 160th of a degree of latitude; the others, and the argument, stay."""
    before = FIXES.copy()
    moved = Fault("", jump=(3.0, 5.0)).apply(FIXES)
    metres = (moved[:, 1] - FIXES[:, 1]) * 111_320
    np.testing.assert_allclose(metres, [0, 0, 0, 700, 700, 0, 0, 0, 0, 0], atol=1e-6)
    np.testing.assert_array_equal(FIXES, before)


def test_a_false_accuracy_scales_the_stated_variance():
    """A third of the sigma is a ninth of the variance."""
    np.testing.assert_allclose(Fault("", sigma_ratio=1 / 3).apply(FIXES)[:, 4], 0.5 / 9)


@pytest.mark.parametrize(
    ("fault", "span"),
    [
        (Fault("", outage=(60.0, 120.0)), (60.0, 120.0)),
        (Fault("", outage=(60.0, 120.0), jump=(120.0, 225.0)), (60.0, 225.0)),
        (Fault("", jump=(120.0, 121.0)), (120.0, 121.0)),
        (Fault("", sigma_ratio=0.5), (0.0, np.inf)),
    ],
)
def test_the_span_is_that_of_the_fault(fault, span):
    """What lasts for the whole drive is measured over the whole drive."""
    assert fault.span == span


def drive(end, way, moved=0.0):
    """Return a drive of two steps that ends with an error along x [m]."""
    errors = np.array([[0.1, 0.0, 0.0], [end, 0.0, 0.0]])
    return FaultyDrive(errors, np.array([1.0, 3.0]), np.array([moved, 0.0]), way)


def test_an_error_counts_by_the_way():
    """A metre and 2 % of the way are the limit; drives that end before the fault do not count."""
    short = FaultyDrive(np.empty((0, 3)), np.empty(0), np.empty(0), 0.0)
    row = fault_row("outage", [drive(1.99, 50.0), drive(2.01, 50.0, moved=0.7), short])
    assert (row["drives"], row["within"], row["moved_m"]) == (2, 0.5, 0.7)
    assert row["largest_at_end_m"] == 2.01
    assert row["nees_mean"] == 2.0
    assert fault_row("outage", [short]) == {"fault": "outage", "drives": 0}
    assert len(outage_table([row, fault_row("outage", [short])])) == 1


def test_the_command_measures_every_fault(capsys):
    """One drive in a maze: a row for each fault; a lie about the accuracy moves nothing much."""
    words = ["bench", "localization", "--world", "maze", "--drives", "1", "--rides", "0"]
    settings = ["--set", "plant=kinematic", "--outages", "--json", "--quiet"]
    assert main([*words, *settings]) == 0
    rows = json.loads(capsys.readouterr().out)["outages"]
    assert [row["fault"] for row in rows] == [fault.name for fault in FAULTS]
    lies = [row for row in rows if row["fault"].startswith("states")]
    assert all(row["moved_m"] < 1.0 and row["nees_mean"] < 20 for row in lies)
