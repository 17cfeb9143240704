"""A live robot's readings are turned by the graph's transforms, on a simulated graph."""

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.reactive import StraightController
from andabata.records import topics
from andabata.records.frames.names import FrameError
from andabata.records.messages import NS
from andabata.ros.navigator_node import NavigatorNode
from tests.support.edited_bags import copy_bag, moved_cloud, turn, turned_imu
from tests.support.played_graph import PlayedGraph

CLOUD, IMU = "/laser_cloud", "/imu"
MOUNTED = (0.1, 0.0, 0.9)


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


def run(path, seconds=3.0, **options):
    """Return the result or error of a node on a recording, its status lines, and the graph."""
    graph, status = PlayedGraph.of_bag(path), []
    config = SimulatedRobotConfig()
    node = NavigatorNode(
        graph,
        config,
        Models(),
        Steering(StraightController(config.robot.speed), LocalPlanner(config.grid)),
        topics.LASER_CLOUD,
        status=status.append,
        **options,
    )
    start = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
    try:
        return node.run(start, seconds), status, graph
    except FrameError as error:
        return error, status, graph


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """Do not wait for the last messages to leave."""
    monkeypatch.setattr("andabata.ros.navigator_node._FLUSH_TIME", 0.0)


def doubts(status):
    """Return the status texts but for those of the first fix: origin and magnetic field."""
    return [text for text in status if "origin" not in text and "WMM" not in text]


def test_static_transforms_of_several_publishers_are_taken(recorded, tmp_path):
    """Static transforms of two messages give both mountings."""
    found, status, _ = run(copy_bag(recorded, tmp_path / "x.bag", edit, STATIC))
    assert found["scans"] > 20
    assert found["refused"] == 0
    frames = found["frames"]
    assert frames["laser"]["source"] == frames["imu"]["source"] == "tf_static"
    np.testing.assert_allclose(frames["laser"]["transform"], [*MOUNTED, np.pi, 0, 0], atol=1e-6)
    assert not found["remark_texts"]
    assert doubts(status) == []


def test_transforms_that_come_late_are_waited_for(recorded, tmp_path):
    """Transforms within the timeout are used, without a status line."""
    late = copy_bag(recorded, tmp_path / "x.bag", edit, STATIC, static_after=1.5)
    found, status, _ = run(late)
    assert found["frames"]["imu"]["source"] == "tf_static"
    assert doubts(status) == []


def test_missing_transforms_are_reported_and_gravity_stops_the_robot(recorded, tmp_path):
    """A missing transform is reported, and wrong gravity ends the run before any motion."""
    error, status, graph = run(copy_bag(recorded, tmp_path / "x.bag", edit))
    assert "gravity points down in the IMU's frame" in str(error)
    assert "imu: the pose of frame imu_link is unknown" in " ".join(status)
    moving = [
        m for _, topic, m in graph.messages if topic is topics.WHEEL_COMMAND and (m.left or m.right)
    ]
    assert not moving


def test_our_own_frames_need_no_transforms(recorded, tmp_path):
    """A robot with our frames starts without waiting for transforms."""
    found, status, graph = run(copy_bag(recorded, tmp_path / "x.bag"), 2.0)
    assert found["frames"]["laser"]["source"] == "assumed"
    assert doubts(status) == []
    assert graph.now_ns() - graph.begin_ns < 3 * NS


def test_the_local_map_is_published_or_not(recorded):
    """Map, plan and the place of odom in the map come with the option, and nothing without."""
    for local_map in (True, False):
        _, _, graph = run(recorded, 2.0, local_map=local_map)
        found = {topic: message for _, topic, message in graph.messages}
        wanted = set(topics.PLANNER_TOPICS) if local_map else set()
        assert set(found) & set(topics.PLANNER_TOPICS) == wanted
        children = [each.child_frame_id for each in found[topics.TF].transforms]
        assert children == (["base_footprint", "odom"] if local_map else ["base_footprint"])
    assert topics.VIRTUAL_SCAN in found
