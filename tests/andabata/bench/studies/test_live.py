"""Live graph: delays and rates from receipt times."""

import numpy as np
import pytest

from andabata.bench.studies.live import delay_row, rate_rows


def test_delays_are_after_the_last_cloud_before_a_message():
    """Messages before the first cloud do not count."""
    clouds = np.array([1.0, 1.05, 1.10, 1.15])
    stamps = np.array([0.5, 1.01, 1.11, 1.21])
    row = delay_row("/cmd_vel", stamps, clouds)
    assert row["messages"] == 3
    assert row["rate [Hz]"] == pytest.approx(10.0)
    assert row["99 % of gaps [ms]"] == pytest.approx(100.0)
    assert row["median delay [ms]"] == pytest.approx(10.0)
    assert row["most [ms]"] == pytest.approx(60.0)


def test_rates_are_intervals_over_time():
    """Three messages in a second have two intervals."""
    assert rate_rows({"/imu": np.array([4.0, 4.5, 5.0])}) == [{"topic": "/imu", "rate [Hz]": 2.0}]
