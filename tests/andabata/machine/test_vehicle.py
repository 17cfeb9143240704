"""The body turns, climbs, slides, stops and tips as a 41 kg skid-steer does, in both plants."""

import numpy as np
import pytest

from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle
from andabata.machine.kinematic_vehicle import KinematicConfig, KinematicVehicle
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import make_vehicle
from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.objects import box, frustum
from worlds.world import Start

ROBOT = RobotModel()
KINEMATICS = SkidSteer(ROBOT)
ORIGIN = Start(0.0, 0.0, 0.0)


def slope(angle_deg):
    return lambda x, y: np.tan(np.deg2rad(angle_deg)) * x


def twist(vehicle, speed, rate, seconds):
    return vehicle.drive(KINEMATICS.wheel_speeds(speed, rate), round(seconds * 100))


@pytest.fixture(params=["bullet", "kinematic"])
def plant(request):
    return request.param


@pytest.fixture(scope="module")
def flat(make_ground):
    vehicle = BulletVehicle(make_ground(), ROBOT)
    yield vehicle
    vehicle.close()


@pytest.mark.parametrize("rate", [0.15, 0.2, 0.3, 0.4, 0.5, -0.5, -0.3, -0.15])
def test_it_turns_at_the_commanded_rate_within_ten_percent(flat, rate):
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
    flat.place(ORIGIN)
    rows = flat.drive(WheelSpeeds(0.0, 0.0), 300)
    assert np.ptp(rows[:, 2]) < 0.002
    assert np.abs(rows[-1, :2]).max() < 0.005
    assert rows[-1, 2] == pytest.approx(0.0, abs=0.01)  # base_footprint lies on the ground.


@pytest.mark.parametrize("angle", [10, 20, 25])
def test_it_climbs(make_ground, plant, angle):
    vehicle = make_vehicle(plant, make_ground(slope(angle)), ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 4.0)
    vehicle.close()
    climbed = (rows[-1, 0] - rows[99, 0]) / 3.0
    assert climbed == pytest.approx(0.3 * np.cos(np.deg2rad(angle)), rel=0.12)
    assert not vehicle_tipped(rows)


@pytest.mark.parametrize("angle", [5, 10, 20])
def test_its_motors_lift_its_weight(make_ground, angle):
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


def vehicle_tipped(rows):
    x, y = rows[-1, 3:5]
    return 1 - 2 * (x * x + y * y) < np.cos(np.deg2rad(60))


def test_it_slides_on_a_steep_cross_slope_and_holds_on_a_gentle_one(make_ground):
    slid = []
    for angle in (15, 32):
        vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT)
        vehicle.place(Start(2.0, 0.0, np.pi / 2))
        rows = twist(vehicle, 0.3, 0.0, 2.0)
        slid.append(2.0 - rows[-1, 0])
        vehicle.close()
    assert slid[0] < 0.1 < 0.4 < slid[1]


@pytest.mark.parametrize(("angle", "tips"), [(30, False), (50, True)])
def test_it_tips_over_when_its_weight_leaves_its_wheels(make_ground, angle, tips):
    # Without sliding, the limit is the angle whose tangent is half the track over the height of
    # the centre of mass: 42.6 degrees.
    config = BulletConfig(friction=3.0, sideways=1.0)
    vehicle = BulletVehicle(make_ground(slope(angle)), ROBOT, config)
    vehicle.place(Start(0.0, 0.0, np.pi / 2))
    vehicle.drive(WheelSpeeds(0.0, 0.0), 300)
    assert vehicle.state.tipped is tips
    vehicle.close()


def test_a_trunk_stops_it_and_is_a_collision(make_ground, plant):
    trunk = frustum(SemanticClass.TRUNK, (2.0, 0.1, 0.0), (0.15, 0.15), 3.0)
    vehicle = make_vehicle(plant, make_ground(objects=[trunk]), ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    for _ in range(80):
        row = twist(vehicle, 0.3, 0.0, 0.1)[-1]
        if vehicle.state.collided:
            break
    vehicle.close()
    assert row[0] + ROBOT.length / 2 == pytest.approx(1.85, abs=0.12)


def test_grass_and_bushes_let_it_pass(make_ground, plant):
    grass = box(SemanticClass.HIGH_GRASS, (2.0, 0.0, 0.3), (1.0, 2.0, 0.6))
    bush = box(SemanticClass.BUSH, (4.0, 0.0, 0.3), (0.5, 2.0, 0.6))
    world = make_ground(objects=[grass, bush])
    vehicle = make_vehicle(plant, world, ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 20.0)
    assert rows[-1, 0] > 5.0
    assert not vehicle.state.collided
    assert world.truth.forbidden_at(2.0, 0.0)  # Trespass, not contact.
    vehicle.close()


@pytest.mark.parametrize(("height", "hit"), [(0.03, False), (0.15, True)])
def test_wheels_climb_small_stones_and_hit_large_ones(make_ground, height, hit):
    stone = box(SemanticClass.ROCK, (1.5, 0.23, 0.0), (0.3, 0.3, 2 * height))
    vehicle = BulletVehicle(make_ground(objects=[stone]), ROBOT)
    vehicle.place(ORIGIN)
    touched = False
    for _ in range(70):
        twist(vehicle, 0.3, 0.0, 0.1)
        touched |= vehicle.state.collided
    vehicle.close()
    assert touched is hit


@pytest.mark.parametrize(
    ("height", "aside", "hit"),
    [(0.075, 0.0, False), (0.075, 0.23, True), (0.13, 0.0, True), (0.13, 0.23, True)],
)
def test_a_low_rock_passes_between_the_wheels(make_ground, plant, height, aside, hit):
    rock = box(SemanticClass.ROCK, (1.5, aside, 0.0), (0.12, 0.12, 2 * height))
    world = make_ground(objects=[rock])
    assert world.truth.forbidden_at(1.5, aside)
    vehicle = make_vehicle(plant, world, ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    touched = False
    for _ in range(80):
        twist(vehicle, 0.3, 0.0, 0.1)
        touched |= vehicle.state.collided
    vehicle.close()
    assert touched is hit


def test_the_fast_plant_is_calibrated_against_the_reference(make_ground):
    """Stated difference on rough ground: 2 degrees of tilt (rms), 5 % of speed and of turn."""
    rng = np.random.default_rng(4)
    bumps = 0.25 * smooth_noise((301, 301), 0.1, 4.0, rng)
    world = make_ground(lambda x, y: bumps + 0.08 * x, size=30.0)
    reference = BulletVehicle(world, ROBOT)
    fast = KinematicVehicle(world, ROBOT, rng, KinematicConfig(slip_sigma=0.0))
    tilts, driven, turned = [], np.zeros(2), np.zeros(2)
    for start_yaw in (0.3, 2.0, -1.2):
        for vehicle in (reference, fast):
            vehicle.place(Start(0.0, -2.0, start_yaw))
        for rate in (0.0, 0.4, 0.0, -0.4, 0.3, -0.2):
            rows = [twist(vehicle, 0.3, rate, 5.0) for vehicle in (reference, fast)]
            driven += [np.hypot(*np.diff(r[:, :2], axis=0).T).sum() for r in rows]
            turned += [np.sign(rate) * wrap(_yaw(r[-1]) - _yaw(r[0])) for r in rows]
            # The reference's places, as the fast plant would stand there.
            for row in rows[0][::10]:
                fast.place(Start(row[0], row[1], _yaw(row)))
                tilts.append(np.subtract(_tilt(row), _tilt(fast.drive(WheelSpeeds(0, 0), 1)[-1])))
            fast.place(Start(rows[0][-1, 0], rows[0][-1, 1], _yaw(rows[0][-1])))
    reference.close()
    assert (np.rad2deg(np.sqrt(np.mean(np.square(tilts), axis=0))) < 2.0).all()
    assert driven[0] == pytest.approx(driven[1], rel=0.05)
    assert turned[0] == pytest.approx(turned[1], rel=0.05)


def _yaw(pose):
    x, y, z, w = pose[3:7]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def _tilt(pose):
    x, y, z, w = pose[3:7]
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))


@pytest.mark.parametrize("wheels", [WheelSpeeds(np.nan, 0.0), WheelSpeeds(0.0, np.inf)])
def test_speeds_that_are_no_numbers_are_refused(make_ground, plant, wheels):
    vehicle = make_vehicle(plant, make_ground(size=4.0), ROBOT, np.random.default_rng(0))
    with pytest.raises(ValueError, match="expected finite speeds"):
        vehicle.drive(wheels, 1)
    vehicle.close()


def test_kinematics_there_and_back():
    for speed, rate in ((0.3, 0.0), (0.3, 0.5), (0.0, -0.4), (-0.2, 0.1)):
        assert KINEMATICS.twist(KINEMATICS.wheel_speeds(speed, rate)) == pytest.approx(
            (speed, rate)
        )


def test_wheel_limits_keep_the_curvature():
    speed, rate = KINEMATICS.twist(KINEMATICS.wheel_speeds(10.0, 5.0))
    assert rate / speed == pytest.approx(0.5)
