"""Free space grid: what came, what stands, and of what nothing is known."""

import numpy as np
import pytest

from andabata.navigation.free_space_grid import (
    CAME,
    HEIGHT,
    KIND,
    STAMP,
    STANDS,
    UNKNOWN,
    FreeSpaceConfig,
    FreeSpaceGrid,
    Rays,
    X,
)

HERE = np.zeros(3)
EYE = 0.7
WALL, BODY = 4.1, 2.1
"""Distances along x of what stands behind, and of what may be before it [m]."""


def look(grid, ends, stamp, is_return=True, base=HERE):
    """Return the returns of one look with beams to some ends from the laser over a base."""
    ends = np.array(ends, dtype=np.float32).reshape(-1, 3)
    stamps, met = np.full(len(ends), stamp), np.full(len(ends), is_return)
    return grid.update(Rays(base + np.array([0.0, 0.0, EYE]), ends, stamps, met), base)


def scene(distance, slope=0.0):
    """Return ends of beams: ground on the way, and a post of 1.4 m at a distance along x."""
    ground = [(x, 0.1, slope * x) for x in np.arange(0.7, distance, 0.1)]
    return ground + [(distance, 0.1, slope * distance + h) for h in np.arange(0.0, 1.4, 0.1)]


def ground():
    """Return ends of beams on bare ground, which pass nothing 2 m away at body height."""
    return [(x, 0.1, 0.0) for x in np.arange(0.7, 2.5, 0.1)]


def seen(grid, *stamps, distance=WALL, slope=0.0):
    """Look at a scene at some times."""
    for stamp in stamps:
        look(grid, scene(distance, slope), stamp)


def kinds(returns, distance=BODY):
    """Return the kinds of the returns at a distance along x."""
    return set(returns[np.abs(returns[:, X] - distance) < 0.1, KIND].tolist())


def grid(**settings):
    return FreeSpaceGrid(FreeSpaceConfig(**{"min_looks": 3, "passing_stride": 1, **settings}))


def test_a_return_from_where_beams_passed_came():
    """Three looks make a place free; two do not, nor do many beams of one look."""
    free, fresh = grid(), grid()
    seen(free, 0.0, 0.1, 0.2)
    seen(fresh, 0.0, 0.1)
    for _ in range(5):
        seen(fresh, 0.1)
    assert kinds(look(free, scene(BODY), 0.3)) == {CAME}
    assert kinds(look(fresh, scene(BODY), 0.3)) == {UNKNOWN}


def test_what_was_there_before_stands():
    """It is unknown at the first look and stands from then on, though beams pass it meanwhile."""
    remembers = grid(standing_memory=8.0)
    assert kinds(look(remembers, scene(BODY), 0.0)) == {UNKNOWN}
    assert kinds(look(remembers, scene(BODY), 0.1)) == {STANDS}
    seen(remembers, 1.0, 2.0, 3.0, 4.0)
    assert kinds(look(remembers, scene(BODY), 5.0)) == {STANDS}


def test_what_has_left_leaves_a_free_place():
    """After the memory of what stood, three looks through a place make it free."""
    forgets = grid(standing_memory=2.0)
    look(forgets, scene(BODY), 0.0)
    seen(forgets, 2.5, 2.6, 2.7)
    assert kinds(look(forgets, scene(BODY), 2.8)) == {CAME}


def test_beside_what_stands_no_place_becomes_free():
    """A post that is seen one cell nearer because the pose drifts has not come."""
    drifting = grid()
    for stamp in (0.0, 0.1, 0.2, 0.3):
        seen(drifting, stamp)
        look(drifting, [(WALL + 1.0, 0.1, 0.9)], stamp + 0.05)
    assert CAME not in kinds(look(drifting, scene(WALL - 0.2), 0.4), WALL - 0.2)


def test_what_came_counts_as_long_as_it_stays_and_then_stands():
    """Until the parking time all its returns came."""
    parked = grid(parking_time=1.0)
    seen(parked, 0.0, 0.1, 0.2)
    for stamp in (0.3, 0.7, 1.2):
        assert kinds(look(parked, scene(BODY), stamp)) == {CAME}
    assert kinds(look(parked, scene(BODY), 1.4)) == {STANDS}


def test_what_came_and_went_leaves_a_free_place_at_once():
    """One look through the place is enough, and the next one comes anew."""
    passing = grid(parking_time=1.0)
    seen(passing, 0.0, 0.1, 0.2)
    look(passing, scene(BODY), 0.3)
    seen(passing, 0.4)
    assert kinds(look(passing, scene(BODY), 1.6)) == {CAME}


def test_places_that_something_came_to_and_left_are_known_for_a_while():
    """Not while it is there, not where it never was, and not for ever."""
    left = grid(left_time=2.0)
    seen(left, 0.0, 0.1, 0.2)
    look(left, scene(BODY), 0.3)
    assert not len(left.left_places())
    seen(left, 0.4)
    np.testing.assert_allclose(left.left_places(), [(2.1, 0.1)])
    look(left, scene(BODY), 0.5)
    assert not len(left.left_places())
    seen(left, 0.6, 2.5)
    assert len(left.left_places()) == 1
    seen(left, 2.7)
    assert not len(left.left_places())


def test_cells_that_a_body_came_to_are_found_along_its_trail():
    """Within the distance that counts, while it is there; never what stands."""
    came = grid(parking_time=1.0)
    seen(came, 0.0, 0.1, 0.2)
    look(came, scene(BODY), 0.3)
    beside, on_it = np.array([[2.1, 1.1, 3.1, 1.1, 0.9]]), np.array([[1.0, 0.1, 3.0, 0.1, 0.05]])
    short, far = np.array([[1.0, 0.1, 1.5, 0.1, 0.3]]), np.array([[2.1, 1.1, 2.1, 1.1, 1.1]])
    np.testing.assert_allclose(came.cells_that_came(on_it), [(2.1, 0.1)])
    np.testing.assert_allclose(came.cells_that_came(far), [(2.1, 0.1)])
    for trail in (beside, short, np.empty((0, 5))):
        assert came.cells_that_came(trail).shape == (0, 2)
    wall = np.array([[WALL, 0.1, WALL, 0.1, 0.5]])
    assert not len(came.cells_that_came(wall))
    seen(came, 0.4)
    assert not len(came.cells_that_came(on_it))


def test_what_parks_is_no_cell_that_something_came_to():
    """After its time it stands, whatever track is over it."""
    parked = grid(parking_time=1.0)
    seen(parked, 0.0, 0.1, 0.2)
    on_it = np.array([[BODY, 0.1, BODY, 0.1, 0.3]])
    for stamp, count in ((0.3, 1), (1.2, 1), (1.4, 0)):
        look(parked, scene(BODY), stamp)
        assert len(parked.cells_that_came(on_it)) == count


def test_free_places_are_forgotten():
    """Longer than the memory without a beam nothing is known of a place."""
    old = grid(memory=1.0)
    seen(old, 0.0, 0.1, 0.2)
    assert kinds(look(old, scene(BODY), 1.3)) == {UNKNOWN}


@pytest.mark.parametrize("slope", [-0.3, 0.3])
def test_heights_are_over_the_ground(slope):
    """On a slope a post of 1.4 m has the heights that it has on flat ground, and grass none."""
    sloped = grid()
    seen(sloped, 0.0, slope=slope)
    returns = look(sloped, scene(BODY, slope), 0.1)
    body = returns[np.abs(returns[:, X] - BODY) < 0.1]
    # The lowest ground of the next cells counts.
    assert 1.25 < body[:, HEIGHT].max() < 1.3 + 0.3 * 0.4
    low = [*scene(BODY, slope)[:-12], (BODY, 0.1, slope * BODY + 0.15)]
    assert not kinds(look(sloped, low, 0.2))


def test_beams_over_a_body_do_not_pass_it():
    """What is seen 2 m over the ground says nothing of what walks there."""
    above = grid()
    for stamp in (0.0, 0.1, 0.2, 0.3):
        look(above, [*ground(), (4.2, 0.1, 3.3)], stamp)
    assert kinds(look(above, scene(BODY), 0.4)) == {UNKNOWN}


def test_beams_without_a_return_pass_all_the_way_and_return_nothing():
    """Their ends are no returns, and places up to them become free."""
    open_ground = grid()
    for stamp in (0.0, 0.1, 0.2):
        look(open_ground, ground(), stamp)
        assert not len(look(open_ground, [(7.0, 0.1, EYE)], stamp + 0.05, is_return=False))
    assert kinds(look(open_ground, scene(BODY), 0.3)) == {CAME}


def test_returns_keep_their_times_and_the_grid_follows_the_robot():
    """Stamps of any origin do, and far away everything is unknown again."""
    moved = grid()
    seen(moved, 1e6, 1e6 + 0.1, 1e6 + 0.2)
    returns = look(moved, scene(BODY), 1e6 + 0.3)
    assert set(returns[:, STAMP].tolist()) == {1e6 + 0.3}
    far = np.array([1000.0, 0.0, 0.0])
    there = np.array(scene(BODY)) + far
    assert set(look(moved, there, 1e6 + 0.4, base=far)[:, KIND].tolist()) == {UNKNOWN}
    moved.reset()
    assert kinds(look(moved, scene(BODY), 0.0)) == {UNKNOWN}
    nothing = Rays(HERE, np.empty((0, 3), np.float32), np.empty(0), np.empty(0, np.bool_))
    assert moved.update(nothing, HERE).shape == (0, 5)


def test_ground_that_no_beam_reaches_is_as_high_as_the_robot_stands():
    """Beside the robot a walker comes to free places; farther away nothing is known of them."""
    base = np.array([0.0, 0.0, 5.0])
    for distance, kind in ((1.3, CAME), (2.5, UNKNOWN)):
        free = grid()
        for k in range(3):
            look(free, [(6.0, 0.1, 5.0 + EYE)], 0.1 * k, is_return=False, base=base)
        body = [(distance, 0.1, 5.0 + height) for height in np.arange(0.4, 1.2, 0.1)]
        returns = look(free, body, 0.3, base=base)
        assert set(returns[:, KIND].tolist()) == {kind}
    returns = look(grid(), [(1.3, 0.1, 5.9)], 0.0, base=base)
    assert returns[:, HEIGHT].tolist() == pytest.approx([0.9], abs=1e-6)
