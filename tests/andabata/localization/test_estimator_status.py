"""Status of an estimator: uncertainty of place and heading, causes and counts in words."""

import numpy as np
import pytest

from andabata.localization.estimator_status import (
    EstimatorStatus,
    error_ellipse,
    heading_sector,
    without_numbers,
)
from andabata.localization.localizer import Health


def status(covariance=None, **fields):
    """Return a status with a covariance."""
    covariance = np.diag([1.0, 4.0, 9.0, 0.1, 0.2, 0.25]) if covariance is None else covariance
    return EstimatorStatus(Health.DEGRADED, fields.pop("causes", ()), covariance, **fields)


def test_the_sigma_of_the_position_is_the_longest_half_axis():
    """It does not depend on the direction of the ellipse, nor on the height."""
    assert status().position_sigma == pytest.approx(2.0)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = np.diag([0.0, 0.0, 9.0, 0.1, 0.2, 0.25])
    turned[:2, :2] = np.array([[c, -s], [s, c]]) @ np.diag([1.0, 4.0]) @ np.array([[c, s], [-s, c]])
    assert status(turned).position_sigma == pytest.approx(2.0)


def test_heading_and_plane_are_taken_from_their_rows():
    """Yaw is the last of six."""
    assert status().yaw_sigma == pytest.approx(0.5)
    np.testing.assert_array_equal(status().planar_covariance, np.diag([1.0, 4.0, 0.25]))


def test_causes_and_unused_readings_are_text():
    """Causes share a line; a sensor has a line with all its reasons."""
    words = status(
        causes=("imu: silent for 1.0 s", "gnss: not accepted for 9.0 s"),
        unused={"compass": {"beyond the gate": 12, "invalid": 3}, "gnss": {"too late": 1}},
    )
    assert words.cause == "imu: silent for 1.0 s; gnss: not accepted for 9.0 s"
    assert words.unused_in_words == ["compass: 12 beyond the gate, 3 invalid", "gnss: 1 too late"]
    assert status().cause == ""


def test_every_point_of_the_ellipse_is_two_sigma_away():
    """By its own covariance, correlated or not, counter-clockwise."""
    covariance = np.array([[2.0, 0.9], [0.9, 1.0]])
    rim = error_ellipse(covariance, 20)
    distances = np.einsum("ki,ij,kj->k", rim, np.linalg.inv(covariance), rim)
    np.testing.assert_allclose(distances, 4.0)
    x, y = rim.T
    assert np.all(x * np.roll(y, -1) - y * np.roll(x, -1) > 0)


def test_a_heading_that_is_unknown_is_a_whole_turn():
    """Never more, however large its sigma."""
    tip, *arc = heading_sector(0.3, 10.0)
    assert tip.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(arc[0], arc[-1], atol=1e-12)
    np.testing.assert_allclose(np.hypot(*np.array(arc).T), 2.5)


@pytest.mark.parametrize(
    ("cause", "kind"),
    [
        ("gnss: not accepted for 9.0 s, no valid reading arrives", "gnss: not accepted"),
        ("heading: uncertain by 40 degrees, limit 20", "heading: uncertain"),
        ("imu: silent for 1.0 s", "imu: silent"),
        ("imu: repeats its last row, for 1.0 s", "imu: repeats its last row"),
        ("gnss: off by 110 m, farther than the robot can have driven", "gnss: off"),
    ],
)
def test_causes_of_a_kind_are_alike_without_their_numbers(cause, kind):
    """They can be counted."""
    assert without_numbers(cause) == kind
