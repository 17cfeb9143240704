"""Footprints of objects: the cells that their triangles reach, and no others."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import SceneObject, frustum
from tests.support.true_maps import solid_at, truth_of
from worlds.footprints import mark_footprints
from worlds.traversability_map import Reason

CELL = 0.1


def marked(*objects):
    """Return the centres of the cells that objects mark on a map of 4 m about the origin [m]."""
    raster = np.zeros((40, 40), dtype=np.uint8)
    mark_footprints(objects, (-1.95, -1.95), CELL, 7, raster)
    assert set(np.unique(raster)) <= {0, 7}
    return np.argwhere(raster == 7) * CELL - 1.95


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_a_triangle_marks_the_cells_up_to_half_a_cell_beyond_its_edges(order):
    """Whichever way round its corners are; the distance from its edges decides."""
    corners = np.array([(-1.0, -1.0, 0.3), (1.2, -0.4, 0.0), (0.1, 1.1, 9.0)], dtype=np.float32)
    triangles = np.array([order], dtype=np.uint32)
    found = marked(SceneObject(SemanticClass.ROCK, corners, triangles))
    centres = np.stack(np.meshgrid(*2 * [np.arange(40) * CELL - 1.95], indexing="ij"), axis=-1)
    a, b = corners[:, :2], np.roll(corners[:, :2], -1, axis=0)
    ahead = b - a
    outward = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1) / np.linalg.norm(ahead, axis=1)[:, None]
    beyond = np.einsum("ijkd,kd->ijk", centres[:, :, None] - a, outward).max(axis=-1)
    np.testing.assert_allclose(found, centres[beyond <= CELL / 2])


def test_nothing_marks_nothing():
    """No objects, upright triangles, and those beyond the border."""
    upright = np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1)], dtype=np.float32)
    wall = SceneObject(SemanticClass.WALL, upright, np.array([[0, 1, 2]], dtype=np.uint32))
    assert len(marked()) == len(marked(wall)) == 0
    assert len(marked(frustum(SemanticClass.ROCK, (9, 9, 0), (0.5, 0.5), 1.0))) == 0


def test_a_thin_object_between_cell_centres_marks_its_cells():
    """A post of 2 cm in the corner of four cells marks them, and nothing further away."""
    post = frustum(SemanticClass.POST, (1.0, 2.0, -0.1), (0.01, 0.01), 2.0)
    truth = truth_of(np.zeros((51, 51)), (post,))
    near = [(1 + dx, 2 + dy) for dx in (-0.05, 0.05) for dy in (-0.05, 0.05)]
    assert any(solid_at(truth, *place) for place in near)
    cells = np.argwhere(truth.reason == Reason.SOLID) * 0.1 - 4.95
    assert np.hypot(*(cells - [1.0, 2.0]).T).max() < 0.25
