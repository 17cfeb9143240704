"""The compiled pass of moving obstacles: bounces, coming and going."""

import numpy as np
import pytest

from worlds.rooms.mover_motion import Movers, Schedules, advance, come_and_go, put_down
from worlds.rooms.movers import Mover, MoverPlan

DT = 0.05
BOX = np.array([[-3.2, -2.2, -3.0, 2.2], [3.0, -2.2, 3.2, 2.2], [-3, -2.2, 3, -2], [-3, 2, 3, 2.2]])
NONE, NO_EDGES = np.zeros((0, 3)), np.zeros((0, 4))


def movers(*rows):
    """Return one robot's movers of x, y, velocity in x and y, radius."""
    rows = np.array(rows, dtype=np.float64).reshape(1, -1, 5)
    return Movers(rows[..., :2].copy(), rows[..., 2:4].copy(), rows[..., 4].copy())


def moved(made, steps, boxes=BOX, circles=NONE, edges=NO_EDGES):
    """Move all movers for some sub-steps."""
    for _ in range(steps):
        advance(0, made, boxes, circles, edges, DT)
    return made


def gaps(made, boxes, circles):
    """Return the least gap of movers to what stands, and to each other [m]."""
    places, radii = made.places[0], made.radii[0]
    nearest = np.clip(places[:, None], boxes[:, :2], boxes[:, 2:])
    standing = np.hypot(*(places[:, None] - nearest).transpose(2, 0, 1)) - radii[:, None]
    round_ones = np.hypot(*(places[:, None] - circles[:, :2]).transpose(2, 0, 1))
    round_ones -= radii[:, None] + circles[:, 2]
    pairs = np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) - radii[:, None] - radii
    np.fill_diagonal(pairs, np.inf)
    return min(standing.min(initial=9.0), round_ones.min(initial=9.0)), pairs.min()


def test_movers_go_straight_at_their_speed():
    """Where nothing is in the way, a mover is where its velocity leads; one that stands stays."""
    made = moved(movers((0.0, 0.0, 0.4, -0.3, 0.2), (-2.0, 1.0, 0.0, 0.0, 0.3)), 40)
    np.testing.assert_allclose(made.places[0], [[0.8, -0.6], [-2.0, 1.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("velocity", "expected"),
    [((1, 0), (-1, 0)), ((-1, 0), (1, 0)), ((0, 1), (0, -1)), ((0, -1), (0, 1))],
)
def test_a_wall_mirrors_the_part_across_it(velocity, expected):
    """Of a slanted velocity the part along the wall stays as it is."""
    across = np.array(velocity, dtype=float)
    along = 0.5 * across[::-1]
    made = movers((*(across * (2.5, 1.5)), *(across + along), 0.3))
    moved(made, 12)
    np.testing.assert_allclose(made.velocities[0, 0], np.array(expected) + along, atol=1e-12)
    # Of twelve sub-steps of 0.025 m along the wall it lost the one that would have overlapped.
    assert np.abs(made.places[0, 0] @ across[::-1]) == pytest.approx(11 * 0.025)


def test_a_head_on_bounce_comes_back_the_way_it_went():
    """0.22 m before a wall, four steps of 0.05 m fit, one is lost, then it returns."""
    made = movers((2.58, 0.0, 1.0, 0.0, 0.2))
    xs = [float(moved(made, 1).places[0, 0, 0]) for _ in range(8)]
    np.testing.assert_allclose(xs, [2.63, 2.68, 2.73, 2.78, 2.78, 2.73, 2.68, 2.63])


def test_corners_and_circles_mirror_at_their_normal():
    """A corner met along its diagonal turns a mover back; a post met off its middle deflects it."""
    box = np.array([[0.0, 0.0, 1.0, 1.0]])
    made = moved(movers((-1.0, -1.0, 0.6, 0.6, 0.3)), 60, box)
    np.testing.assert_allclose(made.velocities[0, 0], [-0.6, -0.6], atol=1e-9)
    post = np.array([[0.0, 0.0, 0.5]])
    # Centres touch at 45 degrees: what came along x leaves along y.
    lift = 0.7 / np.sqrt(2) - 1e-4
    made = moved(movers((-2.0, lift, 0.5, 0.0, 0.2)), 90, np.zeros((0, 4)), post)
    vx, vy = made.velocities[0, 0]
    assert vy > 0.45
    assert abs(vx) < 0.15
    assert np.hypot(vx, vy) == pytest.approx(0.5)


def test_slanted_edges_mirror_at_their_normal_and_at_their_ends():
    """A wall at 45 degrees turns x into y; its end, met head-on, turns a mover back."""
    wall = np.array([[0.0, -1.0, 2.0, 1.0]])
    made = moved(movers((0.0, 0.0, 0.5, 0.0, 0.2)), 60, NO_EDGES, NONE, wall)
    np.testing.assert_allclose(made.velocities[0, 0], [0.0, 0.5], atol=1e-12)
    # The centre keeps its radius from the line y = x - 1.
    x, y = made.places[0, 0]
    assert (y - x + 1.0) / np.sqrt(2) >= 0.2
    made = moved(movers((-0.5, -1.5, 0.4, 0.4, 0.2)), 60, NO_EDGES, NONE, wall)
    np.testing.assert_allclose(made.velocities[0, 0], [-0.4, -0.4], atol=1e-12)
    # Past its end there is nothing.
    made = moved(movers((-0.3, 0.0, 0.0, -0.5, 0.2)), 60, NO_EDGES, NONE, wall)
    np.testing.assert_allclose(made.velocities[0, 0], [0.0, -0.5], atol=1e-12)


def test_movers_that_meet_turn_back():
    """Both do head-on, whoever is first; a faster one that catches up turns back alone."""
    for order in (1, -1):
        rows = [(-1.0, 0.0, 0.6, 0.0, 0.3), (1.0, 0.0, -0.3, 0.0, 0.3)][::order]
        made = moved(movers(*rows), 60)
        velocities = made.velocities[0][::order]
        np.testing.assert_allclose(velocities, [[-0.6, 0.0], [0.3, 0.0]], atol=1e-12)
        rows = [(-1.0, 0.0, 0.6, 0.0, 0.3), (0.0, 0.0, 0.2, 0.0, 0.3)][::order]
        velocities = moved(movers(*rows), 60).velocities[0][::order]
        np.testing.assert_allclose(velocities, [[-0.6, 0.0], [0.2, 0.0]], atol=1e-12)


@pytest.mark.parametrize("gap", [0.021, 0.033, 0.049])
def test_a_slow_mover_turns_back_before_a_fast_one_reaches_it(gap):
    """Both do where the next step of the fast one would touch, though the slow one's would not."""
    made = moved(movers((-gap, 0.0, 1.0, 0.0, 0.3), (0.6, 0.0, -0.2, 0.0, 0.3)), 1)
    np.testing.assert_allclose(made.velocities[0], [[-1.0, 0.0], [0.2, 0.0]], atol=1e-12)


def test_a_mover_turns_back_at_one_that_stands():
    """What stands is not moved by it."""
    made = moved(movers((-1.0, 0.0, 0.6, 0.0, 0.3), (0.5, 0.0, 0.0, 0.0, 0.3)), 60)
    np.testing.assert_allclose(made.velocities[0], [[-0.6, 0.0], [0.0, 0.0]], atol=1e-12)
    assert made.places[0, 1].tolist() == [0.5, 0.0]


@pytest.mark.parametrize("seed", range(4))
def test_nothing_ever_overlaps_and_speeds_stay(seed):
    """Six movers among boxes and posts keep their speeds, leave all alone, and get around."""
    rng = np.random.default_rng(seed)
    boxes = np.concatenate([BOX, [[-1.5, -0.5, -0.5, 1.0], [1.0, -2.0, 1.3, -0.6]]])
    circles = np.array([[1.5, 1.2, 0.3], [-2.0, -1.2, 0.2]])
    made = Movers.none(1, 6)
    made.radii[:] = rng.uniform(0.1, 0.25, 6)
    for m in range(6):
        made.places[0, m] = 9.0 + 3.0 * m  # Out of the way of those that are put down first.
    for m in range(6):
        while True:
            made.places[0, m] = rng.uniform((-2.7, -1.7), (2.7, 1.7))
            if min(gaps(made, boxes, circles)) > 0.0:
                break
            made.places[0, m] = 9.0 + 3.0 * m
    speeds, headings = rng.uniform(0.2, 1.5, 6), rng.uniform(-np.pi, np.pi, 6)
    made.velocities[0] = speeds[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    seen = []
    for _ in range(4000):
        moved(made, 1, boxes, circles)
        assert min(gaps(made, boxes, circles)) > -1e-12
        seen.append(made.places[0].copy())
    np.testing.assert_allclose(np.hypot(*made.velocities[0].T), speeds, rtol=1e-9)
    assert np.ptp(seen, axis=0).min() > 1.0


def test_movers_that_are_not_there_neither_move_nor_block():
    """One of radius 0 stays where it is, and others pass through its place."""
    made = moved(movers((0.0, 0.0, 1.0, 0.0, 0.0), (-0.5, 0.0, 0.5, 0.0, 0.2)), 40)
    np.testing.assert_allclose(made.places[0], [[0.0, 0.0], [0.5, 0.0]], atol=1e-12)


def schedule(radius, distance=np.inf, begin=0.0, duration=np.inf):
    """Return the schedule of one mover of one robot."""
    values = (radius, distance, begin, duration, np.inf)
    return Schedules(*(np.array([[value]]) for value in values))


def present(made, plan, stamp, x=0.0, y=0.0, chosen=True):
    """Return the radius of the only mover at a time, after what is due."""
    motions = np.array([[x, y, 0.0, 0.0, 0.0]])
    come_and_go(motions, np.array([chosen]), np.array([stamp]), made, plan, 0.2)
    return float(made.radii[0, 0])


def test_a_mover_appears_at_its_time_and_vanishes_for_good():
    """From 1.0 s on it is there for 0.5 s, and does not come again."""
    made, plan = movers((2.0, 0.0, 0.0, 0.0, 0.0)), schedule(0.3, begin=1.0, duration=0.5)
    found = [present(made, plan, 0.1 * k) for k in range(40)]
    assert found == [0.0] * 10 + [0.3] * 5 + [0.0] * 25


def test_a_mover_appears_when_the_robot_is_near():
    """The distance is that from its edge; robots that stand still for good see nothing come."""
    made, plan = movers((2.0, 0.0, 0.0, 0.0, 0.0)), schedule(0.3, distance=1.0)
    assert present(made, plan, 0.0, x=0.69) == 0.0
    assert present(made, plan, 0.0, x=0.71, chosen=False) == 0.0
    assert present(made, plan, 0.0, x=0.71) == 0.3
    # It stays when the robot leaves.
    assert present(made, plan, 9.0, x=-2.0) == 0.3


def test_a_mover_does_not_appear_on_robots_and_movers():
    """It waits until its place is free, of the robot's disc and of other movers."""
    made, plan = movers((2.0, 0.0, 0.0, 0.0, 0.0)), schedule(0.3)
    assert present(made, plan, 0.0, x=1.51) == 0.0
    assert present(made, plan, 0.0, x=1.49) == 0.3
    made = movers((2.0, 0.0, 0.0, 0.0, 0.0), (2.5, 0.0, 0.0, 0.0, 0.25))
    plan = Schedules(*(np.repeat(array, 2, axis=1) for array in schedule(0.3)))
    assert present(made, plan, 0.0) == 0.0
    made.places[0, 1, 0] = 2.56
    assert present(made, plan, 0.0) == 0.3


def test_none_are_none_or_of_radius_zero():
    """Each robot has as many places as asked for, all of them empty and at rest, and its own."""
    assert [array.shape for array in Movers.none(3)] == [(3, 0, 2), (3, 0, 2), (3, 0)]
    movers = Movers.none(3, 2)
    assert [array.shape for array in movers] == [(3, 2, 2), (3, 2, 2), (3, 2)]
    assert all(array.dtype == np.float64 and not array.any() for array in movers)
    movers.places[0, 0] = 1.0
    assert not movers.velocities.any()


def test_schedules_of_none_never_begin():
    """Nothing is due, and no two arrays are one."""
    made = Schedules.none(2, 3)
    assert all(array.shape == (2, 3) for array in made)
    assert not made.radii.any()
    assert all(np.isinf(array).all() for array in made[1:])
    made.begins[0, 0] = 0.0
    assert np.isinf(made.ends).all()


def test_a_mover_on_a_course_is_none_of_these():
    """It would stand for ever: it is refused."""
    plan = MoverPlan(radius=0.3, place=(0.0, 0.0), course=((0, 0, 0), (1, 1, 0)))
    one = Mover((0.0, 0.0), (0.0, 0.0), plan)
    with pytest.raises(ValueError, match="expected none with a course, which fields of --task"):
        put_down(0, [one], Movers.none(1, 1), Schedules.none(1, 1), DT)
