"""Worlds and scenes that many tests share."""

import os

# Read when the libraries are loaded. Tests run side by side, and so do their commands: threads of
# one that wait for another's take several times the work.
os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
import pytest
import torch

from terrain.heightfield import Heightfield
from worlds.rays.scene import RayScene
from worlds.scenes import Scene, SceneCache
from worlds.truth import TruthConfig, build_truth
from worlds.world import World


@pytest.fixture(autouse=True)
def _same_weights():
    """Begin each test at the same random weights: no test's result is a matter of luck."""
    torch.manual_seed(0)


@pytest.fixture(autouse=True)
def _no_notice_of_compilation(monkeypatch):
    """Let no command say that it compiles: its output does not depend on what is in the cache."""
    monkeypatch.setattr("andabata.app.options.shared.on_first_compilation", lambda notice: None)


@pytest.fixture(scope="session")
def scenes():
    return SceneCache()


@pytest.fixture(scope="session")
def make_ground():
    """Return a world of one height function and some objects, 20 m square by default."""

    def make(height=lambda x, y: 0.0 * x, objects=(), size=20.0, cell=0.1):
        n = round(size / cell) + 1
        lines = (np.arange(n) - (n - 1) / 2) * cell
        heights = height(*np.meshgrid(lines, lines, indexing="ij"))
        ground = Heightfield(heights.astype(np.float32), cell)
        truth = build_truth(ground, tuple(objects), TruthConfig())
        surface = np.zeros((n - 1, n - 1), dtype=np.uint8)
        return World("made", 0, 0.0, ground, surface, tuple(objects), (), truth)

    return make


@pytest.fixture(scope="session")
def make_scene(make_ground):
    def make(*arguments, **options):
        world = make_ground(*arguments, **options)
        return Scene(world, RayScene(world))

    return make
