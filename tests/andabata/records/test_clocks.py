"""Clocks of a piece: whose headers are the reference, and which are shifted."""

import numpy as np
import pytest

from andabata.records.clocks import Clock, TopicStamps, duration_text, estimate_clock
from andabata.records.messages import NS
from andabata.records.remarks import Remarks
from tests.support.wrong_stamps import BEGIN, topic_stamps


def estimated(given):
    """Return the clock of topics, and the remarks as text."""
    remarks = Remarks()
    return estimate_clock(given, remarks), " ".join(remarks.texts)


def test_simulated_time_is_the_clock_of_all_topics():
    """Headers that agree with each other alone are the clock, at any rate."""
    clock, text = estimated(topic_stamps(header=lambda t: (t - BEGIN) // 3 + 50 * NS))
    assert not clock.header_offsets
    assert clock.convert(BEGIN + 9 * NS) == pytest.approx(53 * NS, abs=1000)
    assert clock.convert(BEGIN) < clock.convert(BEGIN + 1) + 1
    assert "theirs is used" in text


def test_a_laser_with_its_own_clock_is_shifted_to_its_last_point():
    """Its offset is the median difference less the duration of a message."""
    given = topic_stamps()
    laser = given[2]
    given[2] = TopicStamps("/laser", laser.recorder, laser.header - BEGIN, 1.0, 0.1)
    clock, text = estimated(given)
    assert clock.header_offsets == {"/laser": pytest.approx(BEGIN, abs=1000)}
    assert "/laser: headers are of another clock" in text


def test_headers_without_stamps_get_the_recorders():
    """Zero headers are replaced by the time of recording."""
    given = topic_stamps()
    given[0] = TopicStamps("/imu", given[0].recorder, np.zeros_like(given[0].header), 0.3)
    clock, text = estimated(given)
    assert clock.header_offsets == {"/imu": None}
    assert "no stamps" in text


def test_time_goes_on_beyond_the_ends_of_a_clock():
    """Times are interpolated inside and shifted outside."""
    clock = Clock(np.array([100, 200], np.int64), np.array([10, 30], np.int64))
    assert [clock.convert(t) for t in (90, 100, 150, 200, 207)] == [0, 10, 20, 30, 37]


def test_headers_ahead_of_the_recorder_are_shifted_back():
    """The offset has the sign that brings headers to the recorder's time."""
    given = topic_stamps()
    laser = given[2]
    given[2] = TopicStamps("/laser", laser.recorder, laser.header + 7 * NS, 1.0, 0.1)
    clock, text = estimated(given)
    assert clock.header_offsets == {"/laser": pytest.approx(-7 * NS, abs=1000)}
    assert "6.90 s ahead" in text


def test_headers_at_another_rate_get_the_recorders_stamps():
    """No offset fits a clock that drifts; the duration of a message is kept."""
    given = topic_stamps()
    laser = given[2]
    drifting = BEGIN + (laser.header - BEGIN) // 2
    given[2] = TopicStamps("/laser", laser.recorder, drifting, 1.0, 0.1)
    clock, _ = estimated(given)
    assert clock.header_offsets == {"/laser": None}
    assert clock.durations == {"/laser": NS // 10}


def test_a_part_of_stamps_begins_inclusive_and_ends_exclusive():
    """Neighbouring parts share no message and lose none."""
    stamps = np.array([10, 20, 30], np.int64)
    given = TopicStamps("/imu", stamps, stamps + 1, 0.3, 0.1, False)
    first, second = given.within(10, 20), given.within(20, 31)
    assert first.recorder.tolist() == [10]
    assert second.recorder.tolist() == [20, 30]
    assert second.header.tolist() == [21, 31]
    assert (second.max_lag, second.duration, second.is_steady) == (0.3, 0.1, False)


@pytest.mark.parametrize(("headers", "offset"), [([3, 0, 0], None), ([3, 3, 0], 4e-9)])
def test_an_offset_needs_more_than_half_of_the_headers(headers, offset):
    """Recorder minus header in seconds; zeros are no stamps."""
    stamps = TopicStamps("/imu", np.array([7, 7, 7]), np.array(headers), 0.3)
    assert stamps.offset == (None if offset is None else pytest.approx(offset))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(1.5, "1.50 s"), (-300, "5.0 min"), (7200, "2.0 h"), (86400 * 3, "3.0 days")],
)
def test_durations_have_the_largest_unit_of_at_least_two(seconds, text):
    """The sign of a duration is not shown."""
    assert duration_text(seconds) == text
