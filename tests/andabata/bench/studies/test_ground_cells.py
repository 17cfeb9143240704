"""Ground cells against the true map: geometry and scores."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.studies.ground_cells import (
    BANDS,
    CONFIG,
    LETHAL,
    MAP_BANDS,
    GroundCellRecorder,
    map_rows,
    measurement_rows,
    rotated,
    true_state,
)
from traversability.grid import PolarGrid
from worlds.traversability_map import Reason


def test_rotation_is_counter_clockwise():
    """East turns to north by a right angle."""
    np.testing.assert_allclose(
        rotated(np.array([1.0]), np.array([0.5]), np.pi / 2), [[-0.5, 1.0]], atol=1e-12
    )


def test_a_cell_is_blocked_if_one_of_its_quarters_is_forbidden():
    """Only the centres of the quarters count, 5 cm from the cell's."""

    class Truth:
        def reason_at(self, x, y):
            return np.where((x > 1.0) & (y > 2.0), Reason.SOLID, Reason.FREE)

        def clearance_at(self, x, y):
            return (x + y).astype(np.float32)

    centres = np.array([[0.96, 1.96], [0.94, 2.5], [0.96, 2.5], [2.0, 1.94]])
    blocked, clearance = true_state(Truth(), centres)
    assert blocked.tolist() == [True, False, True, False]
    np.testing.assert_allclose(clearance, centres.sum(axis=1), rtol=1e-6)


def test_polar_cells_are_counted_from_behind_relative_to_the_heading():
    """A cell straight ahead of the robot lies in the middle sectors; far cells in the last ring."""
    grid = PolarGrid()
    recorder = SimpleNamespace(_grid=grid)
    x, y = np.array([0.1, -0.1]), np.array([2.0, 99.0])
    sector, ring = GroundCellRecorder._polar_cells(recorder, x, y, np.pi / 2)
    assert sector.tolist() == [grid.n_sectors // 2 - 1, grid.n_sectors // 2]
    assert grid.ring_edges[ring[0]] <= np.hypot(0.1, 2.0) < grid.ring_edges[ring[0] + 1]
    assert ring[1] == grid.n_rings - 1


def measured(odds_of_blocked, odds_of_clear, odds_of_polar):
    """Rows in every band of distance: a blocked cell, a clear one, and one without a polar cell."""
    rows = []
    for near, _ in BANDS:
        rows.append([near, 1.0, 0.0, odds_of_polar, odds_of_blocked])
        rows.append([near, 0.0, 0.4, -1.0, odds_of_clear])
        rows.append([near, 0.0, 0.4, np.nan, 9.0])
    return np.array(rows)


def test_scores_are_of_even_odds_and_of_cells_with_a_polar_cell():
    """The classifier's price of a miss is taken out before odds are compared with even ones."""
    shift = np.log(CONFIG.ground.miss_cost)
    rows = measurement_rows(measured(0.1 - shift, -0.1 - shift, 1.0))
    assert len(rows) == 2 * (len(BANDS) + 1)
    for row in rows:
        assert (row["average precision"], row["AUC"]) == (1.0, 1.0)
        assert (row["recall"], row["false alarms"]) == (1.0, 0.0)
    wrong = measurement_rows(measured(-0.1 - shift, 0.1 - shift, 1.0))
    assert [row["recall"] for row in wrong[:2]] == [1.0, 0.0]
    assert [row["false alarms"] for row in wrong[:2]] == [0.0, 1.0]


def test_obstacles_of_the_map_are_counted_among_blocked_and_among_clear_cells():
    """Cells that are neither, free but near something, count nowhere."""
    rows = [
        [near, *state, odds]
        for near, _ in MAP_BANDS
        for state, odds in (
            ((1.0, 0.0), LETHAL + 0.1),
            ((1.0, 0.0), LETHAL - 0.1),
            ((0.0, 0.5), LETHAL - 0.1),
            ((0.0, 0.2), LETHAL + 0.1),
        )
    ]
    found = map_rows(np.array(rows))
    assert [row["obstacles among blocked cells"] for row in found] == [0.5, 0.5]
    assert [row["among clear cells"] for row in found] == [0.0, 0.0]
    share = CONFIG.occupancy.lethal_log_odds / CONFIG.occupancy.max_log_odds
    assert pytest.approx(share * CONFIG.ground.max_log_odds) == LETHAL
