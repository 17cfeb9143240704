"""Received messages are kept until the navigator takes them, once."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.units import UnitFactors
from andabata.records.messages import NS, MessageBuilder
from andabata.ros.sensor_inbox import SensorInbox
from tests.support.edited_bags import transforms
from tests.support.played_graph import PlayedGraph

EPOCH = 1_700_000_000 * NS
BUILDER = MessageBuilder(1, EPOCH)


def imu(seconds):
    """Return an inertial message of a robot at rest, as it is played."""
    row = np.array([seconds, 0.0, 0.0, 0.0, 0.0, 0.0, 9.81])
    return EPOCH + round(seconds * NS), "/imu", BUILDER.imu(row)


def initial_pose(seconds, x):
    """Return an initial pose at x [m], as it is played."""
    pose = Pose(np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    return EPOCH + round(seconds * NS), "/initialpose", BUILDER.stamped_pose(seconds, pose)


@pytest.fixture
def received():
    """Return a function that plays messages for a second and returns the inbox and its graph."""

    def play(*messages):
        graph = PlayedGraph(messages, EPOCH, EPOCH + 10 * NS)
        inbox = SensorInbox(
            graph, SensorDecoder(EPOCH, decoder=MessageDecoder(units=UnitFactors()))
        )
        inbox.subscribe()
        graph.sleep_until(EPOCH + NS)
        return inbox, graph

    return play


def test_readings_are_taken_once(received):
    """A second call returns what came since the first, and nothing of the first."""
    inbox, graph = received(imu(0.1), imu(0.2), imu(1.5))
    assert inbox.take_readings(1.0).imu[:, 0] == pytest.approx([0.1, 0.2])
    assert inbox.take_readings(1.1).imu is None
    graph.sleep_until(EPOCH + 2 * NS)
    assert inbox.take_readings(2.0).imu[:, 0] == pytest.approx([1.5])


def test_the_last_initial_pose_is_taken_once(received):
    """Of two initial poses the later one is taken, and only once."""
    inbox, _ = received(initial_pose(0.1, 1.0), initial_pose(0.2, 2.0))
    assert inbox.take_initial_pose().position[0] == 2.0
    assert inbox.take_initial_pose() is None


def test_a_restart_discards_what_came_before_and_moves_the_epoch(received):
    """Nothing from before a restart is taken; later stamps count from the new epoch."""
    inbox, graph = received(imu(0.5), initial_pose(0.1, 1.0), imu(1.25))
    inbox.restart(EPOCH + NS)
    assert inbox.take_initial_pose() is None
    graph.sleep_until(EPOCH + 2 * NS)
    assert inbox.take_readings(1.0).imu[:, 0] == pytest.approx([0.25])


def test_goals_are_set_by_users_and_by_messages(received):
    """The last goal counts, from whichever side it came."""
    goal = BUILDER.goal(1.5, np.array([3.0, 4.0]))
    inbox, graph = received((EPOCH + 3 * NS // 2, "/goal", goal))
    assert inbox.goal is None
    inbox.goal = np.array([1.0, 2.0])
    assert inbox.goal.tolist() == [1.0, 2.0]
    graph.sleep_until(EPOCH + 2 * NS)
    assert inbox.goal.tolist() == [3.0, 4.0]


def test_a_frame_is_remarked_until_its_transform_arrives(received):
    """A frame without a transform is incomplete and named in a remark; a later one is used."""
    row = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 9.81])
    message = BUILDER.imu(row)
    message.header.frame_id = "imu_link"
    static = transforms(
        BUILDER, "tf2_msgs/msg/TFMessage", ("base_link", "imu_link", (0, 0, 0.2), (0, 0, 0))
    )
    inbox, graph = received(
        (EPOCH, "/imu", message),
        (EPOCH + 2 * NS, "/tf_static", static),
        (EPOCH + 2 * NS + 1, "/imu", message),
    )
    assert not inbox.has_all_transforms
    assert "imu_link" in " ".join(inbox.mounting_remarks)
    graph.sleep_until(EPOCH + 3 * NS)
    assert "imu_link" not in " ".join(inbox.mounting_remarks)
