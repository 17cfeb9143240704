"""Principal axes against numpy, and known answers."""

import numpy as np
import pytest

from traversability.cells.covariance import Covariance, eigenvalues, normal_z_squared


def covariance_of(matrix):
    """Return a symmetric 3 x 3 matrix as the kernels take it."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = matrix.tolist()
    return Covariance(xx, yy, zz, xy, xz, yz)


@pytest.mark.parametrize("seed", range(20))
def test_eigenvalues_and_normal_are_numpys(seed):
    """The largest comes first, and the normal is the eigenvector of the smallest."""
    points = np.random.default_rng(seed).normal(size=(9, 3)) * [3.0, 1.0, 0.2]
    turn, _ = np.linalg.qr(np.random.default_rng(seed + 100).normal(size=(3, 3)))
    matrix = np.cov((points @ turn).T, bias=True)
    values, vectors = np.linalg.eigh(matrix)
    found = eigenvalues(covariance_of(matrix))
    np.testing.assert_allclose(found, values[::-1], rtol=1e-7)
    expected = vectors[2, 0] ** 2
    assert normal_z_squared(covariance_of(matrix), found) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    ("diagonal", "normal"),
    [
        ((4.0, 1.0, 0.0), 1.0),
        ((0.0, 1.0, 4.0), 0.0),
        ((4.0, 0.0, 0.0), 0.0),
        ((2.0, 2.0, 2.0), 0.0),
    ],
)
def test_planes_lines_and_balls_have_known_axes(diagonal, normal):
    """Level ground has a vertical normal, a wall a level one, a line and a ball none."""
    covariance = covariance_of(np.diag(diagonal))
    found = eigenvalues(covariance)
    np.testing.assert_allclose(found, sorted(diagonal, reverse=True), atol=1e-12)
    assert normal_z_squared(covariance, found) == pytest.approx(normal, abs=1e-12)
