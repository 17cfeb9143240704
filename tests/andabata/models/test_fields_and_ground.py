"""The shipped forest: plants that block are blocked, ground that must stay free is free.

Both halves stand together: a forest that calls more blocked passes one and fails the other.
"""

import numpy as np
import pytest

from andabata.models import shipped_forest
from tests.support.level_clouds import LASERS, Cover, free_ground, plant_field
from traversability.labels import CellState, label_cells
from traversability.scanner import TraversabilityScanner

EDGE = 3.0


@pytest.fixture(scope="module")
def scanner():
    return TraversabilityScanner(shipped_forest())


def field_results(scanner, cases):
    """Return recall of each case's cells, and how many sectors run 1.5 m into its field."""
    recalls, into = [], []
    for laser, height, plants, stopped, seed in cases:
        seen = plant_field(laser, height, plants, stopped, np.random.default_rng(seed), EDGE)
        bad = seen.plants & (seen.points[:, 2] > 0.15)
        truth = label_cells(seen.points, bad, scanner.grid) == CellState.NON_TRAVERSABLE
        called = scanner.cells(seen.points) == CellState.NON_TRAVERSABLE
        ahead = np.abs(scanner.grid.bearings) < np.deg2rad(45)
        limit = EDGE / np.cos(scanner.grid.bearings[ahead]) + 1.5
        ranges = np.minimum(scanner.scan(seen.points).ranges[ahead], scanner.grid.outer_radius)
        recalls.append((called & truth).sum() / truth.sum() if truth.any() else np.nan)
        into.append(int((ranges > limit).sum()))
    return np.array(recalls), np.array(into)


def drawn_fields(count, low, high, seed):
    """Yield drawn cases: lasers, their heights, plants and densities."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        laser = list(LASERS)[int(rng.integers(len(LASERS)))]
        yield laser, rng.uniform(0.5, 1.8), rng.uniform(low, high), rng.uniform(0.1, 0.6), k


def test_fields_from_40_cm_on_are_blocked(scanner):
    """Of 150 drawn ones no sector runs 1.5 m in, and the mean recall is 0.98."""
    recall, into = field_results(scanner, drawn_fields(150, 0.4, 1.2, 1))
    assert np.nanmean(recall) >= 0.98
    assert into.sum() == 0


def test_fields_of_30_cm_are_blocked(scanner):
    """Of 50 drawn ones the mean recall is 0.90."""
    recall, _ = field_results(scanner, drawn_fields(50, 0.3, 0.32, 2))
    assert np.nanmean(recall) >= 0.90


@pytest.mark.parametrize("laser", LASERS)
def test_level_ground_without_any_noise_is_free(scanner, laser):
    """From four heights no cell is blocked: a simulator's first cloud is no closed ring."""
    for height in (0.6, 0.95, 1.28, 1.73):
        points = free_ground(laser, height, Cover(noise=0.0), np.random.default_rng(0))
        assert not (scanner.cells(points) == CellState.NON_TRAVERSABLE).any(), height


def test_covered_ground_is_free(scanner):
    """Of 200 drawn cases of grass, litter and noise no more than a few cells are blocked."""
    rng = np.random.default_rng(3)
    shares = []
    for k in range(200):
        laser = list(LASERS)[int(rng.integers(len(LASERS)))]
        cover = Cover(
            noise=rng.uniform(0.0, 0.03),
            blades=rng.uniform(0.02, 0.15) * (rng.random() < 0.5),
            share=rng.uniform(0.1, 0.7),
            litter=rng.uniform(0.0, 0.02) * (rng.random() < 0.5),
        )
        points = free_ground(laser, rng.uniform(0.5, 1.8), cover, np.random.default_rng(k))
        cells = scanner.cells(points)
        shares.append((cells == CellState.NON_TRAVERSABLE).sum() / (cells > 0).sum())
    assert max(shares) <= 0.05


def test_undulating_ground_with_tufts_is_free(scanner):
    """Undulations of 2 to 3.5 cm with grass of 5 to 10 cm: one cell in a hundred at most."""
    rng = np.random.default_rng(4)
    shares = []
    for k in range(60):
        laser = list(LASERS)[int(rng.integers(len(LASERS)))]
        cover = Cover(blades=rng.uniform(0.05, 0.1), share=0.4, undulation=rng.uniform(0.02, 0.035))
        points = free_ground(laser, rng.uniform(0.5, 1.8), cover, np.random.default_rng(k))
        cells = scanner.cells(points)
        shares.append((cells == CellState.NON_TRAVERSABLE).sum() / (cells > 0).sum())
    assert np.mean(shares) <= 0.01
