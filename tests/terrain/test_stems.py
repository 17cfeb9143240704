"""Bushes and small trees on solid stems: sizes as stated, and what the true map makes of them."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.stems import sapling, shrub

GROUND = Heightfield(np.full((41, 41), 5.0, dtype=np.float32), 0.5)


def made(make, count=200):
    """Return the parts of many plants at a place."""
    return [make(GROUND, 1.0, 2.0, np.random.default_rng(seed)) for seed in range(count)]


def thickness(stem):
    """Return the diameter of a rod of six sides [m]."""
    ring = stem.vertices[:6].astype(float)
    return 2 * np.linalg.norm(ring - ring.mean(axis=0), axis=1).mean()


def stems(parts):
    """Return the parts that stand in the ground."""
    return [
        part
        for part in parts
        if part.semantic is SemanticClass.TRUNK and part.vertices[:, 2].min() < 5.0
    ]


def test_a_shrub_is_a_bush_on_two_to_six_thin_stems():
    """Stems are 2 to 6 cm thick, end in the crown and begin near each other."""
    plants = made(shrub)
    counts = {len(stems(parts)) for parts in plants}
    assert counts == {2, 3, 4, 5, 6}
    thick = [thickness(stem) for parts in plants for stem in stems(parts)]
    assert 0.0199 < min(thick) < 0.022 < 0.058 < max(thick) < 0.0601
    for parts in plants:
        crown = next(part for part in parts if part.semantic is SemanticClass.BUSH)
        high = crown.vertices[:, 2].max() - 5.0
        assert 0.49 < high < 1.61
        assert crown.vertices[:, 2].min() == pytest.approx(5.0, abs=1e-4)
        for stem in stems(parts):
            assert stem.vertices[:, 2].max() - 5.0 == pytest.approx(0.75 * high, abs=0.04)
            assert np.hypot(*(stem.vertices[:6, :2].mean(axis=0) - [1.0, 2.0])) < 0.13


def test_half_of_the_saplings_are_clumps():
    """Stems are 4 to 20 cm thick when alone; each has a crown, and branches above the ground."""
    plants = made(sapling)
    alone = [parts for parts in plants if len(stems(parts)) == 1]
    assert len(alone) == pytest.approx(100, abs=25)
    assert {len(stems(parts)) for parts in plants} == {1, 2, 3, 4}
    thick = [thickness(stem) for parts in alone for stem in stems(parts)]
    assert 0.039 < min(thick) < 0.06 < 0.17 < max(thick) < 0.201
    for parts in plants:
        crowns = [part for part in parts if part.semantic is SemanticClass.FOLIAGE]
        assert len(crowns) == len(stems(parts))
        branches = len(parts) - 2 * len(crowns)
        assert 2 * len(crowns) <= branches <= 4 * len(crowns)
    highs = [max(part.vertices[:, 2].max() for part in parts) - 5.0 for parts in plants]
    assert 1.7 < min(highs) < max(highs) < 4.8
