"""Observations of distilled policies: known answers, mirrors, and other policies refused."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.models import shipped_policy
from andabata.navigation.planar.distilled_observation import (
    ACTIONS,
    FAR,
    OBSERVATIONS,
    WINDOWS,
    check_distilled,
    mirrored,
    nearest_by_window,
    observe,
)
from andabata.navigation.planar.dynamics import PlanarDynamics

DYNAMICS = PlanarDynamics(0.05, 0.1, 3.0, 8.0)
COMMANDS = np.array([(0.1, -0.1), (0.2, -0.2), (0.3, -0.3)])
HITS = np.array([(2.0, 0.02), (0.02, 1.0), (0.02, 1.5), (-3.0, -0.02)])


def observation(hits=HITS, goal=(1.0, 3.0), pose=(1.0, 1.0, 0.0), speeds=(0.5, 0.7), past=COMMANDS):
    """Return an observation; the goal is 2 m to the left."""
    none = np.zeros(0, dtype=np.float32)
    readings = PlanarReadings(0.0, PlanarPose(*pose), Twist(*speeds), none)
    return observe(np.asarray(hits), readings, goal, past, DYNAMICS)


def part(seen, name):
    """Return a term as a list."""
    return seen[OBSERVATIONS.slice_of(name)].tolist()


def test_windows_hold_their_nearest_hits():
    """Ahead in the middle, to the left three quarters round, the nearer of two; the rest is far."""
    found = nearest_by_window(HITS, WINDOWS, FAR)
    expected = np.full(WINDOWS, FAR)
    expected[WINDOWS // 2], expected[3 * WINDOWS // 4 - 1], expected[0] = 2.0, 1.0, 3.0
    np.testing.assert_allclose(found, expected, atol=1e-3)
    assert (nearest_by_window(np.array([(50.0, 0.0)]), WINDOWS, FAR) == FAR).all()


def test_all_else_stands_in_its_place():
    """Goal in the robot's frame, speeds, the newest command first, dynamics."""
    seen = observation()
    assert part(seen, "goal_direction") == pytest.approx([0.0, 1.0], abs=1e-6)
    assert part(seen, "goal_distance") == pytest.approx([2.0])
    assert part(seen, "speed") + part(seen, "yaw_rate") == pytest.approx([0.5, 0.7])
    assert part(seen, "previous_speeds") == pytest.approx([0.3, 0.2, 0.1])
    assert part(seen, "previous_yaw_rates") == pytest.approx([-0.3, -0.2, -0.1])
    found = [part(seen, name)[0] for name in DYNAMICS._fields]
    assert found == pytest.approx(list(DYNAMICS))
    turned = observation(pose=(1.0, 1.0, np.pi / 2))
    assert part(turned, "goal_direction") == pytest.approx([1.0, 0.0], abs=1e-6)
    assert part(observation(goal=(1.0, 99.0)), "goal_distance") == [FAR]


def test_a_mirror_shows_the_mirrored_world():
    """Observation and action of the world with left and right exchanged."""
    shares = np.array([[0.3, 0.4]], dtype=np.float32)
    seen, taken = mirrored(observation()[None], shares)
    past, sides = COMMANDS * (1, -1), HITS * (1, -1)
    there = observation(sides, (1.0, -1.0), speeds=(0.5, -0.7), past=past)
    np.testing.assert_allclose(seen[0], there, atol=1e-6)
    np.testing.assert_allclose(taken, [[0.3, -0.4]])
    again = mirrored(seen, taken)
    np.testing.assert_array_equal(again[0][0], observation())
    np.testing.assert_array_equal(again[1], shares)


def test_other_policies_are_refused():
    """Expected, got, next step."""
    with pytest.raises(ValueError, match=r"spn: expected a policy distilled.*got.*policy distill"):
        check_distilled(shipped_policy("spn"), "spn")


def test_actions_are_those_of_the_expert():
    """Shares of 1 and -1 are its limits."""
    assert ACTIONS.scaled([1.0, 1.0]).tolist() == [2.0, 4.0]
    assert ACTIONS.scaled([-1.0, -1.0]).tolist() == [-0.5, -4.0]
