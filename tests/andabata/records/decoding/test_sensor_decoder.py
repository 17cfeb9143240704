"""Messages of a control period become sensor readings."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.units import UnitFactors
from tests.support import computed_bags
from tests.support.foreign_messages import vector

ROBOT = RobotModel()
TOPIC = {"/imu": topics.IMU, "/encoder_data": topics.ENCODERS, "/mag_orientation": topics.MAG}


@pytest.fixture(scope="module")
def rows():
    """Return the rows of a winding drive."""
    return [row for row in computed_bags.drive(8.0) if row.topic in TOPIC]


def test_another_type_is_refused_by_naming_both(rows):
    """A type that is not accepted is counted with what was expected and got."""
    imu = next(row.content for row in rows if row.topic == "/imu")
    sensor_decoder = SensorDecoder(0)
    for topic in (topics.MAG, topics.GOAL, topics.SCAN, topics.FIX):
        sensor_decoder.add(topic, imu, 1)
    assert sensor_decoder.refused == 4
    for topic in (topics.MAG, topics.GOAL, topics.SCAN, topics.FIX):
        (reason,) = sensor_decoder.remarks.refused_by_reason()[topic.ros1]
        assert topic.kind in reason
        assert "sensor_msgs/msg/Imu" in reason


def test_rows_are_sorted_and_repeated_stamps_dropped(rows):
    """Rows are in order within a period; stamps of earlier periods are left out, and counted."""
    imu = [row.content for row in rows if row.topic == "/imu"][:40]
    sensor_decoder = SensorDecoder(
        computed_bags.EPOCH, decoder=MessageDecoder(ROBOT, UnitFactors())
    )
    for k in (0, 2, 1, 2, 5):
        sensor_decoder.add(topics.IMU, imu[k])
    np.testing.assert_allclose(sensor_decoder.readings(0.1).imu[:, 0], [0.01, 0.02, 0.03, 0.06])
    for k in (5, 4, 6):
        sensor_decoder.add(topics.IMU, imu[k])
    np.testing.assert_allclose(sensor_decoder.readings(0.2).imu[:, 0], [0.07])
    assert sensor_decoder.refused == 3
    assert sensor_decoder.remarks.refused_by_reason() == {
        "/imu": {"a stamp that came before": 2, "older than readings that were used already": 1}
    }


def test_a_live_session_infers_units_at_first_and_after_turns():
    """Without a survey sizes are inferred at once, the gyro after turns."""
    sensor_decoder = SensorDecoder(computed_bags.EPOCH)
    rates, forces = [], []
    for row in computed_bags.drive(14.0):
        if row.topic not in TOPIC:
            continue
        content = row.content
        if row.topic == "/imu":
            w, a = content.angular_velocity, content.linear_acceleration
            content = replace(
                content,
                angular_velocity=vector(*(57.29578 * v for v in (w.x, w.y, w.z))),
                linear_acceleration=vector(*(v / 9.81 for v in (a.x, a.y, a.z))),
            )
        sensor_decoder.add(TOPIC[row.topic], content)
        if row.topic == "/imu" and sensor_decoder._rows[topics.IMU]:
            last = sensor_decoder._rows[topics.IMU][-1]
            rates.append(abs(last[3]))
            forces.append(last[6])
    assert max(rates[:900]) > 5.0  # The units are not inferred yet.
    assert max(rates[-300:]) < 0.5
    assert np.median(forces) == pytest.approx(9.81, rel=0.01)
    assert len(forces) == 1400 - 25
    text = " ".join(sensor_decoder.remarks.texts)
    assert "taken as g" in text
    assert "taken as deg/s" in text
