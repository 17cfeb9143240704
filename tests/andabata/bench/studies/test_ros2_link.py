"""Messages pass between our graph and ROS 2's own client, both ways, whatever service is asked."""

import os

import pytest

from andabata.bench.studies.ros2_link import measure, rclpy_python
from tests.support.ros2_tools import domain, needs_rclpy


@needs_rclpy
@pytest.mark.parametrize("reliable", [True, False], ids=["reliable", "sensors"])
def test_clouds_and_readings_pass_both_ways(reliable, monkeypatch):
    """All clouds of 10,000 points arrive, and nearly all readings; rclpy sees our node."""
    with domain(monkeypatch):
        found = measure(rclpy_python(), reliable, seconds=2.0)
    for way in ("to_rclpy", "from_rclpy"):
        clouds, readings = found[way]["cloud"], found[way]["imu"]
        assert (clouds["sent"], readings["sent"]) == (20, 200)
        assert clouds["received"] == 20
        assert readings["received"] >= 198
        # Wide, since the machine may be busy: the study measures.
        assert clouds["median_ms"] < 50
        assert found[way]["twist"]["received"] >= 19
    assert found["dropped"] == 0
    assert ["andabata_link", "/"] in found["nodes"]
    assert found["topics"]["/cmd_vel"] == ["geometry_msgs/msg/Twist"]


@needs_rclpy
@pytest.mark.parametrize(
    ("variable", "value", "offset"),
    [("ROS_LOCALHOST_ONLY", "1", 1), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 2)],
)
def test_nodes_of_one_machine_find_each_other_without_the_network(
    variable, value, offset, monkeypatch
):
    """The variables of ROS 2 mean the same to both sides."""
    with domain(monkeypatch):
        # A process configures a domain once.
        monkeypatch.setenv("ROS_DOMAIN_ID", str(int(os.environ["ROS_DOMAIN_ID"]) + offset))
        monkeypatch.setenv(variable, value)
        found = measure(rclpy_python(), reliable=True, seconds=0.5)
    assert found["to_rclpy"]["cloud"]["received"] == 5
    assert found["from_rclpy"]["cloud"]["received"] == 5
