"""Second judge: it turns, climbs, slides, tips and works as the reference does."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import WheelSpeeds
from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.objects import box, frustum
from tests.support.driven_plants import KINEMATICS, ROBOT, slope, twist
from worlds.world import Start

pytest.importorskip("mujoco", reason="mujoco is not installed (extra `mujoco`)")

from andabata.machine.mujoco_model import MujocoConfig
from andabata.machine.mujoco_vehicle import MujocoVehicle

ORIGIN = Start(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def flat(make_ground):
    return MujocoVehicle(make_ground(), ROBOT)


@pytest.mark.parametrize("rate", [0.15, 0.3, 0.5, -0.5, -0.15])
@pytest.mark.parametrize("yaw", [0.0, 0.4, 2.0])
def test_it_turns_as_far_as_wheels_that_scrub(flat, rate, yaw):
    """It turns by 0.78 to 0.83 of what wheels that do not slide would, at its speed."""
    flat.place(Start(0.0, 0.0, yaw))
    twist(flat, 0.3, rate, 1.0)
    before = flat.state.pose.yaw
    rows = twist(flat, 0.3, rate, 2.0)
    turned = wrap(flat.state.pose.yaw - before) / 2.0
    assert 0.78 < turned / (rate * ROBOT.slip_factor) < 0.83
    speed = np.hypot(*np.diff(rows[:, :2], axis=0).T).sum() / 1.99
    assert speed == pytest.approx(0.3, rel=0.03)


def test_sliding_wheels_stay_on_the_ground(flat):
    """In a turn the body moves up and down by less than 1 mm."""
    flat.place(Start(0.0, 0.0, 0.3))
    twist(flat, 0.3, 0.5, 1.0)
    assert np.ptp(twist(flat, 0.3, 0.5, 2.0)[:, 2]) < 0.001


def test_it_does_not_bounce_or_creep(flat):
    """A body at rest stays where it is, with base_footprint on the ground."""
    flat.place(ORIGIN)
    rows = flat.drive(WheelSpeeds(0.0, 0.0), 300)
    assert np.ptp(rows[:, 2]) < 0.0005
    assert np.abs(rows[-1, :2]).max() < 0.001
    assert rows[-1, 2] == pytest.approx(0.0, abs=0.002)


def test_a_state_is_the_motion_of_the_rows(make_ground):
    """Velocity and turning in the state are those of the last two rows, on a slope and turning."""
    vehicle = MujocoVehicle(make_ground(slope(15)), ROBOT)
    vehicle.place(Start(0.0, 0.0, 0.7))
    rows, state = twist(vehicle, 0.3, 0.4, 1.0), vehicle.state
    np.testing.assert_array_equal(state.pose.position, rows[-1, :3])
    np.testing.assert_array_equal(state.pose.quaternion, rows[-1, 3:7])
    moved = (rows[-1, :3] - rows[-11, :3]) / 0.1
    assert np.linalg.norm(state.linear) == pytest.approx(np.linalg.norm(moved), rel=0.05)
    assert state.linear[0] == pytest.approx(0.3, rel=0.05)
    assert abs(state.linear[2]) < 0.02
    assert state.angular[2] == pytest.approx(0.4, rel=0.3)
    expected = KINEMATICS.wheel_speeds(0.3, 0.4)
    assert state.wheels.left == pytest.approx(expected.left, rel=0.05)
    assert state.wheels.right == pytest.approx(expected.right, rel=0.05)
    assert state.stamp == 1.0


@pytest.mark.parametrize("angle", [20, 30])
def test_it_climbs_at_its_speed_and_its_motors_lift_its_weight(make_ground, angle):
    """Work on a slope is the potential energy plus little."""
    vehicle = MujocoVehicle(make_ground(slope(angle)), ROBOT)
    vehicle.place(ORIGIN)
    assert vehicle.state.work == 0.0
    twist(vehicle, 0.3, 0.0, 1.0)
    before = vehicle.state
    twist(vehicle, 0.3, 0.0, 4.0)
    after = vehicle.state
    moved = after.pose.position - before.pose.position
    assert np.linalg.norm(moved) / 4.0 == pytest.approx(0.3, rel=0.03)
    lifted = ROBOT.mass * 9.81 * moved[2]
    assert lifted < after.work - before.work < 1.15 * lifted


def test_rolling_down_gives_no_work_back(make_ground):
    """Motors that brake downhill do not recuperate."""
    vehicle = MujocoVehicle(make_ground(slope(-10)), ROBOT)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 2.0)
    assert 0.0 <= vehicle.state.work < 5.0


def test_the_velocity_is_that_of_base_footprint(make_ground):
    """On a step, where the body pitches, it is the motion of the poses, tick by tick."""
    vehicle = MujocoVehicle(make_ground(lambda x, y: np.where(x > 0.3, 0.08, 0.0)), ROBOT)
    vehicle.place(ORIGIN)
    place, errors, rates = vehicle.state.pose.position, [], []
    for _ in range(150):
        twist(vehicle, 0.3, 0.0, 0.01)
        state = vehicle.state
        turn = Rotation.from_quat(state.pose.quaternion)
        moved = turn.inv().apply(state.pose.position - place) / 0.01
        place = state.pose.position
        errors.append(moved[0] - state.linear[0])
        rates.append(state.angular[1])
    assert np.sqrt(np.mean(np.square(rates))) > 0.2
    assert np.sqrt(np.mean(np.square(errors))) < 0.006


def test_motors_that_are_too_weak_stall(make_ground):
    """Four motors of 2 N m push with 80 N, less than the weight on 20 degrees: it rolls back."""
    weak = ROBOT.model_copy(update={"wheel_torque": 2.0})
    vehicle = MujocoVehicle(make_ground(slope(20)), weak)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 2.0)
    assert vehicle.state.pose.position[0] < -0.2


@pytest.mark.parametrize("angle", [24, 30])
def test_a_standing_body_slides_as_coulomb_says(make_ground, angle):
    """The acceleration down a cross slope is g (sin a - mu cos a), and none below its angle."""
    vehicle = MujocoVehicle(make_ground(slope(angle)), ROBOT)
    vehicle.place(Start(2.0, 0.0, np.pi / 2))
    rows = vehicle.drive(WheelSpeeds(0.0, 0.0), 60)
    speed = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1) / 0.01
    config, tilt = MujocoConfig(), np.deg2rad(angle)
    friction = config.friction * config.lateral_friction_ratio
    expected = max(9.81 * (np.sin(tilt) - friction * np.cos(tilt)), 0.0)
    assert (speed[50] - speed[10]) / 0.4 == pytest.approx(expected, rel=0.15, abs=0.02)


@pytest.mark.parametrize("height", [0.03, 0.08])
def test_it_climbs_low_steps_of_the_ground(make_ground, height):
    """Wheels of 10 cm climb what is lower than their axles."""
    vehicle = MujocoVehicle(make_ground(lambda x, y: np.where(x > 1.0, height, 0.0)), ROBOT)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 6.0)
    assert vehicle.state.pose.position[0] > 1.5


@pytest.mark.parametrize(("height", "hit"), [(0.03, False), (0.06, True), (0.15, True)])
def test_wheels_climb_small_stones_and_hit_large_ones(make_ground, height, hit):
    """A stone of 3 cm is driven over, those from 6 cm on are collisions."""
    stone = box(SemanticClass.ROCK, (1.5, 0.23, 0.0), (0.3, 0.3, 2 * height))
    vehicle = MujocoVehicle(make_ground(objects=[stone]), ROBOT)
    vehicle.place(ORIGIN)
    touched = False
    for _ in range(70):
        twist(vehicle, 0.3, 0.0, 0.1)
        touched |= vehicle.state.collided
    assert touched is hit
    assert hit or vehicle.state.pose.position[0] > 2.0


def test_a_trunk_ahead_stops_it(make_ground):
    """Its front stays at the trunk, with a contact that is an obstacle's."""
    trunk = frustum(SemanticClass.TRUNK, (1.5, 0.0, 0.0), (0.2, 0.2), 3.0)
    vehicle = MujocoVehicle(make_ground(objects=[trunk]), ROBOT)
    vehicle.place(ORIGIN)
    twist(vehicle, 0.3, 0.0, 5.0)
    assert vehicle.state.contact is Contact.OBSTACLE
    assert vehicle.state.pose.position[0] == pytest.approx(1.3 - ROBOT.length / 2, abs=0.02)


def test_a_wall_that_is_near_is_not_hit_yet(make_ground):
    """A collision begins at 5 mm, at a corner here."""
    yaw, thickness = 0.5, 0.2
    wall = box(SemanticClass.WALL, (1.2, 0.0, 0.5), (thickness, 3.0, 1.0), yaw)
    vehicle = MujocoVehicle(make_ground(objects=[wall]), ROBOT)
    vehicle.place(Start(0.5, 0.0, 0.0))
    while not vehicle.state.collided:
        x, y, _ = twist(vehicle, 0.1, 0.0, 0.01)[-1, :3]
        corner = np.array([x + ROBOT.length / 2 - 1.2, y + ROBOT.width / 2])
        gap = -corner @ [np.cos(yaw), np.sin(yaw)] - thickness / 2
        assert gap > 0.0
    assert gap < 0.007


@pytest.mark.parametrize(("angle", "tips"), [(30, False), (50, True)])
def test_it_tips_over_when_its_weight_leaves_its_wheels(make_ground, angle, tips):
    """The body tips beyond the angle whose tangent is half the track over the mass height."""
    config = MujocoConfig(friction=3.0, lateral_friction_ratio=1.0)
    vehicle = MujocoVehicle(make_ground(slope(angle)), ROBOT, config)
    vehicle.place(Start(0.0, 0.0, np.pi / 2))
    vehicle.drive(WheelSpeeds(0.0, 0.0), 300)
    assert vehicle.state.tipped is tips


@pytest.fixture(scope="module")
def rough(make_ground):
    """Return rough ground of 60 m with a row of stones."""
    bumps = 0.25 * smooth_noise((301, 301), 0.2, 4.0, np.random.default_rng(4))
    stones = [
        box(SemanticClass.ROCK, (x, 0.2, 0.0), (0.2, 0.2, 0.1)) for x in np.arange(1.0, 9.0, 2.0)
    ]
    return make_ground(lambda x, y: bumps, objects=stones, size=60.0, cell=0.2)


def test_the_same_drive_gives_the_same_bytes(rough):
    """Of two vehicles, and of one that has driven elsewhere in between."""
    start, drives = Start(1.0, 0.5, 0.4), []
    one, other = MujocoVehicle(rough, ROBOT), MujocoVehicle(rough, ROBOT)
    for vehicle, before in ((one, None), (other, None), (one, Start(-3.0, 2.0, 1.0))):
        if before is not None:
            vehicle.place(before)
            twist(vehicle, 0.3, -0.3, 1.0)
        vehicle.place(start)
        drives.append(np.concatenate([twist(vehicle, 0.3, rate, 1.0) for rate in (0.2, -0.4)]))
    assert drives[0].tobytes() == drives[1].tobytes() == drives[2].tobytes()


def test_another_window_of_ground_goes_on_with_the_motion(make_ground):
    """Over 10 m, beyond two windows, nothing jumps: each tick moves it on by 3 mm."""
    vehicle = MujocoVehicle(make_ground(slope(5), size=60.0, cell=0.5), ROBOT)
    vehicle.place(Start(-5.0, 0.0, 0.0))
    rows = np.concatenate([twist(vehicle, 0.3, 0.0, 0.5) for _ in range(70)])
    moved = np.linalg.norm(np.diff(rows[100:, :3], axis=0), axis=1)
    assert rows[-1, 0] > 4.5
    np.testing.assert_allclose(moved, 0.003, atol=0.0004)


@pytest.mark.parametrize("wheels", [WheelSpeeds(np.nan, 0.0), WheelSpeeds(0.0, np.inf)])
def test_speeds_that_are_no_numbers_are_refused(flat, wheels):
    """Speeds that are not finite are an error, and the body stays where it is."""
    flat.place(ORIGIN)
    before = flat.state.pose.position.copy()
    with pytest.raises(ValueError, match="expected finite speeds"):
        flat.drive(wheels, 1)
    np.testing.assert_array_equal(flat.state.pose.position, before)
