"""Tables of the study of movers, and a short drive."""

import pytest

from andabata.bench.studies.mover_probe import Moment, MoverDrive
from andabata.bench.studies.movers import drive_among_movers, drive_rows, main, range_rows
from andabata.navigation.mover_perception import MoverPerceptionConfig


def drive(laser="a", world="w", **measures):
    return MoverDrive((laser, world, 1), **measures)


def test_shares_are_of_the_moments_of_a_laser_in_a_range():
    """The first row has all ranges; errors are of those that were found."""
    moments = [
        Moment(1.0, 2, True, 0.1, 0.4),
        Moment(3.0, 1, True, 0.3, 0.2),
        Moment(3.4, 0, False),
        Moment(4.0, 1, False),
    ]
    rows = range_rows([drive(moments=moments[:2]), drive(moments=moments[2:]), drive("b")])
    everything, near, middle, far, other = rows[:5]
    assert (everything["moments"], everything["found"]) == (4, 0.5)
    assert (everything["looked at"], everything["twice"]) == (0.75, 0.25)
    assert everything["place error [m]"] == pytest.approx(0.2)
    assert everything["velocity error [m/s]"] == pytest.approx(0.3)
    assert near["found"] == 1.0
    assert (middle["moments"], middle["found"]) == (2, 0.5)
    assert (far["found"], far["place error [m]"]) == (0.0, None)
    assert (other["laser"], other["moments"], other["found"]) == ("b", 0, None)


def test_false_tracks_are_counted_by_the_minute():
    """Each laser and preset has a row."""
    drives = [
        drive(duration=60.0, false_tracks=1, tracks=3, encounters=4, met=2, cost=1e-3),
        drive(duration=180.0, false_tracks=1, tracks=1, jumps=1, cost=3e-3),
        drive(world="v", duration=30.0),
    ]
    first, second = drive_rows(drives)
    assert (first["minutes"], first["false tracks"], first["a minute"]) == (4.0, 2, 0.5)
    assert (first["tracks"], first["encounters"], first["found in"]) == (4, 4, 2)
    assert (first["jumps"], first["cost [ms]"]) == (1, pytest.approx(2.0))
    assert (second["world"], second["a minute"]) == ("v", 0.0)


def test_a_drive_ends_after_its_time():
    """Its measures are those of the case."""
    result = drive_among_movers(MoverPerceptionConfig(), 0.5, ("utm-30lx", "plain", 7300))
    assert result.case == ("utm-30lx", "plain", 7300)
    assert result.duration == pytest.approx(0.5)


def test_the_command_prints_two_tables(capsys):
    """Of the lasers and worlds that are asked for."""
    main(["--sensors", "utm-30lx", "--presets", "plain", "--worlds", "1", "--seconds", "0.3"])
    text = capsys.readouterr().out
    assert text.count("| utm-30lx |") == 5
    assert "| plain |" in text
