"""Rows in place of a silent inertial unit."""

import numpy as np
import pytest

from andabata.localization.inertial_bridge import bridging_rows

BIAS = np.array([0.01, -0.02, 0.03])
NO_WHEELS = np.empty((0, 3))


def test_a_short_gap_has_a_row_each_tick_between_its_ends():
    """A tenth of a second at 100 Hz: nine rows, without a force, at the bias of the gyro."""
    rows = bridging_rows(5.0, 5.1, BIAS, NO_WHEELS, 0.1)
    np.testing.assert_allclose(rows[:, 0], 5.0 + np.arange(1, 10) / 100)
    np.testing.assert_allclose(rows[:, 1:4], np.tile(BIAS, (9, 1)))
    assert np.isnan(rows[:, 4:]).all()


def test_a_long_gap_has_no_more_than_a_hundred_rows():
    """A minute is bridged in as many steps as a second, up to its end."""
    rows = bridging_rows(0.0, 60.0, BIAS, NO_WHEELS, 0.1)
    assert 99 <= len(rows) <= 100
    assert 59.0 < rows[-1, 0] < 60.0


@pytest.mark.parametrize(("left", "right", "rate"), [(1.0, 3.0, 0.2), (3.0, 1.0, -0.2)])
def test_the_wheels_tell_the_yaw_rate(left, right, rate):
    """The difference of their mean speeds, right less left, times what one makes."""
    wheels = np.array([[0.01, left, right], [0.02, left, right]])
    rows = bridging_rows(0.0, 0.1, BIAS, wheels, 0.1)
    np.testing.assert_allclose(rows[:, 3] - BIAS[2], rate)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30, -501.0])
def test_damaged_rows_of_the_wheels_count_as_none(bad):
    """As if they had not arrived: a recording may leave them out."""
    wheels = np.array([[0.01, 1.0, 3.0], [0.02, bad, 3.0], [0.03, 1.0, bad], [0.04, 2.0, 3.0]])
    rows = bridging_rows(0.0, 0.1, BIAS, wheels, 0.1)
    np.testing.assert_array_equal(rows, bridging_rows(0.0, 0.1, BIAS, wheels[[0, 3]], 0.1))
    lost = bridging_rows(0.0, 0.1, BIAS, wheels[1:3], 0.1)
    np.testing.assert_allclose(lost[:, 3], BIAS[2])
