"""The monitor of a drive: its measures are those of the true path."""

import numpy as np
import pytest

from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import box
from tests.support.situations import scan_of

GOAL = np.array([5.0, 0.0])


def state(stamp, x, y=0.0, rate=0.0, **others):
    return VehicleState(
        stamp=stamp,
        pose=Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, 0.0),
        linear=np.zeros(3),
        angular=np.array([0.0, 0.0, rate]),
        wheels=WheelSpeeds(0.0, 0.0),
        **others,
    )


@pytest.fixture
def monitor(make_ground):
    return EpisodeMonitor(make_ground(), TerminationConfig(time_limit=50.0))


def test_distance_time_and_path(monitor):
    """The distance is the sum of all moves, the time counts from the begin of the drive."""
    monitor.begin(state(10.0, 0.0), GOAL)
    for stamp, x, y in ((11.0, 3.0, 0.0), (12.0, 3.0, 4.0), (13.0, 0.0, 0.0)):
        assert monitor.update(state(stamp, x, y)) is None
    assert monitor.distance == pytest.approx(3 + 4 + 5)
    assert monitor.time == pytest.approx(3.0)
    np.testing.assert_array_equal(monitor.path, [[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 0, 0]])
    assert monitor.goal_distance(state(13.0, 2.0, 4.0)) == pytest.approx(5.0)


def test_the_contact_is_the_last_one(monitor):
    """A collision with a walker ends the drive, and says who drove into whom."""
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.update(state(1.0, 0.5)) is None
    assert monitor.contact is Contact.NONE
    hit = state(2.0, 0.5, collided=True, contact=Contact.HIT_AT_REST)
    assert monitor.update(hit) is Outcome.COLLISION
    assert monitor.contact is Contact.HIT_AT_REST
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.contact is Contact.NONE


def test_turns_and_steering_variation(monitor):
    """Turns count left less right; the variation is the integral of the squared yaw rate."""
    monitor.begin(state(0.0, 0.0), GOAL)
    monitor.update(state(2.0, 0.5, rate=0.5))
    monitor.update(state(3.0, 0.9, rate=-0.4))
    assert monitor.turns == pytest.approx((2 * 0.5 - 0.4) / (2 * np.pi))
    assert monitor.steering_variation == pytest.approx(2 * 0.25 + 0.16)


def test_forbidden_distance_and_clearance(make_ground):
    """Only moves onto forbidden ground count, and the clearance is the least on the path."""
    wall = box(SemanticClass.WALL, (2.0, 0.0, 1.0), (0.5, 4.0, 2.0))
    world = make_ground(objects=[wall])
    monitor = EpisodeMonitor(world, TerminationConfig())
    monitor.begin(state(0.0, 0.0), GOAL)
    monitor.update(state(1.0, 1.0))
    assert monitor.forbidden_distance == 0.0
    assert monitor.min_clearance == pytest.approx(float(world.truth.clearance_at(1.0, 0.0)))
    assert 0.4 < monitor.min_clearance < 0.9
    monitor.update(state(2.0, 2.0))
    monitor.update(state(3.0, 2.0))
    monitor.update(state(4.0, 4.0))
    assert monitor.forbidden_distance == pytest.approx(1.0)
    assert monitor.min_clearance == 0.0


def test_energy_is_the_work_since_the_begin(monitor):
    """Work that was done before the drive does not count; without motors there is none."""
    monitor.begin(state(0.0, 0.0, work=70.0), GOAL)
    assert monitor.energy is None
    monitor.update(state(1.0, 1.0, work=95.0))
    assert monitor.energy == pytest.approx(25.0)
    monitor.begin(state(0.0, 0.0), GOAL)
    monitor.update(state(1.0, 1.0))
    assert monitor.energy is None


@pytest.mark.parametrize(
    ("last", "outcome"),
    [
        (state(2.0, 4.01), Outcome.GOAL),
        (state(2.0, 3.9, collided=True), Outcome.COLLISION),
        (state(2.0, 4.5, collided=True, tipped=True), Outcome.TIPOVER),
        (state(2.0, 3.99), None),
        (state(50.0, 3.0), Outcome.TIMEOUT),
        (state(21.0, 0.1), Outcome.STUCK),
    ],
)
def test_outcomes(monitor, last, outcome):
    """The true state decides; ``ending`` is the outcome as a number."""
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.update(last) is outcome
    assert monitor.ending.outcome is outcome


def test_a_drive_begins_afresh(monitor):
    """A second drive inherits nothing of the first: neither measures nor the stuck clock."""
    monitor.begin(state(0.0, 0.0, work=1.0), GOAL)
    monitor.update(state(19.0, 0.1, rate=0.5, work=5.0))
    monitor.begin(state(19.0, 0.1), GOAL)
    assert (monitor.distance, monitor.turns, monitor.steering_variation) == (0.0, 0.0, 0.0)
    assert (monitor.time, monitor.energy, len(monitor.path)) == (0.0, None, 1)
    assert np.isposinf(monitor.min_clearance)
    assert monitor.update(state(38.0, 0.1)) is None
    assert monitor.update(state(39.1, 0.1)) is Outcome.STUCK


def test_a_robot_that_declares_its_arrival_ends_the_drive(monitor):
    """Before its word no goal is reached; after it the true distance decides."""
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.update(state(1.0, 4.9), has_arrived=False) is None
    assert monitor.update(state(2.0, 4.9), has_arrived=True) is Outcome.GOAL
    assert monitor.update(state(3.0, 3.9), has_arrived=True) is Outcome.FALSE_ARRIVAL
    assert monitor.update(state(4.0, 3.9, collided=True), has_arrived=True) is Outcome.COLLISION


@pytest.mark.parametrize("limit", [None, 0.72])
def test_a_near_range_ends_a_drive_by_the_rule_alone(make_ground, limit):
    """A contact beside it is a contact, and before the first scan nothing is near."""
    rules = TerminationConfig(collision_range=limit)
    monitor = EpisodeMonitor(make_ground(), rules, sees_scan=True)
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.update(state(1.0, 0.5)) is None
    assert monitor.update(state(2.0, 0.9), scan=scan_of(0.75)) is None
    ended = monitor.update(state(3.0, 1.2), scan=scan_of(0.7))
    assert ended is (None if limit is None else Outcome.COLLISION)
    assert monitor.is_too_near == (limit is not None)
    monitor.update(state(4.0, 1.3, collided=True), scan=scan_of(0.7))
    assert not monitor.is_too_near


def test_the_word_of_a_robot_excuses_no_near_range(make_ground):
    """As it excuses no contact."""
    rules = TerminationConfig(collision_range=0.72)
    monitor = EpisodeMonitor(make_ground(), rules, sees_scan=True)
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.update(state(1.0, 4.9), True, scan_of(0.7)) is Outcome.COLLISION


def test_a_rule_that_needs_a_scan_is_refused_without_one(make_ground):
    """By its name."""
    with pytest.raises(ValueError, match=r"terminations\.collision_range"):
        EpisodeMonitor(make_ground(), TerminationConfig(collision_range=0.72))
