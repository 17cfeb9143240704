"""Slanted edges: signed distances by geometry, holes, overlaps, walls without thickness."""

import numpy as np
import pytest

from worlds.rooms.edges import edge_clearances, outline_edges

DIAMOND = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
DEEP = np.sqrt(0.5)


def clearance(outlines, *points):
    """Return the signed distance of points to outlines [m]."""
    found = np.full(len(points), np.inf)
    edge_clearances(np.array(points, dtype=float), outline_edges(outlines), found)
    return found


def test_edges_close_the_outline():
    """Each corner begins an edge, and the last one ends at the first corner."""
    np.testing.assert_array_equal(
        outline_edges([DIAMOND[:3]]), [[1, 0, 0, 1], [0, 1, -1, 0], [-1, 0, 1, 0]]
    )
    assert outline_edges([]).shape == (0, 4)


def test_the_distance_is_that_to_edges_and_corners_and_negative_inside():
    """A diamond's middle is as deep as its edges are far; before a corner the corner counts."""
    found = clearance([DIAMOND], (0, 0), (1, 1), (3, 0), (0.5, 0.25), (0.75, 0.75))
    np.testing.assert_allclose(found, [-DEEP, DEEP, 2.0, -0.25 * DEEP, 0.5 * DEEP])


def test_the_height_of_a_corner_does_not_confuse_inside_and_outside():
    """Points level with corners, on either side, are what they are, mirrored outlines too."""
    for outline in (DIAMOND, DIAMOND[::-1], np.array(DIAMOND)[:, ::-1].tolist()):
        points = [(-0.5, 0.0), (-2, 0), (2, 0), (-2, 1), (2, 1), (-2, -1), (2, -1)]
        np.testing.assert_array_equal(clearance([outline], *points) < 0, [True] + 6 * [False])


def test_what_overlaps_is_solid_together():
    """Where two outlines overlap is no hole."""
    shifted = [(x + 0.5, y) for x, y in DIAMOND]
    assert clearance([DIAMOND, shifted], (0.25, 0.0))[0] < 0


def test_a_clockwise_outline_inside_another_is_a_hole():
    """In the hole a point is free, as far from its edges as geometry says."""
    hole = [(x / 2, y / 2) for x, y in reversed(DIAMOND)]
    found = clearance([DIAMOND, hole], (0.0, 0.0), (0.8, 0.0))
    np.testing.assert_allclose(found, [0.5 * DEEP, -0.2 * DEEP])


def test_two_corners_are_a_wall_without_inside():
    """Points on both sides of it are outside, at their distance."""
    wall = [(0.0, 0.0), (2.0, 2.0)]
    np.testing.assert_allclose(clearance([wall], (0, 2), (2, 0), (3, 3)), np.sqrt(2))


def test_clearance_is_lowered_never_raised():
    """What was nearer stays."""
    found = np.array([0.1])
    edge_clearances(np.array([[3.0, 0.0]]), outline_edges([DIAMOND]), found)
    assert found[0] == 0.1


@pytest.mark.parametrize("outline", [[(0, 0)], [(0, 0), (0, 0), (1, 1)], [(0, 0), (1, 1), (0, 0)]])
def test_what_encloses_nothing_is_refused(outline):
    """One corner, or the same one twice in a row, is an error that shows the outline."""
    with pytest.raises(ValueError, match="2 or more different corners"):
        outline_edges([outline])
