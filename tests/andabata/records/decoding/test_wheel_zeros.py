"""Zeros of another publisher between the speeds of wheels."""

import numpy as np
import pytest

from andabata.records.decoding.wheel_zeros import zeros_between


def rows(speeds, step=0.01):
    """Return rows of equal speeds of both sides."""
    speeds = np.asarray(speeds, dtype=float)
    return np.column_stack([np.arange(len(speeds)) * step, speeds, speeds])


@pytest.mark.parametrize(
    ("speeds", "expected"),
    [
        ([3, 0, 3, 3], [1]),
        ([-3, 0, 0, -3.1], [1, 2]),
        ([3, 3, 0, 0], []),  # It stops.
        ([0, 0, 3, 3], []),  # It starts.
        ([3, 0, -3], []),  # It turns round.
        ([3, 0, 0.5], []),  # It is braked.
        ([0.1, 0, 0.1], []),  # It creeps.
        ([1e30, 0, 1e30], []),  # Damaged messages of one that stands.
    ],
)
def test_zeros_between_like_speeds_are_false(speeds, expected):
    """Only a robot that drives on makes them false."""
    assert np.flatnonzero(zeros_between(rows(speeds))).tolist() == expected


def test_a_stop_takes_time():
    """Zeros for longer than a sixth of a second are a stop."""
    assert not zeros_between(rows([3, *[0] * 20, 3])).any()
    assert zeros_between(rows([0.1, 0, 0.1]), moving=0.05).any()
