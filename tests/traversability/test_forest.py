"""The forest: its file, empty cells, thresholds of rings, and files that are refused."""

import numpy as np
import pytest

from tests.support.cell_samples import GRID, SMALL, cells
from traversability.arrays import pack, unpack
from traversability.features import ALL_FEATURES, CellFeatures
from traversability.forest import Forest, ForestFileError, Thresholds
from traversability.forest_training import train_forest
from traversability.grid import PolarGrid
from traversability.labels import CellState


@pytest.fixture(scope="module")
def forest():
    """Return a small forest."""
    return train_forest(cells(), GRID, SMALL, seed=1, summary={"cells": 4000})


def test_bytes_come_back_the_same(forest):
    """Probabilities, settings and bytes survive the file."""
    again = Forest.from_bytes(forest.to_bytes())
    fresh = cells(500, seed=3).features
    np.testing.assert_array_equal(again.predict_proba(fresh), forest.predict_proba(fresh))
    for name in ("thresholds", "grid", "summary"):
        assert getattr(again, name) == getattr(forest, name)
    assert again.to_bytes() == forest.to_bytes()


def test_cells_with_few_points_stay_empty(forest):
    """A cell of four points is empty, one of five is not."""
    counts = np.full((GRID.n_sectors, GRID.n_rings), 4, dtype=np.int32)
    counts[2, 3] = 5
    values = np.zeros((*counts.shape, len(ALL_FEATURES)), dtype=np.float32)
    states = forest.classify(CellFeatures(values, counts), GRID)
    assert states[2, 3] != CellState.EMPTY
    assert (states != CellState.EMPTY).sum() == 1


def test_another_grid_is_refused_but_for_the_number_of_sectors(forest):
    """The error names both grids and the next step."""
    forest.check_grid(PolarGrid(n_sectors=64))
    with pytest.raises(ValueError, match=r"10 rings to 10\.0 m over the ground that the forest"):
        forest.check_grid(PolarGrid(n_rings=8))
    with pytest.raises(ValueError, match="over the base"):
        forest.check_grid(PolarGrid(cut="base"))


def test_near_rings_have_their_own_threshold():
    """Rings that begin within the near range have the near threshold."""
    limits = Thresholds(near=0.1, far=0.3, near_range=5.0).of_rings(GRID)
    np.testing.assert_array_equal(limits == 0.1, GRID.ring_edges[:-1] < 5.0)
    assert set(limits) == {0.1, 0.3}


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("left", lambda a: np.where(a > 0, 1, a).astype(a.dtype)),
        ("left", lambda a: a + np.int32(10_000_000)),
        ("screen_left", lambda a: a + np.int32(10_000_000)),
        ("feature", lambda a: np.where(a >= 0, 500, a).astype(a.dtype)),
        ("cut", lambda a: a * np.nan),
        ("roots", lambda a: a - np.int32(1)),
        ("leaf", lambda a: a + np.float32(np.inf)),
        ("leaf", lambda a: a[:-1]),
        ("cut", lambda a: a.astype(np.float32)),
    ],
)
def test_a_forest_that_cannot_be_walked_is_refused(forest, name, change):
    """Bad links, splits, numbers and types are found before a walk."""
    arrays, header = unpack(forest.to_bytes(), 1 << 30)
    arrays[name] = change(arrays[name])
    with pytest.raises(ForestFileError, match="expected a forest written by andabata"):
        Forest.from_bytes(pack(arrays, header))


def huge(header):
    """Put an integer of 400 digits in the place of the first summand."""
    header["trees"]["base"] = 10**400


@pytest.mark.parametrize(
    "change",
    [
        huge,
        lambda header: header["screen"].update(limit=10**400),
        lambda header: header.update(screen=[]),
        lambda header: header.update(exits=[[2**70, 0.0, 0.0]]),
        lambda header: header.update(trees=None),
    ],
)
def test_a_hostile_header_is_named(forest, change):
    """Integers beyond every float, and other types, are errors of the file."""
    arrays, header = unpack(forest.to_bytes(), 1 << 30)
    change(header)
    with pytest.raises(ForestFileError, match="mine: expected a forest written by andabata"):
        Forest.from_bytes(pack(arrays, header), "mine")


def test_damaged_bytes_never_crash(forest):
    """They are refused, or happen to be a valid forest."""
    data = forest.to_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(100):
        spoilt = bytearray(data)
        if rng.random() < 0.3:
            spoilt = spoilt[: rng.integers(len(spoilt))]
        for place in rng.integers(0, max(len(spoilt), 1), 5):
            if len(spoilt):
                spoilt[place] = rng.integers(256)
        try:
            Forest.from_bytes(bytes(spoilt))
        except ForestFileError:
            refused += 1
    assert refused > 90
