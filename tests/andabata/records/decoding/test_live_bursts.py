"""Bursts of a live session."""

from itertools import pairwise

import numpy as np
import pytest

from andabata.records.decoding.live_bursts import LiveBursts

PERIOD = 0.01


def arrivals(count=300, size=10, spacing=1e-4):
    """Return stamps when readings arrive in bursts, and when they were measured [s]."""
    measured = 5.0 + PERIOD * np.arange(count)
    place = np.arange(count) % size
    last = measured - PERIOD * place + PERIOD * (size - 1)
    return last - spacing * (size - 1 - place), measured


def delivered(bursts, stamps, parts):
    """Return the stamps that come out when rows are given in parts of some sizes."""
    rows = np.column_stack([stamps, np.arange(len(stamps))])
    edges = np.cumsum([0, *parts])
    return np.concatenate([bursts.spread(rows[a:b]) for a, b in pairwise(edges)])


@pytest.mark.parametrize("spacing", [0.0, 1e-4, 1e-3])
def test_readings_get_the_times_at_which_they_were_measured(spacing):
    """Once bursts are recognised, each is spread; the last of a burst keeps its stamp."""
    stamps, measured = arrivals(spacing=spacing)
    bursts = LiveBursts()
    found = delivered(bursts, stamps, [10] * 30)
    np.testing.assert_allclose(found[50:, 0], measured[50:], atol=1e-6)
    assert (found[:, 1] == np.arange(300)).all()
    assert bursts.text.startswith("readings come in bursts of 10.0, 100 a second in all")


def test_a_burst_in_two_parts_stays_in_order():
    """No reading is older than one that was used, and none comes after its burst's end."""
    stamps, measured = arrivals()
    found = delivered(LiveBursts(), stamps, [10] * 10 + [4, 6] * 20)[:, 0]
    assert (np.diff(found[50:]) > 0).all()
    np.testing.assert_allclose(found[109::10], measured[109::10], atol=2e-5)


def test_even_stamps_stay_to_the_bit():
    """Nothing is changed or remarked."""
    bursts, stamps = LiveBursts(), 1.7e9 + PERIOD * np.arange(300)
    found = delivered(bursts, stamps, [5] * 60)
    assert (found[:, 0] == stamps).all()
    assert bursts.text is None


def test_readings_that_are_sent_twice_are_no_bursts():
    """Pairs of equal readings look like bursts of two."""
    bursts, stamps = LiveBursts(), np.repeat(5.0 + PERIOD * np.arange(150), 2)
    rows = np.column_stack([stamps, np.repeat(np.arange(150), 2)])
    found = np.concatenate([bursts.spread(rows[k : k + 10]) for k in range(0, 300, 10)])
    assert (found == rows).all()
    assert bursts.text is None
