"""Laws of the polar grid: a point is in the cell that bearing and distance say, turned or not."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.support.properties import law
from traversability.features import cell_features
from traversability.grid import PolarGrid

grids = st.builds(
    PolarGrid,
    n_sectors=st.integers(4, 72),
    n_rings=st.integers(1, 20),
    inner_radius=st.floats(0.2, 2.0, allow_subnormal=False),
    outer_radius=st.floats(5.0, 30.0, allow_subnormal=False),
)
"""Grids of any shape."""


@st.composite
def placed_points(draw, most=60):
    """Return a grid, points well inside of its cells, and the sector and ring of each."""
    grid = draw(grids)
    count, seed = draw(st.integers(1, most)), draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    sectors = rng.integers(0, grid.n_sectors, count)
    rings = rng.integers(0, grid.n_rings, count)
    bearings = -np.pi + (sectors + rng.uniform(0.1, 0.9, count)) * 2 * np.pi / grid.n_sectors
    near, far = grid.ring_edges[rings], grid.ring_edges[rings + 1]
    distances = near + rng.uniform(0.1, 0.9, count) * (far - near)
    places = [distances * np.cos(bearings), distances * np.sin(bearings), np.zeros(count)]
    return grid, np.column_stack(places).astype(np.float32), sectors, rings


def counts_of(grid, sectors, rings):
    """Return how many points are in each cell."""
    found = np.zeros((grid.n_sectors, grid.n_rings), dtype=np.int32)
    np.add.at(found, (sectors, rings), 1)
    return found


@law
@given(placed_points())
def test_a_point_is_counted_in_its_cell(placed):
    """In any grid, and in no other cell; the order of the points is no matter."""
    grid, points, sectors, rings = placed
    expected = counts_of(grid, sectors, rings)
    np.testing.assert_array_equal(cell_features(points, grid).counts, expected)
    np.testing.assert_array_equal(cell_features(points[::-1].copy(), grid).counts, expected)


@law
@given(placed_points(), st.integers(0, 71))
def test_points_that_turn_by_sectors_turn_the_cells(placed, turn):
    """By as many sectors, rings as they are."""
    grid, points, sectors, rings = placed
    angle = turn * 2 * np.pi / grid.n_sectors
    sine, cosine = np.sin(angle), np.cos(angle)
    x, y, z = points.T.astype(np.float64)
    turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y, z])
    found = cell_features(turned.astype(np.float32), grid).counts
    np.testing.assert_array_equal(found, np.roll(counts_of(grid, sectors, rings), turn, axis=0))


@law
@given(placed_points(), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_points_that_are_no_places_count_nowhere(placed, value):
    """Not finite in any coordinate, nearer than the first ring, or beyond the last one."""
    grid, points, sectors, rings = placed
    wrong = np.tile(points[:1], (5, 1))
    wrong[range(3), range(3)] = value
    wrong[3], wrong[4] = 0.0, (2 * grid.outer_radius, 0.0, 0.0)
    found = cell_features(np.concatenate([wrong, points]), grid).counts
    np.testing.assert_array_equal(found, counts_of(grid, sectors, rings))
