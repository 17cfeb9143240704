"""Window of the last sweeps: swaths around what has settled, and memory that parts move through."""

import numpy as np
import pytest

from andabata.navigation import sweep_window
from andabata.navigation.sweep_window import Part, SweepBuffer
from traversability.cloud import PointCloud


def part(stamp, count=1):
    """Return points that were measured at a time, and tell it by their places."""
    stamps = np.full(count, float(stamp))
    return Part(PointCloud(np.full((count, 3), stamp, np.float32), "odom", stamps), float(stamp))


def filled(stamps, **options):
    """Return a buffer with a part for each stamp."""
    buffer = SweepBuffer()
    for stamp in stamps:
        buffer.append(part(stamp, **options))
    return buffer


def test_each_place_comes_once_with_its_neighbours():
    """Since a stamp come the settled places after it, and as much before as lies after them."""
    window = filled(np.arange(0.0, 3.05, 0.25)).window(2.5)
    swath = window.since(1.5)
    # The newest is 0.5 s past the settled places: the swath begins 0.5 s before the stamp.
    np.testing.assert_allclose(swath.stamps, np.arange(1.25, 3.05, 0.25))
    np.testing.assert_array_equal(swath.points[:, 0], swath.stamps)
    assert swath.newest == 3.0
    assert swath.due == (0.5, 1.5)
    ages = swath.newest - swath.stamps
    counted = (ages >= swath.due[0]) & (ages < swath.due[1])
    np.testing.assert_allclose(swath.stamps[counted], [1.75, 2.0, 2.25, 2.5])
    whole = window.since(-np.inf)
    ages = whole.newest - whole.stamps
    assert len(whole.points) == 13
    assert ((ages >= whole.due[0]) & (ages < whole.due[1])).sum() == 11


def test_a_part_without_points_is_refused():
    """A window of nothing cannot be asked what came since."""
    empty = PointCloud(np.empty((0, 3), np.float32), "odom", np.empty(0))
    for bad in (empty, PointCloud(np.zeros((1, 3), np.float32))):
        with pytest.raises(ValueError, match="stamps: expected points with stamps"):
            SweepBuffer().append(Part(bad, 0.0))


def test_parts_move_through_the_memory(monkeypatch):
    """However full it gets, the window holds the parts that are left, in their order."""
    monkeypatch.setattr(sweep_window, "_CAPACITY", 10)
    buffer = SweepBuffer()
    for k in range(40):
        buffer.append(part(k, count=1 + k % 5))
        while len(buffer.parts) > (3 if k < 20 else 8):
            buffer.remove_oldest()
        expected = np.concatenate([each.cloud.stamps for each in buffer.parts])
        window = buffer.window(0.0)
        np.testing.assert_array_equal(window.stamps, expected)
        np.testing.assert_array_equal(window.points[:, 2], expected)
        assert window.parts == tuple(buffer.parts)
    buffer.clear()
    assert not len(buffer.window(0.0).points)
