"""Plant of ray-cast wheels: it rests, drives, turns, holds, slides, tips and is stopped."""

import numpy as np
import pytest
from scipy.optimize import brentq

from andabata.machine.kinematics import SkidSteer
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.wheels.body import WheelsConfig
from andabata.machine.wheels.vehicle import WheelsVehicle
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.world import Start

ROBOT = RobotModel()
KINEMATICS = SkidSteer(ROBOT)
ORIGIN, ACROSS = Start(0.0, 0.0, 0.0), Start(0.0, 0.0, np.pi / 2)
STILL = WheelSpeeds(0.0, 0.0)


def slope(angle_deg):
    return lambda x, y: np.tan(np.deg2rad(angle_deg)) * x


def twist(vehicle, speed, rate, seconds):
    return vehicle.drive(KINEMATICS.wheel_speeds(speed, rate), round(seconds * 100))


@pytest.fixture(scope="module")
def flat(make_ground):
    return WheelsVehicle(make_ground(), ROBOT)


def test_it_drives_straight_at_the_commanded_speed(flat):
    """On level ground speed and heading are exact, and rolling takes next to no work."""
    flat.place(Start(0.0, 0.0, 0.7))
    twist(flat, 0.3, 0.0, 3.0)
    before = flat.state
    rows = twist(flat, 0.3, 0.0, 2.0)
    assert np.hypot(*(rows[-1, :2] - before.pose.position[:2])) == pytest.approx(0.6, rel=1e-3)
    assert flat.state.pose.yaw == pytest.approx(0.7, abs=1e-6)
    assert flat.state.linear[0] == pytest.approx(0.3, rel=1e-3)
    assert flat.state.work - before.work < 1.0


@pytest.mark.parametrize("rate", [0.15, 0.3, -0.5])
def test_it_turns_as_the_effective_track_says(flat, rate):
    """The ellipse of friction turns it at the commanded rate within 5 %."""
    flat.place(ORIGIN)
    twist(flat, 0.3, rate, 1.0)
    before = flat.state.pose.yaw
    twist(flat, 0.3, rate, 2.0)
    assert wrap(flat.state.pose.yaw - before) / 2.0 == pytest.approx(rate, rel=0.05)
    assert flat.state.angular[2] == pytest.approx(rate, rel=0.05)


def turning_moment(yaw_rate, spin, ratio):
    """Return the moment of the forces of largest dissipation of eight rims, per friction [m].

    Args:
        yaw_rate: Yaw rate of the body on the spot [rad/s].
        spin: Speed of the wheels' surface, backwards on the left [m/s].
        ratio: Lateral over longitudinal friction.
    """
    moment = 0.0
    for x in (-ROBOT.wheelbase / 2, ROBOT.wheelbase / 2):
        for y in ROBOT.track / 2 + np.array([-0.5, 0.5]) * ROBOT.wheel_width:
            along, across = spin - yaw_rate * y, -yaw_rate * x
            size = np.hypot(along, ratio * across)
            moment += (y * along + x * ratio**2 * across) / size
    return moment


@pytest.mark.parametrize("ratio", [0.4, 0.7, 1.0])
def test_the_yaw_rate_follows_from_the_axes_of_the_ellipse(make_ground, ratio):
    """On the spot the body turns as fast as lets the moments of all tyres cancel."""
    vehicle = WheelsVehicle(make_ground(), ROBOT, WheelsConfig(lateral_friction_ratio=ratio))
    spin = 0.5 * ROBOT.track / 2  # Ideally 0.5 rad/s.
    vehicle.drive(WheelSpeeds(-spin / ROBOT.wheel_radius, spin / ROBOT.wheel_radius), 300)
    expected = brentq(turning_moment, 0.1, 0.6, args=(spin, ratio))
    assert vehicle.state.angular[2] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("angle", "holds"), [(25.5, True), (28.0, False)])
def test_brakes_hold_it_up_to_the_friction_angle(make_ground, angle, holds):
    """With a friction of 0.5 it stands on slopes up to 26.6 degrees, and slides on steeper ones."""
    config = WheelsConfig(friction=0.5)
    vehicle = WheelsVehicle(make_ground(slope(angle)), ROBOT, config)
    vehicle.place(ORIGIN)
    before = vehicle.state.pose.position[0]
    slid = before - vehicle.drive(STILL, 200)[-1, 0]
    assert abs(slid) < 5e-4 if holds else slid > 0.02


@pytest.mark.parametrize(("angle", "holds"), [(23.0, True), (25.5, False)])
def test_it_slides_across_at_the_angle_of_the_lateral_friction(make_ground, angle, holds):
    """0.9 times 0.5 is the tangent of 24.2 degrees."""
    vehicle = WheelsVehicle(make_ground(slope(angle)), ROBOT)
    vehicle.place(ACROSS)
    before = vehicle.state.pose.position[0]
    slid = before - vehicle.drive(STILL, 200)[-1, 0]
    assert abs(slid) < 5e-4 if holds else slid > 0.02


@pytest.mark.parametrize("angle", [10, 20])
def test_its_motors_lift_its_weight(make_ground, angle):
    """Work uphill is the potential energy and a little; downhill there is none to give back."""
    works = []
    for side in (1, -1):
        vehicle = WheelsVehicle(make_ground(slope(side * angle)), ROBOT)
        vehicle.place(ORIGIN)
        assert vehicle.state.work == 0.0
        twist(vehicle, 0.3, 0.0, 1.0)
        before = vehicle.state
        twist(vehicle, 0.3, 0.0, 3.0)
        works.append(vehicle.state.work - before.work)
        if side > 0:
            rise = vehicle.state.pose.position[2] - before.pose.position[2]
    lifted = ROBOT.mass * 9.81 * rise
    assert lifted < works[0] < 1.1 * lifted + 1.0
    assert 0.0 <= works[1] < 1.0


@pytest.mark.parametrize(("angle", "tips"), [(44, False), (51, True)])
def test_it_tips_over_at_the_static_limit(make_ground, angle, tips):
    """Where friction holds it: beyond the angle of its centre of mass over its outer rims, 49.8."""
    config = WheelsConfig(friction=3.0, lateral_friction_ratio=1.0)
    vehicle = WheelsVehicle(make_ground(slope(angle)), ROBOT, config)
    vehicle.place(ACROSS)
    vehicle.drive(STILL, 200)
    assert vehicle.state.tipped is tips


def test_a_wall_holds_it_with_its_wheels_turning(make_ground):
    """It collides, stands with its front at the wall, and its wheels slip."""
    wall = box(SemanticClass.WALL, (1.5, 0.0, 0.5), (0.4, 4.0, 1.0))
    vehicle = WheelsVehicle(make_ground(objects=[wall]), ROBOT)
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 10.0)
    front = 1.3 - ROBOT.length / 2
    assert vehicle.state.collided
    assert vehicle.state.contact is Contact.OBSTACLE
    assert rows[-1, 0] == pytest.approx(front, abs=0.01)
    assert np.ptp(rows[-300:, 0]) < 0.005
    assert vehicle.state.wheels.left == pytest.approx(3.0)
    vehicle.place(ORIGIN)
    assert not vehicle.state.collided


def test_a_ridge_under_its_floor_wedges_it(make_ground):
    """A sharp ridge higher than its floor holds it; the wheels turn, and that is no collision."""
    height = 0.2

    def ridge(x, y):
        return np.where(np.abs(x - 1.0) < 0.05, height, 0.0)

    vehicle = WheelsVehicle(make_ground(ridge), ROBOT)
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 15.0)
    assert rows[-1, 0] < 1.3
    assert np.ptp(rows[-300:, 0]) < 0.3
    assert not vehicle.state.collided


def test_it_falls_off_the_border_of_its_world(make_ground):
    """There is no ground beyond the border."""
    vehicle = WheelsVehicle(make_ground(size=4.0), ROBOT)
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 10.0)
    assert vehicle.state.tipped
    assert rows[-1, 2] < -1.0
    assert np.isfinite(rows).all()


def test_the_state_is_that_of_base_footprint(flat):
    """Velocities agree with the differences of the rows."""
    flat.place(ORIGIN)
    rows = twist(flat, 0.3, 0.4, 1.0)
    moved = (rows[-1, :3] - rows[-3, :3]) / 0.02
    c, s = np.cos(flat.state.pose.yaw), np.sin(flat.state.pose.yaw)
    expected = [c * moved[0] + s * moved[1], c * moved[1] - s * moved[0], moved[2]]
    np.testing.assert_allclose(flat.state.linear, expected, atol=3e-3)
    np.testing.assert_allclose(flat.state.pose.position, rows[-1, :3], atol=1e-12)
