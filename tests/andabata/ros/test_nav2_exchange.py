"""ROS 2's own client, as Nav2's costmaps and planner use it, reads our maps and sends its path."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

from andabata.bench.studies.ros2_link import peer_process, rclpy_python
from andabata.navigation.planning.map_layers import OCCUPANCY, MapLayers
from andabata.records import map_messages, topics
from andabata.records.messages import MessageBuilder
from andabata.records.topics import Topic
from andabata.ros.path_goals import PathGoals
from andabata.ros.ros2_graph import Ros2Graph
from tests.support.ros2_tools import domain, needs_rclpy
from traversability.virtual_scan import VirtualScan

PEER = Path(__file__).parents[2] / "support" / "costmap_peer.py"
PLAN = Topic("/nav2_plan", "/nav2_plan", topics.PATH, None)


def local_map():
    """Return a map with a free, an occupied and an unknown cell among free ones."""
    occupancy = np.zeros((8, 8), dtype=np.float32)
    occupancy[2, 3], occupancy[5, 5] = 1.0, np.nan
    return MapLayers(np.array([-0.8, -0.8]), 0.2, 0.65, {OCCUPANCY: occupancy})


@needs_rclpy
def test_a_costmap_that_comes_late_has_the_map_and_the_scan_and_its_path_is_followed(monkeypatch):
    """The map is sent once, before the costmap is there; so is the path, to who listens."""
    with domain(monkeypatch):
        graph, goals = Ros2Graph("andabata"), PathGoals()
        builder = MessageBuilder(2, time.time_ns())
        bearings = np.linspace(-np.pi, np.pi, 32)
        scan = VirtualScan(np.full(32, 3.0, dtype=np.float32), 10.0)
        names = {"map": topics.LOCAL_MAP.ros2, "scan": topics.VIRTUAL_SCAN.ros2, "path": PLAN.ros2}
        try:
            graph.advertise(topics.LOCAL_MAP, latch=True)
            graph.advertise(topics.VIRTUAL_SCAN)
            occupancy = map_messages.occupancy_grid(builder, 0.0, local_map(), 0.0)
            graph.write(topics.LOCAL_MAP, 0, occupancy)
            graph.subscribe(PLAN, goals.add)
            with peer_process(rclpy_python(), PEER, names) as process:
                for _ in range(300):
                    graph.write(topics.VIRTUAL_SCAN, 0, builder.virtual_scan(0.0, scan, bearings))
                    if goals.goal(np.zeros(2)) is not None:
                        break
                    time.sleep(0.1)
                found = json.loads(process.stdout.readline())
        finally:
            graph.close()
    assert goals.goal(np.zeros(2)) == pytest.approx((4.0, 0.0))
    assert (found["frame"], found["size"]) == ("odom", [8, 8])
    assert found["resolution"] == pytest.approx(0.2)
    assert found["values"] == [-1, 0, 100]
    assert (found["scan_frame"], found["ranges"]) == ("base_footprint", 32)
