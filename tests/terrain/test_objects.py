"""Every object is a closed convex solid whose faces look outwards."""

import numpy as np
import pytest

from terrain.classes import TRAITS, SemanticClass
from terrain.objects import box, ellipsoid, frustum, log, rock

RNG = np.random.default_rng(0)
THINGS = {
    "frustum": frustum(SemanticClass.TRUNK, (1, 2, 0), (0.3, 0.2), 2.0),
    "box": box(SemanticClass.WALL, (0, 0, 1), (4, 0.4, 2), yaw=0.3),
    "ellipsoid": ellipsoid(SemanticClass.FOLIAGE, (1, 1, 4), (1, 1.5, 0.8)),
    "rock": rock((0, 0, 0), (0.3, 0.4, 0.2), RNG),
    "log": log((0, 0, 0.2), (3, 1, 0.3), 0.2),
}


@pytest.mark.parametrize("name", THINGS)
def test_faces_look_outwards_and_close_the_solid(name):
    thing = THINGS[name]
    corners = thing.vertices[thing.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre = thing.vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1) - centre) > 0).all()
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, atol=1e-5)  # A closed surface.


def test_a_box_has_its_volume():
    thing = THINGS["box"]
    corners = thing.vertices[thing.triangles].astype(np.float64)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(4 * 0.4 * 2, rel=1e-5)


def test_every_class_has_traits():
    assert set(TRAITS) == set(SemanticClass)
