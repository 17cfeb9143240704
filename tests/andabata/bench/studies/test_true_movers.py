"""True movers: what the robot is told, in its own odom, and which cells no map is to keep."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.studies.true_movers import TrueMovers, tell_true_movers
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.mover_perception import MoverPerceptionConfig

TURN = 0.5
HERE = Pose.from_euler(np.array([10.0, 5.0, 0.0]), 0.0, 0.0, TURN)
ODOMETRY = Pose.from_euler(np.array([1.0, 0.0, 0.0]), 0.0, 0.0, 0.0)


def in_map(place):
    """Return the place in the map of a place in odom."""
    c, s = np.cos(TURN), np.sin(TURN)
    x, y = place[0] - 1.0, place[1]
    return np.array([10.0 + c * x - s * y, 5.0 + s * x + c * y])


def made():
    """Return the true movers of a robot that believes to be elsewhere than it is."""
    robot = SimpleNamespace(
        localizer=SimpleNamespace(odometry=ODOMETRY),
        config=SimpleNamespace(robot=SimpleNamespace(lidar_height=0.7)),
    )
    return TrueMovers(MoverPerceptionConfig(), robot)


def told(movers, stamp, *places, radius=0.25):
    """Tell of movers at places in odom."""
    rows = np.array([(*in_map(place), 0.0, radius, 1.7) for place in places]).reshape(-1, 5)
    truth = SimpleNamespace(pose=HERE)
    movers.update(SensorReadings(stamp, walkers=rows, truth=truth), None)
    return movers.movers


def test_places_and_velocities_are_those_in_odom():
    """From the second step on; who stands, or is not there, is left out."""
    movers = made()
    assert not len(told(movers, 0.1, (3.0, 0.0), (2.0, 1.0)).radii)
    found = told(movers, 0.2, (3.1, -0.05), (2.0, 1.02))
    np.testing.assert_allclose(found.places, [(3.1, -0.05)], atol=1e-9)
    np.testing.assert_allclose(found.velocities, [(1.0, -0.5)], atol=1e-9)
    np.testing.assert_array_equal(found.doubts, [0.0])
    assert not len(told(movers, 0.3, (3.2, -0.1), (2.0, 1.0), radius=0.0).radii)


def test_cells_under_them_are_not_kept_for_a_while():
    """Where they are and were, within the time that clouds keep them."""
    movers = made()
    assert movers.transient_places.shape == (0, 2)
    for k in range(100):
        told(movers, 0.1 * k, (0.05 * k - 3.0, 0.0))
        if k == 1:
            first = movers.transient_places
    away = np.hypot(*(first - (-2.95, 0.0)).T)
    assert 0.4 < away.max() <= 0.55
    assert len(first) >= 20
    last = movers.transient_places
    assert last[:, 0].min() > 0.05 * 99 - 3.0 - 0.5 * 7.0 - 0.6
    movers.reset()
    assert not len(movers.movers.radii)


def test_readings_without_truth_and_robots_without_tracks_are_refused():
    """The messages say what is missing."""
    with pytest.raises(ValueError, match="expected the simulator's true state"):
        made().update(SensorReadings(0.1), None)
    robot = SimpleNamespace(perception=None, config=SimpleNamespace(movers=None))
    with pytest.raises(TypeError, match="expected a robot with a planner that perceives movers"):
        tell_true_movers(robot)
