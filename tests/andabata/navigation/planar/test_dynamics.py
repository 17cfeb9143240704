"""Model of how commands are followed: closed forms, delays, and what is not measured."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicle, PlanarVehicleConfig
from andabata.navigation.planar.dynamics import (
    PlanarDynamics,
    WheelLimits,
    advance_axis,
    axis_step,
    delayed,
    limited,
    observed,
)

PERIOD = 0.05
LIMITS = WheelLimits(-0.5, 2.0, 2.0, 0.28, 4.0)
NOTHING = Obstacles(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))


def test_an_axis_follows_a_ramp_as_the_differential_equation_says():
    """Fine steps of Euler's method end where the closed form does."""
    controller, body, dt = 0.3, 0.1, PERIOD / 10_000
    step = axis_step(3.0, 0.1, PERIOD)
    after = advance_axis(controller, body, 2.0, step)
    for _ in range(10_000):
        controller += 3.0 * dt
        body += (controller - body) / 0.1 * dt
    assert after == pytest.approx((controller, body), abs=1e-4)


def test_an_axis_comes_to_rest_at_its_command():
    """The controller's speed does not overshoot, the body's approaches it."""
    controller, body = 0.0, 0.0
    for _ in range(200):
        controller, body = advance_axis(controller, body, 0.7, axis_step(3.0, 0.1, PERIOD))
    assert controller == 0.7
    assert body == pytest.approx(0.7, abs=1e-6)


@pytest.mark.parametrize(("delay", "expected"), [(0.0, 3.0), (1.0, 2.0), (1.5, 1.5), (9.0, 0.0)])
def test_a_delay_takes_older_commands(delay, expected):
    """A part of a period mixes two; before the first command the first counts."""
    commands = np.array([[0.0, 9.0], [1.0, 9.0], [2.0, 9.0], [3.0, 9.0]])
    assert delayed(commands, 3, 0, delay) == pytest.approx(expected)


def test_the_wheels_limit_keeps_the_curvature():
    """Both parts of a command shrink alike, and a limited command stays."""
    v, w = limited(2.0, 3.0, LIMITS)
    assert abs(v) + 0.28 * abs(w) == pytest.approx(2.0)
    assert w / v == pytest.approx(1.5)
    assert limited(v, w, LIMITS) == pytest.approx((v, w))
    assert limited(-3.0, 0.0, LIMITS) == (-0.5, 0.0)
    assert limited(0.0, -9.0, LIMITS) == (0.0, -4.0)


def test_the_model_follows_the_simulated_robot():
    """With a delay of whole periods the speeds differ by less than a step of its controller."""
    config = PlanarVehicleConfig(gain_spread=0.0, slip=0.0, delay=0.1, lag=0.2)
    robot = PlanarVehicle(config, PlanarPose(0, 0, 0), NOTHING, np.random.default_rng(0))
    commands = np.array([[1.5, 1.0]] * 20 + [[0.2, -1.0]] * 20)
    step = axis_step(config.acceleration, config.lag, PERIOD)
    controller = body = 0.0
    before = np.vstack([np.zeros((3, 2)), commands])
    for k, command in enumerate(commands):
        robot.step(Twist(*command))
        controller, body = advance_axis(controller, body, delayed(before, k + 3, 0, 2.0), step)
        assert robot.velocity.linear == pytest.approx(body, abs=0.04)


def test_the_speed_that_the_controller_asks_for_is_observed():
    """It is ahead of the body's on a ramp, and equal at rest."""
    dynamics = PlanarDynamics(0.05, 0.2, 2.0, 8.0)
    config = PlanarVehicleConfig(gain_spread=0.0, delay=0.05, lag=0.2, acceleration=2.0)
    robot = PlanarVehicle(config, PlanarPose(0, 0, 0), NOTHING, np.random.default_rng(0))
    past, speeds = np.tile([1.8, 0.0], (12, 1)), [(0.0, 0.0)]
    past[0] = 0.0  # What the robot is told last before the record begins.
    for command in past:
        robot.step(Twist(*command))
        speeds.append((robot.velocity.linear, robot.velocity.angular))
    state = observed(1.0, 2.0, 0.5, past, np.array(speeds), dynamics, PERIOD)
    assert state[:3] == (1.0, 2.0, 0.5)
    assert state.v == robot.velocity.linear
    assert state.controller_v == pytest.approx(robot.state[5], abs=0.05)
    assert state.controller_v > state.v + 0.2
    assert state.controller_w == pytest.approx(0.0)
