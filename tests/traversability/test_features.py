"""The five features: known answers, and the compiled kernel against plain numpy."""

import numpy as np
import pytest

from traversability.features import cell_features
from traversability.grid import PolarGrid

GRID = PolarGrid()


def reference(points, grid):
    """Features by numpy's eigenvectors, cell by cell."""
    r = np.hypot(points[:, 0], points[:, 1])
    bearing = np.arctan2(points[:, 1], points[:, 0])
    ring = np.searchsorted(grid.ring_edges, r, side="right") - 1
    sector = np.minimum((bearing + np.pi) / (2 * np.pi) * grid.n_sectors, grid.n_sectors - 1)
    keep = (ring >= 0) & (ring < grid.n_rings) & (points[:, 2] <= grid.max_height)
    values = np.zeros((grid.n_sectors, grid.n_rings, 5))
    counts = np.zeros((grid.n_sectors, grid.n_rings), dtype=int)
    for s in range(grid.n_sectors):
        for k in range(grid.n_rings):
            cell = points[keep & (sector.astype(int) == s) & (ring == k)].astype(np.float64)
            counts[s, k] = len(cell)
            if len(cell) < 3:
                continue
            covariance = np.cov(cell.T, bias=True)
            eigenvalues, vectors = np.linalg.eigh(covariance)
            l3, l2, l1 = np.maximum(eigenvalues, 0)
            z = cell[:, 2]
            values[s, k] = np.sqrt(l3), abs(vectors[2, 0]), (l2 - l3) / l1, z.min(), np.ptp(z)
    return values, counts


def rough_ground(n=20_000, seed=0):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-11, 11, (n, 2))
    z = 0.2 * xy[:, 0] + np.sin(xy[:, 1]) * 0.3 + rng.normal(0, 0.05, n)
    return np.column_stack([xy, z]).astype(np.float32)


def test_kernel_equals_numpy():
    points = rough_ground()
    found = cell_features(points, GRID)
    values, counts = reference(points, GRID)
    np.testing.assert_array_equal(found.counts, counts)
    np.testing.assert_allclose(found.values, values, atol=1e-5)


def test_a_flat_plane_has_roughness_zero_and_orientation_one():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-10, 10, (20_000, 2)), np.full(20_000, -0.1)])
    found = cell_features(points.astype(np.float32), GRID)
    judged = found.counts >= 5
    np.testing.assert_allclose(found.values[judged][:, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.values[judged][:, 1], 1.0, atol=1e-6)
    np.testing.assert_allclose(found.values[judged][:, 3], -0.1, atol=1e-6)
    np.testing.assert_allclose(found.values[judged][:, 4], 0.0, atol=1e-6)


def test_a_wall_has_orientation_zero():
    rng = np.random.default_rng(0)
    points = np.column_stack(
        [np.full(500, 3.0), rng.uniform(-0.2, 0.2, 500), rng.uniform(0, 1.2, 500)]
    )
    found = cell_features(points.astype(np.float32), GRID)
    judged = found.counts >= 5
    np.testing.assert_allclose(found.values[judged][:, 1], 0.0, atol=1e-4)
    assert found.values[judged][:, 4].min() > 1.0


def test_features_do_not_change_when_the_robot_turns_by_a_sector():
    points = rough_ground(seed=1)
    angle = 2 * np.pi / GRID.n_sectors
    c, s = np.cos(angle), np.sin(angle)
    turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]], dtype=np.float32)
    before, after = cell_features(points, GRID), cell_features(turned.astype(np.float32), GRID)
    same = np.roll(before.counts, 1, axis=0) == after.counts
    assert same.mean() > 0.97  # Rounding moves points over edges here and there.
    difference = np.abs(np.roll(before.values, 1, axis=0) - after.values)[same]
    assert np.quantile(difference, 0.98) < 1e-4


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite_are_left_out(bad):
    points = rough_ground(2000)
    spoilt = points.copy()
    spoilt[::7, 2] = bad
    found = cell_features(spoilt, GRID)
    expected = cell_features(np.delete(points, np.s_[::7], axis=0), GRID)
    np.testing.assert_array_equal(found.counts, expected.counts)
    assert np.isfinite(found.values).all()


def test_the_input_is_not_changed_and_its_shape_is_checked():
    points = rough_ground(1000)
    copy = points.copy()
    cell_features(points, GRID)
    np.testing.assert_array_equal(points, copy)
    with pytest.raises(ValueError, match=r"expected shape \(n, 3\), got \(1000, 2\)"):
        cell_features(points[:, :2], GRID)
