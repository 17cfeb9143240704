"""Arrival: said by the estimate at the distance, or nearer than the largest after patience."""

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.navigation.arrival import ARRIVAL_DISTANCE, ArrivalConfig, ArrivalMonitor

CONFIG = ArrivalConfig()
PERIOD = 0.1


def arrivals(distances, monitor=None, health=Health.OK, begin=0.0):
    """Return what a monitor says of distances [m], one a control step."""
    monitor = monitor or ArrivalMonitor(CONFIG)
    return [
        monitor.update(float(distance), begin + PERIOD * k, health)
        for k, distance in enumerate(distances)
    ]


def test_a_goal_is_reached_at_the_distance_and_no_sooner():
    """On a straight way the word comes at 0.3 m, whatever the largest distance is."""
    distances = np.arange(3.0, 0.1, -0.03)
    said = arrivals(distances)
    assert distances[said.index(True)] == pytest.approx(ARRIVAL_DISTANCE, abs=0.03)
    assert distances[said.index(True)] <= ARRIVAL_DISTANCE
    assert all(said[said.index(True) :])


def test_the_word_stays_said():
    """A fix that moves the estimate, and a bad health, take nothing back; a new goal does."""
    monitor = ArrivalMonitor(CONFIG)
    assert arrivals([0.2, 2.5], monitor) == [True, True]
    assert arrivals([2.5], monitor, Health.LOST, 1.0) == [True]
    monitor.reset()
    assert monitor.has_arrived is False
    assert arrivals([2.5], monitor, begin=2.0) == [False]


@pytest.mark.parametrize("distance", [0.4, 0.65, 0.99])
def test_a_goal_that_cannot_be_had_is_accepted_in_proportion_to_the_time(distance):
    """A robot that stands before an obstacle declares later the farther off it is, up to 10 s."""
    said = arrivals([distance] * 150)
    expected = CONFIG.patience * (distance - 0.3) / 0.7
    assert said.index(True) * PERIOD == pytest.approx(expected, abs=0.15)


def test_beyond_the_largest_distance_nothing_is_declared():
    """However long the robot stands there."""
    assert not any(arrivals([1.01] * 1000))
    near = ArrivalMonitor(ArrivalConfig(distance=0.3, max_distance=0.1))
    assert not any(arrivals([0.35] * 1000, near))
    assert arrivals([0.29], near, begin=200.0) == [True]


def test_coming_nearer_begins_the_patience_anew():
    """Five centimetres count as nearer, less does not."""
    creeping = 0.95 - 0.06 * np.repeat(np.arange(4), 50)
    assert not any(arrivals(creeping))
    jittering = 0.95 - 0.02 * (np.arange(150) % 2)
    assert any(arrivals(jittering))


def test_a_robot_that_circles_stops_where_it_is_nearest():
    """Between 0.45 and 1.6 m in turns, it declares at the near end and not on its way there."""
    distances = 1.025 - 0.575 * np.cos(2 * np.pi * PERIOD * np.arange(400) / 12.0)
    said = arrivals(distances)
    assert distances[said.index(True)] < 0.47


@pytest.mark.parametrize("health", [Health.LOST, Health.DISORIENTED])
def test_without_a_pose_or_a_heading_nothing_is_declared(health):
    """Nor does that time count as patience; a degraded estimate is good enough."""
    monitor = ArrivalMonitor(CONFIG)
    assert not any(arrivals([0.1] * 300, monitor, health))
    assert arrivals([0.1], monitor, Health.DEGRADED, 30.0) == [True]
    monitor.reset()
    assert not any(arrivals([0.9] * 300, monitor, health, 40.0))
    assert not any(arrivals([0.9] * 50, monitor, Health.OK, 70.0))


def test_the_stalled_time_begins_anew_when_the_robot_comes_nearer():
    """None before a goal; then the time since the last gain, and none again with a new goal."""
    monitor = ArrivalMonitor(CONFIG)
    assert monitor.stalled_time(5.0) == 0.0
    arrivals([3.0, 2.9, 2.8] + [2.9] * 40, monitor)
    assert monitor.stalled_time(4.2) == pytest.approx(4.0)
    arrivals([2.7], monitor, begin=4.3)
    assert monitor.stalled_time(4.3) == 0.0
    monitor.reset()
    assert monitor.stalled_time(9.0) == 0.0
