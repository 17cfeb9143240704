"""The part of the ground around a robot has the heights of the whole."""

import pytest

from andabata.machine.ground_window import REACH, ground_around, has_left


def test_a_window_reaches_eight_metres_and_has_the_grounds_heights(make_ground):
    """Its middle is where it says, and its corners are the ground's nodes."""
    ground = make_ground(lambda x, y: 0.3 * x - 0.1 * y, size=60.0, cell=0.5).ground
    part, (x, y) = ground_around(ground, 4.1, -7.3)
    assert part.cell == ground.cell
    assert part.width >= 2 * REACH
    assert part.depth >= 2 * REACH
    assert x == pytest.approx(4.1, abs=0.5)
    assert y == pytest.approx(-7.3, abs=0.5)
    for dx, dy in ((0.0, 0.0), (3.0, -6.0), (-7.9, 7.9)):
        here = part.height_at(dx, dy)
        assert here == pytest.approx(ground.height_at(x + dx, y + dy), abs=1e-4)


def test_at_the_border_it_ends_with_the_ground(make_ground):
    """A corner of it is the ground's own; beyond the ground one cell is left."""
    ground = make_ground(size=30.0, cell=0.5).ground
    part, (x, y) = ground_around(ground, 14.0, 14.0)
    assert x + part.width / 2 == pytest.approx(15.0)
    assert y + part.depth / 2 == pytest.approx(15.0)
    assert ground_around(ground, 40.0, 40.0)[0].heights.shape == (2, 2)


def test_four_metres_from_its_middle_it_is_left():
    """Along either axis, in either direction."""
    middle = (2.0, -1.0)
    assert not has_left(middle, 5.9, -4.9)
    for x, y in ((6.1, -1.0), (-2.1, -1.0), (2.0, 3.1), (2.0, -5.1)):
        assert has_left(middle, x, y)
