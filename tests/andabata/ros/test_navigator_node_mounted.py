"""A live robot's readings are turned by the graph's transforms, on a simulated graph."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import shipped_forest
from andabata.navigation.reactive import StraightController
from andabata.records import topics
from andabata.records.bags import Bag
from andabata.records.frames import FrameError
from andabata.records.messages import NS
from andabata.ros.navigator_node import NavigatorNode
from tests.edited_bags import copy_bag, moved_cloud, turn, turned_imu

CLOUD, IMU = "/laser_cloud", "/imu"
MOUNTED = (0.1, 0.0, 0.9)


class PlayedGraph:
    """Stands for a ROS graph: its time goes on when someone sleeps, and brings messages."""

    ros = 1

    def __init__(self, path):
        with Bag(path) as bag:
            self._messages = list(bag.messages())
        self._begin = self._now = self._messages[0].stamp_ns
        self._takers, self.written = {}, []

    @property
    def is_shutdown(self):
        return not self._messages

    def now_ns(self):
        return self._now

    def wait_for_clock(self):
        pass

    def sleep_until(self, stamp_ns):
        self._now = max(self._now, stamp_ns)
        while self._messages and self._messages[0].stamp_ns <= self._now:
            message = self._messages.pop(0)
            topic, take = self._takers.get(message.topic, (None, None))
            if take is not None:
                take(topic, message.content)

    def subscribe(self, topic, take):
        self._takers[topic.ros1] = topic, take

    def advertise(self, topic, latch=False):
        return SimpleNamespace()

    def write(self, topic, stamp_ns, message):
        self.written.append((topic, message))

    def close(self):
        pass


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive with a 3D laser."""
    path = tmp_path_factory.mktemp("live") / "drive.bag"
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "straight"]
    words += ["--out", str(path.parent / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words += ["--sensor", "vlp-16", "--time-limit", "6", "--record", str(path)]
    assert main([*words, "--json", "--quiet"]) == 0
    return path


def edit(topic, message):
    """Turn IMU and laser upside down."""
    hanging = turn((180, 0, 0))
    if topic == IMU:
        return turned_imu(message, hanging, "imu_link")
    if topic == CLOUD:

        def move(points, _):
            return hanging.inv().apply(points - np.array(MOUNTED) + np.array([0, 0, 0.72]))

        return moved_cloud(message, move, "velodyne")
    return message


STATIC = [
    ("base_link", "imu_link", (0, 0, 0.2), (180, 0, 0)),
    ("base_link", "velodyne", MOUNTED, (180, 0, 0)),
]


def run(path, seconds=3.0):
    """Return what a node says of a recording, and what it told its user and the graph."""
    graph, said = PlayedGraph(path), []
    config = SimulatedRobotConfig()
    node = NavigatorNode(
        graph,
        config,
        shipped_forest(),
        StraightController(),
        topics.LASER_CLOUD,
        status=said.append,
    )
    start = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
    try:
        return node.run(start, seconds), said, graph
    except FrameError as error:
        return error, said, graph


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """Do not wait for the last messages to leave."""
    monkeypatch.setattr("andabata.ros.navigator_node._FLUSH_TIME", 0.0)


def test_static_transforms_of_several_publishers_are_taken(recorded, tmp_path):
    """Static transforms of two messages give both mountings."""
    found, said, _ = run(copy_bag(recorded, tmp_path / "x.bag", edit, STATIC))
    assert found["scans"] > 20
    assert found["refused"] == 0
    frames = found["frames"]
    assert frames["laser"]["source"] == frames["imu"]["source"] == "tf_static"
    np.testing.assert_allclose(frames["laser"]["transform"], [*MOUNTED, np.pi, 0, 0], atol=1e-6)
    assert not found["remark_texts"]
    assert said == []


def test_transforms_that_come_late_are_waited_for(recorded, tmp_path):
    """Transforms within the timeout are used, without a status line."""
    late = copy_bag(recorded, tmp_path / "x.bag", edit, STATIC, static_after=1.5)
    found, said, _ = run(late)
    assert found["frames"]["imu"]["source"] == "tf_static"
    assert said == []


def test_missing_transforms_are_reported_and_gravity_stops_the_robot(recorded, tmp_path):
    """A missing transform is reported, and wrong gravity ends the run before any motion."""
    error, said, graph = run(copy_bag(recorded, tmp_path / "x.bag", edit))
    assert "gravity points down in the IMU's frame" in str(error)
    assert "imu: nothing tells where frame imu_link is" in " ".join(said)
    moving = [
        m for topic, m in graph.written if topic is topics.WHEEL_COMMAND and (m.left or m.right)
    ]
    assert not moving  # It was never told to go.


def test_our_own_frames_need_no_transforms(recorded, tmp_path):
    """A robot with our frames starts without waiting for transforms."""
    found, said, graph = run(copy_bag(recorded, tmp_path / "x.bag"), 2.0)
    assert found["frames"]["laser"]["source"] == "assumed"
    assert said == []
    assert graph.now_ns() - graph._begin < 3 * NS
