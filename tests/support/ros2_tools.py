"""ROS 2 on this machine: tests of a live graph are left out without DDS, or without rclpy."""

import os
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

from andabata.bench.studies.ros2_link import rclpy_python
from andabata.distribution import install_extra

needs_dds = pytest.mark.skipif(
    find_spec("cyclonedds") is None,
    reason=f"cyclonedds is not installed ({install_extra('ros2')})",
)

needs_rclpy = pytest.mark.skipif(
    find_spec("cyclonedds") is None or not rclpy_python().exists(),
    reason="cyclonedds and rclpy are not installed (make ros2)",
)


@contextmanager
def domain(monkeypatch):
    """Let the block have a domain of its own: other processes of this machine test, too.

    Ports of the domains up to 101 are none that Linux gives away.
    """
    for name in ("CYCLONEDDS_URI", "ROS_DISTRO", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 95))
    yield
