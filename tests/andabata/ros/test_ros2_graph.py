"""Messages pass between the nodes of a ROS 2 graph by DDS, in every way that they are published."""

import os
import sys
import time
from itertools import count

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import Topic
from andabata.ros import ros2_graph
from andabata.ros.graph import RosError, TopicNames
from andabata.ros.ros2_graph import Ros2Graph
from tests.support.ros2_tools import domain, needs_dds

BUILDER = MessageBuilder(2)
ROW = np.array([1.5, 0.1, 0.2, 0.3, 4.0, 5.0, 6.0])
NUMBERS = count()


@pytest.fixture(scope="module", autouse=True)
def _own_domain():
    """Take a domain of our own."""
    with pytest.MonkeyPatch.context() as patch, domain(patch):
        yield


@pytest.fixture
def join():
    """Return a function that joins the graph as a node of a new name; all leave at the end."""
    graphs = []

    def make(name=None, **options):
        graphs.append(Ros2Graph(name or f"node{next(NUMBERS)}", **options))
        return graphs[-1]

    yield make
    for graph in graphs:
        graph.close()


def wait_until(condition, seconds=10.0):
    """Wait until a condition holds, and return whether it does."""
    for _ in range(round(20 * seconds)):
        if condition():
            return True
        time.sleep(0.05)
    return False


def collect(graph, topic):
    """Subscribe to a topic; return the list that gets its messages."""
    messages = []
    graph.subscribe(topic, lambda _, message: messages.append(message))
    return messages


@needs_dds
def test_messages_arrive_unchanged(join):
    """A reading of a sensor arrives with its numbers, and the publisher hears nothing of it."""
    sender, receiver = join(), join()
    received, own = collect(receiver, topics.IMU), collect(sender, topics.IMU)

    def sent():
        sender.write(topics.IMU, 0, BUILDER.imu(ROW))
        return received

    assert wait_until(sent)
    assert received[0].angular_velocity.y == 0.2
    assert received[0].header.stamp.nanosec == NS // 2
    assert own == []


@needs_dds
def test_the_last_latched_message_arrives_later_and_once(join):
    """A goal that was published before is received, and later ones, too, each once."""
    sender = join()
    sender.advertise(topics.GOAL, latch=True)
    sender.write(topics.GOAL, 0, BUILDER.goal(0.0, np.array([1.0, 2.0])))
    goals = collect(join(), topics.GOAL)
    assert wait_until(lambda: goals)
    sender.write(topics.GOAL, 0, BUILDER.goal(0.0, np.array([3.0, 4.0])))
    assert wait_until(lambda: len(goals) > 1)
    time.sleep(0.3)
    assert [goal.pose.position.x for goal in goals] == [1.0, 3.0]


@needs_dds
def test_wheels_are_received_in_the_type_that_somebody_publishes(join):
    """A stamped twist on the wheels' topic is taken, as in a recording."""
    wheels = collect(join(), topics.ENCODERS)
    sender = join()
    stamped = Topic("", "/encoder_data", "geometry_msgs/msg/TwistStamped", 10.0)
    twist = BUILDER.twist(0.3, 0.1)
    message = BUILDER.new(stamped.kind, header=BUILDER.header(0.0, "base_link"), twist=twist)

    def sent():
        sender.write(stamped, 0, message)
        return wheels

    assert wait_until(sent)
    assert wheels[0].twist.linear.x == 0.3


@needs_dds
def test_simulated_time_is_that_of_the_clock(join):
    """It is 0 before the first message of /clock."""
    graph, player = join(use_sim_time=True), join()
    assert graph.now_ns() == 0
    message = BUILDER.new(ros2_graph.CLOCK.kind, clock=BUILDER.header(3.5, "").stamp)

    def played():
        player.write(ros2_graph.CLOCK, 0, message)
        return graph.now_ns()

    assert wait_until(played)
    graph.wait_for_clock()
    assert graph.now_ns() == BUILDER.stamp_ns(3.5)


@needs_dds
def test_names_are_remapped(join):
    """A subscriber of a namespace hears a publisher that has its name by a remapping."""
    received = collect(join(names=TopicNames(2, "/robot1")), topics.FIX)
    sender = join(names=TopicNames(2, "", {"/fix": "/robot1/fix"}))

    def sent():
        sender.write(topics.FIX, 0, BUILDER.fix(np.array([0.0, 40.0, -3.0, 5.0, 1.0])))
        return received

    assert wait_until(sent)
    assert received[0].latitude == 40.0


@needs_dds
def test_quality_of_service_that_cannot_match_is_named(join):
    """A goal that is published with best effort does not arrive, and its node is named."""
    status = []
    receiver, sender = join(status=status.append), join("careless")
    goals = collect(receiver, topics.GOAL)
    careless = Topic("", "/goal", topics.GOAL.kind, 10.0)
    with pytest.MonkeyPatch.context() as patch:
        profile = ros2_graph.subscriber_profiles(topics.IMU)[0]
        patch.setattr(ros2_graph, "publisher_profile", lambda topic, latch: profile)
        sender.advertise(careless)
    assert wait_until(lambda: status)
    assert status[0].startswith("/goal: node /careless offers BEST_EFFORT, VOLATILE, expected")
    assert goals == []


@needs_dds
def test_a_second_node_of_the_same_name_is_refused(join, monkeypatch):
    """Two navigators on one graph are an error of the second; in another namespace it is none."""
    monkeypatch.setattr(ros2_graph, "_LEASE_PERIODS", 1)
    first = join("andabata")
    first.advertise(topics.TWIST)
    time.sleep(0.5)
    with pytest.raises(RosError, match="/andabata: expected no other node of this name"):
        join("andabata")
    join("andabata", names=TopicNames(2, "/robot2"))


@needs_dds
@pytest.mark.parametrize(
    "uri",
    [
        "<CycloneDDS><Domain>",
        "file:///nowhere/cyclone.xml",
        "<CycloneDDS><Domain><Nonsense/></Domain></CycloneDDS>",
    ],
)
def test_a_broken_configuration_is_named(uri, monkeypatch):
    """A CYCLONEDDS_URI that cannot be read is an error on one line with the next step."""
    monkeypatch.setenv("CYCLONEDDS_URI", uri)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(3 + int(os.environ["ROS_DOMAIN_ID"])))
    with pytest.raises(RosError, match="unset CYCLONEDDS_URI") as error:
        Ros2Graph("node")
    assert f"CYCLONEDDS_URI={uri}" in str(error.value)


def test_missing_dds_is_reported(monkeypatch, capsys):
    """Without cyclonedds the error has the line that installs it, in a clone and beside a wheel."""
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    assert main(["ros2", "navigator"]) == 1
    assert ".[ros2]" in capsys.readouterr().err
    monkeypatch.setattr("andabata.distribution.is_clone", lambda: False)
    assert main(["ros2", "navigator"]) == 1
    assert "andabata[ros2]" in capsys.readouterr().err


def test_invalid_names_are_errors(capsys):
    """Wrong names and pairs are errors before anything is joined."""
    assert main(["ros2", "navigator", "--remap", "/imu"]) == 2
    assert main(["ros2", "robot", "--remap", "/imus=/a"]) == 1
    assert main(["ros2", "robot", "--namespace", "robot1"]) == 1
    assert capsys.readouterr().err.count("expected") == 3
