"""Measured ranges of given rays, against the casts that they come from."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.ranging import measure_beams
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rays.scene import RayScene
from worlds.scenes import Scene

SWEEPS, BEAMS = 2, 90


def measured(scene, rays, depths, reach, errors, time=0.0):
    """Return ranges and classes of rays of one time [s]."""
    ranges = np.empty((SWEEPS, BEAMS), dtype=np.float32)
    classes = np.empty((SWEEPS, BEAMS), dtype=np.uint8)
    given = np.asfortranarray(rays), np.full(len(rays), time), depths, scene.rays.layout, None
    measure_beams(*given, reach, np.uint64(7), np.array(errors), 1, ranges, classes)
    return ranges.ravel(), classes.ravel()


@pytest.fixture
def fan(make_scene):
    """Return a scene with posts, and rays all around in two sweeps that descend a little."""
    places = [(3.0, 0.0), (0.0, 5.0), (-4.0, 0.5), (8.0, 1.0)]
    posts = [box(SemanticClass.POST, (x, y, 1.0), (0.6, 0.6, 2.0)) for x, y in places]
    turn, rays = np.linspace(0, 2 * np.pi, SWEEPS * BEAMS), np.zeros((SWEEPS * BEAMS, 6))
    rays[:, 2], rays[:, 5] = 0.7, -0.08
    rays[:, 3], rays[:, 4] = np.cos(turn), np.sin(turn)
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    depths = np.full(len(rays), np.inf, dtype=np.float32)
    return make_scene(objects=posts), rays.astype(np.float32), depths


def test_without_errors_ranges_are_those_of_the_cast(fan):
    """A laser without errors measures what its rays hit, within its ranges."""
    scene, rays, depths = fan
    ranges, classes = measured(scene, rays, depths, np.inf, [0.0, 0.0, 0.3, 0.0, 0.0, 6.0])
    true, kinds = scene.rays.cast(rays, depths, 6.0)
    assert 0 < np.isfinite(true).sum() < len(true)
    np.testing.assert_array_equal(ranges, true)
    np.testing.assert_array_equal(classes, kinds)


def test_a_mixed_pixel_lies_between_a_near_surface_and_the_one_behind_it(fan):
    """Where all edges are mixed, the one behind may even be beyond the reach."""
    scene, rays, depths = fan
    true, kinds = scene.rays.cast(rays, depths)
    rows = true.reshape(SWEEPS, BEAMS)
    near = np.minimum(np.roll(rows, 1, axis=1), np.roll(rows, -1, axis=1))
    near[:, 0], near[:, -1] = rows[:, 1], rows[:, -2]
    edges = np.ravel(rows - near > 0.3)
    for reach in (np.inf, 5.0):
        ranges, classes = measured(scene, rays, depths, reach, [0.0, 0.0, 0.3, 1.0, 0.0, 30.0])
        found = edges & (near.ravel() < reach)
        assert (ranges[found] > near.ravel()[found]).all()
        assert (ranges[found] < true[found]).all()
        np.testing.assert_array_equal(classes[found], kinds[found])
        plain = ~edges & (true < reach)
        np.testing.assert_array_equal(ranges[plain], true[plain])


@pytest.mark.parametrize("reach", [np.inf, 5.0])
def test_leaves_are_those_of_the_time_of_the_beam(make_ground, fan, reach):
    """In wind a beam of a minute later meets others, a mixed pixel's second cast too."""
    bush = box(SemanticClass.BUSH, (0.0, 0.0, 1.0), (16.0, 16.0, 2.0))
    world = replace(make_ground(objects=[bush]), wind=1.0)
    scene, errors = Scene(world, RayScene(world)), [0.0, 0.0, 0.3, 1.0, 0.0, 30.0]
    _, rays, _ = fan
    depths = np.full(len(rays), 0.5, dtype=np.float32)
    for time in (0.0, 60.0):
        ranges, _ = measured(scene, rays, depths, reach, [*errors[:3], 0.0, *errors[4:]], time)
        true, _ = scene.rays.cast(rays, depths, reach, np.full(len(rays), time))
        np.testing.assert_array_equal(ranges, true)
    found = [measured(scene, rays, depths, reach, errors, time)[0] for time in (0.0, 60.0)]
    assert (found[0] != found[1]).mean() > 0.3
