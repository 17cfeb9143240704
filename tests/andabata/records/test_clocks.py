"""Clocks: where a recording is cut, whose time a piece has, and which headers are shifted."""

import numpy as np
import pytest

from andabata.records.clocks import LONGEST_GAP, MOST_PIECES, NS, Clock, SenseStamps, cut_pieces
from andabata.records.remarks import Remarks

BEGIN = 1_700_000_000 * NS
HOUR = 3600 * NS


def readings(recorder=lambda t: t, header=lambda t: t, seconds=20.0):
    """Return the stamps of three senses whose two clocks are functions of the true time [ns]."""
    found = []
    for name, rate, lag, delay in (
        ("/imu", 100, 0.3, 0),
        ("/wheels", 50, 0.3, 0),
        ("/laser", 10, 1.0, 10**8),
    ):
        times = BEGIN + (np.arange(1, round(seconds * rate) + 1) * (NS // rate)).astype(np.int64)
        stamps = np.array([recorder(int(t)) for t in times], dtype=np.int64)
        heads = np.array([header(int(t) - delay) for t in times], dtype=np.int64)
        order = np.argsort(stamps, kind="stable")
        found.append(SenseStamps(name, stamps[order], heads[order], lag, delay / NS))
    return found


def cut(given):
    remarks = Remarks()
    return *cut_pieces(given, remarks), " ".join(remarks.texts)


def after(seconds, step):
    """Return a clock that jumps by ``step`` [ns] at a time [s]."""
    return lambda t: t + (step if t > BEGIN + seconds * NS else 0)


def test_a_sound_recording_is_one_piece_and_stays_as_it_is():
    pieces, left_out, said = cut(readings())
    assert len(pieces) == 1
    assert pieces[0].clock.plain
    assert (left_out, said) == (0, "")
    assert pieces[0].begin_ns < BEGIN < pieces[0].end_ns


@pytest.mark.parametrize("step", [8 * HOUR, -8 * HOUR, 8 * 8766 * HOUR, 5 * NS, 1 << 60])
def test_a_clock_that_is_set_cuts_the_recording(step):
    jump = after(6, step)
    pieces, left_out, said = cut(readings(jump, jump))
    assert sorted(round(piece.seconds) for piece in pieces) == [6, 14]
    assert all(piece.clock.plain for piece in pieces)
    assert left_out == 0
    assert "cut there" in said


@pytest.mark.parametrize("step", [HOUR, -HOUR, 2 * NS])
def test_headers_that_jump_alone_cut_it_too_and_each_piece_has_its_clock(step):
    pieces, _, said = cut(readings(header=after(6, step)))
    assert [round(piece.seconds) for piece in pieces] == [6, 14]
    assert pieces[0].clock.plain
    second = pieces[1].clock
    assert second.time(BEGIN + 10 * NS) == BEGIN + 10 * NS + step
    assert not second.shifts
    assert "jump by" in said


def test_what_lies_mixed_after_a_clock_went_back_is_left_out():
    jump = after(12, -3 * NS)
    pieces, left_out, said = cut(readings(jump, jump))
    assert left_out == 1
    assert "went back by about 3 s" in said
    assert len(pieces) == 2
    assert pieces[0].end_ns <= BEGIN + 9.1 * NS
    assert pieces[1].begin_ns >= BEGIN + 11.9 * NS
    assert 8 < pieces[0].seconds < 9.1
    assert 4 < pieces[1].seconds < 5.1


def test_twice_as_many_messages_throughout_are_no_overlap():
    given = [
        SenseStamps(s.name, np.repeat(s.recorder, 2), np.repeat(s.header, 2), s.lag, s.span)
        for s in readings()
    ]
    pieces, left_out, _ = cut(given)
    assert (len(pieces), left_out) == (1, 0)


def test_a_hold_up_on_the_way_to_the_recorder_cuts_nothing():
    held = readings(lambda t: max(t, BEGIN + 9 * NS) if t > BEGIN + 5 * NS else t)
    pieces, left_out, _ = cut(held)
    assert (len(pieces), left_out) == (1, 0)


def test_simulated_time_is_everybodys_however_fast_it_runs():
    pieces, _, said = cut(readings(header=lambda t: (t - BEGIN) // 3 + 50 * NS))
    (piece,) = pieces
    assert not piece.clock.shifts
    assert piece.clock.time(BEGIN + 9 * NS) == pytest.approx(53 * NS, abs=1000)
    assert piece.clock.time(BEGIN) < piece.clock.time(BEGIN + 1) + 1
    assert "theirs is used" in said


def test_a_laser_with_its_own_clock_is_shifted_to_its_last_point():
    given = readings()
    laser = given[2]
    given[2] = SenseStamps("/laser", laser.recorder, laser.header - BEGIN, 1.0, 0.1)
    (piece,), _, said = cut(given)
    assert piece.clock.shifts == {"/laser": pytest.approx(BEGIN, abs=1000)}
    assert "/laser: headers are of another clock" in said


def test_headers_without_stamps_get_the_recorders():
    given = readings()
    given[0] = SenseStamps("/imu", given[0].recorder, np.zeros_like(given[0].header), 0.3)
    (piece,), _, said = cut(given)
    assert piece.clock.shifts == {"/imu": None}
    assert "no stamps" in said


def test_pieces_that_are_too_short_or_too_many_are_left_out():
    many = 3 * MOST_PIECES
    jump = lambda t: t + ((t - BEGIN) // (2 * NS)) * 10 * NS  # noqa: E731
    pieces, left_out, _ = cut(readings(jump, jump, seconds=2.0 * many))
    assert len(pieces) == MOST_PIECES
    assert left_out >= many - MOST_PIECES
    jump = lambda t: t + ((t - BEGIN) // (NS // 2)) * 10 * NS  # noqa: E731
    pieces, left_out, _ = cut(readings(jump, jump, seconds=5.0))
    assert pieces == []
    assert left_out >= 9


def test_time_goes_on_beyond_the_ends_of_a_clock():
    clock = Clock(np.array([100, 200], np.int64), np.array([10, 30], np.int64))
    assert [clock.time(t) for t in (90, 100, 150, 200, 207)] == [0, 10, 20, 30, 37]


def test_a_start_that_was_told_hours_ago_begins_with_the_first_sense():
    (piece,), _, _ = cut(readings())
    first = BEGIN + NS // 100
    assert piece.epoch_ns(BEGIN) == BEGIN
    assert piece.epoch_ns(BEGIN - HOUR) == first
    assert piece.epoch_ns(BEGIN + HOUR) == first
    assert piece.epoch_ns(0) == first
    assert LONGEST_GAP < 10
