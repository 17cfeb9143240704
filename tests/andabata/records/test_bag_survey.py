"""A survey finds clocks, units and settings in one pass."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.bag_survey import BagSurvey, survey_bag
from andabata.records.bags import Bag, BagError, Message
from andabata.records.clocks import Clock
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.units import UnitFactors
from andabata.records.messages import NS
from andabata.records.remarks import Remarks
from tests.support import computed_bags
from tests.support.foreign_messages import joints

LASER = topics.LASER_CLOUD


def surveyed(path, rows):
    """Return the survey of a bag with some rows."""
    with Bag(computed_bags.write(path / "x.bag", rows)) as bag:
        return survey_bag(bag, LASER, {}, MessageDecoder(units=UnitFactors()))


def test_a_survey_counts_messages_and_keeps_readings(tmp_path):
    """Counts are by both names of a topic, and the history holds the readings."""
    found = surveyed(tmp_path, computed_bags.drive(3.0))
    assert found.messages == {
        "/encoder_data": 300, "/imu": 300, "/mag_orientation": 300, "/laser_cloud": 30, "/fix": 3,
    }  # fmt: skip
    assert found.counts == found.messages
    assert found.history.array(topics.IMU).shape == (300, 7)
    assert found.history.array(topics.ENCODERS).shape == (300, 3)
    assert found.history.array(topics.MAG).shape == (300, 4)
    assert found.settings == {}
    (piece,), left_out = found.pieces(Remarks())
    assert (piece.clock, left_out) == (Clock(), 0)


def test_a_cloud_of_another_clock_is_shifted_by_its_duration(tmp_path):
    """The stamp of a cloud is that of its first point, a tenth of a second before the last."""
    rows = [
        computed_bags.restamped(row, row.stamp_ns - 50 * NS) if row.topic == "/laser_cloud" else row
        for row in computed_bags.drive(3.0)
    ]
    (piece,), _ = surveyed(tmp_path, rows).pieces(Remarks())
    duration = 359 / 3600
    offset = pytest.approx((50 - duration) * NS, abs=0.002 * NS)
    assert piece.clock.header_offsets == {"/laser_cloud": offset}


def test_a_sensor_without_a_usable_message_is_refused(tmp_path):
    """The error has the most frequent reason, or the joints that were found."""
    rows = computed_bags.drive(2.0)
    wheels = [row for row in rows if row.topic == "/encoder_data"]
    others = [row for row in rows if row.topic != "/encoder_data"]
    bad = [replace(row, content=replace(row.content, left=np.nan)) for row in wheels]
    with pytest.raises(BagError, match=r"/encoder_data: .* got 200 refused: a wheel's speed is"):
        surveyed(tmp_path, [*others, *bad])
    kind = "sensor_msgs/msg/JointState"
    arm = [replace(row, kind=kind, content=joints(("elbow",), [0.0])) for row in wheels]
    with pytest.raises(BagError, match=r"expected joints called wheels .*, got elbow; --map"):
        surveyed(tmp_path, [*others, *arm])


def test_head_angles_are_shifted_like_their_sweeps():
    """A sweep still finds its angle after both were shifted."""
    times = computed_bags.EPOCH + np.arange(1, 100) * (NS // 40)
    kinds = {topics.SCAN: 7, topics.HEAD_ANGLE: 7, topics.IMU: 0}
    messages = []
    for stamp in times:
        for topic, ahead in kinds.items():
            message = SimpleNamespace(header=SimpleNamespace(stamp=_split(stamp + ahead * NS)))
            messages.append(Message(topic.ros1, topic.kind, int(stamp), message))
    bag = SimpleNamespace(path="x.bag", messages=lambda names: iter(messages))
    names = {topic.ros1: topic for topic in kinds}
    found = BagSurvey(bag, names, _NoRows(), None)
    (piece,), _ = found.pieces(Remarks())
    offsets = piece.clock.header_offsets
    assert offsets["/2D_scan"] == pytest.approx(-7 * NS, abs=1000)
    assert offsets["/head_angle"] == offsets["/2D_scan"]
    assert "/imu" not in offsets


class _NoRows:
    """A decoder that finds no readings."""

    joints = None

    def raw(self, topic, message, stamp):
        """Return no numbers."""


def _split(stamp_ns):
    """Return a header's stamp."""
    return SimpleNamespace(sec=int(stamp_ns) // NS, nanosec=int(stamp_ns) % NS)
