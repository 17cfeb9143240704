"""Endpoints that cannot match ours are named once, with the next step."""

from types import SimpleNamespace

import pytest

from andabata.records import topics
from andabata.records.decoding.accepted_types import accepted_types
from andabata.ros.dds_discovery import Endpoint
from andabata.ros.dds_qos import Profile, subscriber_profiles
from andabata.ros.endpoint_check import EndpointCheck
from andabata.ros.graph import TopicNames

RELIABLE, BEST_EFFORT = Profile(True, False), Profile(False, False)
NODES = SimpleNamespace(knows=lambda endpoint: True, node_of=lambda endpoint: "node /other")


def ours(topic):
    """Return a subscription of ours."""
    return SimpleNamespace(
        name=topic.ros2, kinds=accepted_types(topic), profiles=subscriber_profiles(topic)
    )


def findings(publishers=(), subscribers=(), nodes=NODES, looks=2):
    """Return what a check of others' endpoints reports; we take goals and IMU and send twists."""
    status = []
    check = EndpointCheck(nodes, status.append)
    watch = SimpleNamespace(
        publishers={each.gid: each for each in publishers},
        subscribers={each.gid: each for each in subscribers},
    )
    published = {topics.TWIST: False, topics.LOCAL_MAP: True, topics.VIRTUAL_SCAN: False}
    for _ in range(looks):
        check.poll(watch, [ours(topics.GOAL), ours(topics.IMU)], published, TopicNames(2))
    return status


def endpoint(topic, profile=RELIABLE, kind=None):
    """Return an endpoint of somebody else."""
    return Endpoint(b"x", topic.ros2, kind or topic.kind, profile)


def test_what_fits_is_not_reported():
    """A driver's IMU, a goal of RViz, and a base that obeys."""
    assert findings([endpoint(topics.IMU, BEST_EFFORT)]) == []
    assert findings([endpoint(topics.GOAL)], [endpoint(topics.TWIST)]) == []
    assert findings(subscribers=[endpoint(topics.LOCAL_MAP, Profile(True, True))]) == []


@pytest.mark.parametrize(
    ("publisher", "text"),
    [
        (
            endpoint(topics.GOAL, BEST_EFFORT),
            "/goal: node /other offers BEST_EFFORT, VOLATILE, expected RELIABLE",
        ),
        (
            endpoint(topics.IMU, kind="std_msgs/msg/String"),
            "/imu/data: node /other publishes std_msgs/msg/String, expected sensor_msgs/msg/Imu",
        ),
        (endpoint(topics.TWIST), "/cmd_vel: node /other publishes it, too"),
    ],
)
def test_publishers_that_do_not_fit_are_named_once(publisher, text):
    """The line names topic, node, what came and what was expected."""
    (line,) = findings([publisher])
    assert line.startswith(text)


@pytest.mark.parametrize(
    ("subscriber", "text"),
    [
        (
            endpoint(topics.VIRTUAL_SCAN, Profile(True, True)),
            "asks for RELIABLE, TRANSIENT_LOCAL, got RELIABLE, VOLATILE",
        ),
        (endpoint(topics.TWIST, kind="geometry_msgs/msg/TwistStamped"), "--stamped"),
    ],
)
def test_subscribers_that_get_nothing_are_named_once(subscriber, text):
    """A stamped command has an option; others have a quality of service to ask for."""
    (line,) = findings(subscribers=[subscriber])
    assert text in line


def test_a_process_without_a_node_is_judged_after_a_while():
    """Its name is waited for, then it is reported without one."""
    nodes = SimpleNamespace(knows=lambda endpoint: False, node_of=lambda endpoint: "a process")
    bad = endpoint(topics.GOAL, BEST_EFFORT)
    assert findings([bad], nodes=nodes, looks=20) == []
    assert len(findings([bad], nodes=nodes, looks=60)) == 1
