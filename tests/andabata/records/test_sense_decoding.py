"""Readings decoded: any type that tells one, in any unit that its size tells, becomes SI rows."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.geo_reference import GeoReference
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.point_cloud2 import cloud_of
from andabata.records.remarks import Remarks
from andabata.records.row_error import RowError
from andabata.records.sense_decoding import MessageDecoder, as_point_cloud2
from andabata.records.sense_units import (
    History,
    SenseUnits,
    UnitError,
    factor_of,
    judge_history,
)
from andabata.records.sensor_decoder import SensorDecoder
from andabata.records.wheel_decoding import wheel_sides
from tests import made_bag
from tests.made_bag import new

ROBOT = RobotModel()
TOPIC = {"/imu": topics.IMU, "/encoder_data": topics.ENCODERS, "/mag_orientation": topics.MAG}


@pytest.fixture(scope="module")
def rows():
    return [row for row in made_bag.drive(8.0) if row.topic in TOPIC]


def units_of(rows, asked=None, **scales):
    """Return the units that are judged of rows whose numbers were scaled, and what was said."""
    decoder, history, remarks = MessageDecoder(ROBOT, SenseUnits()), History(), Remarks()
    for row in rows:
        topic, stamp = TOPIC[row.topic], row.stamp_ns / 1e9
        found = np.array(decoder.raw(topic, row.content, stamp))
        if topic is topics.IMU:
            found[:3] *= scales.get("gyro", 1.0)
            found[3:] *= scales.get("force", 1.0)
        if topic is topics.MAG:
            found *= scales.get("field", 1.0)
        if topic is topics.ENCODERS:
            found *= scales.get("wheels", 1.0)
            found = found[:: scales.get("order", 1)]
        history.add(topic, [stamp, *found], row.kind)
    return judge_history(history, ROBOT, asked or {}, remarks, 43.6e-6), " ".join(remarks.texts)


def test_si_is_taken_as_it_is_and_nothing_is_said(rows):
    assert units_of(rows) == (SenseUnits(), "")
    row = [1.0, 0.1, 0.2]
    assert MessageDecoder(ROBOT, SenseUnits()).scaled(topics.ENCODERS, row) is row


@pytest.mark.parametrize(
    ("quantity", "scale", "name"),
    [
        ({"force": 1 / 9.81}, ("acceleration", 9.81), "g"),
        ({"force": 1000 / 9.81}, ("acceleration", 9.81e-3), "mg"),
        ({"gyro": 180 / np.pi}, ("angular_velocity", np.pi / 180), "deg/s"),
        ({"field": 1e6}, ("magnetic_field", 1e-6), "uT"),
        ({"field": 1e9}, ("magnetic_field", 1e-9), "nT"),
        ({"field": 1e3}, ("magnetic_field", 1e-3), "mT"),
        ({"field": 1e4}, ("magnetic_field", 1e-4), "G"),
        ({"field": 1e7}, ("magnetic_field", 1e-7), "mG"),
        ({"field": 1 / 43.6e-6}, ("magnetic_field", 43.6e-6), "direction"),
        ({"field": 3000 / 43.6e-6}, ("magnetic_field", 43.6e-6 / 3000), "direction"),
        ({"wheels": 0.1}, ("wheels", 10.0), "m/s"),
        ({"wheels": 60 / (2 * np.pi)}, ("wheels", 2 * np.pi / 60), "rpm"),
        ({"wheels": 180 / np.pi}, ("wheels", np.pi / 180), "deg/s"),
        ({"wheels": -1.0}, ("wheels", -1.0), "backwards"),
    ],
)
def test_another_unit_is_told_by_its_size_and_said(rows, quantity, scale, name):
    units, said = units_of(rows, **quantity)
    field, factor = scale
    assert getattr(units, field) == pytest.approx(factor, rel=0.02)
    assert replace(units, **{field: 1.0}) == SenseUnits()
    assert name in said


def test_swapped_sides_are_said(rows):
    units, said = units_of(rows, order=-1)
    assert units == SenseUnits()
    assert "left and right are swapped" in said


@pytest.mark.parametrize(
    ("quantity", "match"),
    [
        ({"force": 0.0}, "/imu: expected accelerations around 9.8 m/s2.*got 0 .*--unit"),
        ({"force": 0.3}, "got 2.943"),
        ({"gyro": 4.0}, "angular velocities in rad/s or deg/s.*turns by 0.2"),
        ({"gyro": 0.0}, "/imu: expected numbers that change"),
        ({"field": 0.0}, "/mag_orientation: expected a field"),
        ({"wheels": 0.0}, "/encoder_data: expected numbers that change"),
        ({"wheels": 0.4e-3}, "wheel speeds in rad/s, m/s, rpm or deg/s.*turns by 2.5e"),
    ],
)
def test_what_fits_no_unit_is_refused_by_name_and_number(rows, quantity, match):
    with pytest.raises(UnitError, match=match):
        units_of(rows, **quantity)


def test_the_user_stands_above_what_sizes_tell(rows):
    asked = {"acceleration": 3.0, "angular_velocity": 1.0, "magnetic_field": 2.0, "wheels": 4e3}
    units, _ = units_of(rows, asked, force=0.3, field=0.0, wheels=0.25e-3)
    assert units == SenseUnits(**asked)
    assert factor_of("wheels", "m/s", ROBOT) == 10.0
    assert factor_of("acceleration", "0.25", ROBOT) == 0.25
    for quantity, unit in (
        ("wheels", "knots"),
        ("mass", "kg"),
        ("wheels", "-1"),
        ("wheels", "nan"),
    ):
        with pytest.raises(ValueError, match="--unit"):
            factor_of(quantity, unit, ROBOT)


def test_a_robot_that_stands_leaves_its_gyro_and_wheels_as_they_are():
    still = [row for row in made_bag.drive(5.0, turning=0.0) if row.topic in TOPIC]
    assert units_of(still, gyro=180 / np.pi, wheels=0.1)[0] == SenseUnits()


def header():
    return made_bag.drive(0.02)[0].content.header


def vector(x, y=0.0, z=0.0):
    return new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))


def twist(speed, yaw_rate):
    return new("geometry_msgs/msg/Twist", linear=vector(speed), angular=vector(0, 0, yaw_rate))


def odometry(speed, yaw_rate, x=0.0):
    level = new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    place = new("geometry_msgs/msg/Point", x=float(x), y=0.0, z=0.0)
    pose = new("geometry_msgs/msg/Pose", position=place, orientation=level)
    zeros = np.zeros(36)
    return new(
        "nav_msgs/msg/Odometry",
        header=header(),
        child_frame_id="base_link",
        pose=new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=zeros),
        twist=new(
            "geometry_msgs/msg/TwistWithCovariance", twist=twist(speed, yaw_rate), covariance=zeros
        ),
    )


def joints(names, positions=(), velocities=()):
    return new(
        "sensor_msgs/msg/JointState",
        header=header(),
        name=list(names),
        position=np.array(positions, dtype=float),
        velocity=np.array(velocities, dtype=float),
        effort=np.zeros(0),
    )


def decoded(topic, *messages, step=0.1):
    decoder = MessageDecoder(ROBOT, SenseUnits())
    found = [decoder.rows(topic, m, k * step) for k, m in enumerate(messages)]
    return [row[1:] for rows in found for row in rows], decoder.remarks.texts


@pytest.mark.parametrize(
    "message",
    [
        lambda: twist(0.3, 0.5),
        lambda: new("geometry_msgs/msg/TwistStamped", header=header(), twist=twist(0.3, 0.5)),
        lambda: new(
            "geometry_msgs/msg/TwistWithCovarianceStamped",
            header=header(),
            twist=new(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=twist(0.3, 0.5),
                covariance=np.zeros(36),
            ),
        ),
        lambda: odometry(0.3, 0.5),
    ],
)
def test_a_twist_turns_the_wheels_by_the_effective_track(message):
    (row,), _ = decoded(topics.ENCODERS, message())
    half = 0.46 * 1.275 / 2
    np.testing.assert_allclose(row, [(0.3 - 0.5 * half) / 0.1, (0.3 + 0.5 * half) / 0.1])


def test_a_fast_twist_that_was_measured_is_not_limited():
    (row,), _ = decoded(topics.ENCODERS, twist(5.0, 0.0))
    np.testing.assert_allclose(row, [50.0, 50.0])


def test_odometry_whose_twist_stays_zero_is_told_by_its_pose():
    messages = [odometry(0.0, 0.0, 0.05 * k) for k in range(20)]
    rows, said = decoded(topics.ENCODERS, *messages)
    np.testing.assert_allclose(rows[-1], [5.0, 5.0])
    assert "twist stays zero" in said[0]


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("front_left_wheel", "front_right_wheel"),
        ("left_front_wheel_joint", "right_front_wheel_joint"),
        ("wheel_left_joint", "wheel_right_joint"),
        ("fl_wheel", "fr_wheel"),
        ("wheel_rl", "wheel_rr"),
        ("FrontLeftWheel", "FrontRightWheel"),
        ("wheelFL", "wheelFR"),
        ("leftwheel", "rightwheel"),
        ("drivewhl_l_joint", "drivewhl_r_joint"),
        ("rear_left", "rear_right"),
        ("lf", "rf"),
        ("left_track", "right_track"),
        ("joint_wheel_1_left", "joint_wheel_1_right"),
    ],
)
def test_wheels_are_found_in_every_spelling(left, right):
    assert wheel_sides((right, "arm_left_shoulder", "caster_left_wheel", left)) == ((3,), (0,))


def test_joints_that_are_no_wheels_say_nothing_and_wheels_without_sides_are_refused():
    assert wheel_sides(("left_shoulder", "right_gripper", "head_pan")) is None
    assert decoded(topics.ENCODERS, joints(("elbow",), [0.0], [1.0]))[0] == []
    with pytest.raises(RowError, match="left and right wheels, got wheel_0, wheel_1"):
        wheel_sides(("wheel_0", "wheel_1"))


FOUR = ("fl_wheel", "fr_wheel", "rl_wheel", "rr_wheel")


def test_a_wheel_without_a_number_leaves_the_other_of_its_side():
    rows, _ = decoded(topics.ENCODERS, joints(FOUR, velocities=[1.0, 2.0, np.nan, 4.0]))
    assert rows == [[1.0, 3.0]]


@pytest.mark.parametrize("velocities", [(), [0.0] * 4, [np.nan] * 4])
@pytest.mark.parametrize("wrapped", [False, True])
def test_wheels_that_tell_positions_alone_are_differentiated(velocities, wrapped):
    angles = np.arange(40) * 0.1
    turn = (lambda a: (a + np.pi) % (2 * np.pi) - np.pi) if wrapped else (lambda a: a)
    messages = [joints(FOUR, [turn(a), turn(2 * a)] * 2, velocities) for a in angles]
    rows, said = decoded(topics.ENCODERS, *messages)
    np.testing.assert_allclose(rows[-20:], np.tile([1.0, 2.0], (20, 1)), rtol=1e-9)
    assert "differences of positions" in said[0]


def test_joints_with_neither_are_refused():
    with pytest.raises(RowError, match="neither velocities nor positions"):
        decoded(topics.ENCODERS, joints(FOUR))


def test_a_field_may_be_a_vector():
    vectors = new("geometry_msgs/msg/Vector3Stamped", header=header(), vector=vector(1, 2, 3))
    for message in (vectors, vector(1, 2, 3)):
        assert decoded(topics.MAG, message)[0] == [[1.0, 2.0, 3.0]]


def test_an_imu_that_lacks_something_says_so(rows):
    imu = next(row.content for row in rows if row.topic == "/imu")
    none = np.array([-1.0] + [0.0] * 8)
    with pytest.raises(RowError, match="no angular velocity"):
        decoded(topics.IMU, replace(imu, angular_velocity_covariance=none))
    with pytest.raises(RowError, match="angular velocity is not a number"):
        decoded(topics.IMU, replace(imu, angular_velocity=vector(np.nan)))
    (row,), said = decoded(topics.IMU, replace(imu, linear_acceleration_covariance=none))
    assert np.isfinite(row[:3]).all()
    assert np.isnan(row[3:]).all()
    assert "acceleration is not a number" in said[0]


def test_another_type_is_refused_by_naming_both(rows):
    imu = next(row.content for row in rows if row.topic == "/imu")
    sensor_decoder = SensorDecoder(0)
    for topic in (topics.MAG, topics.GOAL, topics.SCAN, topics.FIX):
        sensor_decoder.add(topic, imu, 1)
    assert sensor_decoder.refused == 4
    for topic in (topics.MAG, topics.GOAL, topics.SCAN, topics.FIX):
        (reason,) = sensor_decoder.remarks.refused_by_reason()[topic.ros1]
        assert topic.kind in reason
        assert "sensor_msgs/msg/Imu" in reason


def test_the_older_point_cloud_keeps_points_and_channels():
    point, channel = (
        made_bag.TYPES.types[f"{kind}"]
        for kind in ("geometry_msgs/msg/Point32", "sensor_msgs/msg/ChannelFloat32")
    )
    message = new(
        "sensor_msgs/msg/PointCloud",
        header=header(),
        points=[point(x=float(k), y=2.0, z=-1.0) for k in range(4)],
        channels=[channel(name="time", values=np.arange(4, dtype=np.float32) / 100)],
    )
    cloud = cloud_of(as_point_cloud2(message), None, 5.0)
    np.testing.assert_array_equal(cloud.points, [[k, 2, -1] for k in range(4)])
    np.testing.assert_allclose(cloud.stamps, 5.0 + np.arange(4) / 100, atol=1e-7)
    with pytest.raises(RowError, match="channel"):
        as_point_cloud2(replace(message, points=message.points[:2]))


def test_rows_are_put_in_order_and_stamps_that_came_before_are_dropped(rows):
    imu = [row.content for row in rows if row.topic == "/imu"][:40]
    sensor_decoder = SensorDecoder(made_bag.EPOCH, decoder=MessageDecoder(ROBOT, SenseUnits()))
    for k in (0, 2, 1, 2, 5):
        sensor_decoder.add(topics.IMU, imu[k])
    np.testing.assert_allclose(sensor_decoder.readings(0.1).imu[:, 0], [0.01, 0.02, 0.03, 0.06])
    for k in (5, 4, 6):
        sensor_decoder.add(topics.IMU, imu[k])
    np.testing.assert_allclose(sensor_decoder.readings(0.2).imu[:, 0], [0.07])
    assert sensor_decoder.refused == 1
    assert sensor_decoder.remarks.refused_by_reason() == {
        "/imu": {"older than what was used already": 1}
    }
    dropped = next(r for r in sensor_decoder.remarks.as_dicts() if not r["refused"])
    assert dropped["count"] == 2


def test_a_live_session_judges_by_its_first_rows_and_again_when_it_has_turned():
    """The same code without a survey: units by size at once, the gyro's when the robot turned."""
    sensor_decoder = SensorDecoder(made_bag.EPOCH)
    rates, forces = [], []
    for row in made_bag.drive(14.0):
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
        if row.topic == "/imu" and sensor_decoder._rows["imu"]:
            last = sensor_decoder._rows["imu"][-1]
            rates.append(abs(last[3]))
            forces.append(last[6])
    assert max(rates[:900]) > 5.0  # Nothing told it yet.
    assert max(rates[-300:]) < 0.5
    assert np.median(forces) == pytest.approx(9.81, rel=0.01)
    assert len(forces) == 1400 - 25
    said = " ".join(sensor_decoder.remarks.texts)
    assert "taken as g" in said
    assert "taken as deg/s" in said


def test_the_model_of_the_earth_has_the_strength_that_a_direction_is_given(rows):
    units, _ = units_of(rows, field=1 / 43.6e-6)
    assert units.magnetic_field == pytest.approx(GeoReference().field * 1e-6, rel=0.01)
