"""Skid-steer robots by the batch: each does what it would do alone."""

import numpy as np
import pytest

from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.kinematic_vehicle import contact_map
from andabata.machine.robot import RobotModel
from andabata.tasks.terrain_batch import PlanarLidar, TerrainBatch
from andabata.tasks.terrain_kernel import AHEAD, TerrainObstacles
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rooms.mover_motion import Movers
from worlds.world import Start

ROBOT = RobotModel()
EXACT = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)


def batch(scenes, count=1, errors=EXACT):
    """Return a batch of robots with four beams, and a world for each scene."""
    lidar = PlanarLidar(np.array([0.0, np.pi / 2, np.pi, -np.pi / 2]), 0.4, 10.0)
    made = TerrainBatch(count, ROBOT, lidar, errors)
    for scene in scenes:
        truth = scene.world.truth
        raster = (truth.x_min, truth.y_min, truth.cell)
        contact = contact_map(truth, made.outline)
        made.add_world(TerrainObstacles(scene.rays.layout, contact, raster))
    return made


@pytest.fixture(scope="module")
def planes(make_scene):
    """Return an empty world and one with a wall whose face is 3 m ahead of the origin."""
    wall = box(SemanticClass.WALL, (3.2, 0.0, 1.0), (0.4, 6.0, 2.0))
    return make_scene(), make_scene(objects=[wall])


def drive(made, twist, steps, count=None):
    count = len(made.stamps) if count is None else count
    twists = np.tile(np.array(twist, dtype=np.float64), (count, 1))
    for _ in range(steps):
        state = made.step(twists, np.ones(count, bool))
    return state


def test_a_robot_drives_ahead_and_its_beam_shortens(planes):
    """A robot moves along its heading at its speed, and what is ahead comes nearer as much."""
    made = batch(planes)
    made.place(0, 1, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    made.observe(np.ones(1, bool))
    np.testing.assert_allclose(made.ranges[0], [3.0, 10.0, 10.0, 10.0], atol=1e-4)
    state = drive(made, (0.3, 0.0), 40)
    x, y, yaw = state.poses[0]
    assert x == pytest.approx(1.2, abs=0.1)
    assert abs(y) < 0.15
    assert abs(yaw) < 0.1
    assert made.ranges[0, 0] == pytest.approx((3.0 - x) / np.cos(yaw), abs=1e-3)
    assert made.stamps[0] == pytest.approx(4.0)


def test_a_positive_yaw_rate_turns_left(planes):
    """The yaw grows with a positive rate, and the robot curves to its left."""
    made = batch(planes)
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    state = drive(made, (0.3, 0.5), 20)
    assert state.poses[0, 2] == pytest.approx(1.0, abs=0.15)
    assert state.poses[0, 1] > 0.1


def test_a_wall_stops_the_body_and_counts_as_contact(planes):
    """A robot that drives at a wall ends in contact, half a body's length before it."""
    made = batch(planes)
    made.place(0, 1, Start(2.0, 0.0, 0.0), np.random.default_rng(0))
    state = drive(made, (0.3, 0.0), 5)
    assert not state.contacts[0]
    state = drive(made, (0.3, 0.0), 40)
    assert state.contacts[0]
    assert 3.0 - state.poses[0, 0] == pytest.approx(ROBOT.length / 2, abs=0.15)
    assert not state.tipped[0]


def test_a_robot_among_many_is_as_alone(planes):
    """With the same generator a robot does the same, to the bit, whoever is beside it."""
    errors = NoisyGroundTruthConfig()
    starts = [Start(0.0, 0.2 * k, 0.3 * k) for k in range(5)]
    twists = np.array([[0.3, 0.1 * k - 0.2] for k in range(5)])
    many = batch(planes, 5, errors)
    for k, start in enumerate(starts):
        many.place(k, k % 2, start, np.random.default_rng(k))
    alone = [batch(planes, 1, errors) for _ in starts]
    for k, start in enumerate(starts):
        alone[k].place(0, k % 2, start, np.random.default_rng(k))
    goals = np.array([[4.0, 1.0]])
    for _ in range(2 * AHEAD + 5):
        state = many.step(twists, np.ones(5, bool))
        for k, one in enumerate(alone):
            single = one.step(twists[k : k + 1], np.ones(1, bool))
            np.testing.assert_array_equal(many.ranges[k], one.ranges[0])
            for name in ("poses", "contacts", "tipped"):
                np.testing.assert_array_equal(getattr(state, name)[k], getattr(single, name)[0])
            np.testing.assert_array_equal(many.believed_positions[k], one.believed_positions[0])
            turned = many.heading_errors(np.repeat(goals, 5, axis=0))[k]
            assert turned == one.heading_errors(goals)[0]


def test_robots_of_other_seeds_slip_otherwise(planes):
    """Slip and errors come from each robot's own generator, and new draws in every block."""
    made = batch(planes, 3, NoisyGroundTruthConfig())
    for k, seed in enumerate((1, 1, 2)):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(seed))
    errors = made.robots.errors.copy()
    np.testing.assert_array_equal(errors[0], errors[1])
    assert (errors[0] != errors[2]).all()
    first = made.robots.slip.copy()
    state = drive(made, (0.3, 0.0), AHEAD)
    np.testing.assert_array_equal(state.poses[0], state.poses[1])
    assert np.abs(state.poses[0] - state.poses[2]).max() > 1e-4
    second = made.robots.slip.copy()
    drive(made, (0.3, 0.0), 1)
    assert (second != first).any()
    assert (made.robots.slip[0] != second[0]).all()


def test_robots_that_are_not_chosen_stand_still(planes):
    """Neither pose, clock, errors nor movers of other robots change."""
    made = batch(planes, 2, NoisyGroundTruthConfig())
    made.movers = Movers(np.full((2, 1, 2), 5.0), np.ones((2, 1, 2)), np.full((2, 1), 0.3))
    for k in range(2):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(k))
    before = [np.copy(array) for array in (*made.robots, *made.movers)]
    made.step(np.array([[0.3, 0.4]] * 2), np.array([True, False]))
    for old, new in zip(before, (*made.robots, *made.movers), strict=True):
        np.testing.assert_array_equal(old[1], new[1])
    assert made.stamps.tolist() == [pytest.approx(0.1), 0.0]


def test_wheels_scale_down_what_they_cannot_turn(planes):
    """A twist beyond the wheels' limit is driven slower on the same curve."""
    slow = RobotModel(max_wheel_speed=2.0)
    lidar = PlanarLidar(np.zeros(1), 0.4, 10.0)
    made = TerrainBatch(1, slow, lidar, EXACT)
    truth = planes[0].world.truth
    raster = (truth.x_min, truth.y_min, truth.cell)
    layout = planes[0].rays.layout
    made.add_world(TerrainObstacles(layout, contact_map(truth, made.outline), raster))
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    twists = np.array([[1.0, 0.0]])
    for _ in range(20):
        state = made.step(twists, np.ones(1, bool))
    assert state.poses[0, 0] == pytest.approx(2 * 0.2, abs=0.06)  # 2 rad/s of a 10 cm wheel.
    assert twists.tolist() == [[1.0, 0.0]]


def movers(place, velocity, radius=0.4):
    return Movers(
        np.array([[place]], np.float64),
        np.array([[velocity]], np.float64),
        np.array([[radius]], np.float64),
    )


def test_a_mover_moves_and_is_seen_where_it_is(planes):
    """A mover advances by its velocity each period, and the beam follows it."""
    made = batch(planes)
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    made.movers = movers((5.0, 0.0), (-0.5, 0.25))
    for k in range(1, 5):
        state = made.step(np.zeros((1, 2)), np.ones(1, bool))
        x, y = 5.0 - 0.05 * k, 0.025 * k
        np.testing.assert_allclose(made.movers.places[0, 0], [x, y])
        expected = x - np.sqrt(0.16 - y * y)
        assert made.ranges[0, 0] == pytest.approx(expected, abs=0.01)
    assert not state.contacts[0]


def test_errors_of_the_believed_pose_wander(planes):
    """Errors keep their standard deviation and lose their memory with the correlation time."""
    errors = NoisyGroundTruthConfig(
        position_sigma=0.5, position_time=2.0, yaw_sigma=0.1, yaw_time=4.0, tilt_sigma=0.02
    )
    made = batch(planes, 1500, errors)
    for k in range(1500):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(k))
    first = made.robots.errors.copy()
    sigma, time = np.array([0.5, 0.5, 0.1, 0.02, 0.02]), np.array([2.0, 2.0, 4.0, 4.0, 4.0])
    np.testing.assert_allclose(first.std(axis=0), sigma, rtol=0.07)
    state = drive(made, (0.0, 0.0), 20)
    np.testing.assert_allclose(made.robots.errors.std(axis=0), sigma, rtol=0.07)
    kept = (first * made.robots.errors).mean(axis=0) / sigma**2
    np.testing.assert_allclose(kept, np.exp(-2.0 / time), atol=0.09)
    believed = state.poses[:, :2] + made.robots.errors[:, :2]
    np.testing.assert_array_equal(made.believed_positions, believed)
