"""Motion: agreement of virtual scans, and tables of rides."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.motion import (
    GROUNDS,
    SPEEDS,
    TURNS,
    _agreement,
    _Frozen,
    _rings,
    agreement_table,
    error_table,
    ride_count,
)
from andabata.machine.pose import PoseTrack
from traversability.grid import PolarGrid


def test_scans_agree_up_to_one_ring():
    """Two rings apart is too far; an unknown sector agrees with unknown ones alone."""
    one, other = np.array([3, 3, 3, -10, -10]), np.array([4, 2, 5, -10, 0])
    assert _agreement(one, other) == pytest.approx(3 / 5)


def test_rings_of_ranges():
    """A range is the inner edge of its ring; free lies beyond the last one."""
    grid = PolarGrid()
    edges = grid.ring_edges
    ranges = np.array([edges[0], edges[3], np.inf, np.nan])
    scanner = SimpleNamespace(grid=grid, scan=lambda points: SimpleNamespace(ranges=ranges))
    assert _rings(scanner, None).tolist() == [0, 3, len(edges) - 1, -10]


def test_a_frozen_track_has_the_latest_pose_at_all_times():
    """Beams that are placed with it are not de-skewed."""
    track = PoseTrack()
    for stamp in (0.0, 1.0, 2.0):
        track.append(stamp, np.array([stamp, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    assert track.at(np.array([1.0]))[0, 0] == 1.0
    np.testing.assert_allclose(_Frozen(track).at(np.array([0.5, 1.0, 2.0]))[:, 0], 2.0)


def test_rows_without_clouds_are_left_out_of_tables():
    """A ride that ended in a collision has no errors."""
    names = ("error_median_m", "error_95_m", "skewed_median_m", "skewed_95_m")
    agree = ("scan_agrees", "skewed_scan_agrees", "true_scan_agrees", "standing_scan_agrees")
    row = {"ground": "lake", "turn": 0.4, "speed": 0.3, "clouds": 2}
    row |= {name: k / 10 for k, name in enumerate((*names, *agree), start=1)}
    rows = [row, {"ground": "lake", "turn": 0.4, "speed": 1.0, "clouds": 0}]
    (errors,), (agreements,) = error_table(rows), agreement_table(rows)
    assert errors["error [m]"] == "0.100 0.200"
    assert errors["skewed [m]"] == "0.300 0.400"
    assert [agreements[name] for name in ("scan", "skewed", "true pose", "standing")] == [
        0.5,
        0.6,
        0.7,
        0.8,
    ]


def test_rides_are_counted():
    """Each ground, yaw rate and speed has as many."""
    assert ride_count(3) == 3 * len(GROUNDS) * len(TURNS) * len(SPEEDS)
