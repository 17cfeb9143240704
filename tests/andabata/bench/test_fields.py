"""Scores of the field suite: cells of fields, sectors that run into them, free ground."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.bench.fields import FieldClassification, evaluate_fields, field_scores, field_table
from andabata.datasets.field_suite import FREE_KINDS, FieldCase
from terrain.classes import SemanticClass
from tests.support.cell_samples import SMALL, cells
from traversability.forest_training import train_forest
from traversability.grid import PolarGrid
from traversability.labels import CellState
from worlds.fields import Field

GRID = PolarGrid()
MEADOW = Field(SemanticClass.MEADOW, 0.5, 3.0, 0.0, 0.0, 0.0, 0)
FREE, BLOCKED = CellState.TRAVERSABLE, CellState.NON_TRAVERSABLE


def result(field=MEADOW, blocked=(), called=(), ranges=np.inf):
    """Return a case whose cells are free but for some, given as (sector, ring)."""
    truth, states = (np.full((32, 10), FREE, dtype=np.uint8) for _ in range(2))
    for grid, chosen in ((truth, blocked), (states, called)):
        for cell in chosen:
            grid[cell] = BLOCKED
    case = FieldCase("field" if field else "grass", "vlp-16", 1.0, 0.0, field, 0)
    found = np.full(32, ranges, dtype=np.float32)
    none = np.zeros((0, 3), dtype=np.float32)
    return FieldClassification(case, none, truth, states, found, GRID.bearings)


def test_recall_and_false_alarms_count_cells():
    """Two of four blocked cells found, and one free cell called blocked."""
    one = result(blocked=[(16, 6), (16, 7)], called=[(16, 6), (3, 2)])
    other = result(blocked=[(15, 6), (15, 7)], called=[(15, 6)])
    scores = field_scores([one, other], GRID)
    assert (scores["clouds"], scores["red_cells"], scores["recall"]) == (2, 4, 0.5)
    assert scores["green_cells"] == 636
    assert scores["false_alarms"] == pytest.approx(1 / 636)
    assert scores["closed"] == pytest.approx(1 / 62)


@pytest.mark.parametrize(("ranges", "into"), [(3.0, 0), (4.6, 1), (np.inf, 1)])
def test_sectors_run_into_a_field_from_a_metre_and_a_half_on(ranges, into):
    """Those within 45 degrees of its middle count; unknown ones do not."""
    scores = field_scores([result(ranges=ranges)], GRID)
    assert scores["towards"] == 8
    # A range of 4.6 m is 1.6 m behind the edge straight ahead, and less far aside.
    assert (scores["into_field"] > 0) == bool(into)
    assert scores["into_field"] == (8 if np.isinf(ranges) else scores["into_field"])
    assert field_scores([result(ranges=np.nan)], GRID)["into_field"] == 0


def test_fields_with_gaps_and_free_ground_have_no_sectors_towards_them():
    """Through a gap a range may run; a gradual edge moves the limit outwards."""
    gaps = result(field=replace(MEADOW, gaps=0.2))
    assert field_scores([gaps, result(field=None)], GRID)["towards"] == 0
    gradual = result(field=replace(MEADOW, ramp=2.0), ranges=6.0)
    assert field_scores([gradual], GRID)["into_field"] == 0


def test_the_suite_is_scored_by_height_and_by_kind_of_free_ground():
    """Every case counts once, and a row without clouds has no scores."""
    forest = train_forest(cells(), GRID, SMALL, 0)
    done = []
    rows = evaluate_fields(forest.to_bytes(), 6, 1, 1, lambda: done.append(1))
    assert len(done) == 12 == sum(row["clouds"] for row in rows)
    assert [row["kind"] for row in rows][-len(FREE_KINDS) :] == list(FREE_KINDS)
    assert all((row["recall"] is None) == (row["red_cells"] == 0) for row in rows)
    table = field_table(rows)
    assert len(table) == 4 + len(FREE_KINDS)
    assert table[0]["sectors into the field"].count(" of ") == 1
