"""Auto-context: mean and extremes of the neighbours' log odds, counted by hand."""

import numpy as np

from traversability.cartesian.context import (
    CONTEXT_FEATURES,
    MAX_LOG_ODDS,
    NO_NEIGHBOUR,
    add_context,
)
from traversability.cartesian.features import GROUND_FEATURES


def test_context_is_made_of_the_log_odds_of_the_neighbours():
    """Five cells in a cross and one alone, whose answer is counted by hand."""
    cross = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]
    cells, log_odds = np.array([*cross, [7, 7]]), np.array([3.0, -1.0, 2.0, -20.0, 20.0, 1.0])
    features = np.arange(6 * len(GROUND_FEATURES), dtype=np.float32).reshape(6, -1)
    rows = add_context(features, log_odds, cells)
    assert rows.shape == (6, len(CONTEXT_FEATURES))
    assert np.array_equal(rows[:, : len(GROUND_FEATURES)], features)
    found = rows[:, len(GROUND_FEATURES) :]
    assert found[0].tolist() == [
        3.0,
        (-1.0 + 2.0 - MAX_LOG_ODDS + MAX_LOG_ODDS) / 4,
        -MAX_LOG_ODDS,
        MAX_LOG_ODDS,
    ]
    assert found[1].tolist() == [
        -1.0,
        1.0,
        -MAX_LOG_ODDS,
        MAX_LOG_ODDS,
    ]  # Diagonal ones are beside it, too.
    assert found[5].tolist() == [1.0, NO_NEIGHBOUR, NO_NEIGHBOUR, NO_NEIGHBOUR]
    order = np.array([3, 1, 5, 0, 2, 4])
    assert np.array_equal(add_context(features[order], log_odds[order], cells[order]), rows[order])
    assert np.array_equal(add_context(features, log_odds, cells - 1000), rows)
    assert add_context(features[:0], log_odds[:0], cells[:0]).shape == (0, len(CONTEXT_FEATURES))


def test_cells_that_are_not_due_are_neighbours_alone():
    """Rows of due cells are those of all cells."""
    rng = np.random.default_rng(0)
    cells = np.argwhere(rng.random((9, 9)) < 0.6)
    features = rng.random((len(cells), len(GROUND_FEATURES))).astype(np.float32)
    log_odds, due = rng.normal(0, 6, len(cells)), rng.random(len(cells)) < 0.5
    rows = add_context(features, log_odds, cells)
    assert np.array_equal(add_context(features, log_odds, cells, due), rows[due])
