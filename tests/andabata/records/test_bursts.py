"""Bursts of stamps: recognised, and spread over the time to their neighbours."""

import numpy as np
import pytest

from andabata.records.bursts import find_bursts, holds_what_follows

TRUE = np.arange(600) * 10_000_000


def arrived(size, apart=100_000, is_after=False):
    """Return stamps [ns] of readings that were measured evenly and stamped in bursts."""
    place = np.arange(len(TRUE)) % size
    anchor = TRUE - 10_000_000 * place if is_after else TRUE + 10_000_000 * (size - 1 - place)
    return anchor + apart * (place if is_after else place - size + 1)


@pytest.mark.parametrize("size", [2, 3, 10, 25])
@pytest.mark.parametrize("is_after", [False, True])
@pytest.mark.parametrize("apart", [0, 100_000])
def test_bursts_are_spread_to_the_times_of_measurement(size, is_after, apart):
    """Within a tenth of a millisecond a reading of a burst is back where it was measured."""
    stamps = arrived(size, apart, is_after)
    bursts = find_bursts(stamps)
    assert bursts.size == pytest.approx(size)
    assert bursts.period == pytest.approx(10_000_000, rel=0.01)
    spread = bursts.spread(stamps, is_after)
    inner = slice(size, -size)
    np.testing.assert_allclose(spread[inner], TRUE[inner], atol=1.1 * apart + 1)
    assert (np.diff(spread) >= 0).all()


def test_even_stamps_jitter_and_few_are_no_bursts():
    """Jitter of a third of the period is even."""
    jitter = np.random.default_rng(0).uniform(-3e6, 3e6, len(TRUE)).astype(np.int64)
    assert find_bursts(TRUE) is None
    assert find_bursts(np.sort(TRUE + jitter)) is None
    assert find_bursts(arrived(10)[:20]) is None
    assert find_bursts(np.zeros(100, dtype=np.int64)) is None


def test_a_pause_is_no_time_to_spread_over():
    """The burst after a pause takes as long as any other."""
    stamps = arrived(10)
    stamps[300:] += 5_000_000_000
    spread = find_bursts(stamps).spread(stamps, is_after=False)
    assert spread[300] - spread[299] > 4_900_000_000
    np.testing.assert_allclose(np.diff(spread)[300:309], 10_000_000, rtol=0.02)


@pytest.mark.parametrize("is_after", [False, True])
def test_the_compass_decides_on_which_side_a_burst_is_spread(is_after):
    """Of two spreads the gyro's turn fits the headings with the right one."""
    times = TRUE / 1e9
    headings = np.column_stack([times, 0.5 * np.sin(2 * times)])
    right, wrong = times, times + (-0.09 if is_after else 0.09)
    pair = (wrong, right) if is_after else (right, wrong)
    assert holds_what_follows(*pair, np.cos(2 * times), headings) == is_after
    assert not holds_what_follows(wrong, right, np.cos(2 * times), headings[:5])
