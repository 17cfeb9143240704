"""Hazards are scored by blocked cells, by sectors that stop in time, and by false alarms."""

import numpy as np
import pytest

from andabata.bench.hazards import hazard_scores, hazard_table
from traversability.grid import PolarGrid
from traversability.labels import CellState

GRID = PolarGrid()

EMPTY, FREE, BLOCKED = CellState.EMPTY, CellState.TRAVERSABLE, CellState.NON_TRAVERSABLE


def hazard(*sectors):
    """Return cells of one cloud, free but for the first sectors' first rings."""
    cells = np.full((1, GRID.n_sectors, GRID.n_rings), FREE, dtype=np.uint8)
    for number, states in enumerate(sectors):
        cells[0, number, : len(states)] = states
    return cells


def test_hazards_are_scored_by_cells_and_by_sectors():
    """Recall counts blocked cells, ``stopped`` sectors whose range is at most a ring too long."""
    truth = hazard([FREE, BLOCKED], [BLOCKED, BLOCKED], [BLOCKED], [EMPTY])
    called = hazard([FREE, FREE, BLOCKED], [BLOCKED, FREE], [FREE, FREE, BLOCKED], [EMPTY])
    clear = np.zeros(truth.shape, dtype=bool)
    clear[0, 1, 0] = True
    scores = hazard_scores(truth, called, clear, GRID)
    near = int(np.searchsorted(GRID.ring_edges, 4.0))
    free = GRID.n_sectors * near - 5
    assert scores == {
        "clouds": 1,
        "red_cells": 4,
        "recall": 0.25,
        "recall_clear": 1.0,
        "stopped": pytest.approx(2 / 3),
        "false_alarms": pytest.approx(2 / free),
    }


def test_cells_of_hazards_beyond_4_m_do_not_count():
    """A far hazard has no recall, and false alarms there are none."""
    near = int(np.searchsorted(GRID.ring_edges, 4.0))
    far = hazard([FREE] * near + [BLOCKED])
    scores = hazard_scores(far, hazard(), np.ones(far.shape, dtype=bool), GRID)
    assert scores["red_cells"] == 0
    assert scores["recall"] is None
    assert scores["stopped"] is None
    assert hazard_scores(hazard(), far, far == BLOCKED, GRID)["false_alarms"] == 0.0


def test_the_table_has_a_line_for_each_hazard():
    """What has no cells has no share."""
    scores = hazard_scores(hazard([BLOCKED]), hazard(), np.zeros((1, 32, 10), dtype=bool), GRID)
    (row,) = hazard_table([{"hazard": "ditch"} | scores])
    assert row["blocked cells"] == 1
    assert row["recall"] == 0.0
    assert row["of clear labels"] is None
