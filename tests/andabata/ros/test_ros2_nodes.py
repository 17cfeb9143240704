"""Robot and navigator as a user starts them, in a live ROS 2 graph without ROS."""

import sys
import threading
import time
from itertools import pairwise

import numpy as np
import pytest

from andabata.bench.studies.ros_graph import Graph, stop
from andabata.records import topics
from andabata.records.messages import header_ns
from andabata.ros.navigator_output import STAMPED_TWIST
from andabata.ros.ros2_graph import Ros2Graph
from tests.support.ros2_tools import domain, needs_dds

WATCHED = (
    topics.GROUND_TRUTH,
    topics.VIRTUAL_SCAN,
    topics.WHEEL_COMMAND,
    topics.DIAGNOSTICS,
    topics.RELATIVE_CLOUD,
    topics.TF,
    topics.TF_STATIC,
    STAMPED_TWIST,
)


class Watch:
    """Node that keeps what it hears, with the time of arrival [s]."""

    def __init__(self):
        self.graph = Ros2Graph("watch")
        self.heard = {topic: [] for topic in WATCHED}
        self._lock = threading.Lock()
        for topic in WATCHED:
            self.graph.subscribe(topic, self._take)

    def _take(self, topic, message):
        with self._lock:
            self.heard[topic].append((time.monotonic(), message))

    def messages(self, topic):
        """Return the messages of a topic so far."""
        return [message for _, message in self.heard[topic]]

    def wait(self, condition, seconds=60.0):
        """Wait until a condition holds."""
        for _ in range(round(10 * seconds)):
            if condition():
                return
            time.sleep(0.1)
        raise TimeoutError(f"expected {condition.__doc__}, got none in {seconds:.0f} s")


@pytest.fixture
def watch(monkeypatch):
    """Node in a domain of its own."""
    with domain(monkeypatch):
        found = Watch()
        yield found
        found.graph.close()


def moving(message):
    """Return True if a command moves the wheels."""
    return message.left != 0 or message.right != 0


@needs_dds
def test_a_simulated_robot_is_driven_and_stands_when_its_topics_stop(watch, tmp_path):
    """Commands, scan, frames and thinned clouds come in time; a silent robot is named."""
    processes = Graph(tmp_path)

    def start(*words):
        return processes.start(
            sys.executable, "-m", "andabata", "ros2", *words, "--json", "--quiet"
        )

    def is_moving():
        """A command that moves."""
        return any(map(moving, watch.messages(topics.WHEEL_COMMAND)))

    def is_named():
        """Diagnostics that name the silent sensor."""
        texts = [m.status[0].message for m in watch.messages(topics.DIAGNOSTICS)]
        return any("imu: silent" in text for text in texts)

    try:
        robot = start("robot", "--world", "natural-test", "--set", "plant=kinematic")
        node = start("navigator", "--controller", "reactive", "--stamped", "--points", "2000")
        watch.wait(is_moving, 240)
        time.sleep(5)
        robot.kill()
        silent = time.monotonic()
        watch.wait(is_named)
        stop(node)
    finally:
        for process in reversed(processes.processes):
            stop(process)
    assert node.returncode == 130, node.output.with_suffix(".err").read_text()
    check_products(watch)
    stopped = [at for at, m in watch.heard[topics.WHEEL_COMMAND] if at > silent and not moving(m)]
    assert stopped
    assert not any(
        moving(m) for at, m in watch.heard[topics.WHEEL_COMMAND] if at > stopped[0] + 0.1
    )
    assert stopped[0] - silent < 1.0


def check_products(watch):
    """Check what the navigator published."""
    places = [m.pose.pose.position for m in watch.messages(topics.GROUND_TRUTH)]
    assert np.hypot(places[-1].x - places[0].x, places[-1].y - places[0].y) > 0.5
    stamps = [header_ns(m) / 1e9 for m in watch.messages(STAMPED_TWIST)]
    assert np.median(np.diff(stamps)) == pytest.approx(0.1, rel=0.1)
    assert all(m.width <= 2000 for m in watch.messages(topics.RELATIVE_CLOUD))
    assert len(watch.messages(topics.VIRTUAL_SCAN)) > 20
    pairs = {
        (t.header.frame_id, t.child_frame_id)
        for topic in (topics.TF, topics.TF_STATIC)
        for m in watch.messages(topic)
        for t in m.transforms
    }
    chain = ("map", "odom", "base_footprint", "base_link")
    assert set(pairwise(chain)) <= pairs


@needs_dds
def test_a_navigator_without_a_start_names_what_is_missing(monkeypatch, tmp_path):
    """The line has the names of ROS 2's topics."""
    with domain(monkeypatch):
        processes = Graph(tmp_path)
        words = ("ros2", "navigator", "--controller", "reactive", "--namespace", "/alone")
        try:
            node = processes.start(sys.executable, "-m", "andabata", *words)
            error = node.output.with_suffix(".err")
            for _ in range(600):
                if "no start yet" in error.read_text():
                    break
                time.sleep(0.1)
        finally:
            for process in reversed(processes.processes):
                stop(process)
    text = error.read_text()
    assert "no start yet: expected /imu/data and /imu/mag and 3 good fixes of /fix" in text
    assert "Traceback" not in text
