"""Pieces of a recording: where it is cut, and which parts are left out."""

import numpy as np
import pytest

from andabata.records.clocks import TopicStamps
from andabata.records.messages import NS
from andabata.records.pieces import LONGEST_GAP, MOST_PIECES, cut_pieces
from andabata.records.remarks import Remarks
from tests.support.wrong_stamps import BEGIN, HOUR, topic_stamps


def cut(given):
    """Return pieces, the number of parts left out, and the remarks as text."""
    remarks = Remarks()
    return *cut_pieces(given, remarks), " ".join(remarks.texts)


def after(seconds, step):
    """Return a clock that jumps by ``step`` [ns] at a time [s]."""
    return lambda t: t + (step if t > BEGIN + seconds * NS else 0)


def test_a_sound_recording_is_one_piece():
    """Without gaps nothing is cut, shifted or remarked on."""
    pieces, left_out, text = cut(topic_stamps())
    assert len(pieces) == 1
    assert pieces[0].clock.is_identity
    assert (left_out, text) == (0, "")
    assert pieces[0].begin_ns < BEGIN < pieces[0].end_ns


@pytest.mark.parametrize("step", [8 * HOUR, -8 * HOUR, 8 * 8766 * HOUR, 5 * NS, 1 << 60])
def test_a_clock_that_is_set_cuts_the_recording(step):
    """A step of all stamps makes two pieces, each with its own clock."""
    jump = after(6, step)
    pieces, left_out, text = cut(topic_stamps(jump, jump))
    assert sorted(round(piece.seconds) for piece in pieces) == [6, 14]
    assert all(piece.clock.is_identity for piece in pieces)
    assert left_out == 0
    assert "cut there" in text


@pytest.mark.parametrize("step", [HOUR, -HOUR, 2 * NS])
def test_headers_that_jump_alone_cut_it_too(step):
    """The second piece converts by the size and the sign of the step."""
    pieces, _, text = cut(topic_stamps(header=after(6, step)))
    assert [round(piece.seconds) for piece in pieces] == [6, 14]
    assert pieces[0].clock.is_identity
    second = pieces[1].clock
    assert second.convert(BEGIN + 10 * NS) == BEGIN + 10 * NS + step
    assert not second.header_offsets
    assert "jump by" in text


def test_mixed_messages_are_left_out():
    """Where the clock went back, both times are left out and no more."""
    jump = after(12, -3 * NS)
    pieces, left_out, text = cut(topic_stamps(jump, jump))
    assert left_out == 1
    assert "went back by about 3 s" in text
    assert len(pieces) == 2
    assert pieces[0].end_ns <= BEGIN + 9.1 * NS
    assert pieces[1].begin_ns >= BEGIN + 11.9 * NS
    assert 8 < pieces[0].seconds < 9.1
    assert 4 < pieces[1].seconds < 5.1


def test_twice_as_many_messages_throughout_are_no_overlap():
    """A doubled recording is the usual rate."""
    given = [
        TopicStamps(s.name, np.repeat(s.recorder, 2), np.repeat(s.header, 2), s.max_lag, s.duration)
        for s in topic_stamps()
    ]
    pieces, left_out, _ = cut(given)
    assert (len(pieces), left_out) == (1, 0)


def test_a_delay_of_transport_cuts_nothing():
    """Headers that continue over a gap of the recorder are one piece."""
    held = topic_stamps(lambda t: max(t, BEGIN + 9 * NS) if t > BEGIN + 5 * NS else t)
    pieces, left_out, _ = cut(held)
    assert (len(pieces), left_out) == (1, 0)


def test_pieces_that_are_too_short_or_too_many_are_left_out():
    """Pieces under a second and all but the longest thirty are left out."""
    many = 3 * MOST_PIECES
    jump = lambda t: t + ((t - BEGIN) // (2 * NS)) * 10 * NS  # noqa: E731
    pieces, left_out, _ = cut(topic_stamps(jump, jump, seconds=2.0 * many))
    assert len(pieces) == MOST_PIECES
    assert left_out >= many - MOST_PIECES
    jump = lambda t: t + ((t - BEGIN) // (NS // 2)) * 10 * NS  # noqa: E731
    pieces, left_out, _ = cut(topic_stamps(jump, jump, seconds=5.0))
    assert pieces == []
    assert left_out >= 9


def test_a_start_of_hours_ago_begins_with_the_first_reading():
    """Only a start within the piece, or just before, is its epoch."""
    (piece,), _, _ = cut(topic_stamps())
    first = BEGIN + NS // 100
    assert piece.epoch_ns(BEGIN) == BEGIN
    assert piece.epoch_ns(BEGIN - HOUR) == first
    assert piece.epoch_ns(BEGIN + HOUR) == first
    assert piece.epoch_ns(0) == first
    assert LONGEST_GAP < 10


@pytest.mark.parametrize(("gap", "count"), [(NS + 9 * NS // 10, 1), (2 * NS + NS // 10, 2)])
def test_a_silence_of_more_than_two_seconds_cuts(gap, count):
    """The next piece begins with the first message after the gap, and the first ends before it."""
    paused = after(6, gap)
    pieces, left_out, _ = cut(topic_stamps(paused, paused))
    assert (len(pieces), left_out) == (count, 0)
    if count == 2:
        first = BEGIN + 6 * NS + NS // 100 + gap
        assert (pieces[1].begin_ns, pieces[1].first_ns) == (first, first)
        assert pieces[0].end_ns == pieces[0].last_ns + round(LONGEST_GAP * NS)
        assert pieces[0].last_ns == BEGIN + 6 * NS


def test_fixes_alone_do_not_lengthen_a_piece():
    """A topic that is not steady neither cuts nor goes on after the others."""
    times = BEGIN + np.arange(1, 40) * NS
    fixes = TopicStamps("/fix", times, times, 3.0, is_steady=False)
    (piece,), _, text = cut([*topic_stamps(), fixes])
    assert piece.last_ns == BEGIN + 20 * NS
    assert piece.end_ns == BEGIN + 22 * NS
    assert text == ""
    assert cut([fixes])[:2] == ([], 0)
