"""ROS 1's tools on this machine: tests of a live graph are left out without them."""

import shutil

import pytest

from andabata.distribution import install_ros

_TOOLS = ("rosmaster", "rosbag", "rostopic", "rosparam")


def has_tools(*more):
    """Return True if ROS 1's tools are installed where Debian puts them."""
    return all(shutil.which(tool, path="/usr/bin") for tool in (*_TOOLS, *more))


needs_ros = pytest.mark.skipif(
    not has_tools(),
    reason=f"ROS 1's tools are not installed (on Debian: {install_ros()})",
)
