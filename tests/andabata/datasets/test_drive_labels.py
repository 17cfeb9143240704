"""Labels of cells from the way of a robot."""

import numpy as np
import pytest

from andabata.datasets.drive_labels import _near_trouble, label_driven_cells
from andabata.datasets.drive_path import DriveLabelsConfig, DrivePath, Trouble
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from tests.support.driven_ground import SPEED, level_ground, period, raised, straight
from traversability.grid import PolarGrid
from traversability.labels import CellState

ROBOT, GRID, CONFIG = RobotModel(), PolarGrid(), DriveLabelsConfig()
ORIGIN = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)


def labels(points, periods, pose=ORIGIN, config=CONFIG, stamp=0.0):
    """Return the states of the cells of a cloud."""
    return label_driven_cells(points, pose, stamp, DrivePath.of(periods), ROBOT, GRID, config)


def at(states, x, y):
    """Return the state of the cell at a place in the cloud."""
    sector = int((np.arctan2(y, x) + np.pi) / (2 * np.pi) * GRID.n_sectors)
    return states[sector, np.searchsorted(GRID.ring_edges, np.hypot(x, y), side="right") - 1]


def test_crossed_cells_are_free_and_all_others_unknown():
    """Ahead, where the robot drove, cells are free; beside and behind nothing is known."""
    states = labels(level_ground(), straight(8))
    for x in (0.7, 1.0, 1.5, 2.0):
        assert at(states, x, 0.02) == CellState.TRAVERSABLE
    assert at(states, 3.5, 0.02) == CellState.EMPTY  # 2.4 m and half a length were driven.
    for x, y in ((0.0, 1.5), (1.0, 1.0), (-1.5, 0.02)):
        assert at(states, x, y) == CellState.EMPTY
    assert not (states == CellState.NON_TRAVERSABLE).any()


def test_labels_do_not_depend_on_where_and_how_the_map_lies():
    """Moved and turned together, way and cloud give the same labels."""
    turned = [
        period(0.1 * k, 5 + 0.03 * k * np.cos(2), y=-3 + 0.03 * k * np.sin(2), yaw=2.0)
        for k in range(1, 81)
    ]
    pose = Pose.from_euler(np.array([5.0, -3.0, 0.0]), 0.0, 0.0, 2.0)
    expected = labels(level_ground(), straight(8))
    assert (labels(level_ground(), turned, pose) == expected).all()


def test_grass_that_was_driven_over_is_free():
    """What stands under the footprint is free, however high: the robot went through."""
    points = level_ground()
    points[::2] = raised(points[::2], (1.2, -0.27), (1.9, 0.27), 0.4)  # Every second beam.
    assert at(labels(points, straight(8)), 1.5, 0.02) == CellState.TRAVERSABLE


@pytest.mark.parametrize("height", [0.2, -0.2])
def test_an_obstacle_beside_the_footprint_leaves_its_cell_unknown(height):
    """A rock or a hole in the part of a cell that was not crossed: nobody knows the cell."""
    points = raised(level_ground(), (2.4, 0.3), (2.8, 0.5), height)
    plain = labels(level_ground(), straight(12))
    assert at(plain, 2.5, 0.2) == CellState.TRAVERSABLE
    assert at(labels(points, straight(12)), 2.5, 0.2) == CellState.EMPTY


def test_high_cover_vouches_for_nothing_beside_it():
    """Crossed grass of 0.4 m does not make free what stands as high beside the footprint."""
    points = level_ground()
    points[::2] = raised(points[::2], (2.0, -0.27), (3.0, 0.27), 0.4)
    crossed = labels(points, straight(12))
    points = raised(points, (2.4, 0.3), (2.8, 0.5), 0.35)
    assert at(crossed, 2.5, 0.2) == CellState.TRAVERSABLE
    assert at(labels(points, straight(12)), 2.5, 0.2) == CellState.EMPTY


def test_slopes_are_compared_along_their_plane():
    """On a slope the ground beside the way is no obstacle: heights count from the wheels' plane."""
    slope = 0.2
    points = level_ground()
    points[:, 2] = np.tan(slope) * points[:, 1]
    drive = [
        each._replace(odometry=Pose.from_euler(each.odometry.position, slope, 0.0, 0.0))
        for each in straight(12)
    ]
    assert at(labels(points, drive), 2.5, 0.2) == CellState.TRAVERSABLE
    assert at(labels(points, straight(12)), 3.3, 0.3) == CellState.EMPTY


def stopped(direction=1.0):
    """Return a drive that stands against something after 1.2 m, commanded to go on."""
    drive = [
        period(
            0.1 * k,
            direction * 0.03 * min(k, 40),
            commanded=direction * SPEED,
            wheels=direction * SPEED * (k <= 40),
        )
        for k in range(1, 61)
    ]
    return drive


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_ground_ahead_of_a_stop_is_blocked(direction):
    """Blocked is what lies ahead in the commanded direction, not what lies behind or beside."""
    states = labels(level_ground(), stopped(direction))
    front = direction * (1.2 + ROBOT.length / 2 + 0.1)
    assert at(states, front, 0.02) == CellState.NON_TRAVERSABLE
    assert at(states, direction * 0.75, 0.02) == CellState.TRAVERSABLE
    assert at(states, front, 0.6) == CellState.EMPTY
    assert at(states, -front, 0.02) == CellState.EMPTY


def test_nothing_is_free_right_before_trouble():
    """Within the time of doubt around a stop, footprints vouch for nothing."""
    wide = CONFIG.model_copy(update={"doubt_time": 10.0})
    assert (labels(level_ground(), stopped(), config=wide) != CellState.TRAVERSABLE).all()


def test_the_ground_under_a_tilted_body_is_blocked():
    """Where the body leans beyond its limit the ground itself is blocked."""
    drive = straight(8)
    tilted = [
        each._replace(odometry=Pose.from_euler(each.odometry.position, 0.0, 0.4, 0.0))
        if each.stamp > 6
        else each
        for each in drive
    ]
    states = labels(level_ground(), tilted)
    assert at(states, 2.2, 0.02) == CellState.NON_TRAVERSABLE
    assert at(states, 0.9, 0.02) == CellState.TRAVERSABLE


def test_an_estimate_that_is_not_healthy_labels_nothing():
    """Without trust in the poses no cell is labelled, free or blocked."""
    drives = ([each._replace(trusted=False) for each in part] for part in (straight(8), stopped()))
    for drive in drives:
        assert not labels(level_ground(), drive).any()


def test_a_cell_with_too_few_points_is_unknown():
    """A cell is labelled from the grid's number of points on."""
    cell = np.float32([[1.5, 0.02 * k - 0.02, 0.0] for k in range(GRID.min_points)])
    assert at(labels(cell, straight(8)), 1.5, 0.01) == CellState.EMPTY  # In two sectors.
    cell[:, 1] = 0.02
    assert at(labels(cell, straight(8)), 1.5, 0.02) == CellState.TRAVERSABLE
    assert at(labels(cell[1:], straight(8)), 1.5, 0.02) == CellState.EMPTY


def slipping():
    """Return a drive whose wheels turn on while the robot stays after 2.4 m."""
    return [
        each._replace(position=np.array([min(each.position[0], 2.4), 0.0])) for each in straight(25)
    ]


def test_a_slip_blocks_the_ground_where_it_began():
    """Blocked is what lies ahead of the place where the robot got stuck, and nothing beyond."""
    states = labels(level_ground(8.0), slipping())
    assert at(states, 2.75, 0.02) == CellState.NON_TRAVERSABLE
    assert at(states, 1.0, 0.02) == CellState.TRAVERSABLE
    assert at(states, 4.5, 0.02) == at(states, 5.5, 0.02) == CellState.EMPTY


def test_clouds_during_a_slip_are_not_labelled():
    """While the wheels slip, nobody knows where footprints lie in a cloud."""
    assert not labels(level_ground(), slipping(), stamp=15.0).any()


def test_trouble_is_near_from_both_sides():
    """The time counts to the nearest trouble before and after, whichever others there are."""
    stamps = np.arange(20.0)
    troubles = np.zeros(20, dtype=np.uint8)
    assert not _near_trouble(stamps, troubles, 2.0).any()
    troubles[[3, 4, 5, 14]] = Trouble.STOPPED
    near = np.flatnonzero(_near_trouble(stamps, troubles, 2.0))
    assert near.tolist() == [1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15, 16]
