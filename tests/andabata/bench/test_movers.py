"""Tables of tracks against the truth, and short drives of each kind of laser."""

import numpy as np
import pytest

from andabata.app.console import Console
from andabata.bench.mover_tally import Moment, MoverDrive
from andabata.bench.movers import (
    PLANAR_KINDS,
    BenchMoversConfig,
    bench_movers,
    class_rows,
    class_table,
    drive_case,
    drive_rows,
    drive_table,
)


def drive(laser="a", world="w", **measures):
    return MoverDrive((laser, world, 1), **measures)


MOMENTS = [
    Moment(1.0, 0.2, 2, True, 0.1, 0.4),
    Moment(3.0, 1.0, 1, True, 0.3, 0.2),
    Moment(3.4, 1.0, 0, False),
    Moment(4.0, 9.0, 1, False),
]


def rows_of(drives, speeds=False):
    """Return rows by range, or by speed."""
    if speeds:
        return class_rows(drives, "speed_m_s", (0.0, 0.5, np.inf), lambda m: m.speed)
    return class_rows(drives, "range_m", (0.0, 2.0, 3.5, 5.0), lambda m: m.distance)


def test_shares_are_of_the_moments_of_a_laser_in_a_class():
    """The first row has all ranges; errors are of those that were found."""
    drives = [drive(moments=MOMENTS[:2]), drive(moments=MOMENTS[2:]), drive("b")]
    everything, near, middle, far, other = rows_of(drives)[:5]
    assert (everything["moments"], everything["found"], everything["missed"]) == (4, 2, 2)
    assert (everything["looked_at_share"], everything["twice_share"]) == (0.75, 0.25)
    assert everything["place_error_m"] == pytest.approx(0.2)
    assert everything["velocity_error_m_s"] == pytest.approx(0.3)
    assert everything["velocity_error_90_m_s"] == pytest.approx(0.38)
    assert (near["found_share"], near["range_m"]) == (1.0, [0.0, 2.0])
    assert (middle["moments"], middle["found_share"]) == (2, 0.5)
    assert (far["found_share"], far["place_error_m"]) == (0.0, None)
    assert (other["laser"], other["moments"], other["found_share"]) == ("b", 0, None)


def test_speeds_have_an_open_last_class():
    """Its upper edge is none, in JSON and in the table for people."""
    rows = rows_of([drive(moments=MOMENTS)], speeds=True)
    assert [row["moments"] for row in rows] == [4, 1, 3]
    assert [row["speed_m_s"] for row in rows] == [[0.0, None], [0.0, 0.5], [0.5, None]]
    shown = class_table(rows, "speed_m_s", "speed [m/s]")
    assert [row["speed [m/s]"] for row in shown] == ["all", "0 to 0.5", "from 0.5"]
    assert [row["found"] for row in shown] == [0.5, 1.0, pytest.approx(1 / 3)]


def test_false_tracks_are_counted_by_the_minute():
    """Each laser and kind of world has a row."""
    drives = [
        drive(duration=60.0, false_tracks=1, tracks=3, encounters=4, met=2, cost=1e-3),
        drive(duration=180.0, false_tracks=1, tracks=1, jumps=1, cost=3e-3),
        drive(world="v", duration=30.0),
    ]
    rows = drive_rows(drives)
    first, second = rows
    assert (first["minutes"], first["false_tracks"], first["false_a_minute"]) == (4.0, 2, 0.5)
    assert (first["tracks"], first["encounters"], first["found_in"]) == (4, 4, 2)
    assert (first["jumps"], first["cost_ms"]) == (1, pytest.approx(2.0))
    assert (second["world"], second["false_a_minute"]) == ("v", 0.0)
    assert [row["a minute"] for row in drive_table(rows)] == [0.5, 0.0]


def test_an_offroad_drive_ends_after_its_time():
    """Its measures are those of the case."""
    result = drive_case(BenchMoversConfig(), 0.5, ("utm-30lx", "plain", 7300))
    assert result.case == ("utm-30lx", "plain", 7300)
    assert result.duration == pytest.approx(0.5)


def test_a_laser_drives_in_its_own_worlds():
    """The planar one in rooms; the same call gives the same rows."""
    calls = [
        bench_movers(BenchMoversConfig(), ["planar"], 1, 0.5, 7300, 1, Console(quiet=True))
        for _ in range(2)
    ]
    assert [row["world"] for row in calls[0]["drives"]] == list(PLANAR_KINDS)
    assert calls[0]["ranges"] == calls[1]["ranges"]
    assert (calls[0]["seed"], calls[0]["worlds"], calls[0]["seconds"]) == (7300, 1, 0.5)
