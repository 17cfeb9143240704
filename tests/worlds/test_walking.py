"""Walkers over time: on the ground, back at what stands, and in the way of rays at their time."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box, frustum
from tests.support.walking_worlds import peopled, walker
from worlds.rays.scene import RayScene
from worlds.walking import Walkers, cover_rays

FAR = (1e6, 1e6)


def steps(walkers, seconds, robot=FAR, gap=0.0):
    """Walk for some time and return the track of the last step."""
    for _ in range(round(10 * seconds)):
        track = walkers.step(10, robot, gap)
    return track


def covered(track, rays, times, max_range=np.inf, ranges=None):
    """Return ranges and classes of rays in a world of walkers alone, or of some ranges."""
    rays = np.array(rays, dtype=np.float32).reshape(-1, 6)
    if ranges is None:
        ranges = np.full(len(rays), np.inf)
    ranges = np.array(ranges, dtype=np.float32)
    classes = np.full(len(rays), 255, dtype=np.uint8)
    cover_rays(rays, np.array(times, dtype=np.float64), track, max_range, ranges, classes)
    return ranges, classes


def test_walkers_go_straight_on_the_height_of_the_ground(make_ground):
    """A walker's foot is on the triangulated surface under its axis, at every tick."""
    world = make_ground(lambda x, y: 0.2 * np.sin(3 * x) + 0.1 * x * y, size=20.0)
    walkers = Walkers(peopled(world, walker((-3.0, 1.0), (0.8, -0.3))), 100.0)
    track = steps(walkers, 4.0)
    np.testing.assert_allclose(track.movers.places[-1, 0], [0.2, -0.2], atol=1e-9)
    assert track.feet.shape == (10, 1)
    whole = walkers.track
    assert whole.feet.shape == (401, 1)
    places = whole.movers.places[:, 0]
    np.testing.assert_allclose(np.diff(places, axis=0), [[0.008, -0.003]] * 400, atol=1e-12)
    expected = world.ground.height_at(places[:, 0], places[:, 1])
    np.testing.assert_allclose(whole.feet[:, 0], expected, atol=1e-6)
    assert whole.latest == pytest.approx(4.0)
    np.testing.assert_allclose(whole.now[0, :2], [0.2, -0.2], atol=1e-9)
    assert whole.now[0, 3:].tolist() == [0.25, 1.7]


def test_walkers_turn_back_at_solids_and_at_the_border(make_ground):
    """At a slanted wall, at a trunk and a metre before the border; a stone is stepped over."""
    wall = box(SemanticClass.WALL, (0.0, 4.0, 0.5), (6.0, 0.2, 1.0), np.pi / 4)
    trunk = frustum(SemanticClass.TRUNK, (4.0, -5.0, 0.0), (0.5, 0.5), 3.0, 24)
    stone = box(SemanticClass.STONE, (-5.0, -5.0, 0.0), (0.4, 0.4, 0.05))
    world = make_ground(objects=[wall, trunk, stone])
    made = [
        walker((-3.0, 4.0), (1.0, 0.0)),
        walker((2.0, -5.0), (1.0, 0.0)),
        walker((-7.0, -5.0), (1.0, 0.0)),
        walker((8.0, 7.0), (0.5, 0.0)),
    ]
    walkers = Walkers(peopled(world, *made), 100.0)
    velocities = steps(walkers, 4.0).movers.velocities[-1]
    expected = [[0.0, 1.0], [-1.0, 0.0], [1.0, 0.0], [-0.5, 0.0]]
    np.testing.assert_allclose(velocities, expected, atol=1e-6)
    places, radii = walkers.track.movers.places, 0.25
    assert places[:, 3, 0].max() <= 9.0 - radii
    assert np.hypot(*(places[:, 1] - [4.0, -5.0]).T).min() >= 0.5 + radii - 1e-6


def test_looking_at_what_is_near_changes_nothing(make_ground, monkeypatch):
    """Where walkers go does not depend on how often they look for what they may meet."""
    rng = np.random.default_rng(1)
    trunks = [
        frustum(SemanticClass.TRUNK, (*place, 0.0), (0.2, 0.2), 3.0)
        for place in rng.uniform(-8, 8, (60, 2))
    ]
    walls = [
        box(SemanticClass.WALL, (*place, 0.5), (1.5, 0.1, 1.0), turn)
        for place, turn in zip(rng.uniform(-8, 8, (20, 2)), rng.uniform(0, 3, 20), strict=True)
    ]
    world = peopled(
        make_ground(objects=[*trunks, *walls]),
        *(walker(tuple(8.5 * d), tuple(-1.5 * d), 0.2) for d in np.eye(2)),
    )
    often, seldom = (Walkers(world, 100.0) for _ in range(2))
    a = steps(often, 12.0).movers.places
    monkeypatch.setattr("worlds.walking._HORIZON", 500)
    b = steps(seldom, 12.0).movers.places
    np.testing.assert_array_equal(a, b)
    # And as often as not they had to turn back.
    turns = np.abs(np.diff(often.track.movers.velocities, axis=0)).sum(axis=2) > 0
    assert turns.sum() > 4


def test_a_drive_begins_with_the_same_walkers(make_ground):
    """After a reset they are where they were, whatever a longer drive did."""
    walkers = Walkers(peopled(make_ground(), walker((0.0, 0.0), (0.7, 0.2))), 100.0)
    first = steps(walkers, 1.0).movers.places.copy()
    steps(walkers, 30.0)
    walkers.reset(FAR)
    np.testing.assert_array_equal(steps(walkers, 1.0).movers.places, first)


def test_the_last_ten_seconds_are_remembered(make_ground):
    """Of a long drive the older ticks go; the numbers of the others stay theirs."""
    walkers = Walkers(peopled(make_ground(size=80.0), walker((-30.0, 0.0), (1.0, 0.0))), 100.0)
    steps(walkers, 50.0)
    track = walkers.track
    assert 1000 <= len(track.feet) <= 2048
    assert track.first + len(track.feet) == 5001
    assert track.latest == pytest.approx(50.0)
    seconds = (track.first + np.arange(len(track.feet))) / 100
    np.testing.assert_allclose(track.movers.places[:, 0, 0], seconds - 30.0, atol=1e-9)


def test_walkers_come_and_go_but_not_onto_the_robot(make_ground):
    """One is there from 1 s to 3 s; where the robot stands it waits until it has left."""
    made = walker((2.0, 0.0), appears_at=1.0, duration=2.0)
    walkers = Walkers(peopled(make_ground(), made), 100.0)
    radii = [steps(walkers, 0.1).movers.radii[-1, 0] for _ in range(40)]
    assert radii == [0.0] * 10 + [0.25] * 20 + [0.0] * 10
    walkers.reset(FAR)
    assert steps(walkers, 2.0, (2.5, 0.0), 0.4).movers.radii[-1, 0] == 0.0
    assert steps(walkers, 0.1, (2.7, 0.0), 0.4).movers.radii[-1, 0] == 0.25


@pytest.mark.parametrize(
    ("origin", "direction", "expected"),
    [
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 1.75),
        ((0.0, 0.24, 1.0), (1.0, 0.0, 0.0), 2.0 - 0.07),
        ((0.0, 0.26, 1.0), (1.0, 0.0, 0.0), np.inf),
        ((4.0, 0.0, 1.0), (1.0, 0.0, 0.0), np.inf),
        ((0.0, 0.0, 1.8), (1.0, 0.0, 0.0), np.inf),
        ((0.0, 0.0, 1.0), (0.8, 0.0, 0.6), np.inf),
        ((0.0, 0.0, 2.7), (0.8, 0.0, -0.6), 2.1875),
        ((2.1, 0.0, 3.0), (0.0, 0.0, -1.0), 1.3),
        ((2.0, 0.0, 1.0), (0.0, 1.0, 0.0), 0.25),
        ((2.3, 0.0, 3.0), (0.0, 0.0, -1.0), np.inf),
    ],
)
def test_rays_meet_side_and_top_of_a_cylinder(make_ground, origin, direction, expected):
    """Known ranges; from inside the far side is hit."""
    track = Walkers(peopled(make_ground(), walker((2.0, 0.0))), 100.0).track
    ranges, classes = covered(track, [*origin, *direction], [0.0])
    assert ranges[0] == pytest.approx(expected, abs=1e-5)
    assert classes[0] == (SemanticClass.WALKER if np.isfinite(expected) else 255)


def test_the_cylinder_is_that_of_a_scene(make_ground):
    """Rays meet a walker where they meet a solid of sixty-four sides in its place."""
    rng = np.random.default_rng(0)
    world = make_ground(lambda x, y: 0.1 * x)
    foot = float(world.ground.height_at(1.0, 2.0))
    solid = frustum(SemanticClass.WALL, (1.0, 2.0, foot), (0.3, 0.3), 1.6, 64)
    scene, bare = RayScene(make_ground(lambda x, y: 0.1 * x, [solid])), RayScene(world)
    origins = rng.uniform((-3, -3, 0.5), (3, 1, 2.0), (4000, 3))
    aims = np.array([1.0, 2.0, foot + 0.8]) + rng.normal(0, 0.4, (4000, 3)) - origins
    aims /= np.linalg.norm(aims, axis=1, keepdims=True)
    rays = np.hstack([origins, aims]).astype(np.float32)
    depths = np.full(4000, np.inf, dtype=np.float32)
    expected, kinds = scene.cast(rays, depths)
    ranges, classes = bare.cast(rays, depths)
    track = Walkers(peopled(world, walker((1.0, 2.0), radius=0.3, height=1.6)), 100.0).track
    cover_rays(rays, np.zeros(4000), track, np.inf, ranges, classes)
    same = (kinds == SemanticClass.WALL) == (classes == SemanticClass.WALKER)
    assert same.mean() > 0.98
    met = same & (classes == SemanticClass.WALKER)
    assert met.sum() > 500
    np.testing.assert_allclose(ranges[met], expected[met], atol=0.03)


def test_each_ray_meets_walkers_where_they_are_at_its_time(make_ground):
    """Between two ticks they go straight; before the first and after the last they stand."""
    walkers = Walkers(peopled(make_ground(), walker((2.0, 0.0), (1.0, 0.0))), 100.0)
    steps(walkers, 1.0)
    times = [-1.0, 0.0, 0.004, 0.5, 0.999, 1.0, 1.5]
    rays = [[0.0, 0.0, 1.0, 1.0, 0.0, 0.0]] * len(times)
    ranges, _ = covered(walkers.track, rays, times)
    expected = 1.75 + np.clip(times, 0.0, 1.0)
    np.testing.assert_allclose(ranges, expected, atol=1e-5)


def test_what_is_nearer_or_out_of_range_stays(make_ground):
    """A walker behind a tree is not seen, nor one beyond the range, nor one that is not there."""
    made = walker((2.0, 0.0)), walker((0.0, 3.0), appears_at=5.0)
    track = Walkers(peopled(make_ground(), *made), 100.0).track
    ahead, left = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 1.0, 0.0]
    assert covered(track, ahead, [0.0], ranges=[1.0])[0].tolist() == [1.0]
    assert covered(track, ahead, [0.0], 1.8, ranges=[5.0])[0].tolist() == [1.75]
    assert covered(track, ahead, [0.0], 1.7, ranges=[5.0])[0].tolist() == [5.0]
    assert covered(track, left, [0.0], ranges=[5.0])[0].tolist() == [5.0]


def test_a_foot_on_a_slope_hangs_nowhere(make_ground):
    """Below the foot, on the side that falls away, a ray still meets the walker."""
    world = make_ground(lambda x, y: -0.4 * x)
    track = Walkers(peopled(world, walker((0.0, 0.0))), 100.0).track
    ray = [3.0, 0.0, -0.05, -1.0, 0.0, 0.0]
    assert covered(track, ray, [0.0])[0][0] == pytest.approx(2.75)


def test_past_rays_meet_walkers_far_from_where_they_are_now(make_ground):
    """A short reach leaves out whom no ray of a long span can meet, and nobody else."""
    walkers = Walkers(peopled(make_ground(size=60.0), walker((2.0, 0.0), (2.5, 0.0))), 100.0)
    steps(walkers, 8.0)
    rays = [[0.0, 0.0, 1.0, 1.0, 0.0, 0.0]] * 2
    assert covered(walkers.track, rays, [8.0, 0.0], 5.0)[0].tolist() == [np.inf, 1.75]
    assert covered(walkers.track, rays, [0.0, 8.0], 5.0)[0].tolist() == [1.75, np.inf]
