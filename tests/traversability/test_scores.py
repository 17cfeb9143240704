"""Scores of classified cells: the paper's figures, and ranges that are too long or too short."""

import numpy as np
import pytest

from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.scores import PAPER, CellScores, range_errors

GRID = PolarGrid()


def test_the_papers_counts_give_the_scores_of_their_formulas():
    """Each score is that of its formula on the paper's Table 1."""
    assert PAPER.accuracy == pytest.approx(0.793, abs=5e-4)
    assert PAPER.precision == pytest.approx(0.806, abs=5e-4)
    assert PAPER.recall == pytest.approx(0.618, abs=5e-4)
    assert PAPER.specificity == pytest.approx(0.905, abs=5e-4)
    assert PAPER.balanced_accuracy == pytest.approx(0.762, abs=5e-4)
    assert PAPER.f1_red == pytest.approx(0.700, abs=5e-4)
    assert PAPER.iou_red == pytest.approx(0.538, abs=5e-4)


def test_empty_cells_are_not_scored():
    """Of five cells, the one without a true state is left out."""
    truth = np.array([0, 1, 2, 2, 1], dtype=np.uint8)
    called = np.array([2, 1, 2, 1, 2], dtype=np.uint8)
    assert CellScores.of(truth, called) == CellScores(tp=1, tn=1, fp=1, fn=1)


def test_a_range_is_wrong_if_it_is_off_by_more_than_a_ring():
    """Of four ranges, one ends two rings too far and one two rings too early."""
    truth = np.full((4, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    truth[:, 5] = CellState.NON_TRAVERSABLE
    found = np.full_like(truth, CellState.TRAVERSABLE)
    for sector, ring in enumerate((5, 6, 7, 3)):
        found[sector, ring] = CellState.NON_TRAVERSABLE
    assert range_errors(truth, found, GRID) == {"too_long": 0.25, "too_short": 0.25}


def test_misses_and_false_alarms_are_not_mixed_up():
    """A blocked cell classified as free is a miss, fn; the reverse is a false alarm, fp."""
    blocked, free = np.full(3, 2, np.uint8), np.full(3, 1, np.uint8)
    assert CellScores.of(blocked, free) == CellScores(tp=0, tn=0, fp=0, fn=3)
    assert CellScores.of(free, blocked) == CellScores(tp=0, tn=0, fp=3, fn=0)
    assert np.isnan(CellScores(tp=0, tn=0, fp=0, fn=0).accuracy)
    with pytest.raises(ValueError, match="predicted: expected shape"):
        CellScores.of(blocked, free[:2])
