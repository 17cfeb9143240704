"""The reactive law avoids obstacles and heads for the goal where nothing is in the way."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.reactive import ReactiveConfig, ReactiveController, StraightController
from tests.support.situations import GRID, pose_at, scan_of, situation


def view(ranges, heading_error, distance=20.0, **changes):
    return situation(scan_of(ranges), heading_error, distance, **changes)


def blocked(bearing_low, bearing_high, distance):
    ranges = np.full(GRID.n_sectors, np.inf)
    ranges[(GRID.bearings >= bearing_low) & (GRID.bearings <= bearing_high)] = distance
    return ranges


def rate(controller, given):
    """Return the yaw rate of an act."""
    return controller.act(given).angular


@pytest.mark.parametrize("error", [-1.0, -0.3, 0.0, 0.3, 1.0])
def test_free_space_steers_at_the_goal(error):
    """The yaw rate is proportional to the goal's bearing."""
    controller = ReactiveController(RobotModel(), GRID)
    assert rate(controller, view(np.full(32, np.inf), error)) == pytest.approx(5.5 * error)


def test_the_forward_speed_is_the_robots():
    """The law steers and leaves the speed alone."""
    controller = ReactiveController(RobotModel(speed=0.7), GRID)
    assert controller.act(view(np.full(32, np.inf), 0.1)).linear == 0.7


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_obstacle_ahead_and_to_one_side_turns_to_the_other(side):
    """Blocked sectors ahead and left turn the robot right, and the other way round."""
    controller = ReactiveController(RobotModel(), GRID)
    low, high = sorted([-0.25 * side, 1.5 * side])
    assert side * rate(controller, view(blocked(low, high, 1.5), 0.0)) < -0.5


def test_an_obstacle_aside_does_not_disturb():
    """What stands beside the way leaves the heading almost as it is."""
    controller = ReactiveController(RobotModel(), GRID)
    assert abs(rate(controller, view(blocked(1.4, 2.5, 2.0), 0.0))) < 0.6


def test_a_gap_narrower_than_the_body_is_not_taken():
    """Obstacles are widened by the body and its margin."""
    ranges = np.full(32, 1.2)
    ranges[16] = np.inf  # One sector is 0.24 m wide at 1.2 m.
    ranges[:8] = np.inf
    steering = rate(ReactiveController(RobotModel(), GRID), view(ranges, 0.1))
    assert abs(steering) > 5.5 * np.pi / 4


@pytest.mark.parametrize(("distance", "is_straight"), [(1.6, True), (2.4, False)])
def test_what_stands_behind_the_goal_does_not_count(distance, is_straight):
    """A sector is open when it is free as far as the goal."""
    controller = ReactiveController(RobotModel(), GRID)
    steering = rate(controller, view(blocked(-0.5, 0.5, 2.0), 0.0, distance))
    assert (abs(steering) < 1e-9) == is_straight


def test_where_nothing_is_open_the_freest_sector_is_taken():
    """Without an open sector the robot turns to where it is free farthest."""
    ranges = np.full(32, 1.0)
    ranges[2:12] = 2.5
    steering = rate(ReactiveController(RobotModel(), GRID), view(ranges, 0.0))
    assert steering == pytest.approx(5.5 * GRID.bearings[9])  # Two sectors from the edge.


def test_a_choice_is_kept_in_the_world_until_a_reset():
    """Between two equal ways the last one, seen from the turned robot, is taken again."""
    config = ReactiveConfig(commitment_weight=0.35)
    wall = blocked(-0.5, 0.5, 1.5)
    controller = ReactiveController(RobotModel(), GRID, config)
    left = rate(controller, view(blocked(-3.0, 0.5, 1.5), 0.0))
    assert left > 0
    assert rate(controller, view(wall, -0.1)) > 0  # The right is a little nearer.
    controller.reset()
    assert rate(controller, view(wall, -0.1)) < 0
    # Turned by a whole half turn, the bearing that was on the left lies on the right.
    turned = ReactiveController(RobotModel(), GRID, config)
    rate(turned, view(blocked(-3.0, 0.5, 1.5), 0.0))
    assert rate(turned, view(wall, 0.1, pose=pose_at(yaw=2 * left / 5.5))) < 0


def test_a_free_detour_is_taken_up_to_its_worth():
    """A sector free to the last ring beats one that ends sooner and lies a little nearer."""
    ranges = np.full(32, np.inf)
    ranges[GRID.bearings > -0.2] = 3.5
    wide = ReactiveConfig(clearance_weight=2.0, margin=0.0)
    narrow = ReactiveConfig(clearance_weight=0.0, margin=0.0)
    given = view(ranges, 0.0)
    assert rate(ReactiveController(RobotModel(), GRID, wide), given) < -0.5
    assert rate(ReactiveController(RobotModel(), GRID, narrow), given) == 0.0


def test_straight_ignores_the_scan():
    """The lower bound steers at the goal at its own speed, through whatever is there."""
    controller = StraightController(0.3)
    assert controller.act(view(blocked(-1, 1, 0.7), 0.2)) == Twist(0.3, pytest.approx(1.1))
    assert StraightController(0.6, 2.0).act(view(np.inf, -0.2)) == Twist(0.6, pytest.approx(-0.4))
