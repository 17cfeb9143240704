"""Heading by two fixes and the way of dead reckoning between them."""

import numpy as np
import pytest

from andabata.localization.heading_alignment import HeadingAlignment

TURN = np.deg2rad(130)
ROTATION = np.array([[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]])


def ways(length, count=11):
    """Return places of dead reckoning along a straight way [m], shape (count, 2)."""
    return np.linspace(0, length, count)[:, None] * [0.6, 0.8]


def test_two_fixes_far_apart_tell_the_rotation():
    """The angle between both ways is the rotation, its sigma the noise over the way."""
    alignment, white = HeadingAlignment(), 0.1
    found = [alignment.add(ROTATION @ p + 40, p, white) for p in ways(2.0)]
    first = next(k for k, one in enumerate(found) if one is not None)
    way = np.hypot(*ways(2.0)[first])
    assert 5 * np.sqrt(2) * white <= way < 5 * np.sqrt(2) * white + 0.21
    assert found[first].angle == pytest.approx(TURN, abs=1e-9)
    assert found[first].sigma == pytest.approx(np.sqrt(2) * white / way)


def test_a_short_way_tells_nothing():
    """Fixes as near as their noise have no direction."""
    alignment = HeadingAlignment()
    assert all(alignment.add(p, p, 0.5) is None for p in ways(3.4))


def test_wheels_that_spin_begin_anew():
    """Where both lengths differ by a third one of them is wrong: nothing is told by it."""
    alignment = HeadingAlignment()
    assert alignment.add(np.zeros(2), np.zeros(2), 0.1) is None
    assert alignment.add(np.array([0.1, 0.0]), np.array([3.0, 0.0]), 0.1) is None
    later = alignment.add(np.array([2.1, 0.0]), np.array([5.0, 0.0]), 0.1)
    assert later is not None
    assert later.angle == pytest.approx(0.0, abs=1e-9)


def test_it_forgets_when_the_heading_is_known():
    """After it is cleared the next fix is the first."""
    alignment = HeadingAlignment()
    alignment.add(np.zeros(2), np.zeros(2), 0.1)
    alignment.clear()
    assert alignment.add(np.array([9.0, 0.0]), np.array([9.0, 0.0]), 0.1) is None
