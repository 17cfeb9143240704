"""Topics have legal names and known types in both versions of ROS."""

import re

import pytest

from andabata.records import topics
from andabata.records.topics import PLANNER_TOPICS, TOPICS, message_types

OTHERS = (topics.TF_STATIC, topics.LASER_CLOUD, *PLANNER_TOPICS)


@pytest.mark.parametrize("topic", [*TOPICS, *OTHERS], ids=str)
def test_types_are_known_and_names_legal(topic):
    """Both stores define the type, and no part of a ROS 2 name begins with a digit."""
    for ros in (1, 2):
        assert topic.type_name(ros) in message_types(ros).types
    assert re.fullmatch(r"(/[A-Za-z_]\w*)+", topic.name(2))
    assert topic.name(1) == topic.ros1


def test_the_type_differs_where_ros_1_names_it_otherwise():
    """Only /tf has another type in ROS 1."""
    assert [t for t in TOPICS if t.type_name(1) != t.type_name(2)] == [topics.TF]
    assert topics.TF.type_name(1) == "tf/msg/tfMessage"


def test_names_are_unique():
    """No two topics share a name in either version."""
    for ros in (1, 2):
        names = [topic.name(ros) for topic in (*TOPICS, *OTHERS)]
        assert len(set(names)) == len(names)
