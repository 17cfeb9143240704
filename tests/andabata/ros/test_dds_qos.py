"""Profiles match as DDS matches them, and serve drivers, viewers and late subscribers."""

from itertools import product

import pytest

from andabata.records import topics
from andabata.records.topics import Topic
from andabata.ros.dds_qos import Profile, publisher_profile, subscriber_profiles
from tests.support.ros2_tools import needs_dds

PROFILES = [Profile(reliable, latched) for reliable, latched in product((False, True), repeat=2)]


def test_a_publisher_offers_at_least_what_is_asked_for():
    """The strongest serves all, and the weakest itself alone."""
    served = {str(p): [str(s) for s in PROFILES if p.can_serve(s)] for p in PROFILES}
    assert len(served["RELIABLE, TRANSIENT_LOCAL"]) == 4
    assert served["BEST_EFFORT, VOLATILE"] == ["BEST_EFFORT, VOLATILE"]
    assert served["RELIABLE, VOLATILE"] == ["BEST_EFFORT, VOLATILE", "RELIABLE, VOLATILE"]


def test_sensors_are_received_from_every_publisher():
    """Whatever a driver offers, its readings arrive."""
    for topic in (topics.IMU, topics.SCAN, topics.LASER_CLOUD):
        assert all(each.can_serve(subscriber_profiles(topic)[0]) for each in PROFILES)


def test_events_are_received_latched_or_not_but_reliably():
    """A goal arrives from RViz (volatile) and from a latched publisher, not from best effort.

    So does another planner's path.
    """
    path = Topic("/plan", "/plan", topics.PATH, None)
    for asked in (subscriber_profiles(topics.GOAL), subscriber_profiles(path)):
        for publisher in PROFILES:
            arrives = any(publisher.can_serve(each) for each in asked)
            assert arrives == publisher.is_reliable


def test_outputs_serve_viewers_and_costmaps():
    """Commands and scans serve reliable subscribers, and a latched map those that come late."""
    reliable, late = Profile(True, False), Profile(True, True)
    assert publisher_profile(topics.TWIST, latch=False).can_serve(reliable)
    assert publisher_profile(topics.RELATIVE_CLOUD, latch=False).can_serve(reliable)
    assert publisher_profile(topics.LOCAL_MAP, latch=True).can_serve(late)
    assert not publisher_profile(topics.IMU, latch=False).is_reliable


@needs_dds
@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_policies_state_the_profile(profile):
    """A profile comes back from its policies."""
    assert str(Profile.of(profile.dds())) == str(profile)
