"""Rays against the ground: where a walk begins, and that nothing is hit before."""

import numpy as np
import pytest

from terrain.kernel import kernel
from worlds.rays.geometry import read_ray
from worlds.rays.ground import start_of_walk
from worlds.rays.layout import Lid
from worlds.rays.scene import RayScene


@kernel
def start_of(rays, lid, begin, stop, side):
    """Return where the walk of the first of some rays begins [m], and its side of the ground."""
    return start_of_walk(read_ray(rays, 0), lid, begin, stop, side)


@pytest.mark.parametrize(
    ("dz", "lid", "begin", "side", "expected"),
    [
        (-0.6, Lid(1.0, 0.0, 0.0), 0.0, 0, (5.0, 1)),
        (-0.6, Lid(1.0, 0.0, 0.0), 6.0, 0, (6.0, 0)),
        (-0.6, Lid(4.5, 0.0, 0.0), 0.0, 0, (0.0, 0)),
        (-0.6, Lid(1.0, 0.0, 0.0), 0.0, -1, (0.0, -1)),
        (-0.6, Lid(0.0, 0.5, 0.0), 0.0, 0, (4.0, 1)),
        (-0.6, Lid(-3.0, 0.0, 0.0), 0.0, 0, (9.0, 1)),
        (0.6, Lid(5.0, 0.0, 0.0), 0.0, 0, (0.0, 0)),
        (0.0, Lid(1.0, 0.0, 0.0), 0.0, 0, (9.0, 1)),
        (0.6, Lid(0.0, 0.75, 0.0), 0.0, 0, (9.0, 1)),
    ],
)
def test_a_walk_begins_where_a_ray_comes_down_to_the_lid(dz, lid, begin, side, expected):
    """From 4 m at 0.6 m a metre; not before the block, from below, or where it stays above."""
    rays = np.array([[0, 0, 4, np.sqrt(1 - dz**2), 0, dz]], dtype=np.float32)
    found = start_of(rays, lid, begin, 9.0, side)
    assert found == (pytest.approx(expected[0], abs=2e-6), expected[1])
    assert found[0] <= expected[0] + 1e-9


def test_ground_is_hit_where_a_walk_through_all_cells_hits_it(make_ground):
    """Bit for bit: with lids far above the ground no ray begins its walk any later."""
    rng = np.random.default_rng(3)
    scene = RayScene(make_ground(lambda x, y: 0.4 * np.sin(3 * x) + 0.3 * np.cos(2 * y)))
    n, blocks = 2000, scene.layout.blocks
    azimuth, fall = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.05, 1.5, n)
    level = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1) * np.cos(fall)[:, None]
    rays = np.column_stack([rng.uniform(-4, 4, (n, 2)), np.full(n, 1.5), level, -np.sin(fall)])
    rays, depths = rays.astype(np.float32), np.full(n, np.inf, dtype=np.float32)
    ranges, _ = scene.cast(rays, depths)
    assert np.isfinite(ranges).mean() > 0.7
    high = blocks._replace(
        tops=np.add(blocks.tops, [10.0, 0.0, 0.0]), lids=np.add(blocks.lids, [10.0, 0.0, 0.0])
    )
    scene.layout = scene.layout._replace(blocks=high)
    np.testing.assert_array_equal(scene.cast(rays, depths)[0], ranges)
