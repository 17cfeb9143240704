"""Plants: leaves around their hulls, blades on the ground, fewer of both where it matters not."""

import numpy as np
import pytest

from andabata.report.rendering.camera import Camera
from andabata.report.rendering.canvas import Canvas
from andabata.report.rendering.plants import GRASSY, LEAFY, Plants, shares
from terrain.classes import TRAITS, SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box, ellipsoid, frustum

GROUND = Heightfield(np.full((81, 81), 2.0, dtype=np.float32), 0.25)
CROWN = ellipsoid(SemanticClass.FOLIAGE, (3.0, 1.0, 5.0), (1.0, 1.0, 1.5))
CLUMP = frustum(SemanticClass.HIGH_GRASS, (-2.0, 1.0, 1.9), (0.4, 0.3), 0.9, 7)
ROCK = box(SemanticClass.ROCK, (0.0, 0.0, 2.0), (1.0, 1.0, 1.0))


@pytest.fixture(scope="module")
def plants():
    """Return a crown and a clump of grass; a rock is no plant."""
    return Plants.of([CROWN, ROCK, CLUMP], GROUND)


def test_every_porous_class_is_drawn_as_a_plant():
    """What beams pass through has leaves or blades."""
    porous = {each for each, traits in TRAITS.items() if np.isfinite(traits.hits_per_metre)}
    assert porous == {*LEAFY, *GRASSY}


def test_leaves_lie_about_their_hull(plants):
    """None is farther out than 1.1 of the hull, none in its middle; more than a hundred."""
    out = (plants.leaves - [3.0, 1.0, 5.0]) / [1.0, 1.0, 1.5]
    distances = np.linalg.norm(out, axis=1)
    assert len(distances) > 100
    assert 0.4 < distances.min() < distances.max() < 1.1
    assert plants.leaves.mean(axis=0) == pytest.approx([3.0, 1.0, 5.0], abs=0.15)


def test_blades_stand_on_the_ground_within_their_clump(plants):
    """Feet are on the ground, tips above them, none higher than the clump."""
    assert len(plants.feet) > 50
    assert plants.feet[:, 2] == pytest.approx(2.0)
    assert np.hypot(*(plants.feet[:, :2] - [-2.0, 1.0]).T).max() <= 0.41
    heights = plants.tips[:, 2] - plants.feet[:, 2]
    assert heights.min() > 0.3
    assert plants.tips[:, 2].max() <= 1.9 + 0.9 + 1e-6


def test_the_same_objects_have_the_same_leaves():
    """Nothing is drawn from a clock."""
    first, second = (Plants.of([CROWN, CLUMP], GROUND) for _ in range(2))
    np.testing.assert_array_equal(first.leaves, second.leaves)
    np.testing.assert_array_equal(first.tips, second.tips)


def test_a_world_without_plants_has_none():
    """Empty arrays of the right shapes."""
    none = Plants.of([ROCK], GROUND)
    assert (none.leaves.shape, none.tips.shape, none.blade_colours.shape) == ((0, 3),) * 3


def test_far_plants_have_fewer_parts_and_those_before_the_subject_none():
    """All near ones without a subject; of those nearer than the subject none; some far away."""
    near, at, far = shares(np.array([5.0, 12.0, 200.0]), 0.0)
    assert (near, at) == (1.0, 1.0)
    assert 0 < far < 0.2
    before, beside = shares(np.array([5.0, 15.0]), 10.0)
    assert (before, beside) == (0.0, 1.0)


def test_plants_are_drawn_where_they_stand(plants):
    """Green pixels lie around the crown's place in the picture."""
    camera = Camera.looking_at(np.array([-9.0, 1.0, 5.0]), np.array([3.0, 1.0, 5.0]), (160, 120))
    count = 160 * 120
    canvas = Canvas.of(camera, np.zeros((count, 3)), np.full(count, np.inf))
    plants.draw(canvas)
    there = np.argwhere(canvas.depths[:90] < 1e6)
    assert there.mean(axis=0) == pytest.approx([60, 80], abs=5)
    red, green, blue = canvas.colours[60, 80]
    assert green > max(red, blue)
