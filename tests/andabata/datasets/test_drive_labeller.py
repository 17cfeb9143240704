"""Cells that a drive labels as it goes on."""

import numpy as np
import pytest

from andabata.datasets.drive_labeller import DriveLabeller
from andabata.datasets.drive_labels import label_driven_cells
from andabata.datasets.drive_path import DriveLabelsConfig, DrivePath
from andabata.machine.robot import RobotModel
from tests.support.driven_ground import level_ground, period, straight
from traversability.features import cell_features
from traversability.grid import PolarGrid
from traversability.labels import CellState

ROBOT, GRID, CONFIG = RobotModel(), PolarGrid(), DriveLabelsConfig(horizon=6.05, interval=2.0)


def drive(labeller, periods):
    """Send a drive to a labeller, with a cloud wherever it wants one; return their times."""
    times = []
    for each in periods:
        points = level_ground() if labeller.wants_cloud(each.stamp) else None
        times += [each.stamp] if points is not None else []
        labeller.add(each, points)
    labeller.end_piece()
    return times


def test_cells_are_those_of_the_way_around_each_cloud():
    """Streamed labels and features are those of each cloud with the way within the horizon."""
    labeller, periods = DriveLabeller(ROBOT, GRID, CONFIG), straight(20)
    times = drive(labeller, periods)
    assert np.diff(times) == pytest.approx(2.0)
    found = labeller.samples()
    assert found.stamps == pytest.approx(times)
    values = cell_features(level_ground(), GRID).values
    for number, stamp in enumerate(times):
        around = [each for each in periods if abs(each.stamp - stamp) <= CONFIG.horizon]
        pose = next(each.odometry for each in periods if each.stamp == stamp)
        path = DrivePath.of(around)
        states = label_driven_cells(level_ground(), pose, stamp, path, ROBOT, GRID, CONFIG)
        known = states != CellState.EMPTY
        mine = found.cells.cloud == number
        assert (found.cells.features[mine] == values[known]).all()
        assert (found.cells.ring[mine] == np.nonzero(known)[1]).all()
        assert (found.cells.blocked[mine] == (states[known] == CellState.NON_TRAVERSABLE)).all()
    assert found.clouds == len(times)
    assert not found.cells.blocked.any()
    assert found.cells.clear.all()


def test_pieces_do_not_vouch_for_each_other():
    """Two pieces label what each labels by itself; times of the second one follow."""
    once, twice = (DriveLabeller(ROBOT, GRID, CONFIG) for _ in range(2))
    drive(once, straight(8))
    drive(twice, straight(8))
    drive(twice, straight(8))
    one, two = once.samples(), twice.samples()
    assert (two.cells.features == np.concatenate([one.cells.features] * 2)).all()
    assert (np.diff(two.stamps) > 0).all()
    assert two.stamps[len(one.stamps)] - one.stamps[-1] > CONFIG.horizon


def test_troubles_are_counted_once_each():
    """A trouble counts once, however long it lasts."""
    periods = [
        period(0.1 * k, 0.03 * min(k, 40), wheels=0.3 * (k <= 40 or 60 < k <= 61))
        for k in range(1, 81)
    ]
    labeller = DriveLabeller(ROBOT, GRID, CONFIG)
    drive(labeller, periods)
    found = labeller.samples()
    assert found.troubles == {"stopped": 2, "slipped": 0, "tilted": 0}
    assert found.cells.blocked.any()


def test_a_drive_that_labels_nothing_is_an_error():
    """A drive without clouds, or that stays where it is not trusted, says what to record."""
    labeller = DriveLabeller(ROBOT, GRID, CONFIG)
    for each in straight(8, trusted=False):
        labeller.add(each, level_ground())
    labeller.end_piece()
    with pytest.raises(ValueError, match="expected cells that the robot has crossed, got none"):
        labeller.samples()
