"""The layout of a world for rays: planes, boxes and blocks of known objects."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box, ellipsoid
from worlds.rays.layout import GROUND_TOP, OBJECTS_BOTTOM, OBJECTS_TOP, build_layout

WALL = box(SemanticClass.WALL, (3.0, -1.0, 1.0), (1.0, 4.0, 2.0))


def test_a_box_has_six_planes(make_ground):
    """Twelve triangles make six planes: outward normals and distances from the origin."""
    objects = build_layout(make_ground(objects=(WALL,))).objects
    assert objects.starts.tolist() == [0, 6]
    assert objects.kinds.tolist() == [SemanticClass.WALL]
    found = sorted(np.round(objects.planes, 6).tolist())
    expected = [[1, 0, 0, 3.5], [-1, 0, 0, -2.5], [0, 1, 0, 1], [0, -1, 0, 3], [0, 0, 1, 2]]
    np.testing.assert_allclose(found, sorted([*expected, [0, 0, -1, 0]]), atol=1e-5)
    np.testing.assert_allclose(objects.boxes, [[2.5, -3, 0, 3.5, 1, 2]], atol=2e-4)


def test_every_vertex_is_inside_of_all_planes(make_ground):
    """Planes never cut a corner off."""
    ball = ellipsoid(SemanticClass.FOLIAGE, (1.0, 2.0, 3.0), (1.0, 0.7, 0.5))
    planes = build_layout(make_ground(objects=(WALL, ball))).objects.planes[6:]
    depths = ball.vertices.astype(np.float64) @ planes[:, :3].T - planes[:, 3]
    assert depths.max() < 1e-9
    np.testing.assert_allclose(depths.max(axis=0), 0.0, atol=1e-9)


@pytest.mark.parametrize("cell", [0.1, 0.3])
def test_blocks_hold_the_highest_ground_and_the_objects_that_overlap_them(make_ground, cell):
    """Each block's top is at least that of any place in it, and its objects are those listed."""
    world = make_ground(lambda x, y: 0.2 * x - 0.1 * y, (WALL,), size=9.0, cell=cell)
    lattice, tops, _, firsts, members = build_layout(world).blocks
    assert lattice.edge == pytest.approx(lattice.cells * cell)
    assert lattice.edge == pytest.approx(1.0, abs=0.15)
    x, y = np.random.default_rng(0).uniform(-4.4, 4.4, (2, 2000))
    i = ((x - lattice.x_min) / lattice.edge).astype(int)
    j = ((y - lattice.y_min) / lattice.edge).astype(int)
    above = tops[i, j, GROUND_TOP] - world.ground.height_at(x, y)
    assert above.min() > -1e-6
    assert above.max() < 0.3 * lattice.edge + 0.3 * cell
    listed = np.diff(firsts).reshape(tops.shape[:2]) == 1
    on_wall = (np.abs(x - 3.0) < 0.5) & (np.abs(y + 1.0) < 2.0)
    assert listed[i, j][on_wall].all()
    far = (np.abs(x - 3.0) > 0.6 + lattice.edge) | (np.abs(y + 1.0) > 2.1 + lattice.edge)
    assert not listed[i, j][far].any()
    np.testing.assert_array_equal(np.isfinite(tops[..., OBJECTS_TOP]), listed)
    np.testing.assert_allclose(tops[listed][:, OBJECTS_TOP], 2.0, atol=1e-5)
    np.testing.assert_allclose(tops[listed][:, OBJECTS_BOTTOM], 0.0, atol=1e-5)
    assert (members == 0).all()
    assert lattice.z_min < world.ground.heights.min() - 0.5
    assert lattice.z_max > 2.5


@pytest.mark.parametrize("cell", [0.1, 0.3])
def test_lids_lie_on_the_ground_and_not_below_it(make_ground, cell):
    """A plane is its own lid; bumps touch theirs; no place of a block is above it."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-4.4, 4.4, (2, 4000))
    for bump, most in ((0.0, 1e-5), (0.05, 0.15)):
        world = make_ground(
            lambda x, y, b=bump: 0.4 * x - 0.1 * y + b * np.sin(9 * x) * np.cos(7 * y),
            size=9.0,
            cell=cell,
        )
        lattice, _, lids, _, _ = build_layout(world).blocks
        i = ((x - lattice.x_min) / lattice.edge).astype(int)
        j = ((y - lattice.y_min) / lattice.edge).astype(int)
        z, dx, dy = lids[i, j].T
        above = z + dx * x + dy * y - world.ground.height_at(x, y)
        assert above.min() >= 0.0
        assert above.max() < most


def test_blocks_list_their_objects_in_order(make_ground):
    """Members of each block are the objects whose box overlaps it, counted upwards."""
    rng = np.random.default_rng(2)
    boxes = tuple(
        box(SemanticClass.WALL, (*rng.uniform(-4, 4, 2), 1.0), (*rng.uniform(0.1, 3.0, 2), 2.0))
        for _ in range(30)
    )
    lattice, tops, _, firsts, members = build_layout(make_ground(objects=boxes, size=8.0)).blocks
    corner, shape = np.array([lattice.x_min, lattice.y_min]), tops.shape[:2]
    for block, (i, j) in enumerate(np.ndindex(shape)):
        low = corner + np.array([i, j]) * lattice.edge
        overlap = [
            k
            for k, each in enumerate(boxes)
            if (each.vertices[:, :2].max(axis=0) >= low).all()
            and (each.vertices[:, :2].min(axis=0) < low + lattice.edge).all()
        ]
        assert members[firsts[block] : firsts[block + 1]].tolist() == overlap
    assert firsts[-1] == len(members)


def test_the_lattice_covers_objects_that_overhang_the_ground(make_ground):
    """Blocks begin before the ground's corner, by whole blocks."""
    over = box(SemanticClass.WALL, (-5.5, 0.0, 1.0), (2.9, 1.0, 2.0))
    layout = build_layout(make_ground(objects=(over,), size=10.0))
    lattice = layout.blocks.lattice
    assert lattice.x_min == pytest.approx(-7.0)
    assert lattice.y_min == layout.ground.frame.y_min == pytest.approx(-5.0)
    assert (lattice.first_i, lattice.first_j) == (-2 * lattice.cells, 0)
