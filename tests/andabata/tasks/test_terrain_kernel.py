"""The compiled pass of planar robots: beams, moving obstacles, believed headings, layouts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.kinematic_vehicle import contact_map
from andabata.machine.robot import RobotModel
from andabata.tasks.terrain_batch import PlanarLidar, TerrainBatch
from andabata.tasks.terrain_kernel import (
    Beams,
    Robots,
    TerrainObstacles,
    heading_errors,
    lay_out,
    measure,
)
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rooms.mover_motion import Movers
from worlds.world import Start

WALL, ROBOT = SemanticClass.WALL, RobotModel()


def obstacles(scene):
    return TerrainObstacles(scene.rays.layout, np.zeros((4, 4), np.uint8), (0.0, 0.0, 0.1))


@pytest.fixture(scope="module")
def walls(make_scene):
    """Return a world with a wall 3 m in the east, and one 2 m in the north that is low."""
    east = box(WALL, (3.2, 0.0, 1.0), (0.4, 3.0, 2.0))
    north = box(WALL, (0.0, 2.2, 0.25), (3.0, 0.4, 0.5))
    return lay_out([obstacles(make_scene(objects=[east, north]))])


def ranges(worlds, poses, bearings=(0.0,), x=0.0, y=0.0, z=0.4, movers=None, chosen=None):
    count = len(poses)
    robots = Robots.make(count)
    robots.motions[:, :3] = poses
    bearings = np.asarray(bearings)
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    found = np.full((count, len(bearings)), -1.0, dtype=np.float32)
    measure(
        np.ones(count, bool) if chosen is None else chosen,
        robots,
        movers or Movers.none(count),
        worlds,
        Beams(directions, x, y, z, 10.0),
        found,
    )
    return found


HALF = np.pi / 2


@pytest.mark.parametrize(
    ("pose", "bearing", "expected"),
    [
        ((0, 0, 0), 0.0, 3.0),
        ((0, 0, 0), HALF, 2.0),
        ((0, 0, 0), -HALF, 10.0),
        ((0, 0, 0), np.pi, 10.0),
        ((0, 0, HALF), 0.0, 2.0),
        ((0, 0, HALF), -HALF, 3.0),
        ((0, 0, HALF), HALF, 10.0),
        ((1, 0, 0), 0.0, 2.0),
        ((0, 0.5, 0), HALF, 1.5),
        ((0, 0, 0.3), 0.0, 3.0 / np.cos(0.3)),
        ((0, 0, -0.3), 0.0, 3.0 / np.cos(0.3)),
        ((0, 0, np.pi / 6), 0.0, 10.0),
        ((0, 0, 0), np.pi / 9, 3.0 / np.cos(np.pi / 9)),
    ],
)
def test_a_beam_ends_at_the_wall(walls, pose, bearing, expected):
    """The range is the distance along heading plus bearing, the largest range in the open."""
    assert ranges(walls, [pose], [bearing])[0, 0] == pytest.approx(expected, abs=1e-4)


def test_an_obstacle_on_the_left_shortens_the_left_beams(make_scene):
    """Bearings count counter-clockwise: a post on the left is on no beam of the right."""
    post = box(WALL, (2.0, 2.0, 1.0), (0.4, 0.4, 2.0))
    worlds = lay_out([obstacles(make_scene(objects=[post]))])
    bearings = -np.pi + 2 * np.pi * (np.arange(32) + 0.5) / 32
    found = ranges(worlds, [(0, 0, 0)], bearings)[0]
    seen = bearings[found < 10]
    assert len(seen) > 0
    assert (np.abs(seen - np.pi / 4) < 0.2).all()


@pytest.mark.parametrize("yaw", [0.0, HALF, 2.0])
def test_the_laser_stands_where_it_is_mounted(make_scene, yaw):
    """x is ahead of the robot and y to its left, whatever its heading."""
    ring = [
        box(WALL, (3.2, 0.0, 1.0), (0.4, 8.0, 2.0)),
        box(WALL, (0.0, 4.2, 1.0), (8.0, 0.4, 2.0)),
    ]
    worlds = lay_out([obstacles(make_scene(objects=ring))])
    found = ranges(worlds, [(0, 0, yaw)], [-yaw, HALF - yaw], x=0.5, y=0.3)[0]
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    left = np.array([-np.sin(yaw), np.cos(yaw)])
    place = 0.5 * ahead + 0.3 * left
    np.testing.assert_allclose(found, np.array([3.0, 4.0]) - place, atol=1e-4)


def test_beams_pass_above_what_is_lower(walls):
    """A laser above the low wall does not see it."""
    assert ranges(walls, [(0, 0, HALF)], z=0.6)[0, 0] == 10.0
    assert ranges(walls, [(0, 0, 0)], z=0.6)[0, 0] == pytest.approx(3.0, abs=1e-4)


def test_only_chosen_robots_are_measured(walls):
    """The rows of other robots stay as they are."""
    found = ranges(walls, [(0, 0, 0)] * 3, chosen=np.array([False, True, False]))
    assert found[:, 0].tolist() == [-1.0, pytest.approx(3.0, abs=1e-4), -1.0]


@pytest.mark.parametrize(
    ("place", "radius", "expected"),
    [
        ((2.0, 0.0), 0.5, 1.5),
        ((2.0, 0.3), 0.5, 2.0 - 0.4),
        ((2.0, -0.3), 0.5, 2.0 - 0.4),
        ((2.0, 0.6), 0.5, 3.0),
        ((-2.0, 0.0), 0.5, 3.0),
        ((0.2, 0.0), 0.5, 0.0),
        ((5.0, 0.0), 0.5, 3.0),
    ],
)
def test_a_mover_shortens_the_beams_that_meet_it(walls, place, radius, expected):
    """A beam ends at the near side of a circle: not beside, behind, or beyond a wall."""
    movers = Movers(np.array([[place]]), np.zeros((1, 1, 2)), np.array([[radius]]))
    found = ranges(walls, [(0, 0, 0)], movers=movers)
    assert found[0, 0] == pytest.approx(expected, abs=1e-4)


def test_each_robot_has_movers_of_its_own(walls):
    """The nearest of a robot's movers counts, and another robot's is not seen."""
    places = np.array([[[2.0, 0.0], [1.0, 0.0]], [[2.5, 0.0], [-3.0, 0.0]]])
    movers = Movers(places, np.zeros((2, 2, 2)), np.full((2, 2), 0.25))
    found = ranges(walls, [(0, 0, 0), (0, 0, 0)], movers=movers)
    np.testing.assert_allclose(found[:, 0], [0.75, 2.25], atol=1e-4)


def test_worlds_behind_each_other_are_seen_one_by_one(make_scene):
    """In each world a robot sees that world's objects alone, however many the others have."""
    rng = np.random.default_rng(0)
    scenes = []
    for count in (1, 5, 0, 3):
        places = rng.uniform(2, 8, (count, 2)) * rng.choice([-1, 1], (count, 2))
        scenes.append(
            make_scene(objects=[box(WALL, (x, y, 1.0), (0.8, 0.6, 2.0)) for x, y in places])
        )
    bearings = np.linspace(-np.pi, np.pi, 64, endpoint=False)
    robots = Robots.make(4)
    robots.worlds[:] = np.arange(4)
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    together = np.zeros((4, 64), np.float32)
    beams = Beams(directions, 0.0, 0.0, 0.7, 10.0)
    worlds = lay_out([obstacles(scene) for scene in scenes])
    measure(np.ones(4, bool), robots, Movers.none(4), worlds, beams, together)
    for k, scene in enumerate(scenes):
        alone = ranges(lay_out([obstacles(scene)]), [(0, 0, 0)], bearings, z=0.7)[0]
        np.testing.assert_array_equal(together[k], alone)
        assert (alone < 10).any() == (k != 2)


def test_worlds_of_two_sizes_are_refused(make_scene):
    """All worlds of a batch have one size."""
    scenes = [make_scene(size=size) for size in (20.0, 24.0)]
    with pytest.raises(ValueError, match="expected mazes of one size"):
        lay_out([obstacles(scene) for scene in scenes])


def errors_of(pose, goal, error=(0.0,) * 5):
    motion = np.zeros((1, 8))
    motion[0, :3] = pose
    return float(heading_errors(motion, np.array([error]), np.array([goal]))[0])


@pytest.mark.parametrize(
    ("pose", "goal", "expected"),
    [
        ((0, 0, 0), (5, 0), 0.0),
        ((0, 0, 0), (0, 5), HALF),
        ((0, 0, 0), (0, -5), -HALF),
        ((0, 0, HALF), (0, 5), 0.0),
        ((0, 0, HALF), (5, 0), -HALF),
        ((1, 2, 0), (2, 3), np.pi / 4),
        ((0, 0, 3.0), (np.cos(-3.0), np.sin(-3.0)), 2 * np.pi - 6.0),
    ],
)
def test_the_bearing_of_the_goal(pose, goal, expected):
    """The heading error is the goal's bearing less the heading, positive to the left."""
    assert errors_of(pose, goal) == pytest.approx(expected, abs=1e-12)


def test_heading_errors_are_wrapped():
    """Errors lie in (-pi, pi], also after many turns."""
    for yaw in np.linspace(-20, 20, 41):
        assert -np.pi < errors_of((0, 0, yaw), (3, 1)) <= np.pi
    assert errors_of((0, 0, 0), (-1, 0)) == pytest.approx(np.pi)


def test_the_believed_pose_turns_the_bearing():
    """Errors of position and heading are those of the pose that the robot believes."""
    assert errors_of((0, 0, 0), (5, 0), (0, 0, 0.2, 0, 0)) == pytest.approx(-0.2)
    assert errors_of((0, 0, 0), (5, 0), (4, -1, 0, 0, 0)) == pytest.approx(np.pi / 4)


def test_believed_roll_and_pitch_turn_the_heading():
    """The believed heading is that of the level heading rolled, pitched, then turned."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        yaw, error = rng.uniform(-3, 3), rng.normal(0, 0.3, 5)
        turn = Rotation.from_euler("xyz", [error[3], error[4], error[2]])
        ahead = turn.apply([np.cos(yaw), np.sin(yaw), 0.0])
        to_goal = np.array([4.0, -1.0]) - error[:2]
        wanted = np.arctan2(to_goal[1], to_goal[0]) - np.arctan2(ahead[1], ahead[0])
        found = errors_of((0, 0, yaw), (4.0, -1.0), tuple(error))
        assert np.angle(np.exp(1j * (found - wanted))) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("side", range(4))
def test_a_body_stops_at_a_wall_on_any_side(make_scene, side):
    """A body that drives at a wall in the east, north, west or south touches it where it stands."""
    wall = box(WALL, (5.0, 1.0, 1.0), (0.4, 2.0, 2.0))
    turn = np.array([[0, -1], [1, 0]])
    for _ in range(side):
        x, y, z = wall.vertices[:, 0], wall.vertices[:, 1], wall.vertices[:, 2]
        wall = replace(wall, vertices=np.stack([-y, x, z], axis=1))
    start = np.linalg.matrix_power(turn, side) @ [3.9, 1.0]
    scene = make_scene(objects=[wall])
    made = batch(scene)
    made.place(0, 0, Start(*start, side * HALF), np.random.default_rng(0))
    contacts, ranges_ = [], []
    for _ in range(40):
        state = made.step(np.array([[0.3, 0.0]]), np.ones(1, bool))
        contacts.append(bool(state.contacts[0]))
        ranges_.append(float(made.ranges[0, 0]))
    first = contacts.index(True)
    assert ranges_[first] == pytest.approx(ROBOT.length / 2, abs=0.12)
    assert first == pytest.approx((0.9 - 0.335) / 0.03, abs=6)


@pytest.fixture(scope="module")
def planes(make_scene):
    """Return an empty world."""
    return make_scene()


def batch(scene):
    """Return one robot at the origin of a world."""
    exact = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)
    made = TerrainBatch(1, ROBOT, PlanarLidar(np.zeros(1), 0.4, 10.0), exact)
    truth = scene.world.truth
    raster = (truth.x_min, truth.y_min, truth.cell)
    made.add_world(TerrainObstacles(scene.rays.layout, contact_map(truth, made.outline), raster))
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    return made


def movers(place, velocity, radius=0.4):
    return Movers(
        np.array([[place]], np.float64),
        np.array([[velocity]], np.float64),
        np.array([[radius]], np.float64),
    )


@pytest.mark.parametrize("side", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_a_mover_that_reaches_the_body_is_a_contact(planes, side):
    """Contact begins where the circle touches the body's, from any side, and ends behind it."""
    reach = 0.4 + ROBOT.half_radius
    made = batch(planes)
    for distance, contact in ((reach + 0.02, False), (reach - 0.02, True), (reach + 0.02, False)):
        place = (distance * side[0], distance * side[1])
        made.movers = movers(place, (0.0, 0.0))
        state = made.step(np.zeros((1, 2)), np.ones(1, bool))
        assert state.contacts[0] == contact


def test_movers_move_by_their_velocity(planes):
    """A mover advances by its velocity times the period, each axis by its own."""
    made = batch(planes)
    made.movers = movers((5.0, -3.0), (-0.5, 0.25))
    made.step(np.zeros((1, 2)), np.ones(1, bool))
    np.testing.assert_allclose(made.movers.places[0, 0], [4.95, -2.975])


def test_a_mover_collides_after_it_has_moved(planes):
    """Contact is checked at the end of the period, not at its begin."""
    made = batch(planes)
    made.movers = movers((0.4 + ROBOT.half_radius + 0.05, 0.0), (-1.0, 0.0))
    assert made.step(np.zeros((1, 2)), np.ones(1, bool)).contacts[0]
