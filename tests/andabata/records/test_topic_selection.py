"""Topics of a recording: names, types and a choice of clouds."""

from types import SimpleNamespace

import pytest

from andabata.records import topics
from andabata.records.bags import BagError, Message
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.frames.names import FrameError
from andabata.records.topic_selection import (
    LEFT_OUT,
    check_frames,
    choose_cloud,
    select_topics,
    topic_names,
)

CLOUD = "sensor_msgs/msg/PointCloud2"
OURS = {topic.ros1: (topic.type_name(1), 9) for topic in topics.TOPICS}


def bag(**changes):
    """Return a recording with our topics and others; None leaves one out."""
    found = {name: kind for name, kind in (OURS | changes).items() if kind is not None}
    return SimpleNamespace(path="x.bag", topics=found)


def without(*left_out, **others):
    """Return our topics without some."""
    return bag(**dict.fromkeys(left_out), **others)


def test_names_are_both_of_our_own_or_the_remapped_one():
    """A remapping by the name of ROS 1 replaces both."""
    assert topic_names((topics.IMU,), {}) == {"/imu": topics.IMU, "/imu/data": topics.IMU}
    assert topic_names((topics.IMU,), {"/imu": "/x"}) == {"/x": topics.IMU}


def test_the_rotating_laser_comes_before_clouds():
    """A cloud is chosen by its name, or where it is the only one without a rotating laser."""
    assert choose_cloud(bag(), None) is None
    assert choose_cloud(bag(), "/3D_cloud") == topics.Topic("/3D_cloud", "/3D_cloud", CLOUD, None)
    clouds = ("/3D_cloud", "/3D_relative_cloud")
    one = without("/2D_scan", *clouds, **{"/velodyne": ("sensor_msgs/PointCloud2", 3)})
    assert choose_cloud(one, None).ros1 == "/velodyne"
    assert choose_cloud(without("/2D_scan", *clouds), None) is None
    own = without("/2D_scan", **{"/laser_cloud": (CLOUD, 3)})
    assert choose_cloud(own, None).ros1 == "/laser_cloud"


def test_a_choice_of_clouds_is_the_users():
    """Several clouds, a missing one and another type are errors with the names."""
    with pytest.raises(BagError, match=r"--cloud: expected one of /3D_cloud, /3D_rel.*, got none"):
        choose_cloud(without("/2D_scan"), None)
    with pytest.raises(BagError, match=r"got /nix$"):
        choose_cloud(bag(), "/nix")
    with pytest.raises(BagError, match="got /imu of sensor_msgs/msg/Imu"):
        choose_cloud(bag(), "/imu")


def test_missing_sensors_are_refused_and_a_missing_fix_is_not():
    """Without fixes positions count from the start, with a remark."""
    with pytest.raises(BagError, match=r"expected the topics /imu, got .*--map"):
        select_topics(without("/imu"), SensorDecoder(0), {})
    decoder = SensorDecoder(0)
    assert select_topics(without("/fix", "/goal"), decoder, {}) == {}
    assert decoder.remarks.texts == ("/fix: missing: positions are counted from the start",)


def test_wrong_types_are_refused_if_needed_and_left_out_otherwise():
    """The error of a needed topic names both types."""
    wrong = ("std_msgs/msg/String", 9)
    with pytest.raises(BagError, match=r"^/imu: expected sensor_msgs/msg/Imu, got std_msgs"):
        select_topics(bag(**{"/imu": wrong}), SensorDecoder(0), {})
    found = select_topics(bag(**{"/diagnostics": wrong}), SensorDecoder(0), {})
    assert found == {"/diagnostics": LEFT_OUT}


def test_of_two_names_the_filled_one_is_read():
    """A topic without messages does not hide the other name."""
    kind = topics.IMU.kind
    both = bag(**{"/imu": (kind, 0), "/imu/data": (kind, 5)})
    decoder = SensorDecoder(0)
    assert select_topics(both, decoder, {}) == {"/imu": "/imu/data"}
    assert "/imu: /imu/data is read instead" in decoder.remarks.texts[0]


def test_remappings_must_fit():
    """Unknown keys and missing values are errors with the known ones."""
    with pytest.raises(BagError, match=r"--map: expected one of .*/imu.*, got /gyro"):
        select_topics(bag(), SensorDecoder(0), {"/gyro": "/imu"})
    with pytest.raises(BagError, match=r"expected the topics /imu, got"):
        select_topics(bag(), SensorDecoder(0), {"/imu": "/nix"})
    with pytest.raises(BagError, match=r"--map /diagnostics: expected one of .*, got /nix"):
        select_topics(bag(), SensorDecoder(0), {"/diagnostics": "/nix"})
    renamed = without("/imu", **{"/gyro": (topics.IMU.kind, 5)})
    assert select_topics(renamed, SensorDecoder(0), {"/imu": "/gyro"}) == {"/imu": "/gyro"}


def test_a_frame_without_a_pose_is_refused():
    """The error names the sensor and the option."""
    content = SimpleNamespace(header=SimpleNamespace(frame_id="odom"))

    def messages(names):
        return iter([Message(names[0], "kind", 0, content)] if "/imu" in names else [])

    recording = SimpleNamespace(path="x.bag", messages=messages)
    with pytest.raises(FrameError, match=r"imu: frame odom: .*; --mounting imu=X,Y,Z"):
        check_frames(recording, SensorDecoder(0), {})
