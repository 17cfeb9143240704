"""Contact of boxes and discs with solid objects: known gaps, normals and places."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.solid_contact import build_solids, find_near, meet_box, meet_disc
from andabata.machine.vectors import axes_of
from terrain.classes import SemanticClass
from terrain.objects import box, frustum

HALF = (0.3, 0.2, 0.1)


def axes(yaw=0.0, pitch=0.0):
    return axes_of(Rotation.from_euler("ZY", [yaw, pitch]).as_quat())


@pytest.fixture(scope="module")
def solids(make_ground):
    """Return a wall whose face is at x = 2, a trunk, a stone, and a bush, which is not solid."""
    wall = box(SemanticClass.WALL, (2.5, 0.0, 1.0), (1.0, 6.0, 2.0))
    trunk = frustum(SemanticClass.TRUNK, (-2.0, 0.0, 0.0), (0.2, 0.2), 3.0, sides=40)
    stone = box(SemanticClass.ROCK, (0.0, 3.0, 0.0), (0.4, 0.4, 0.1))
    bush = box(SemanticClass.BUSH, (0.0, 0.0, 0.5), (1.0, 1.0, 1.0))
    return build_solids(make_ground(objects=[bush, wall, trunk, stone]))


def test_what_is_near_is_found_once(solids):
    """An object of many blocks counts once, what wheels pass through not at all."""
    near = np.zeros(8, dtype=np.int64)
    found = {
        place: sorted(near[: find_near((*place, 0.5), 1.0, solids, near)].tolist())
        for place in [(0.0, 0.0), (2.0, 0.0), (-2.5, 0.5), (0.0, 2.5), (50.0, 0.0)]
    }
    assert list(found.values()) == [[], [0], [1], [2], []]


@pytest.mark.parametrize("gap", [0.05, -0.03])
def test_a_side_against_a_wall_touches_in_the_middle_of_its_lower_edge(solids, gap):
    """Gap and normal are those of the planes."""
    met = meet_box((1.7 - gap, 0.4, 0.5), axes(), HALF, solids, 0)
    assert met.gap == pytest.approx(gap, abs=1e-6)
    np.testing.assert_allclose(met.normal, [-1.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(met.place[1:], [0.4, 0.4], atol=1e-6)
    assert met.place[0] == pytest.approx(2.0 - gap, abs=abs(gap) + 1e-6)


def test_a_turned_box_touches_a_wall_with_its_corner(solids):
    """The gap is that of the corner, and the force acts there."""
    met = meet_box((1.5, 0.0, 0.5), axes(yaw=0.5), HALF, solids, 0)
    corner = 0.3 * np.cos(0.5) + 0.2 * np.sin(0.5)
    assert met.gap == pytest.approx(0.5 - corner, abs=1e-6)
    np.testing.assert_allclose(met.normal, [-1.0, 0.0, 0.0], atol=1e-6)
    assert met.place[1] == pytest.approx(0.3 * np.sin(0.5) - 0.2 * np.cos(0.5), abs=1e-6)


@pytest.mark.parametrize("aside", [0.0, 0.1])
def test_a_side_against_a_trunk_touches_where_the_trunk_is(solids, aside):
    """The force acts abreast of the trunk's axis."""
    met = meet_box((-1.52, aside, 0.5), axes(), HALF, solids, 1)
    assert met.gap == pytest.approx(-0.02, abs=2e-3)
    np.testing.assert_allclose(met.normal, [1.0, 0.0, 0.0], atol=1e-6)
    assert met.place[1] == pytest.approx(0.0, abs=0.01)


def test_a_box_passes_over_a_stone(solids):
    """A floor above the stone is apart from it by the difference of their heights."""
    met = meet_box((0.0, 3.0, 0.2), axes(), HALF, solids, 2)
    assert met.gap == pytest.approx(0.05, abs=1e-6)
    np.testing.assert_allclose(met.normal, [0.0, 0.0, 1.0], atol=1e-6)


@pytest.mark.parametrize(
    ("x", "z", "distance", "way"),
    [
        (0.0, 0.13, 0.08, (0.0, -1.0)),
        (-0.25, 0.0, 0.05, (1.0, 0.0)),
        (-0.28, 0.11, 0.1, (0.8, -0.6)),
        (-0.31, 0.0, np.inf, (0.0, 1.0)),
        (0.0, 0.02, 0.0, (0.0, -1.0)),
    ],
)
def test_a_disc_meets_the_nearest_point_of_a_stone(solids, x, z, distance, way):
    """It is on the top, a side or an edge; a disc that is apart meets nothing."""
    for aside in (2.9, 3.1):
        met = meet_disc((x, aside, z), axes(), 0.105, solids, 2)
        assert met.distance == pytest.approx(distance, abs=1e-6)
        np.testing.assert_allclose(met.way, [way[0], 0.0, way[1]], atol=1e-5)
    assert meet_disc((x, 3.21, z), axes(), 0.105, solids, 2).distance == np.inf


def test_a_tilted_disc_meets_a_trunk_at_its_own_height(solids):
    """In the plane of a disc that is turned and tilted the cut is an ellipse: still exact."""
    met = meet_disc((-1.7, 0.0, 1.0), axes(yaw=np.pi, pitch=0.3), 0.2, solids, 1)
    assert met.distance == pytest.approx(0.1 * np.cos(0.0), abs=2e-3)
    np.testing.assert_allclose(met.way, [-1.0, 0.0, 0.0], atol=0.02)
