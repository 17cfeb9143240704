"""DDS follows the environment variables of ROS 2, and the user's own configuration comes last."""

import pytest

from andabata.ros.dds_configuration import configuration, domain_id, gid_size
from andabata.ros.graph import RosError


def test_the_domain_is_the_environments():
    """It is 0 by default; others than 0 to 232 are errors."""
    assert domain_id({}) == domain_id({"ROS_DOMAIN_ID": ""}) == 0
    assert domain_id({"ROS_DOMAIN_ID": "232"}) == 232
    for text in ("233", "-1", "x"):
        with pytest.raises(RosError, match=f"from 0 to 232, got '{text}'"):
            domain_id({"ROS_DOMAIN_ID": text})


def test_the_users_configuration_is_merged_and_comes_last():
    """Ours is before it, so that the user's elements take precedence."""
    user = "file:///etc/cyclone.xml"
    parts = configuration({"CYCLONEDDS_URI": user}).split(",")
    assert parts[-1] == user
    assert "<IgnoreTypeInformation>1.15</IgnoreTypeInformation>" in parts[0]
    assert len(configuration({}).split(",")) == 1


def test_discovery_stays_on_this_machine_where_ros_says_so():
    """ROS_LOCALHOST_ONLY takes precedence over the range, whose values are ROS 2's."""
    only = configuration({"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"})
    assert 'address="127.0.0.1"' in only
    local = configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"})
    assert '<Peer address="localhost"/>' in local
    assert "<AllowMulticast>false" in local
    off = configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"})
    assert "<Peers></Peers>" in off
    peers = configuration({"ROS_STATIC_PEERS": "10.0.0.2;10.0.0.3"})
    assert '<Peer address="10.0.0.2"/><Peer address="10.0.0.3"/>' in peers
    assert "AllowMulticast" not in peers
    with pytest.raises(RosError, match=r"expected one of SUBNET, .*got 'HOME'"):
        configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "HOME"})


def test_identifiers_are_longer_before_iron():
    """ROS_DISTRO chooses the size."""
    assert gid_size({}) == gid_size({"ROS_DISTRO": "kilted"}) == 16
    assert gid_size({"ROS_DISTRO": "humble"}) == 24
