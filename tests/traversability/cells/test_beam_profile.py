"""Gaps and rises along the beams: known answers for sums written by hand."""

import numpy as np
import pytest

from traversability.binning import COUNT, FURTHEST, HIGHEST, LOWEST, NEAREST, X, Y, Z
from traversability.cells import columns
from traversability.cells.beam_profile import beam_gaps, compare_with_ring, profile
from traversability.cells.columns import MAX_SLOPE, MIN_DESCRIBED

RINGS = 5
MIDDLES = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
BEARING = 0.4


def sums_of(points):
    """Return sums of two sectors with points: half sector, half ring, distance and height [m]."""
    sums = np.zeros((4, 2 * RINGS, 14))
    sums[..., NEAREST] = np.inf
    for i, j, r, z in points:
        quarter = sums[i, j]
        quarter[LOWEST] = z if quarter[COUNT] == 0 else min(quarter[LOWEST], z)
        quarter[HIGHEST] = z if quarter[COUNT] == 0 else max(quarter[HIGHEST], z)
        quarter[COUNT] += 1
        quarter[[X, Y, Z]] += r * np.cos(BEARING), r * np.sin(BEARING), z
        quarter[NEAREST] = min(quarter[NEAREST], r * r)
        quarter[FURTHEST] = max(quarter[FURTHEST], r * r)
    return sums


def gaps(points, sector=0, ring=2):
    out = np.full(44, np.nan, dtype=np.float32)
    beam_gaps(sums_of(points), sector, ring, MIDDLES, out)
    return out


def test_a_gap_behind_is_a_share_of_the_distance_at_which_it_begins():
    """From the last point of the cell to the next one outwards; the worst and the mean column."""
    left = [(0, 4, 2.5, 0.0), (0, 5, 3.0, 0.0), (0, 8, 4.5, 0.0)]
    right = [(1, 4, 2.6, 0.0), (1, 5, 2.7, 0.0), (1, 6, 2.97, 0.0)]
    found = gaps(left + right)
    assert found[columns.GAP_AFTER] == pytest.approx(1.5 / 3.0)
    assert found[columns.GAP_AFTER_MEAN] == pytest.approx((0.5 + 0.1) / 2)
    assert found[columns.DEPTH] == pytest.approx(3.0 - 2.5)


def test_without_points_behind_a_gap_is_as_large_as_they_get():
    """The last ring, or nothing any more."""
    assert gaps([(0, 4, 2.5, 0.0)])[columns.GAP_AFTER] == MAX_SLOPE
    assert gaps([(1, 9, 5.2, 0.0)], ring=4)[columns.GAP_AFTER_MEAN] == MAX_SLOPE


def test_a_larger_gap_within_the_cell_counts():
    """Between its inner and its outer quarter."""
    found = gaps([(0, 4, 2.5, 0.0), (0, 5, 3.1, 0.0), (0, 6, 3.2, 0.0)])
    assert found[columns.GAP_AFTER] == pytest.approx(0.6 / 3.1)


def test_a_gap_before_is_a_share_of_the_distance_at_which_it_ends():
    """From the last point inwards, or from the middle of the first ring; none is negative."""
    assert gaps([(0, 1, 1.4, 0.0), (0, 5, 2.8, 0.0)])[columns.GAP_BEFORE] == pytest.approx(0.5)
    assert gaps([(0, 5, 2.5, 0.0)])[columns.GAP_BEFORE] == pytest.approx(0.6)
    assert gaps([(0, 0, 0.8, 0.0)], ring=0)[columns.GAP_BEFORE] == 0.0


def test_the_sector_is_that_of_the_cell():
    """Points of another sector are of no beam of this one."""
    other = [(2, 4, 2.5, 0.0), (2, 6, 3.0, 0.0)]
    assert gaps([(0, 4, 2.5, 0.0), *other])[columns.GAP_AFTER] == MAX_SLOPE
    assert gaps(other, sector=1)[columns.GAP_AFTER] == pytest.approx(0.2)


def rises(levels, described=None, ring=2):
    """Return the profile of a sector whose cells have one mean point each, at heights [m]."""
    points = [(0, 2 * k, MIDDLES[k], z) for k, z in enumerate(levels) if z is not None]
    counts = np.zeros((2, RINGS), dtype=np.int32)
    for k, z in enumerate(levels):
        counts[0, k] = 0 if z is None else MIN_DESCRIBED
    for k in described or ():
        counts[0, k] = MIN_DESCRIBED - 1
    out = np.full(44, np.nan, dtype=np.float32)
    profile(sums_of(points), counts, 0, ring, MIDDLES, out)
    names = (columns.RISE_BEFORE, columns.RISE_AFTER, columns.BEND, columns.DISTANCE)
    return out[list(names)].tolist()


def test_rises_are_slopes_to_the_neighbours_and_the_bend_departs_from_the_one_before():
    """Up 0.1, up 0.3, down 0.2 in steps of a metre."""
    found = rises([0.0, 0.1, 0.4, 0.2, None])
    assert found == pytest.approx([0.3, -0.2, 0.4 - 0.1 - 0.1, 3.0])


def test_cells_of_too_few_points_are_passed_over():
    """The neighbours are two metres away; the one before the last is next to it."""
    assert rises([0.0, 0.1, 0.4, 0.2, 1.0], described=[1, 3]) == pytest.approx([0.2, 0.3, 0.0, 3.0])


def test_at_the_ends_there_is_no_rise():
    """The first cell has none before it, the last one none behind."""
    assert rises([0.0, 0.5, None, None, None], ring=0) == pytest.approx([0.0, 0.5, 0.0, 1.0])
    assert rises([None, None, None, 0.5, 0.0], ring=4) == pytest.approx([-0.5, 0.0, 0.0, 5.0])


def test_rises_are_limited_and_so_is_the_slope_that_bends():
    """A wall of 9 m; before it a slope of 2, of which 1 counts."""
    before, after, bend, _ = rises([0.0, 2.0, 11.0, 0.0, None])
    assert (before, after) == (MAX_SLOPE, -MAX_SLOPE)
    assert bend == pytest.approx(9.0 - 1.0)


def test_gaps_are_compared_with_those_of_the_ring():
    """The upper median of described cells is taken off; what it was stands beside it."""
    counts = np.full((5, 2), MIN_DESCRIBED, dtype=np.int32)
    counts[4, 0] = MIN_DESCRIBED - 1
    values = np.zeros((5, 2, 44), dtype=np.float32)
    values[:, 0, columns.GAP_AFTER] = [0.4, 0.1, 0.3, 0.2, 9.0]
    values[:, 0, columns.GAP_AFTER_MEAN] = [0.2, 0.2, 0.1, 0.6, 9.0]
    values[:, 0, columns.GAP_BEFORE] = [0.5, 0.7, 0.6, 0.4, 9.0]
    compare_with_ring(counts, values)
    inner = values[:4, 0]
    assert inner[:, columns.GAP_AFTER] == pytest.approx(np.array([0.1, -0.2, 0.0, -0.1]))
    assert inner[:, columns.GAP_AFTER_MEAN] == pytest.approx(np.array([0.0, 0.0, -0.1, 0.4]))
    assert inner[:, columns.GAP_BEFORE] == pytest.approx(np.array([-0.1, 0.1, 0.0, -0.2]))
    assert inner[:, columns.SPACING] == pytest.approx(np.full(4, 0.2))
    assert values[4, 0, columns.GAP_AFTER] == 9.0


def test_what_is_seen_beyond_is_the_share_of_sectors_with_cells_further_out():
    """Outermost nothing; further in each sector counts once."""
    counts = np.zeros((4, 3), dtype=np.int32)
    counts[:, 0], counts[:2, 1], counts[1:3, 2] = MIN_DESCRIBED, MIN_DESCRIBED, MIN_DESCRIBED
    values = np.zeros((4, 3, 44), dtype=np.float32)
    compare_with_ring(counts, values)
    seen = values[..., columns.SEEN_BEYOND]
    assert seen[:, 0].tolist() == [0.75] * 4
    assert seen[:2, 1].tolist() == [0.5] * 2
    assert seen[1:3, 2].tolist() == [0.0] * 2
