"""Laws of the cells' features: bounds, mirrored points, and points in any order."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.support.properties import law
from traversability.features import ALL_FEATURES, cell_features
from traversability.grid import PolarGrid

GRID = PolarGrid()


def column(found, name):
    """Return one feature of the cells that have enough points."""
    return found.values[..., ALL_FEATURES.index(name)][found.counts >= 3]


@st.composite
def clouds(draw):
    """Return points around the robot, up to a metre above and below its base."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(50, 2000))
    reach = draw(st.floats(1.0, 12.0, allow_subnormal=False))
    points = rng.uniform([-reach, -reach, -1.0], [reach, reach, 1.0], (count, 3))
    return points.astype(np.float32)


@law
@given(clouds())
def test_features_are_within_their_bounds(points):
    """Orientation and planarity are shares, roughness and height differences no less than zero."""
    found = cell_features(points, GRID)
    assert np.isfinite(found.values).all()
    for name in ("orientation", "planarity"):
        values = column(found, name)
        assert (values >= -1e-6).all(), name
        assert (values <= 1 + 1e-5).all(), name
    for name in ("roughness", "height_difference"):
        assert (column(found, name) >= 0).all(), name


@law
@given(clouds(), st.randoms(use_true_random=False))
def test_the_order_of_the_points_is_no_matter(points, random):
    """But for rounding of the sums."""
    order = list(range(len(points)))
    random.shuffle(order)
    first, other = cell_features(points, GRID), cell_features(points[order], GRID)
    np.testing.assert_array_equal(first.counts, other.counts)
    for name in ("roughness", "orientation", "min_height", "height_difference"):
        np.testing.assert_allclose(column(first, name), column(other, name), atol=2e-3)


@law
@given(clouds())
def test_mirrored_points_have_mirrored_cells(points):
    """Left and right are described alike: no feature knows a side."""
    mirrored = points * np.array([1, -1, 1], dtype=np.float32)
    first, other = cell_features(points, GRID), cell_features(mirrored, GRID)
    np.testing.assert_array_equal(first.counts, other.counts[::-1])
    for name in ("roughness", "orientation", "min_height", "height_difference"):
        k = ALL_FEATURES.index(name)
        enough = first.counts >= 3
        a, b = first.values[..., k][enough], other.values[::-1][..., k][enough]
        np.testing.assert_allclose(a, b, atol=2e-3)
