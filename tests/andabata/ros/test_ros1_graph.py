"""Errors of a missing ROS, and our bags and types as ROS's own tools see them."""

import re
import sys

import pytest

from andabata.app.cli import main
from andabata.bench.studies.ros_graph import Graph
from andabata.records.topics import TOPICS
from tests.support.ros_tools import needs_ros


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Short recorded drive."""
    path = tmp_path_factory.mktemp("bag") / "drive.bag"
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
    words += ["--set", "plant=kinematic", "--out", str(path.parent / "out"), "--time-limit", "8"]
    assert main([*words, "--record", str(path), "--quiet", "--json"]) == 0
    return path


@needs_ros
def test_the_reference_tools_read_our_bags(bag, tmp_path):
    """rosbag reads our bags, and the types' checksums are ROS's."""
    graph = Graph(tmp_path)
    info = graph.tool("rosbag", "info", "-y", bag)
    assert all(f"topic: {topic.ros1}\n" in info for topic in TOPICS)
    checked = graph.start("rosbag", "check", bag)
    checked.wait(60)
    output = checked.output.read_text() + checked.output.with_suffix(".err").read_text()
    # It compares definitions with their comments, which rosbags leaves out: every standard type is
    # listed, and none has another checksum. Our own types are nowhere but in the bag.
    pairs = re.findall(r"From: (\S+) \[(\w+)\]\s+To: +(\S+)(?: \[(\w+)\])?", output)
    assert len(pairs) > 5
    assert [p for p in pairs if p[1] != p[3] and not p[0].startswith("andabata_msgs/")] == []


@needs_ros
def test_a_missing_master_is_reported(tmp_path):
    """Without a master the error names roscore."""
    graph = Graph(tmp_path)
    node = graph.andabata("navigator")
    assert node.wait(60) == 1
    assert "roscore" in node.output.with_suffix(".err").read_text()


def test_missing_ros_packages_are_reported(monkeypatch, capsys):
    """Without rospy the error has the line that installs it, in a clone and beside a wheel."""
    monkeypatch.setitem(sys.modules, "rospy", None)
    assert main(["ros", "navigator"]) == 1
    assert "make ros" in capsys.readouterr().err
    monkeypatch.setattr("andabata.distribution.is_clone", lambda: False)
    assert main(["ros", "navigator"]) == 1
    assert "python3-rospy" in capsys.readouterr().err
