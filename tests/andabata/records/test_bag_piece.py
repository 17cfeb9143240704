"""Pieces are read like recordings of their own."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.records.bag_piece import BagPiece, with_stamp
from andabata.records.bags import Message
from andabata.records.clocks import Clock
from andabata.records.messages import NS, MessageBuilder, header_ns
from andabata.records.pieces import Piece

COMPOSE = MessageBuilder(2)


class ListBag:
    """A recording of some messages."""

    path = "list"
    topics = {"/imu": ("sensor_msgs/msg/Imu", 1)}  # noqa: RUF012

    def __init__(self, messages):
        """Keep messages."""
        self._messages = messages

    def messages(self, topics=None):
        """Yield the messages of topics."""
        return (m for m in self._messages if topics is None or m.topic in topics)


def message(topic, stamp_ns, header=None):
    """Return a message with the stamp of its header [ns]."""
    content = SimpleNamespace()
    if header is not None:
        content = with_stamp(COMPOSE.imu(np.zeros(7)), header)
    return Message(topic, "kind", stamp_ns, content)


def read(messages, clock=None, begin=10, end=20, topics=("/imu",)):
    """Return the messages of a piece from ``begin`` to ``end``."""
    piece = Piece(begin, end, begin, end, clock or Clock())
    return list(BagPiece(ListBag(messages), piece).messages(topics))


def test_a_piece_begins_inclusive_and_ends_exclusive():
    """Neighbouring pieces share no message and lose none."""
    given = [message("/imu", stamp) for stamp in (9, 10, 19, 20)]
    assert [m.stamp_ns for m in read(given)] == [10, 19]
    assert [m.stamp_ns for m in read(given, begin=20, end=30)] == [20]


def test_latched_transforms_belong_to_all_pieces():
    """Static transforms of any time are read, other topics are not."""
    stamps = [("/tf_static", 1), ("/imu", 5), ("/imu", 20), ("/tf_static", 99)]
    given = [message(topic, stamp) for topic, stamp in stamps]
    found = read(given, topics=("/tf_static", "/imu"))
    assert [(m.topic, m.stamp_ns) for m in found] == [("/tf_static", 1), ("/tf_static", 99)]


@pytest.mark.parametrize(
    ("offset", "duration", "header"), [(7, 0, 107), (-7, 3, 93), (None, 0, 15), (None, 3, 12)]
)
def test_headers_are_shifted_or_replaced(offset, duration, header):
    """An offset is added; None takes the recorder's stamp less the duration of a message."""
    durations = {"/imu": duration} if duration else {}
    clock = Clock(header_offsets={"/imu": offset}, durations=durations)
    (found,) = read([message("/imu", 15, 100)], clock)
    assert (found.stamp_ns, header_ns(found.content)) == (15, header)


def test_stamps_are_converted_into_the_pieces_clock():
    """Headers of that clock stay, the recorder's stamps change."""
    clock = Clock(np.array([10, 20]), np.array([1010, 1020]))
    (found,) = read([message("/imu", 15, 1014)], clock)
    assert (found.stamp_ns, header_ns(found.content)) == (1015, 1014)


def test_a_stamp_is_split_into_seconds_and_nanoseconds():
    """The original message is left as it is."""
    original = COMPOSE.imu(np.zeros(7))
    changed = with_stamp(original, 5 * NS + 7)
    assert (changed.header.stamp.sec, changed.header.stamp.nanosec) == (5, 7)
    assert header_ns(original) == COMPOSE.epoch_ns
