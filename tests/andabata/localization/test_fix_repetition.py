"""Repetition of fixes: a receiver that hangs, one of coarse places, one that holds its place."""

import numpy as np
import pytest

from andabata.localization.fix_repetition import FixRepetition, RepetitionConfig

NONE = np.empty((0, 5))


def fix(stamp, place, altitude=60.0):
    """Return a fix at a place of the north."""
    return np.array([[stamp, 36.7 + 1e-6 * place, -4.5, altitude, 0.5]])


def sent(check, places, way=0.3, begin=0.0, altitude=60.0):
    """Return which fixes are believed, one a second, of a robot that drives ``way`` in each."""
    found = []
    for k, place in enumerate(places):
        check.drive(way)
        found.append(len(check.believed(fix(begin + k, place, altitude))) == 1)
    return found


@pytest.mark.parametrize("way", [0.3, -0.3])
@pytest.mark.parametrize("altitude", [60.0, np.nan])
def test_a_receiver_that_hangs_is_not_believed_from_the_second_repetition_on(way, altitude):
    """The first may be chance; the next place is believed at once."""
    check = FixRepetition(RepetitionConfig())
    assert all(sent(check, range(12), way, altitude=altitude))
    assert sent(check, [11] * 4, way, 12.0, altitude) == [True, False, False, False]
    assert (check.is_frozen, check.is_repeating, check.since) == (True, True, 11.0)
    assert all(sent(check, [50, 51], way, 16.0, altitude))
    assert (check.is_frozen, check.is_repeating) == (False, False)
    # Who hung once is not held for coarse.
    assert sent(check, [51] * 2, way, 18.0, altitude) == [True, False]


def test_a_robot_that_stands_may_get_the_same_place_for_ever():
    """Without a way nothing has to change, nor in the first metres of a receiver that holds."""
    check = FixRepetition(RepetitionConfig())
    assert all(sent(check, range(12)))
    assert all(sent(check, [11] * 30, way=0.0, begin=12.0))
    assert not check.is_repeating
    assert all(sent(check, [11] * 6, begin=42.0))
    assert check.is_repeating
    assert sent(check, [11] * 3, begin=48.0) == [False] * 3  # Two metres.


def test_coarse_places_repeat_themselves_and_are_believed():
    """A receiver whose places repeated before, or of which little is known, gets two metres."""
    check = FixRepetition(RepetitionConfig())
    places = [k // 3 for k in range(60)]
    assert all(sent(check, places))
    assert sent(check, [100] * 10)[-3:] == [False] * 3


def test_another_altitude_is_another_place_and_no_fix_is_none():
    """All three coordinates repeat themselves; a row without a place is for others to reject."""
    check = FixRepetition(RepetitionConfig())
    assert all(sent(check, range(12)))
    check.drive(5.0)
    for k in range(5):
        assert len(check.believed(fix(12.0 + k, 11, 60.0 + k)))
    assert len(check.believed(np.full((3, 5), np.nan))) == 3
    assert len(check.believed(NONE)) == 0
