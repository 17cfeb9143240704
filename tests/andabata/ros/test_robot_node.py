"""A simulated robot publishes its readings in time and follows fresh commands only."""

import re
import signal
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench.studies.ros_graph import finished_bag, running
from andabata.machine.faults import Fault
from andabata.machine.reality import Reality
from andabata.records import topics
from andabata.records.bags import Bag
from andabata.records.messages import NS, MessageBuilder
from andabata.ros.robot_node import RobotNode
from andabata.tasks.episode_monitor import TerminationConfig
from tests.support.played_graph import PlayedGraph
from tests.support.ros_tools import needs_ros
from worlds.catalogue import make_world, patch
from worlds.rays.scene import RayScene
from worlds.world import Start, Task

EPOCH = 1_700_000_000 * NS
BUILDER = MessageBuilder(1, EPOCH)


def command(seconds, left, right):
    """Return commanded wheel speeds, as they are played."""
    message = BUILDER.wheels("Wheels_cmd", seconds, left, right)
    return EPOCH + round(seconds * NS), "/wheel_speed_cmd", message


@pytest.fixture(scope="module")
def scene():
    """A gentle hill."""
    world = make_world("hill", 4, 0.3, patch("hill", 60.0, 0.25))
    return SimpleNamespace(world=world, rays=RayScene(world))


def drive(scene, commands, seconds=3.0, ros=1, **settings):
    """Return the result of a drive, and the graph with the published messages."""
    graph = PlayedGraph(commands, EPOCH, EPOCH + round(seconds * NS))
    graph.ros = ros
    config = SimulatedRobotConfig(plant="kinematic", **settings)
    node = RobotNode(graph, scene, config)
    task = Task(Start(-8.0, 0.0, 0.3), ((10.0, 0.0),))
    calls = []
    result = node.run(
        task, np.random.default_rng(1), TerminationConfig(), lambda: calls.append(graph.now_ns())
    )
    return result, graph, calls


def places(graph):
    """Return the true positions, shape (n, 2), [m]."""
    found = [m.pose.pose.position for _, topic, m in graph.messages if topic is topics.GROUND_TRUTH]
    return np.array([[p.x, p.y] for p in found])


def test_readings_are_published_at_their_times(scene):
    """Rates are those of the sensors; goal and initial pose come once; no message is early."""
    result, graph, calls = drive(scene, [])
    counts = Counter(topic.ros1 for _, topic, _ in graph.messages)
    assert (counts["/goal"], counts["/initialpose"]) == (1, 1)
    assert counts["/imu"] == counts["/encoder_data"] == round(100 * result["simulated_s"])
    assert counts["/2D_scan"] == counts["/head_angle"]
    assert result["outcomes"] == ["interrupted"]
    assert result["simulated_s"] == pytest.approx(2.9, abs=0.15)
    assert len(calls) == int(result["simulated_s"] + 0.01)
    stamps = [stamp for stamp, _, _ in graph.messages]
    assert stamps == sorted(stamps)


def test_messages_are_those_of_the_graphs_version(scene):
    """In ROS 2 headers have no number, and the robot gives the frame of its base, once."""
    _, first, _ = drive(scene, [], seconds=1.0)
    _, second, _ = drive(scene, [], seconds=1.0, ros=2)
    by_topic = [{topic: m for _, topic, m in graph.messages} for graph in (first, second)]
    assert hasattr(by_topic[0][topics.IMU].header, "seq")
    assert not hasattr(by_topic[1][topics.IMU].header, "seq")
    assert set(by_topic[1]) - set(by_topic[0]) == {topics.TF_STATIC}
    (frame,) = by_topic[1][topics.TF_STATIC].transforms
    assert (frame.header.frame_id, frame.child_frame_id) == ("base_footprint", "base_link")
    assert frame.transform.rotation.w == 1.0


def test_a_command_counts_for_half_a_second(scene):
    """One command moves the robot for about half a second; a NaN is no command."""
    _, still, _ = drive(scene, [command(0.5, np.nan, 3.0)])
    assert np.ptp(places(still), axis=0).max() < 0.01
    _, moved, _ = drive(scene, [command(0.5, 3.0, 3.0), command(0.6, np.inf, 3.0)])
    track = places(moved)
    speed = 3.0 * SimulatedRobotConfig().robot.wheel_radius
    driven = np.hypot(*(track[-1] - track[0]))
    assert 0.3 * speed < driven < 0.8 * speed
    assert np.hypot(*(track[-1] - track[-8])) < 0.01


def test_the_simulated_robot_is_as_real_as_its_settings(scene):
    """With two seconds of latency at most, one at least, a command of the end moves nothing."""
    commands = [command(2.0, 3.0, 3.0), command(2.4, 3.0, 3.0)]
    _, prompt, _ = drive(scene, commands)
    _, late, _ = drive(scene, commands, reality=Reality(latency=2.0))
    assert np.ptp(places(prompt), axis=0).max() > 0.1
    assert np.ptp(places(late), axis=0).max() < 0.01


def test_faults_of_the_settings_are_published(scene):
    """Encoders that are off from 1 s on send nothing from then on; the truth is sent as ever."""
    counts = [
        Counter(topic.ros1 for _, topic, _ in drive(scene, [], faults=faults)[1].messages)
        for faults in ((), (Fault("wheels", "off", onset=1.0),))
    ]
    assert counts[1]["/encoder_data"] == 90
    assert counts[0]["/encoder_data"] > 200
    for topic in ("/imu", "/ground_truth"):
        assert counts[1][topic] == counts[0][topic]


@needs_ros
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "hangs"])
def test_a_navigator_that_is_killed_or_hangs_is_stopped_by_the_base(tmp_path, end):
    """On a live graph the robot moves till the last command, and stands soon after the time-out."""
    with running(tmp_path) as graph:
        graph.andabata("robot", "--world", "natural-test", "--set", "plant=kinematic")
        graph.wait_for("/initialpose", "Publishers:")
        path = tmp_path / "live.bag"
        watched = ("/wheel_speed_cmd", "/ground_truth")
        recorder = graph.start("rosbag", "record", "-O", path, *watched)
        navigator = graph.andabata("navigator", "--controller", "straight")
        graph.wait_for("/wheel_speed_cmd", "Publishers:")
        wait_for_a_drive(graph)
        graph.tool("rostopic", "echo", "-n", "10", "/wheel_speed_cmd")
        navigator.send_signal(end)
        graph.tool("rostopic", "echo", "-n", "200", "/imu")  # Two seconds.
        navigator.kill()
        commands, places = recorded(finished_bag(recorder, path))
    last = commands[-1]
    before, after = (places[abs(places[:, 0] - last - each) < 0.5] for each in (-0.5, 1.4))
    assert np.ptp(before[:, 1:], axis=0).max() > 0.05
    assert len(after) > 5
    assert np.ptp(after[:, 1:], axis=0).max() < 0.01


def wait_for_a_drive(graph):
    """Wait until the navigator has a first scan and commands a speed.

    On a busy machine readings are late, and a robot whose laser is late stands or is slow.
    """
    for _ in range(180):
        seen = graph.tool("rostopic", "echo", "-n", "1", "/cmd_vel/linear/x")
        if any(float(speed) > 0.1 for speed in re.findall(r"[\d.]+", seen)):
            return
    raise TimeoutError(f"/cmd_vel: expected a speed, got {seen!r} at last")


def recorded(path):
    """Return the times of commands [s], and those of true positions with x and y [m]."""
    commands, places = [], []
    with Bag(path) as bag:
        for message in bag.messages():
            if message.topic == "/ground_truth":
                p = message.content.pose.pose.position
                places.append([message.stamp_ns / NS, p.x, p.y])
            else:
                commands.append(message.stamp_ns / NS)
    return commands, np.array(places)


def reached(seconds, x):
    """Return the word that a goal is reached, as it is played."""
    return EPOCH + round(seconds * NS), "/goal_reached", BUILDER.goal(seconds, np.array([x, 0.0]))


def test_the_navigators_word_ends_an_attempt(scene):
    """It counts for the goal that was announced alone, and is false far from it."""
    other, _, _ = drive(scene, [reached(1.0, 9.0)])
    assert other["outcomes"] == ["interrupted"]
    word, graph, _ = drive(scene, [reached(1.0, 10.0)])
    assert word["outcomes"] == ["false arrival"]
    assert word["simulated_s"] == pytest.approx(1.0, abs=0.25)
    assert Counter(topic.ros1 for _, topic, _ in graph.messages)["/goal"] == 1
