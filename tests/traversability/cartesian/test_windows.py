"""Planes in windows: equal to a least-squares fit of the cells themselves."""

import numpy as np
import pytest

from traversability.cartesian.windows import (
    EDGE_CELLS,
    OWN_MEAN,
    OWN_TOP,
    WINDOW_FEATURES,
    WINDOWS,
    add_columns,
    add_flat_cell,
    fit_planes,
    make_workspace,
    no_flat_cells,
    remove_flat_cell,
)

N, CELL = 32, 0.1


def made(heights):
    """Return the flat cells of a map of heights, NaN where there is none."""
    flat = no_flat_cells(N)
    for i, j in np.argwhere(np.isfinite(heights)):
        add_flat_cell(flat, i, j, heights[i, j], CELL)
    return flat


def described(flat, row, column, own):
    """Return the features of the windows around a ground cell, shape (windows, features)."""
    work, found = make_workspace(N), np.zeros(len(WINDOWS) * len(WINDOW_FEATURES), np.float32)
    add_columns(flat, row, column - WINDOWS[-1], column + WINDOWS[-1] + 1, work.sums)
    fit_planes(flat, (row, column, CELL), own, work, found)
    return found.reshape(len(WINDOWS), -1)


def expected(heights, row, column, own, reach):
    """Return the features of one window by a plain fit."""
    around = [slice(EDGE_CELLS * (k - reach), EDGE_CELLS * (k + reach + 1)) for k in (row, column)]
    u, v = np.argwhere(np.isfinite(heights[tuple(around)])).T
    z = heights[tuple(around)][u, v]
    design = np.stack([CELL * u, CELL * v, np.ones(len(u))], axis=1)
    plane = np.linalg.lstsq(design, z, rcond=None)[0]
    beside = z - design @ plane
    place = EDGE_CELLS * reach + np.stack(np.meshgrid([0, 1], [0, 1], indexing="ij"), axis=2)
    off = own[..., OWN_MEAN] - CELL * place @ plane[:2] - plane[2]
    peak = off + own[..., OWN_TOP] - own[..., OWN_MEAN] - np.abs(plane[:2]).sum() * CELL / 2
    share = len(z) / (EDGE_CELLS * (2 * reach + 1)) ** 2
    steep, rough = np.hypot(*plane[:2]), np.sqrt((beside**2).mean())
    return [share, steep, rough, np.ptp(beside), np.nanmax(off), np.nanmin(off), np.nanmax(peak)]


@pytest.mark.parametrize("height", [0.0, 900.0])
@pytest.mark.parametrize("place", [(8, 8), (5, 9), (10, 6)])
def test_features_are_those_of_a_least_squares_fit(place, height):
    """On rough ground with holes, wherever the window lies, high above the origin too."""
    rng = np.random.default_rng(sum(place))
    i, j = np.indices((N, N))
    heights = height + 0.02 * i - 0.01 * j + rng.normal(0, 0.03, (N, N))
    heights[rng.random((N, N)) < 0.4] = np.nan
    own = height + rng.normal(0, 0.1, (EDGE_CELLS, EDGE_CELLS, 2))
    own[0, 1] = np.nan
    found = described(made(heights), *place, own)
    for k, reach in enumerate(WINDOWS):
        known = expected(heights, *place, own, reach)
        np.testing.assert_allclose(found[k], known, atol=3e-4 if height else 1e-6)


def test_a_cell_that_is_removed_leaves_nothing():
    """What was added and removed is as if it had never been."""
    heights = np.random.default_rng(0).normal(0, 1, (N, N))
    flat, empty = made(heights), no_flat_cells(N)
    for i, j in np.ndindex(N, N):
        remove_flat_cell(flat, i, j)
    np.testing.assert_array_equal(flat.heights, empty.heights)
    np.testing.assert_array_equal(flat.moments, empty.moments)


def test_cells_in_a_row_and_few_cells_have_no_plane():
    """All but the share of flat cells is unknown."""
    own = np.zeros((EDGE_CELLS, EDGE_CELLS, 2))
    for places in ([(16, 13 + k) for k in range(6)], [(16, 16), (17, 18), (15, 14), (14, 17)]):
        heights = np.full((N, N), np.nan)
        heights[tuple(np.transpose(places))] = 0.2
        near = described(made(heights), 8, 8, own)[0]
        assert near[0] == pytest.approx(sum(14 <= j < 20 for _, j in places) / 36)
        assert near[1:].tolist() == [-1.0] * (len(WINDOW_FEATURES) - 1)
