"""The files for Nav2 agree with what the navigator publishes and does."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from ruamel.yaml import YAML

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import with_parts
from andabata.navigation.arrival import ArrivalConfig
from andabata.records import topics

FOLDER = Path(__file__).parents[1] / "docs" / "guides" / "nav2"
TYPES = {"nav2_costmap_2d::StaticLayer": "OccupancyGrid", "LaserScan": "LaserScan"}


@pytest.fixture(scope="module")
def parameters():
    """Parameters by node."""
    found = YAML(typ="safe").load((FOLDER / "parameters.yaml").read_text())
    return {name: node.get(name, node)["ros__parameters"] for name, node in found.items()}


@pytest.fixture(scope="module")
def costmaps(parameters):
    """Parameters of the two costmaps."""
    return [parameters["local_costmap"], parameters["global_costmap"]]


def test_topics_and_types_are_published(costmaps):
    """Each layer reads a topic that the navigator publishes, in the type that it expects."""
    published = {each.ros2: each.kind for each in (topics.LOCAL_MAP, topics.VIRTUAL_SCAN)}
    read = {}
    for costmap in costmaps:
        for layer in (costmap[name] for name in costmap["plugins"]):
            if "map_topic" in layer:
                read[layer["map_topic"]] = TYPES[layer["plugin"]]
            for source in layer.get("observation_sources", "").split():
                read[layer[source]["topic"]] = TYPES[layer[source]["data_type"]]
    assert {name: kind.rpartition("/")[2] for name, kind in published.items()} == read


def test_costmaps_move_with_the_robot_and_lie_in_our_frames(costmaps):
    """A static layer changes the size of a costmap that does not roll."""
    assert [each["global_frame"] for each in costmaps] == ["odom", "map"]
    assert all(each["rolling_window"] for each in costmaps)
    assert all(each["lethal_cost_threshold"] == 100 for each in costmaps)


def test_obstacles_on_slopes_count_and_rays_do_not_clear(costmaps):
    """Heights have no bounds, and 32 rays free nothing between them."""
    layer = costmaps[0]["virtual_scan"]
    for each in (layer, layer["scan"]):
        assert each["min_obstacle_height"] <= -1000
        assert each["max_obstacle_height"] >= 1000
    assert layer["scan"]["marking"]
    assert not layer["scan"]["clearing"]


def test_the_outline_is_the_robots(costmaps):
    """Length and width of the robot file."""
    robot = with_parts(SimulatedRobotConfig, "utm-30lx", "andabata").robot
    for each in costmaps:
        corners = np.array(YAML(typ="safe").load(each["footprint"]))
        assert np.ptp(corners, axis=0) == pytest.approx((robot.length, robot.width))


def test_the_text_has_no_anchors():
    """ROS 2's own reader of parameters knows none."""
    lines = (FOLDER / "parameters.yaml").read_text().splitlines()
    values = [line.partition("#")[0].partition(":")[2].strip() for line in lines]
    assert not [value for value in values if value.startswith(("&", "*"))]


def test_nav2_takes_the_goal_for_reached_where_the_robot_stops(parameters):
    """The tree ends by a tolerance that the robot's arrival satisfies, and follows no path."""
    tolerance = parameters["bt_navigator"]["goal_reached_tol"]
    assert tolerance >= ArrivalConfig().max_distance
    tree = ElementTree.parse(FOLDER / "plan_only.xml").getroot()
    tags = [each.tag for each in tree.iter()]
    assert tree.get("main_tree_to_execute") in {each.get("ID") for each in tree}
    assert "ComputePathToPose" in tags
    assert "FollowPath" not in tags
