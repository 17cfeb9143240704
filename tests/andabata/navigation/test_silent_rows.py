"""Beams without a return: found where a laser of known rows has none."""

import numpy as np
import pytest

from andabata.navigation.silent_rows import SilentRows
from traversability.cloud import PointCloud

ROWS = (-20.0, -10.0, -5.0, 0.0, 5.0, 20.0)
COUNTING = (-10.0, 5.0)
COLUMNS = 1024
STEP = 360.0 / COLUMNS


def cloud(keep, frame="sensor", height=0.0):
    """Return returns at 5 m of the beams that ``keep`` chooses of rows and bearings [deg]."""
    rows = np.tile(ROWS, COLUMNS)
    bearings = np.repeat((np.arange(COLUMNS) + 0.5) * STEP - 180.0, len(ROWS))
    stamps = 7.0 + np.repeat(np.arange(COLUMNS), len(ROWS)) * 1e-4
    chosen = keep(rows, bearings)
    up, around = np.radians(rows[chosen]), np.radians(bearings[chosen])
    points = 5.0 * np.stack(
        [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=1
    )
    points[:, 2] += height
    return PointCloud(points.astype(np.float32), frame, stamps[chosen])


def silent(points, height=0.7, free_range=8.0):
    """Return bearings and elevations [deg], ranges [m] and times of beams without a return."""
    ends = SilentRows(ROWS, COUNTING).ends(points, height, free_range)
    assert ends.frame == points.frame
    x, y, z = ends.points.T.astype(np.float64)
    z -= 0.0 if points.frame == "sensor" else height
    level = np.hypot(x, y)
    bearings, elevations = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, level))
    return bearings, elevations, np.hypot(level, z), ends.stamps


def open_ahead(rows, bearings):
    """Beams down to the ground are returned all around, all others behind and beside."""
    return (rows < -15.0) | (np.abs(bearings) > 30.0)


@pytest.mark.parametrize("frame", ["sensor", "base_link"])
def test_beams_over_open_ground_passed_the_free_range(frame):
    """In each row that counts, ahead alone, as far as said, when the laser looked there."""
    points = cloud(open_ahead, frame, 0.0 if frame == "sensor" else 0.7)
    bearings, elevations, ranges, stamps = silent(points)
    assert np.abs(bearings).max() < 30.0
    assert np.abs(bearings).max() > 21.0
    np.testing.assert_allclose(np.unique(np.round(elevations, 3)), [-10.0, -5.0, 0.0, 5.0])
    np.testing.assert_allclose(ranges, 8.0, rtol=1e-5)
    looked_at = 7.0 + (bearings + 180.0) / STEP * 1e-4
    np.testing.assert_allclose(stamps, looked_at, atol=8e-4)


def test_a_body_is_passed_by_no_beam():
    """Nor are the sectors beside it, in part."""

    def body(rows, bearings):
        return open_ahead(rows, bearings) | (np.abs(bearings - 10.0) < 4.0)

    bearings, *_ = silent(cloud(body))
    assert np.abs(bearings - 10.0).min() > 4.0
    assert np.count_nonzero(np.abs(bearings - 10.0) < 9.0)


def test_gaps_between_leaves_are_not_passed():
    """A shrub that stops half of the beams, in runs of columns, is passed by none."""
    rng = np.random.default_rng(0)
    stops = rng.random((len(ROWS), COLUMNS // 8)).repeat(8, axis=1) < 0.5

    def shrub(rows, bearings):
        columns = ((bearings + 180.0) / STEP).astype(int)
        is_leaf = stops[np.searchsorted(ROWS, rows), columns] & (np.abs(bearings) < 15.0)
        return open_ahead(rows, bearings) | is_leaf

    bearings, *_ = silent(cloud(shrub))
    assert np.count_nonzero(np.abs(bearings) < 12.0) < 0.02 * 4 * 24 / 2.8
    assert np.count_nonzero(np.abs(bearings) > 18.0)


def test_one_lost_return_is_nothing():
    """A beam of a wall that was lost leaves its neighbours in the same sector."""
    lost = (np.arange(COLUMNS)[400] + 0.5) * STEP - 180.0
    points = cloud(lambda rows, bearings: (np.abs(bearings - lost) > STEP / 2) | (rows != 0.0))
    assert not len(silent(points)[0])


def test_sectors_without_any_return_are_left_out():
    """A laser that does not look there has none either."""
    bearings, *_ = silent(cloud(lambda rows, bearings: (rows < -15.0) & (bearings > 0.0)))
    assert len(bearings)
    assert bearings.min() > 0.0
    assert not len(silent(cloud(lambda rows, bearings: rows > 100.0))[0])


def test_rows_that_do_not_count_and_clouds_without_times():
    """Rows may all lie too high; times are needed."""
    ends = SilentRows(ROWS, (30.0, 40.0)).ends(cloud(open_ahead), 0.7, 8.0)
    assert not len(ends.points)
    points = PointCloud(cloud(open_ahead).points, "sensor")
    with pytest.raises(ValueError, match="stamps: expected a time of each point"):
        SilentRows(ROWS, COUNTING).ends(points, 0.7, 8.0)
