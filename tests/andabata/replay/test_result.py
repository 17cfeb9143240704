"""Counts, shares and texts of a replay's result."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.records.bag_reader import Period
from andabata.replay.result import (
    LocalizerStatistics,
    RecordedComparison,
    left_out,
    no_scan_reason,
    summary_text,
)

MOVING, STILL = WheelSpeeds(1.0, 2.0), WheelSpeeds(0.0, 0.0)
RANGES = np.array([1.0, np.nan, np.inf, 2.0], dtype=np.float32)


def period(ranges=None, wheels=MOVING):
    """Return a recorded control period."""
    return Period(SensorReadings(0.1), None, ranges, wheels)


def step(ranges=None, wheels=MOVING):
    """Return the outcome of a navigator's step."""
    scan = None if ranges is None else SimpleNamespace(ranges=ranges)
    return SimpleNamespace(scan=scan, wheels=wheels)


def compared(*pairs):
    """Return the counts of recorded periods and present steps."""
    comparison = RecordedComparison()
    for recorded, present in pairs:
        comparison.add(recorded, present)
    return comparison.as_dict()


def test_equal_scans_and_commands_do_not_differ():
    """Unknown sectors equal unknown ones, free ones free ones; a quarter is unknown."""
    found = compared((period(RANGES), step(RANGES.copy())))
    assert (found["compared_scans"], found["differing_scans"]) == (1, 0)
    assert (found["differing_sectors"], found["differing_commands"]) == (0, 0)
    assert found["unknown_share"] == 0.25


def test_a_sector_that_becomes_known_differs():
    """Each changed sector counts once, and the scan once."""
    found = compared(
        (period(RANGES), step(np.array([1.0, 3.0, np.inf, 2.5], dtype=np.float32))),
        (period(RANGES), step(RANGES)),
    )
    assert (found["compared_scans"], found["differing_scans"]) == (2, 1)
    assert found["differing_sectors"] == 2 / 8


def test_scans_of_other_sizes_differ_without_sectors():
    """A scan with another number of sectors differs, and adds none to the share of sectors."""
    found = compared((period(RANGES), step(RANGES[:2])))
    assert (found["differing_scans"], found["differing_sectors"]) == (1, None)


def test_a_scan_on_one_side_differs_while_the_recorded_navigator_ran():
    """One missing scan differs only in periods with a recorded command."""
    assert compared((period(RANGES), step()))["differing_scans"] == 1
    assert compared((period(), step(RANGES)))["differing_scans"] == 1
    assert compared((period(), step()))["differing_scans"] == 0
    found = compared((period(wheels=None), step(RANGES)))
    assert (found["scans"], found["recorded_scans"], found["differing_scans"]) == (1, 0, 0)


def test_commands_are_compared_where_one_is_recorded():
    """Present standstills are not moving periods; unrecorded commands cannot differ."""
    found = compared(
        (period(wheels=MOVING), step(wheels=STILL)),
        (period(wheels=STILL), step(wheels=STILL)),
        (period(wheels=None), step(wheels=MOVING)),
    )
    assert (found["periods"], found["moving_periods"], found["differing_commands"]) == (3, 1, 1)


def test_complaints_are_counted_without_their_numbers():
    """Complaints that differ in their numbers only are one; counts of pieces add up."""
    statistics = LocalizerStatistics()
    for seconds in (0.5, 0.6):
        text = f"imu: silent for {seconds} s"
        localizer = SimpleNamespace(health="lost", warnings=[text], counts={"imu": (3, 2, 1)})
        statistics.add(localizer)
        statistics.end(localizer)
    assert statistics.health == {"lost": 2}
    assert statistics.complaints == {"imu: silent": 2}
    assert statistics.counts == {"imu": (6, 4, 2)}


def result(**changes):
    """Return a result with one piece, changed."""
    piece = {"begin_s": 0.0, "seconds": 5.0, "scans": 3, "reason": None}
    data = compared((period(RANGES), step(RANGES)))
    return data | {
        "laser": "/2D_scan",
        "health": {"degraded": 1, "ok": 999},
        "complaints": {},
        "refused_by_reason": {},
        "pieces": [piece],
        "remark_texts": (),
        "left_out": [],
        **changes,
    }


@pytest.mark.parametrize(("refused", "number"), [(1, 0), (2, 1)])
def test_data_are_left_out_above_one_per_cent_of_refusals(refused, number):
    """A share of exactly one per cent is not reported, a greater one is."""
    data = result(refused_by_reason={"/imu": {"not a number": refused}})
    assert len(left_out(data, {"/imu": 100}, 0)) == number


def test_pieces_and_skipped_parts_are_left_out():
    """Several pieces, skipped parts and pieces without a start are one sentence each."""
    piece = result()["pieces"][0]
    data = result(pieces=[piece, piece | {"reason": "no fix"}])
    found = left_out(data, {}, 3)
    assert [text.split()[1] for text in found] == ["2", "3", "of"]
    assert found[2].startswith("1 of 2 pieces")
    assert left_out(result(), {}, 0) == []


def test_a_missing_scan_has_a_reason():
    """Refused messages and complaints explain a missing scan; else the laser does."""
    reason = no_scan_reason(result(refused_by_reason={"/imu": {"not a number": 4}}))
    assert reason.endswith("got none: /imu: 4 messages refused (not a number)")
    assert "/2D_scan made no whole cloud in 1 periods" in no_scan_reason(result())


def test_the_summary_shows_small_shares_and_few_remarks():
    """A share below one per cent is not shown as zero; the ninth remark is counted only."""
    text = summary_text(result(remark_texts=tuple(f"remark {k}" for k in range(9))))
    assert "health: ok 100 %, degraded < 1 %" in text
    assert "unknown: 25 % of the sectors" in text
    assert text.count("remark: remark") == 8
    assert "remark: 1 more, see --json" in text
    assert "pieces" not in text


def test_a_failed_check_leaves_no_period_ok():
    """Periods that were ok count as degraded, beside those that were."""
    statistics = LocalizerStatistics()
    statistics.health.update({"ok": 5, "degraded": 2, "lost": 1})
    assert statistics.health_after(False) == {"ok": 5, "degraded": 2, "lost": 1}
    assert statistics.health_after(True) == {"degraded": 7, "lost": 1}
