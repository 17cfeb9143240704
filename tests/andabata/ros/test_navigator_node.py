"""A live ROS 1 graph: a real master, the reference tools, and our nodes as a user starts them."""

import time

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.studies.ros_graph import finished_bag, result, running, stop
from andabata.records.bags import Bag
from andabata.records.messages import header_ns
from tests.support.ros_tools import needs_ros
from traversability.grid import PolarGrid

SENSORS = ("/2D_scan", "/head_angle", "/encoder_data", "/imu", "/mag_orientation", "/fix")
QUICK = ["--set", "plant=kinematic"]


@pytest.fixture
def graph(tmp_path):
    """Running master."""
    with running(tmp_path) as found:
        yield found


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Short recorded drive."""
    path = tmp_path_factory.mktemp("live") / "drive.bag"
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
    options = ["--out", str(path.parent / "out"), "--time-limit", "14", "--record", str(path)]
    assert main([*words, *QUICK, *options, "--quiet", "--json"]) == 0
    return path


@needs_ros
def test_a_simulated_robot_is_driven_through_the_graph(graph):
    """Robot and navigator drive through a master at the paper's rates."""
    graph.andabata("robot", "--world", "natural-test", "--seconds", "60", *QUICK)
    graph.wait_for("/initialpose", "Publishers:")
    recorded = graph.folder / "live.bag"
    watched = ("/cmd_vel", "/2D_virtual_scan", "/3D_relative_cloud", "/ground_truth")
    recorder = graph.start("rosbag", "record", "-O", recorded, *watched)
    node = graph.andabata("navigator", "--controller", "reactive", "--seconds", "16")
    found = result(node, 60)
    finished_bag(recorder, recorded)
    assert found["health"] == "ok"
    assert found["scans"] > 80
    assert found["moving"] > 80
    assert found["refused"] == 0
    stamps, places = {name: [] for name in watched}, []
    with Bag(recorded) as live:
        for message in live.messages():
            stamps[message.topic].append(message.stamp_ns / 1e9)
            if message.topic == "/ground_truth":
                p = message.content.pose.pose.position
                places.append([p.x, p.y])
    # Wide bounds, since the machine may be busy: the benchmark measures.
    assert np.median(np.diff(stamps["/cmd_vel"])) == pytest.approx(0.1, rel=0.1)
    assert np.median(np.diff(stamps["/3D_relative_cloud"])) == pytest.approx(0.05, rel=0.2)
    driven = np.hypot(*(np.array(places[-1]) - places[0]))
    assert driven > 1.0


@needs_ros
def test_a_played_bag_gives_the_recorded_scans_again(graph, bag):
    """A navigator fed by `rosbag play` makes the recorded virtual scans."""
    graph.tool("rosparam", "set", "/use_sim_time", "true")
    node = graph.andabata("navigator", "--controller", "reactive")
    graph.wait_for("/imu", "Subscribers:")
    live = graph.folder / "live.bag"
    graph.start("rosbag", "record", "-O", live, "/2D_virtual_scan", "/cmd_vel")
    recorder = graph.processes[-1]
    graph.wait_for("/cmd_vel", "Subscribers:")
    topics = (*SENSORS, "/goal", "/initialpose")
    play = graph.start(
        "rosbag", "play", "--quiet", "--clock", "--delay=2", bag, "--topics", *topics
    )
    rates = graph.tool("rostopic", "hz", "/cmd_vel", seconds=12)
    assert play.wait(60) == 0
    finished_bag(recorder, live)
    stop(node)
    measured = [float(line.split(":")[1]) for line in rates.splitlines() if "average rate" in line]
    assert measured
    assert np.median(measured) == pytest.approx(10.0, rel=0.1)
    before, now = virtual_scans(bag), virtual_scans(live)
    assert len(now) > 60
    same = [agreement(scan, before[nearest(before, stamp)]) for stamp, scan in now.items()]
    assert np.mean(same) > 0.85


def virtual_scans(path):
    """Return the recorded virtual scans by their stamp [s]."""
    with Bag(path) as found:
        scans = [message.content for message in found.messages(("/2D_virtual_scan",))]
    return {header_ns(scan) / 1e9: np.array(scan.ranges) for scan in scans}


def nearest(scans, stamp):
    """Return the stamp of the nearest scan [s]."""
    return min(scans, key=lambda other: abs(other - stamp))


def agreement(ranges, others):
    """Return the share of sectors that are equal or one ring apart."""
    edges = PolarGrid().ring_edges
    rings, other = (np.searchsorted(edges, np.nan_to_num(r, nan=0.0)) for r in (ranges, others))
    return np.mean(np.abs(rings - other) <= 1)


@needs_ros
def test_a_robot_without_readings_is_stopped_and_reported(graph):
    """Without inertial readings the robot is stopped, and the diagnostics report it, in time."""
    robot = graph.andabata("robot", "--world", "natural-test", "--seconds", "60", *QUICK)
    graph.wait_for("/initialpose", "Publishers:")
    recorded = graph.folder / "live.bag"
    node = graph.andabata("navigator", "--controller", "straight", "--seconds", "14")
    graph.wait_for("/wheel_speed_cmd", "Publishers:")
    recorder = graph.start(
        "rosbag", "record", "-O", recorded, "/wheel_speed_cmd", "/diagnostics", "/imu"
    )
    time.sleep(7)
    robot.kill()
    result(node, 60)
    finished_bag(recorder, recorded)
    last, stopped_at, reported = 0.0, None, None
    with Bag(recorded) as live:
        for message in live.messages():
            stamp = message.stamp_ns / 1e9
            if message.topic == "/imu":
                last = stamp
            elif message.topic == "/wheel_speed_cmd":
                moving = message.content.left != 0 or message.content.right != 0
                stopped_at = None if moving else stopped_at or stamp
            elif "imu: silent" in message.content.status[0].message:
                reported = reported or stamp
    assert stopped_at is not None
    assert stopped_at - last < 0.2 + 0.2 + 0.15
    assert reported is not None
    assert reported - last < 0.5


@needs_ros
def test_a_navigator_that_is_stopped_stops_the_robot(graph):
    """The last command of an interrupted navigator is a standstill."""
    graph.andabata("robot", "--world", "natural-test", "--seconds", "60", *QUICK)
    graph.wait_for("/initialpose", "Publishers:")
    node = graph.andabata("navigator", "--controller", "straight")
    graph.wait_for("/wheel_speed_cmd", "Publishers:")
    recorded = graph.folder / "live.bag"
    recorder = graph.start("rosbag", "record", "-O", recorded, "/wheel_speed_cmd")
    time.sleep(7)
    stop(node)
    assert node.returncode == 130
    finished_bag(recorder, recorded)
    with Bag(recorded) as live:
        wheels = [(m.content.left, m.content.right) for m in live.messages()]
    assert wheels[-2] != (0.0, 0.0)
    assert wheels[-1] == (0.0, 0.0)


@needs_ros
def test_readings_of_another_clock_are_refused(graph, bag):
    """Stamps of another clock are an error that names use_sim_time."""
    node = graph.andabata("navigator")
    graph.wait_for("/imu", "Subscribers:")
    graph.start("rosbag", "play", "--quiet", bag, "--topics", *SENSORS)
    assert node.wait(30) == 1
    error = node.output.with_suffix(".err").read_text()
    assert "use_sim_time" in error
    assert "Traceback" not in error


def test_invalid_positions_are_a_usage_error(capsys):
    """Wrong starts, goals and controllers are usage errors."""
    assert main(["ros", "navigator", "--start", "1,2"]) == 2
    assert main(["ros", "navigator", "--goal", "1,nan"]) == 2
    assert main(["ros", "navigator", "--controller", "oracle"]) == 2
    assert capsys.readouterr().err.count("expected") == 3
