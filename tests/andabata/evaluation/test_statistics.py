"""Intervals of success rates."""

import pytest

from andabata.evaluation.statistics import wilson_interval


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (49, 50, 0.8950, 0.9965),
        (10, 20, 0.2993, 0.7007),
        (0, 20, 0.0, 0.1611),
        (20, 20, 0.8389, 1.0),
    ],
)
def test_known_intervals(successes, trials, low, high):
    """The 95 % intervals are those of the literature, closed at 0 and at 1."""
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=1e-4)


@pytest.mark.parametrize(("successes", "trials"), [(2, 1), (-1, 3), (0, 0)])
def test_impossible_counts_are_refused(successes, trials):
    """More successes than trials, negative counts and no trials are errors."""
    with pytest.raises(ValueError, match="expected 0 <= successes <= trials"):
        wilson_interval(successes, trials)


def test_failures_mirror_successes():
    """The interval of the failures is that of the successes, mirrored at one half."""
    for successes in range(21):
        low, high = wilson_interval(successes, 20)
        assert wilson_interval(20 - successes, 20) == pytest.approx((1 - high, 1 - low))


def test_a_smaller_quantile_gives_a_narrower_interval():
    """The 68 % interval lies within the 95 % interval."""
    low, high = wilson_interval(7, 20)
    inner_low, inner_high = wilson_interval(7, 20, z=1.0)
    assert low < inner_low < 7 / 20 < inner_high < high
