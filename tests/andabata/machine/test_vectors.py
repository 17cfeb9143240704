"""Vectors of compiled code equal numpy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.vectors import added, axes_of, cross, dot, to_map


@pytest.fixture
def pair():
    return tuple(tuple(row) for row in np.random.default_rng(0).normal(size=(2, 3)).tolist())


def test_products_and_sums_are_numpys(pair):
    """Scalar and vector product, and a sum with a factor."""
    a, b = pair
    assert dot(a, b) == pytest.approx(np.dot(a, b))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b))
    np.testing.assert_allclose(added(a, b, -2.0), np.array(a) - 2.0 * np.array(b))


def test_axes_are_the_columns_of_the_rotation(pair):
    """A vector of the body is turned into the map as by scipy."""
    turn = Rotation.from_rotvec(pair[0])
    axes = axes_of(turn.as_quat())
    np.testing.assert_allclose(np.array(axes).T, turn.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(to_map(axes, *pair[1]), turn.apply(pair[1]), atol=1e-12)
