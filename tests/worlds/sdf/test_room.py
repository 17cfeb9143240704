"""Rooms from worlds of Gazebo: everything in the slab, in its place, once, and seen exactly."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.mesh_files import angle_bar, ranges, save
from tests.support.sdf_worlds import CUBE, PLANE, POST, pose, read, solid
from worlds.rooms.room import Room
from worlds.sdf.elements import SdfError
from worlds.sdf.room import is_flat, room_of
from worlds.sdf.world import read_sdf

ROOT = os.environ.get("ANDABATA_REAL_DATA")
BARN = sorted(Path(ROOT).glob("barn/*.world*")) if ROOT else []
EIGHTH = np.pi / 4
SLOPE = "<plane><normal>0.1 0 1</normal></plane>"


def room(folder, *parts, **options):
    """Return the import of a world of some parts."""
    return room_of(read(folder, *parts), **options)


def test_boxes_posts_and_turned_boxes_have_their_kinds(tmp_path):
    """Boxes along the axes, turned by quarters, too; circles; outlines for the others."""
    parts = [
        solid("a", CUBE, pose(0, 0, 0.5)),
        solid("b", "<box><size>2 1 1</size></box>", pose(3, 0, 0.5, 0, 0, np.pi / 2)),
        solid("c", POST, pose(0, 3, 0.5)),
        solid("d", CUBE, pose(3, 3, 0.5, 0, 0, EIGHTH)),
        solid("e", PLANE),
    ]
    found = room(tmp_path, *parts, bounds=(-2.0, -2.0, 6.0, 6.0))
    plan = found.plan
    assert (plan.half, plan.origin, found.ground, found.outside) == ((4, 4), (2, 2), 0.0, 0)
    assert sorted(plan.boxes) == [(-2.5, -2.5, -1.5, -1.5), (0.5, -3.0, 1.5, -1.0)]
    assert plan.circles == ((-2.0, 1.0, 0.1),)
    ((*corners,),) = plan.outlines
    half = np.sqrt(0.5)
    wanted = [(1 - half, 1), (1, 1 - half), (1, 1 + half), (1 + half, 1)]
    np.testing.assert_allclose(sorted(corners), wanted, atol=1e-6)


def test_the_room_holds_all_obstacles_and_a_metre_around_them(tmp_path):
    """Unless bounds are given; without obstacles it is ten metres wide."""
    parts = solid("a", CUBE, pose(0, 0, 0.5)), solid("c", POST, pose(4, 8, 0.5))
    plan = room(tmp_path, *parts).plan
    assert plan.half == (3.3, 5.3)
    assert plan.origin == (1.8, 3.8)
    assert room(tmp_path, solid("e", PLANE)).plan.half == (5.0, 5.0)


def test_heights_are_above_the_ground(tmp_path):
    """The highest level plane, in the world; what hangs or lies outside of the slab is counted."""
    parts = [
        solid("ground", PLANE, pose(0, 0, 2)),
        solid("low", PLANE, pose(0, 0, 1)),
        solid("in", POST, pose(0, 0, 2.5)),
        solid("above", POST, pose(1, 0, 3.1)),
        solid("below", POST, pose(2, 0, 1.5)),
    ]
    found = room(tmp_path, *parts)
    assert (found.ground, found.outside, len(found.plan.circles)) == (2.0, 2, 1)
    higher = room(tmp_path, *parts, slab=(0.05, 0.7))
    assert (higher.outside, len(higher.plan.circles)) == (1, 2)


def test_what_is_outside_of_the_bounds_is_left_out(tmp_path):
    """What reaches in stays whole."""
    parts = [solid(str(x), CUBE, pose(x, 0, 0.5)) for x in (-3, 0, 1.9, 2.6)]
    found = room(tmp_path, *parts, bounds=(-2.0, -1.0, 2.0, 1.0))
    assert found.outside == 2
    assert sorted(found.plan.boxes) == [(-0.5, -0.5, 0.5, 0.5), (1.4, -0.5, 2.4, 0.5)]


def test_an_outline_that_is_a_hole_is_no_box(tmp_path):
    """A square frame: the room in it is free, the frame is not."""

    def square(edge):
        corners = [(-edge, -edge), (edge, -edge), (edge, edge), (-edge, edge)]
        points = "".join(f"<point>{x} {y}</point>" for x, y in corners)
        return f"<polyline>{points}<height>1</height></polyline>"

    made = Room.of("r", room(tmp_path, solid("m", square(2) + square(1))).plan)
    points = np.array([(0.0, 0.0), (1.5, 0.0), (2.5, 0.0)])
    np.testing.assert_allclose(made.clearance(points), [1.0, -0.5, 0.5])


def test_a_plan_is_checked_when_it_is_made(tmp_path):
    """Its name is that of the world, without what a file cannot hold."""
    world = read(tmp_path, solid("m", CUBE, pose(0, 0, 0.5)))
    assert room_of(world).plan.about == "from the world w"


def test_sloping_ground_is_no_room(tmp_path):
    """A slope or a ceiling is refused with its place; ``is_flat`` tells before."""
    for ground, flat in (
        (PLANE, True),
        (SLOPE, False),
        ("<plane><normal>0 0 -1</normal></plane>", False),
    ):
        world = read(tmp_path, solid("g", ground), solid("m"))
        assert is_flat(world) is flat
        if not flat:
            with pytest.raises(SdfError, match=r"test\.world:3: <collision.*expected level ground"):
                room_of(world)


@pytest.mark.parametrize(
    ("options", "wrong"),
    [
        ({"slab": (0.5, 0.05)}, "slab: expected"),
        ({"bounds": (0.0, 0.0, 0.0, 1.0)}, "bounds: expected"),
        ({"bounds": (0.0, 0.0, 300.0, 1.0)}, "of 0 to 200 m, got"),
    ],
)
def test_bad_slabs_and_bounds_are_refused(tmp_path, options, wrong):
    """Empty, or larger than a room may be."""
    with pytest.raises(ValueError, match=wrong):
        room(tmp_path, solid("m"), **options)


def test_a_mesh_is_seen_as_open3d_sees_it(tmp_path):
    """Level rays at an upright mesh end where those on the mesh itself do."""
    bar = angle_bar(1.0, 0.2, 1.0)
    save(tmp_path / "bar.ply", bar)
    text = "<mesh><uri>bar.ply</uri></mesh>"
    plan = room(tmp_path, solid("m", text, pose(0.5, 0.2, 0, 0, 0, 0.6))).plan
    made = Room.of("r", plan)
    turn = Rotation.from_euler("z", 0.6).as_matrix()
    place = (0.5 - plan.origin[0], 0.2 - plan.origin[1], 0.0)
    moved = bar._replace(vertices=bar.vertices @ turn.T + place)
    angles = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    origin = np.array([-0.6, -0.3])
    rays = np.zeros((720, 6))
    rays[:, :2], rays[:, 2] = origin, 0.3
    rays[:, 3], rays[:, 4] = np.cos(angles), np.sin(angles)
    met = ranges(moved, rays)
    ends = origin + np.where(np.isfinite(met), met, 0.0)[:, None] * rays[:, 3:5]
    hit = np.isfinite(met)
    assert hit.sum() > 50
    # Each end is on an outline, and the way there is free.
    np.testing.assert_allclose(made.clearance(ends[hit]), 0.0, atol=2e-6)
    halfway = origin + 0.5 * (ends[hit] - origin)
    assert made.clearance(halfway).min() > 0


@pytest.mark.skipif(not BARN, reason="ANDABATA_REAL_DATA names no folder with worlds")
@pytest.mark.parametrize("path", BARN, ids=lambda path: path.name)
def test_a_real_world_is_a_room_of_posts(path):
    """Every cylinder is a circle of 7.5 cm, once; the back wall stands where it is described."""
    world = read_sdf(path)
    plan = room_of(world).plan
    assert len(plan.circles) == len(set(plan.circles)) == len(world.solids) - 1
    assert {radius for *_, radius in plan.circles} == {0.075}
    assert plan.boxes == plan.outlines == ()
    lowest = min(y for _, y, _ in plan.circles) + plan.origin[1]
    assert lowest == pytest.approx(0.075)
