"""Packets of rays: hits do not depend on a ray's neighbours; bounds hold them and are tight."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.catalogue import make_world
from worlds.rays.packet import PACKET, packet_span
from worlds.rays.scene import RayScene


def fan(origin, azimuth, elevations):
    """Return rays of one vertical plane, float32, shape (n, 6)."""
    c, s = np.cos(elevations), np.sin(elevations)
    directions = np.stack([c * np.cos(azimuth), c * np.sin(azimuth), s], axis=1)
    origins = np.broadcast_to(origin, directions.shape)
    return np.concatenate([origins, directions], axis=1).astype(np.float32)


def spans(scene, rays, max_range=np.inf):
    """Return begin and end of each packet."""
    blocks = scene.layout.blocks
    packets = (rays[k : k + PACKET] for k in range(0, len(rays), PACKET))
    return [packet_span(packet, blocks.lattice, blocks.tops, max_range) for packet in packets]


@pytest.mark.parametrize("name", ["natural-test", "park", "maze"])
@pytest.mark.parametrize("reach", [12.0, np.inf])
def test_a_hit_does_not_depend_on_the_rays_beside_it(name, reach):
    """Fans hit the same, bit for bit, as their rays shuffled, of which no packet is bounded."""
    world, rng = make_world(name, 6), np.random.default_rng(2)
    half = world.ground.width / 2
    fans = []
    for x, y in rng.uniform(-1.05 * half, 1.05 * half, (60, 2)):
        height = world.ground.height_at(np.array([x]), np.array([y]))[0] + rng.uniform(0.1, 4)
        rise = np.linspace(rng.uniform(-0.3, 0.3), np.pi - 0.1, 3 * PACKET)
        fans.append(fan((x, y, height), rng.uniform(-np.pi, np.pi), rise))
    rays, scene = np.concatenate(fans), RayScene(world)
    depths = rng.standard_exponential(len(rays), dtype=np.float32)
    ranges, classes = scene.cast(rays, depths, reach)
    order = rng.permutation(len(rays))
    shuffled, kinds = scene.cast(rays[order], depths[order], reach)
    np.testing.assert_array_equal(ranges[order], shuffled)
    np.testing.assert_array_equal(classes[order], kinds)
    assert 0.05 < np.isfinite(ranges).mean() < 0.9
    bounds = spans(scene, rays, reach)
    assert all(bound == (0.0, reach) for bound in spans(scene, rays[order], reach))
    assert any(begin >= end for begin, end in bounds)
    for k, (begin, end) in enumerate(bounds):
        hits = ranges[k * PACKET : (k + 1) * PACKET]
        assert begin <= hits.min()
        assert hits[np.isfinite(hits)].max(initial=0.0) <= end


def test_bounds_are_tight(make_ground):
    """A wall is found within two blocks; what rises past it, or away from it, meets nothing."""
    wall = box(SemanticClass.WALL, (5.5, 0.0, 1.0), (1.0, 8.0, 2.0))
    scene = RayScene(make_ground(objects=(wall,)))
    low, high = np.linspace(0.02, 0.1, PACKET), np.linspace(0.5, 0.6, PACKET)
    begin, end = spans(scene, fan((0.0, 0.0, 1.0), 0.0, low))[0]
    assert 3.0 <= begin <= 5.0
    assert 6.0 <= end <= 8.0
    for azimuth, rise in ((0.0, high), (np.pi, low)):
        begin, end = spans(scene, fan((0.0, 0.0, 1.0), azimuth, rise))[0]
        assert begin >= end


def test_rays_that_descend_or_part_are_not_bounded(make_ground):
    """One ray below the horizon, or two planes at right angles, open the bounds."""
    scene = RayScene(make_ground())
    rise = np.linspace(0.1, 0.2, PACKET)
    up = fan((0.0, 0.0, 1.0), 0.0, rise)
    assert spans(scene, up, 9.0)[0][0] >= spans(scene, up, 9.0)[0][1]
    falling = fan((0.0, 0.0, 1.0), 0.0, np.append(rise[1:], -0.01))
    apart = np.concatenate([up[:-1], fan((0.0, 0.0, 1.0), 1.0, rise[:1])])
    for rays in (falling, apart):
        assert spans(scene, rays, 9.0) == [(0.0, 9.0)]
