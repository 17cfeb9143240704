"""The ground plane is found under trunks, and the pitch of a sensor is undone."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from traversability.levelling import ground_plane, levelled, tilt_of


def ground_with_trunks(tilt_deg, height=-0.7, seed=0):
    """Return tilted ground with trunks on it, and its rotation."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-8, 8, (8000, 2)), rng.normal(0, 0.02, 8000)])
    trunks = np.column_stack([rng.uniform(1, 3, (3000, 2)), rng.uniform(0, 2, 3000)])
    both = np.concatenate([points[np.hypot(*points[:, :2].T) > 0.7], trunks])
    turn = Rotation.from_euler("y", tilt_deg, degrees=True)
    return turn.apply(both + np.array([0, 0, height])).astype(np.float32), turn


@pytest.mark.parametrize("tilt", [0.0, 16.0, -25.0])
def test_the_tilt_of_the_ground_is_found_and_undone(tilt):
    """The levelled ground is z = 0, and distances are kept."""
    points, _ = ground_with_trunks(tilt)
    plane = ground_plane(points)
    assert np.rad2deg(tilt_of(plane[0])) == pytest.approx(abs(tilt), abs=1.5)
    flat = levelled(points, plane)
    again = ground_plane(flat)
    assert np.rad2deg(tilt_of(again[0])) < 0.7
    assert again[1] == pytest.approx(0.0, abs=0.03)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(flat[:50], axis=0), axis=1),
        np.linalg.norm(np.diff(points[:50], axis=0), axis=1),
        rtol=1e-4,
    )


def test_a_pivot_stays_over_the_same_ground():
    """The sensor keeps its x, its y and its distance from the ground."""
    points, turn = ground_with_trunks(25.0)
    sensor = np.array([0.3, -0.2, 0.1])
    flat = levelled(points + sensor.astype(np.float32), ground_plane(points + sensor), sensor)
    np.testing.assert_allclose(
        flat, turn.inv().apply(points) + np.array([0.3, -0.2, 0.7]), atol=0.12
    )


def test_too_few_points_have_no_ground():
    """Three points, or points out of range, make no plane."""
    assert ground_plane(np.zeros((3, 3), dtype=np.float32)) is None
    assert ground_plane(np.full((100, 3), 50.0, dtype=np.float32)) is None
