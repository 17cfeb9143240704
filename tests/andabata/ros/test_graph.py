"""Topics have the graph's names: our own, moved by a namespace, or the user's."""

import pytest

from andabata.records import topics
from andabata.records.topics import POINT_CLOUD, Topic
from andabata.ros.graph import RosError, TopicNames


def test_names_are_those_of_the_version():
    """Without anything given, each version has its own names."""
    assert TopicNames(1).of(topics.IMU) == "/imu"
    assert TopicNames(2).of(topics.IMU) == "/imu/data"


def test_a_namespace_moves_our_own_names_alone():
    """Transforms move, too; the user's cloud and /clock stay where they are."""
    names = TopicNames(2, "/robot1")
    assert names.of(topics.TF) == "/robot1/tf"
    assert names.of(topics.VIRTUAL_SCAN) == "/robot1/traversability_scan"
    cloud = Topic("/points_raw", "/points_raw", POINT_CLOUD, None)
    assert names.of(cloud) == "/points_raw"


def test_a_remapped_name_is_absolute_and_may_be_given_by_either_of_ours():
    """The namespace is not put before it."""
    for ours in ("/imu", "/imu/data"):
        names = TopicNames(2, "/robot1", {ours: "/os_imu"})
        assert names.of(topics.IMU) == "/os_imu"
        assert names.of(topics.FIX) == "/robot1/fix"


def test_a_topic_that_the_user_names_is_not_remapped():
    """Another planner's /plan is read under its name while ours is published under another."""
    names = TopicNames(2, "/robot1", {"/plan": "/local_plan"})
    assert names.of(topics.PLAN) == "/local_plan"
    assert names.of(Topic("/plan", "/plan", topics.PATH, None)) == "/plan"


def test_names_that_cannot_be_are_errors():
    """An unknown topic, a namespace without a slash, and a digit at the begin in ROS 2."""
    with pytest.raises(RosError, match=r"expected one of .*got /imus"):
        TopicNames(2, "", {"/imus": "/a"})
    with pytest.raises(RosError, match="as /robot1, got 'robot1'"):
        TopicNames(2, "robot1")
    digit = Topic("/2D", "/2D", POINT_CLOUD, None)
    assert TopicNames(1).of(digit) == "/2D"
    with pytest.raises(RosError, match="begins with a digit"):
        TopicNames(2).of(digit)
