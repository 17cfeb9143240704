"""Crops of the robot's map: places turn with the robot, channels say what they are."""

import numpy as np
import pytest

from andabata.navigation.map_crops import (
    FAR_BEHIND,
    FAR_CELL,
    FAR_CELLS,
    NEAR_BEHIND,
    NEAR_CELL,
    NEAR_CELLS,
    RobotMap,
    far_crop,
    near_crop,
)

N, CELL = 128, 0.2
GOAL = np.array([10.0, 0.0])


def map_with(places=(), position=(0.0, 0.0)):
    """Return a map around a position with log odds at places (x, y, log odds), else unknown."""
    centre = np.floor(np.array(position) / CELL).astype(np.int64)
    log_odds = np.zeros((N, N), dtype=np.float32)
    for x, y, known in places:
        i, j = (int(np.floor(each / CELL)) & (N - 1) for each in (x, y))
        log_odds[i, j] = known
    clearance = np.full((N, N), 6.5, dtype=np.float32)
    corner = (centre - N // 2) * CELL
    return RobotMap(log_odds, centre, clearance, corner, CELL, 1.0, 3.0, 6.5, np.zeros(2))


def near_cell(ahead, aside):
    """Return row and column of a place in the robot's frame."""
    half = NEAR_CELLS * NEAR_CELL / 2
    return int((ahead + NEAR_BEHIND) / NEAR_CELL), int((aside + half) / NEAR_CELL)


def far_cell(ahead, aside):
    """Return row and column of a place in the robot's frame."""
    half = FAR_CELLS * FAR_CELL / 2
    return int((ahead + FAR_BEHIND) / FAR_CELL), int((aside + half) / FAR_CELL)


@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, np.pi, -np.pi / 2])
@pytest.mark.parametrize("position", [(0.0, 0.0), (61.3, -47.7)])
def test_an_obstacle_stands_where_the_robot_sees_it(yaw, position):
    """Ahead and to the left, whatever way the robot looks and wherever it is."""
    ahead, aside = 3.1, 1.5
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = position[0] + c * ahead - s * aside, position[1] + s * ahead + c * aside
    post = [(x + i, y + j, 2.0) for i in (-0.1, 0.1) for j in (-0.1, 0.1)]
    around = map_with(post, position)
    crop = near_crop(around, np.array(position), yaw, GOAL)
    rows, columns = np.nonzero(crop[0])
    row, column = near_cell(ahead, aside)
    assert len(rows) >= 1
    assert np.abs(rows - row).max() <= 1
    assert np.abs(columns - column).max() <= 1
    coarse = far_crop(around, np.array(position), yaw, GOAL)
    rows, columns = np.nonzero(coarse[0])
    row, column = far_cell(ahead, aside)
    assert np.abs(rows - row).max() <= 1
    assert np.abs(columns - column).max() <= 1


def test_channels_of_what_is_known():
    """Half of a share of blocked is lethal; driven ground is free and driven; the rest unknown."""
    known = {0.5: (0.25, 0, 0, 0), 1.0: (0.5, 0, 0, 0), 9.0: (1, 0, 0, 0)}
    known |= {-1.5: (0, 0.5, 0, 0), -3.0: (0, 1, 0, 0), -4.5: (0, 1, 0, 0.5), -6.0: (0, 1, 0, 1)}
    known[0.0] = (0, 0, 1, 0)
    for log_odds, expected in known.items():
        crop = near_crop(map_with([(1.1, 0.5, log_odds)]), np.zeros(2), 0.0, GOAL)
        row, column = near_cell(1.1, 0.5)
        np.testing.assert_allclose(crop[:4, row, column], expected, atol=1e-6)


def test_the_far_crop_keeps_the_worst_and_the_shares():
    """One lethal cell of sixteen shows as such; free and unknown are shares."""
    cells = [(4.0 + 0.2 * i + 0.1, 0.2 * j + 0.1, -3.0) for i in range(4) for j in range(4)]
    around = map_with([*cells[:-1], (cells[-1][0], cells[-1][1], 2.0)])
    crop = far_crop(around, np.zeros(2), 0.0, GOAL)
    row, column = far_cell(4.4, 0.4)
    assert crop[0, row, column] == 1.0
    assert crop[1, row, column] >= 0.9
    assert crop[2, row, column] == 0.0
    assert crop[2, *far_cell(12.0, 9.0)] == 1.0


def test_nearer_tells_where_the_goal_is():
    """More towards it, less away from it, none abeam."""
    crop = near_crop(map_with(), np.zeros(2), 0.0, np.array([20.0, 0.0]))
    assert crop[5, *near_cell(4.1, 0.1)] == pytest.approx(4.1 / 8.0, abs=0.03)
    assert crop[5, *near_cell(-2.1, 0.1)] == pytest.approx(-2.1 / 8.0, abs=0.03)
    assert abs(crop[5, *near_cell(0.1, 3.0)]) < 0.05


def test_clearance_is_a_share_of_the_most():
    """Of the last plan's square, and the most beyond it."""
    around = map_with()
    around.clearance[N // 2 + 5, N // 2] = 1.3
    crop = near_crop(around, np.zeros(2), 0.0, GOAL)
    assert crop[4, *near_cell(1.1, 0.1)] == pytest.approx(0.2)
    assert crop[4, *near_cell(1.5, 0.1)] == 1.0


def test_beyond_the_map_nothing_is_known():
    """A small map: unknown, not blocked, no clearance missing."""
    crop = far_crop(map_with([(0.1, 0.1, 5.0)]), np.zeros(2), 0.0, GOAL)
    row, column = far_cell(15.5, 0.0)
    np.testing.assert_allclose(crop[:4, row, column], [0, 0, 1, 1])


@pytest.mark.parametrize("yaw", [0.0, 0.4, 2.0, -1.3, np.pi / 2])
def test_the_far_crop_is_that_of_all_cells_within_it(yaw):
    """Each cell of the map counts once, where its middle lies, in oblique crops, too."""
    rng = np.random.default_rng(3)
    around = map_with(position=(8.3, -5.1))
    around.log_odds[:] = rng.choice([0.0, -2.0, 0.6, 2.0], size=(N, N))
    around.clearance[:] = rng.uniform(0.0, 8.0, size=(N, N))
    position = np.array([8.37, -5.02])
    crop = far_crop(around, position, yaw, GOAL)
    cells = np.arange(N) + around.centre[:, None] - N // 2
    i, j = (each.ravel() for each in np.meshgrid(*cells, indexing="ij"))
    beside = np.stack([(i + 0.5) * CELL, (j + 0.5) * CELL], axis=1) - position
    c, s = np.cos(yaw), np.sin(yaw)
    ahead, aside = beside @ [c, s], beside @ [-s, c]
    row = np.floor((ahead + FAR_BEHIND) / FAR_CELL).astype(int)
    column = np.floor((aside + FAR_CELLS * FAR_CELL / 2) / FAR_CELL).astype(int)
    known = around.log_odds[i & (N - 1), j & (N - 1)]
    clearance = around.clearance[i - around.centre[0] + N // 2, j - around.centre[1] + N // 2]
    # The map's own edge, N // 2 cells off, is not read.
    read = (np.abs(i - around.centre[0]) < N // 2) & (np.abs(j - around.centre[1]) < N // 2)
    for k in range(FAR_CELLS):
        for q in range(FAR_CELLS):
            its = (row == k) & (column == q) & read
            if not its.any():
                np.testing.assert_array_equal(crop[:4, k, q], [0, 0, 1, 1])
                continue
            expected = [
                min(0.5 * max(known[its].max(), 0.0), 1.0),
                (known[its] < 0).mean(),
                (known[its] == 0).mean(),
                min(clearance[its].min() / 6.5, 1.0),
            ]
            np.testing.assert_allclose(crop[:4, k, q], expected, atol=1e-6)
