"""Mover detector: bodies of a known place and size, and what is none."""

import numpy as np
import pytest

from andabata.navigation.free_space_grid import CAME, STANDS, UNKNOWN
from andabata.navigation.mover_detector import DetectorLaw, MoverDetectorConfig, detect_movers

ORIGIN = np.array([1.0, -2.0, 0.7])
ALWAYS = (-np.inf, np.inf)


def front(x, y, radius=0.25, low=0.3, high=1.5, kind=CAME, stamp=0.0, origin=ORIGIN):
    """Return the visible front of an upright cylinder, evenly across, as returns."""
    ahead = np.arctan2(y - origin[1], x - origin[0]) + np.pi
    across = np.linspace(-0.99, 0.99, 21)
    angles = ahead + np.arcsin(across)
    heights = np.linspace(low, high, 9)
    places = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])
    rows = np.repeat(places, len(heights), axis=0)
    count = len(rows)
    return np.column_stack(
        [rows, np.tile(heights, len(places)), np.full(count, stamp), np.full(count, kind)]
    )


def detect(*returns, complete=ALWAYS, **settings):
    """Return the discs among some returns."""
    law = DetectorLaw.of(MoverDetectorConfig(**settings), 0.2)
    return detect_movers(np.concatenate(returns), ORIGIN, complete, law)


@pytest.mark.parametrize("place", [(4.0, 0.5), (-2.0, -2.0), (1.0, -5.0)])
def test_a_body_is_where_it_is_and_as_wide(place):
    """In any direction, though only its front is seen."""
    np.testing.assert_allclose(detect(front(*place)), [(*place, 0.25)], atol=0.02)


def test_bodies_apart_are_two():
    """Each has its own place."""
    discs = detect(front(4.0, 0.0), front(4.0, 1.5))
    np.testing.assert_allclose(discs[:, :2], [(4.0, 0.0), (4.0, 1.5)], atol=0.02)


@pytest.mark.parametrize(
    "returns",
    [
        front(4.0, 0.5)[:9],
        front(4.0, 0.5, high=0.9),
        front(4.0, 0.5, low=1.2),
        front(4.0, 0.5, radius=0.9),
        front(4.0, 0.5, kind=STANDS),
        front(4.0, 0.5, kind=UNKNOWN),
        np.empty((0, 5)),
    ],
    ids=["few", "low", "flat", "large", "stands", "unknown", "nothing"],
)
def test_what_is_no_body_is_not_found(returns):
    """Too few returns, no height, too large a size, or nothing that came."""
    assert detect(returns).shape == (0, 3)


def test_what_is_long_along_the_line_of_sight_is_too_large():
    """The depth counts as the width does."""
    deep = np.concatenate([front(1.0 + d, -2.0, radius=0.1) for d in np.arange(2.0, 4.0, 0.1)])
    assert not len(detect(deep))


def test_other_returns_beside_it_are_against_it():
    """Leaves that stand are against a body; what stands elsewhere, or is unknown, is not."""
    body, leaves = front(4.0, 0.5), front(4.0, 0.5, kind=STANDS)
    assert len(detect(body, front(4.0, 2.5, kind=STANDS))) == 1
    assert len(detect(body, leaves[::2])) == 1
    assert not len(detect(body, leaves))
    assert len(detect(body, front(4.0, 0.5, kind=UNKNOWN))) == 1


def test_a_body_counts_once_when_the_plane_has_passed_it():
    """Its newest return lies after the begin and not after the end."""
    body = np.concatenate([front(4.0, 0.5, stamp=0.5)[::2], front(4.0, 0.5, stamp=1.0)[::2]])
    assert not len(detect(body, complete=(0.3, 0.9)))
    assert len(detect(body, complete=(0.9, 1.0))) == 1
    assert not len(detect(body, complete=(1.0, 1.1)))


def test_a_radius_stays_within_its_bounds():
    """A thin body is as wide as the smallest."""
    assert detect(front(4.0, 0.5, radius=0.05))[0, 2] == pytest.approx(0.15)
