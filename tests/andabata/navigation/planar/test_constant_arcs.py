"""Constant arcs: the grid of commands, the rollout's dynamics, and what an arc costs."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.clearance_field import body_discs, clearance_field
from andabata.navigation.planar.constant_arcs import (
    ConstantArcsConfig,
    ConstantArcsNavigator,
    _costs,
    _Rollout,
    _step,
    _time_left,
)
from andabata.navigation.planar.time_to_go import TimeField
from andabata.navigation.planning.geofence_bounds import EVERYWHERE

VEHICLE = PLANAR_VEHICLES["barn"]
DISCS = body_discs(VEHICLE.footprint)
CELL = 0.1


def rollout(**changes):
    """Return a rollout of 1 s without limits, lag, margins or prices."""
    plain = _Rollout(20, 0.05, np.inf, np.inf, 1.0, 0.0, 0.0, 0.3, 0.0, 0.0)
    return plain._replace(**changes)


def time_along_x(size=80):
    """Return a field of a second a metre that falls along x: the goal lies far ahead."""
    middles = (np.arange(size) + 0.5) * CELL - size * CELL / 2
    times = np.repeat((4.0 - middles)[:, None], size, axis=1)
    corner = np.full(2, -size * CELL / 2)
    return TimeField(times, corner, CELL, 1.0, np.full(1, 1e3))


def costs(commands, points=(), waiting=(), state=(0, 0, 0, 0, 0), goal=(50.0, 0.0), **changes):
    """Return the costs of commands among points."""
    field = clearance_field(np.array(points, float).reshape(-1, 2), (0.0, 0.0), 4.0, 0.05, 0.5)
    return _costs(
        np.array(commands, float).reshape(-1, 2),
        np.array(waiting, float).reshape(-1, 2),
        np.array(state, float),
        DISCS,
        field,
        time_along_x(),
        np.array(goal),
        rollout(**changes),
    )


def test_all_speeds_are_tried_with_turns_that_the_wheels_allow():
    """Speeds from 0 to the largest and one back; the fastest keep a quarter of the turns."""
    config = ConstantArcsConfig(speeds=5, yaw_rates=5, max_speed=2.0, reverse=0.3)
    commands = ConstantArcsNavigator(VEHICLE, config)._commands
    assert sorted(set(commands[:, 0])) == [-0.3, 0.0, 0.5, 1.0, 1.5, 2.0]
    most = {v: float(np.abs(commands[commands[:, 0] == v, 1]).max()) for v in commands[:, 0]}
    assert most[0.0] == config.max_yaw_rate
    assert most[2.0] == pytest.approx(0.25 * config.max_yaw_rate)
    assert most[1.5] == pytest.approx((VEHICLE.max_wheel_speed - 1.5) / VEHICLE.half_track)
    assert -0.3 not in ConstantArcsNavigator(VEHICLE, ConstantArcsConfig(reverse=0.0))._commands


def test_a_step_is_limited_lags_and_turns_half_before_it_moves():
    """Speed asked for by the acceleration, speed by the lag, motion at the middle heading."""
    body = np.array([1.0, 2.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0])
    _step(body, np.array([2.0, -9.0]), rollout(acceleration=0.4, yaw_acceleration=0.2, follow=0.5))
    assert body[5:].tolist() == pytest.approx([0.4, -0.2])
    assert body[3:5].tolist() == pytest.approx([0.2, -0.1])
    yaw = np.pi / 2 - 0.1 * 0.05
    middle = np.pi / 2 - 0.1 * 0.05 / 2
    place = [1.0 + 0.01 * np.cos(middle), 2.0 + 0.01 * np.sin(middle)]
    assert body[:3].tolist() == pytest.approx([*place, yaw])


def test_an_arc_costs_the_time_that_is_left_at_its_end():
    """A second at 1 m/s on a field of 1 s a metre leaves a second less than to stand."""
    still, ahead, back = costs([(0, 0), (1, 0), (-1, 0)])
    assert still == pytest.approx(4.0)
    assert ahead == pytest.approx(3.0)
    assert back == pytest.approx(5.0)


def test_commands_that_wait_act_first():
    """Ten periods of 1 m/s before the first command move where its arc begins by half a metre."""
    (cost,) = costs([(0, 0)], waiting=[(1, 0)] * 10)
    assert cost == pytest.approx(3.5)


def test_contact_costs_more_than_any_time_and_the_earlier_the_more():
    """A post 1 m ahead: the faster arc meets it sooner; one beside it is not met."""
    slow, fast, still = costs([(1, 0), (2, 0), (0, 0)], points=[(1.0, 0.0)], margin=0.03)
    assert fast > slow > 1e4 > still
    (beside,) = costs([(1, 0)], points=[(1.0, 0.35)], margin=0.03)
    assert beside == pytest.approx(3.0)


def test_the_margin_grows_with_speed():
    """A post 0.10 m beside the way: passed slowly, refused at speed."""
    side = max(y for _, y in VEHICLE.footprint)
    points, limits = [(1.0, side + 0.1)], {"margin": 0.04, "margin_time": 0.05}
    slow, fast = costs([(0.9, 0), (2, 0)], points, **limits)
    assert slow < 1e4 < fast


def test_closeness_costs_up_to_its_distance():
    """Beside a wall at half of the soft distance each second costs half of the price more."""
    side = max(y for _, y in VEHICLE.footprint)
    wall = [(x, side + 0.15) for x in np.arange(-1.0, 3.0, 0.02)]
    (plain,) = costs([(1, 0)], wall)
    (dear,) = costs([(1, 0)], wall, closeness=2.0, soft=0.3)
    assert dear - plain == pytest.approx(2.0 * 0.5, abs=0.1)


def test_where_it_is_nearer_already_it_may_leave():
    """With a post within the margin behind it, it drives on and not back."""
    rear = min(x for x, _ in VEHICLE.footprint)
    ahead, back = costs([(1, 0), (-1, 0)], [(rear - 0.05, 0.0)], margin=0.2)
    assert ahead < 1e4 < back


def test_an_arc_that_reaches_the_goal_ends_there():
    """The sooner the better: a goal 0.5 m ahead is worth the time that is left of the rollout."""
    slow, fast, still = costs([(0.5, 0), (1, 0), (0, 0)], goal=(0.5, 0.0))
    assert fast - slow == pytest.approx(-0.2, abs=0.06)
    assert slow < still


def test_the_goal_counts_before_a_later_contact_but_not_before_one_in_the_same_step():
    """A post behind the goal is not met: the arc ends before it. One at the goal is."""
    goal, limits = (0.525, 0.0), {"margin": 0.03}
    # The robot arrives at x = 0.25 m with its front at 0.504 m; a disc of it has y = 0.11 m.
    (free,) = costs([(1, 0)], goal=goal)
    (behind,) = costs([(1, 0)], [(0.7, 0.11)], goal=goal, **limits)
    assert behind == free
    (without,) = costs([(1, 0)], [(0.7, 0.11)], **limits)
    (at_the_goal,) = costs([(1, 0)], [(0.51, 0.11)], goal=goal, **limits)
    assert min(at_the_goal, without) > 1e4


def test_ground_in_doubt_and_unknown_ground_take_no_longer():
    """Cells between free and obstacle, and cells not seen, leave the time to go as it is."""

    def times(config):
        robot = ConstantArcsNavigator(VEHICLE, config)
        layer, position, goal = robot._hits, np.zeros(2), np.array([2.5, 0.0])
        found = []
        for share in (0.0, 0.6, -0.6):
            doubt = np.full_like(layer.log_odds, share * layer.config.lethal_log_odds)
            robot._plan.reset()
            robot._plan.plan(doubt, layer.centre, EVERYWHERE, position, goal, layer.places)
            found.append(robot._plan.cost_to_go.copy())
        return found

    config = ConstantArcsConfig()
    unknown, doubtful, free = times(config)
    np.testing.assert_array_equal(unknown, free)
    np.testing.assert_array_equal(doubtful, free)
    for name, changed in (("unknown_cost", 0), ("uncertain_cost", 1)):
        costs_of = config.costs.model_copy(update={name: 3.0})
        found = times(config.model_copy(update={"costs": costs_of}))
        known = np.isfinite(free) & np.isfinite(found[changed])
        assert found[changed][known].max() > 1.5 * free[known].max()


def test_the_heading_at_the_end_costs_its_angle_to_the_way():
    """Half a turn away from where the time falls costs pi times the price, either side alike."""
    found = []
    for yaw in (0.0, np.pi / 2, -np.pi / 2, np.pi):
        body = np.array([0.0, 0.0, yaw, 0, 0, 0, 0])
        found.append(_time_left(body, time_along_x(), rollout(heading=0.3)))
    assert np.array(found) - 4.0 == pytest.approx([0.0, 0.15 * np.pi, 0.15 * np.pi, 0.3 * np.pi])


def test_a_place_that_was_not_searched_costs_as_much_as_it_says():
    """Without a time there is no way that a heading could be compared with."""
    body, field = np.array([0.0, 0.0, np.pi, 0, 0, 0, 0]), time_along_x()
    field.times[:50] = np.inf
    assert _time_left(body, field, rollout(heading=0.3)) == 1e3
    # At its edge there is a time, and no way of a known direction.
    field.times[:] = time_along_x().times
    field.times[:39] = np.inf
    assert _time_left(body, field, rollout(heading=0.3)) == pytest.approx(4.0)


@pytest.mark.parametrize(("aside", "count"), [(0.01, 1), (-0.04, 0)])
def test_hits_under_the_robot_are_forgotten(aside, count):
    """What is 2 cm nearer than its half width, or more, cannot stand there."""
    side = max(y for _, y in VEHICLE.footprint)
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=90, max_range=10)
    robot = ConstantArcsNavigator(VEHICLE)
    robot.reset(lidar, (4.0, 0.0))
    ranges = np.array([np.inf, np.inf, side + aside], dtype=np.float32)
    for k in range(3):
        robot.act(PlanarReadings(0.05 * k, PlanarPose(0, 0, 0), Twist(0, 0), ranges))
    assert len(robot._hits.obstacles) == count
