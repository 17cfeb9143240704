"""Positions of wheels: speeds, jumps, and a second node that stands still."""

import numpy as np
import pytest

from andabata.records.decoding.position_tracks import PositionTracks
from andabata.records.decoding.unusable_message import UnusableMessageError


def test_positions_give_speeds_one_after_the_other():
    """Change by time; the first gives none."""
    tracks = PositionTracks()
    assert tracks.add(np.zeros(2), 0.0) is None
    np.testing.assert_allclose(tracks.add(np.array([0.1, 0.2]), 0.1), [1, 2])
    assert not tracks.moved
    tracks.add(np.array([0.3, 0.2]), 0.2)
    assert tracks.moved


def test_an_encoder_that_starts_anew_goes_on():
    """One jump is a new start, with a speed from its second message on."""
    tracks = PositionTracks()
    tracks.add(np.array([50.0]), 0.0)
    assert tracks.add(np.array([0.0]), 0.01) is None
    np.testing.assert_allclose(tracks.add(np.array([0.1]), 0.11), [1])


def test_zeros_of_a_second_node_are_refused():
    """Each second message stands still: it is refused, and the others keep their speed."""
    tracks, speeds, refused = PositionTracks(), [], 0
    for k in range(100):
        moved = tracks.add(np.array([20 + 0.02 * k] * 2), k / 100)
        speeds += [] if moved is None else [moved[0]]
        try:
            tracks.add(np.zeros(2), k / 100 + 0.001)
        except UnusableMessageError as error:
            assert "jump back" in str(error)
            refused += 1
    assert refused >= 97
    np.testing.assert_allclose(speeds, 2.0)


def test_missing_positions_break_the_track():
    """No speed across a message without positions."""
    tracks = PositionTracks()
    tracks.add(np.zeros(1), 0.0)
    assert tracks.add(None, 0.1) is None
    assert tracks.add(np.array([0.1]), 0.2) is None


@pytest.mark.parametrize("wraps", [True, False])
def test_angles_take_the_shorter_way_round_where_they_wrap(wraps):
    """Beyond one turn they do not wrap."""
    tracks = PositionTracks()
    first = np.array([3.1 if wraps else 9.3])
    tracks.add(first, 0.0)
    np.testing.assert_allclose(tracks.add(first + 0.1 - (2 * np.pi if wraps else 0.0), 0.1), [1.0])
