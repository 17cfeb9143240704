"""Reference plant: it turns, climbs, slides, tips and works as a 41 kg skid-steer robot does."""

import numpy as np
import pytest

from tests.support.plants import module_needs_bullet

module_needs_bullet()

from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import WheelSpeeds
from terrain.classes import SemanticClass
from terrain.objects import box
from tests.support.driven_plants import ROBOT, slope, twist
from worlds.quiet_pybullet import pybullet
from worlds.world import Start

ORIGIN = Start(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def flat(make_ground):
    vehicle = BulletVehicle(make_ground(), ROBOT)
    yield vehicle
    vehicle.close()


@pytest.mark.parametrize("rate", [0.15, 0.2, 0.3, 0.4, 0.5, -0.5, -0.3, -0.15])
def test_it_turns_at_the_commanded_rate_within_ten_percent(flat, rate):
    """Yaw rate and speed are the commanded ones, within 10 and 5 %."""
    rates = []
    for yaw in (0.0, 0.4, 0.8, 1.2):  # pybullet's friction depends a little on the direction.
        flat.place(Start(0.0, 0.0, yaw))
        twist(flat, 0.3, rate, 1.0)
        before = flat.state.pose.yaw
        rows = twist(flat, 0.3, rate, 2.0)
        rates.append(wrap(flat.state.pose.yaw - before) / 2.0)
        speed = np.hypot(*np.diff(rows[:, :2], axis=0).T).sum() / 1.99
        assert speed == pytest.approx(0.3, rel=0.05)
    assert np.mean(rates) == pytest.approx(rate, rel=0.1)


def test_it_does_not_bounce_or_creep(flat):
    """A body at rest stays where it is, with base_footprint on the ground."""
    flat.place(ORIGIN)
    rows = flat.drive(WheelSpeeds(0.0, 0.0), 300)
    assert np.ptp(rows[:, 2]) < 0.002
    assert np.abs(rows[-1, :2]).max() < 0.005
    assert rows[-1, 2] == pytest.approx(0.0, abs=0.01)  # base_footprint lies on the ground.


@pytest.mark.parametrize("angle", [5, 10, 20])
def test_its_motors_lift_its_weight(make_ground, angle):
    """Work on a slope is the potential energy plus little."""
    vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT)
    vehicle.place(ORIGIN)
    assert vehicle.state.work == 0.0
    twist(vehicle, 0.3, 0.0, 1.0)
    before = vehicle.state
    twist(vehicle, 0.3, 0.0, 4.0)
    after = vehicle.state
    vehicle.close()
    lifted = ROBOT.mass * 9.81 * (after.pose.position[2] - before.pose.position[2])
    # Besides, level ground takes some 40 J: wheels that are dragged by the corners of squares.
    assert lifted < after.work - before.work < lifted + 45.0


def test_turning_takes_work_and_rolling_down_gives_none_back(make_ground, flat):
    """Turning costs work, and rolling downhill recuperates none."""
    spent = []
    for rate in (0.0, 0.5):
        flat.place(ORIGIN)
        twist(flat, 0.3, rate, 4.0)
        spent.append(flat.state.work)
    assert spent[1] > 2 * spent[0] > 0
    vehicle = BulletVehicle(make_ground(slope(-10)), ROBOT)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 4.0)
    assert 0 <= vehicle.state.work < spent[0]
    vehicle.close()


def test_it_slides_on_a_steep_cross_slope_and_holds_on_a_gentle_one(make_ground):
    """Tyres hold on a gentle cross slope and slide on a steep one."""
    slid = []
    for angle in (15, 32):
        vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT)
        vehicle.place(Start(2.0, 0.0, np.pi / 2))
        rows = twist(vehicle, 0.3, 0.0, 2.0)
        slid.append(2.0 - rows[-1, 0])
        vehicle.close()
    assert slid[0] < 0.1 < 0.4 < slid[1]


@pytest.mark.parametrize("angle", [24, 30])
def test_a_standing_body_slides_as_coulomb_says(make_ground, angle):
    """The acceleration down a cross slope is g (sin a - mu cos a), and none below its angle."""
    vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT)
    vehicle.place(Start(2.0, 0.0, np.pi / 2))
    rows = vehicle.drive(WheelSpeeds(0.0, 0.0), 60)
    vehicle.close()
    speed = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1) / 0.01
    config, tilt = BulletConfig(), np.deg2rad(angle)
    friction = config.friction * config.lateral_friction_ratio
    expected = max(9.81 * (np.sin(tilt) - friction * np.cos(tilt)), 0.0)
    assert (speed[50] - speed[10]) / 0.4 == pytest.approx(expected, rel=0.25, abs=0.05)


@pytest.mark.parametrize(("height", "climbs"), [(0.05, True), (0.12, False)])
def test_a_step_higher_than_the_axles_stops_it(make_ground, height, climbs):
    """Wheels of 10 cm climb a low step of the ground, and none that is higher than they reach."""
    vehicle = BulletVehicle(make_ground(lambda x, y: np.where(x > 1.0, height, 0.0)), ROBOT)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 6.0)
    assert bool(vehicle.state.pose.position[0] > 1.5) is climbs
    vehicle.close()


def test_spheres_meet_the_ground_and_wheels_meet_solids(make_ground):
    """Each part of a wheel has contacts with its own kind of body alone."""
    stone = box(SemanticClass.ROCK, (0.5, 0.23, 0.0), (0.3, 0.3, 0.06))
    vehicle = BulletVehicle(make_ground(objects=[stone]), ROBOT)
    vehicle.place(ORIGIN)
    met = {"ground": set(), "solid": set()}
    for _ in range(40):
        twist(vehicle, 0.3, 0.0, 0.05)
        for name, body in (
            ("ground", vehicle._window.body),
            ("solid", vehicle._solids[0]),
        ):
            points = pybullet.getContactPoints(vehicle._body, body, physicsClientId=vehicle._client)
            met[name] |= {point[3] for point in points}
    assert met["ground"] == set(vehicle._spheres)
    assert met["solid"] & set(vehicle._wheels)
    assert not met["solid"] & set(vehicle._spheres)
    vehicle.close()


@pytest.mark.parametrize(("angle", "tips"), [(30, False), (50, True)])
def test_it_tips_over_when_its_weight_leaves_its_wheels(make_ground, angle, tips):
    """The body tips beyond the angle whose tangent is half the track over the mass height."""
    # Without sliding, the limit is the angle whose tangent is half the track over the height of
    # the centre of mass: 42.6 degrees.
    config = BulletConfig(friction=3.0, lateral_friction_ratio=1.0)
    vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT, config)
    vehicle.place(Start(0.0, 0.0, np.pi / 2))
    vehicle.drive(WheelSpeeds(0.0, 0.0), 300)
    assert vehicle.state.tipped is tips
    vehicle.close()


def test_a_wall_that_is_near_is_not_hit_yet(make_ground):
    """The physics reports pairs up to 15 mm apart; a collision begins at 5 mm, at a corner here."""
    yaw, thickness = 0.5, 0.2
    wall = box(SemanticClass.WALL, (1.2, 0.0, 0.5), (thickness, 3.0, 1.0), yaw)
    vehicle = BulletVehicle(make_ground(objects=[wall]), ROBOT)
    vehicle.place(Start(0.5, 0.0, 0.0))
    while not vehicle.state.collided:
        x, y, _ = twist(vehicle, 0.1, 0.0, 0.01)[-1, :3]
        corner = np.array([x + ROBOT.length / 2 - 1.2, y + ROBOT.width / 2])
        gap = -corner @ [np.cos(yaw), np.sin(yaw)] - thickness / 2
        assert gap > 0.0
    vehicle.close()
    assert gap < 0.007


@pytest.mark.parametrize(("height", "hit"), [(0.03, False), (0.15, True)])
def test_wheels_climb_small_stones_and_hit_large_ones(make_ground, height, hit):
    """Wheels climb small stones and collide with large ones."""
    stone = box(SemanticClass.ROCK, (1.5, 0.23, 0.0), (0.3, 0.3, 2 * height))
    vehicle = BulletVehicle(make_ground(objects=[stone]), ROBOT)
    vehicle.place(ORIGIN)
    touched = False
    for _ in range(70):
        twist(vehicle, 0.3, 0.0, 0.1)
        touched |= vehicle.state.collided
    vehicle.close()
    assert touched is hit
