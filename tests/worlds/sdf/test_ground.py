"""Worlds of hills from worlds of Gazebo: ground, objects, beams and contacts."""

import numpy as np
import pytest
from PIL import Image

from terrain.classes import SemanticClass
from tests.support.collada_files import crate
from tests.support.mesh_files import angle_bar, block, ranges, save, torus
from tests.support.plants import needs_bullet
from tests.support.sdf_worlds import CUBE, PLANE, POST, document, pose, read, solid
from tests.support.true_maps import solid_at
from worlds.rays.scene import RayScene
from worlds.sdf.ground import world_of
from worlds.sdf.world import read_sdf
from worlds.traversability_map import Reason

FLAT = solid("ground", PLANE)
HILL = "<heightmap><uri>h.png</uri><size>16 16 3</size></heightmap>"


def made(folder, *parts, **options):
    """Return the import of a world of some parts."""
    return world_of(read(folder, *parts), **options)


def hill(folder):
    """Write an image with a hill in the middle, and return its heightmap."""
    edge = np.linspace(-1, 1, 65)
    values = np.exp(-4 * (edge[:, None] ** 2 + edge**2))
    Image.fromarray((255 * values).astype(np.uint8)).save(folder / "h.png")
    return solid("hill", HILL)


def test_a_heightmap_is_the_ground(tmp_path):
    """Its middle is on top; the grid is that of the image."""
    found = made(tmp_path, hill(tmp_path))
    ground = found.world.ground
    assert (ground.width, ground.depth, ground.cell) == (16.0, 16.0, 0.25)
    np.testing.assert_allclose(ground.height_at([0.0, -8.0], [0.0, -8.0]), [3.0, 0.0], atol=0.02)
    assert found.origin == (0.0, 0.0)
    assert (found.world.surface == SemanticClass.GROUND).all()
    assert (found.world.truth.reason == Reason.SLOPE).any()


def test_the_highest_of_all_grounds_counts(tmp_path):
    """A plane half as high as a hill drowns its foot."""
    ground = made(tmp_path, hill(tmp_path), solid("sea", PLANE, pose(0, 0, 1.5))).world.ground
    np.testing.assert_allclose(ground.height_at([0.0, -7.0], [0.0, -7.0]), [3.0, 1.5], atol=0.02)


def test_the_middle_of_the_bounds_is_the_origin(tmp_path):
    """Objects and heights move with it; what is beyond is left out and counted."""
    places = [(2, 0), (5, 0), (9, 0), (-1, 0), (3, 5), (3, -5)]
    posts = [solid(str(k), POST, pose(*place, 3)) for k, place in enumerate(places)]
    found = made(tmp_path, hill(tmp_path), *posts, bounds=(0.0, -4.0, 8.0, 4.0))
    world = found.world
    assert (found.origin, found.outside) == ((4.0, 0.0), 4)
    assert (world.ground.width, world.ground.depth) == (8.0, 8.0)
    np.testing.assert_allclose(world.ground.height_at(-4.0, 0.0), 3.0, atol=0.02)
    places = sorted(each.vertices[:, 0].mean() for each in world.objects)
    np.testing.assert_allclose(places, [-2.0, 1.0], atol=1e-6)


def test_without_hills_the_ground_reaches_five_metres_beyond_the_shapes(tmp_path):
    """On a plane, or at height 0 without any; the grid lines are half a metre apart."""
    parts = solid("a", CUBE, pose(0, 0, 0.5)), solid("b", CUBE, pose(10, 4, 0.5))
    for ground in ([FLAT], []):
        found = made(tmp_path, *ground, *parts)
        assert (found.world.ground.width, found.world.ground.depth) == (21.0, 15.0)
        assert found.world.ground.cell == 0.5
        assert not found.world.ground.heights.any()
        assert found.origin == (5.0, 2.0)


def test_shapes_are_objects_of_their_classes(tmp_path):
    """Walls, posts and rocks; one that is under the ground is left out."""
    parts = [
        solid("a", CUBE, pose(0, 0, 0.5)),
        solid("b", POST, pose(2, 0, 0.5)),
        solid("c", "<sphere><radius>0.3</radius></sphere>", pose(4, 0, 0.2)),
        solid("d", CUBE, pose(6, 0, -2)),
    ]
    found = made(tmp_path, FLAT, *parts)
    kinds = [each.semantic for each in found.world.objects]
    assert kinds == [SemanticClass.WALL, SemanticClass.POST, SemanticClass.ROCK]
    assert found.outside == 1
    truth, (x, y) = found.world.truth, found.origin
    assert solid_at(truth, np.array([0, 2, 4]) - x, np.zeros(3) - y).all()
    assert not solid_at(truth, 6 - x, -y)


def test_a_world_of_space_has_tasks_and_one_without_has_none(tmp_path):
    """Starts and goals are safe, and the same each time."""
    parts = FLAT, solid("a", CUBE, pose(0, 0, 0.5)), solid("b", CUBE, pose(20, 20, 0.5))
    world = made(tmp_path, *parts).world
    assert len(world.tasks) == 12
    for task in world.tasks:
        assert world.truth.clearance_at(task.start.x, task.start.y) >= 1.3
        assert world.truth.clearance_at(*task.goals[0]) >= 1.3
    assert made(tmp_path, *parts).world.tasks == world.tasks
    assert made(tmp_path, FLAT, solid("a", CUBE), bounds=(-1.0, -1.0, 1.0, 1.0)).world.tasks == ()


def test_no_task_begins_inside_of_a_mesh(tmp_path):
    """A solid angle bar has room inside for a robot; its plates would not keep it out."""
    save(tmp_path / "bar.ply", angle_bar(20.0, 9.0, 2.0))
    sunk = solid("m", "<mesh><uri>bar.ply</uri></mesh>", pose(0, 0, -0.5))
    found = made(tmp_path, FLAT, sunk, bounds=(-6.0, -6.0, 22.0, 22.0))
    assert len(found.world.tasks) == 12
    places = np.array([p for t in found.world.tasks for p in ((t.start.x, t.start.y), t.goals[0])])
    x, y = (places + found.origin).T
    within = (x > 0) & (x < 20) & (y > 0) & (y < 20)
    assert not (within & ((x < 9) | (y < 9))).any()


def test_a_world_is_named_as_a_file_can_be(tmp_path):
    """Names of worlds may hold anything."""
    path = tmp_path / "a.world"
    path.write_text(document(FLAT, world="my world/1"))
    assert world_of(read_sdf(path)).world.name == "my_world_1"


def test_a_named_model_is_ground_and_no_object(tmp_path):
    """A ramp that would else be a wall; other models stay what they are."""
    ramp = solid("ramp", "<box><size>4 4 0.2</size></box>", pose(0, 0, 0.3, 0, -0.1, 0))
    parts = FLAT, ramp, solid("post", POST, pose(5, 0, 0.5))
    assert [each.semantic for each in made(tmp_path, *parts).world.objects] == [
        SemanticClass.WALL,
        SemanticClass.POST,
    ]
    found = made(tmp_path, *parts, ground=["ramp"], bounds=(-6.0, -6.0, 6.0, 6.0))
    assert [each.semantic for each in found.world.objects] == [SemanticClass.POST]
    heights = found.world.ground.height_at([-1.0, 0.0, 1.0], 0.0)
    np.testing.assert_allclose(np.diff(heights), np.tan(0.1), atol=1e-4)
    with pytest.raises(ValueError, match="ground: expected names of models, got lost"):
        made(tmp_path, *parts, ground=["ramp", "lost"])


@pytest.mark.parametrize("shape", ["torus", "bar", "cube", "cylinder"])
def test_beams_end_where_they_do_on_the_shape_itself(tmp_path, shape):
    """Rays from outside at shapes that stand askew, against open3d on the same triangles."""
    meshes = {"torus": torus(0.8, 0.3), "bar": angle_bar(1.0, 0.3, 1.0)}
    text = {"cube": CUBE, "cylinder": "<cylinder><radius>0.5</radius><length>1</length></cylinder>"}
    if shape in meshes:
        save(tmp_path / "a.ply", meshes[shape])
        text[shape] = "<mesh><uri>a.ply</uri></mesh>"
    found = made(
        tmp_path,
        solid("m", text[shape], pose(0, 0, 2, 0.5, 0.3, 0.8)),
        bounds=(-6.0, -6.0, 6.0, 6.0),
    )
    world = found.world
    rng = np.random.default_rng(0)
    starts = rng.normal(size=(4000, 3))
    starts *= 1.9 / np.linalg.norm(starts, axis=1, keepdims=True)
    aims = rng.uniform(-0.9, 0.9, (4000, 3)) - starts
    rays = np.hstack(
        [starts + np.array([0, 0, 2]), aims / np.linalg.norm(aims, axis=1, keepdims=True)]
    )
    seen, classes = RayScene(world).cast(rays.astype(np.float32), np.full(4000, np.inf, np.float32))
    seen[classes != world.objects[0].semantic] = np.inf
    if shape in meshes:
        (solid_,) = read(tmp_path, solid("m", text[shape], pose(0, 0, 2, 0.5, 0.3, 0.8))).solids
        moved = meshes[shape].vertices @ solid_.pose[:3, :3].T + solid_.pose[:3, 3]
        wanted = ranges(meshes[shape]._replace(vertices=moved), rays)
    else:
        (only,) = world.objects
        wanted = ranges(type(torus())(only.vertices, only.triangles.astype(np.int64)), rays)
    hit = np.isfinite(wanted)
    assert 500 < hit.sum() < 3900
    # Rays that pass an edge by less than rounding may differ.
    alike = np.isfinite(seen) == hit
    alike[alike & hit] = abs(seen[alike & hit] - wanted[alike & hit]) < 1e-3
    assert alike.mean() > 0.998


def touched(world, places):
    """Return whether a ball of 0.2 m touches a solid of a world at each place, in pybullet."""
    from worlds.bodies import build_bodies
    from worlds.quiet_pybullet import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    try:
        bodies = build_bodies(world, client)
        ball = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=0.2, physicsClientId=client
        )
        found = []
        for x, y in places:
            body = pybullet.createMultiBody(
                0.1, ball, basePosition=[x, y, 0.5], physicsClientId=client
            )
            near = [
                pybullet.getClosestPoints(body, solid_, 0.0, physicsClientId=client)
                for solid_ in bodies.solids
            ]
            found.append(any(near))
            pybullet.removeBody(body, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    return found


@needs_bullet
def test_meshes_are_met_by_bodies(tmp_path):
    """pybullet's contacts with an angle bar: in its corner there is room, at its sides none."""
    save(tmp_path / "bar.ply", angle_bar(2.0, 0.3, 1.0))
    text = "<mesh><uri>bar.ply</uri></mesh>"
    world = made(tmp_path, FLAT, solid("m", text), bounds=(-5.0, -5.0, 5.0, 5.0)).world
    places = [(1.0, 1.0), (1.0, 0.45), (0.45, 1.0), (1.0, 0.15), (-0.15, 1.0), (-0.3, 1.0)]
    assert touched(world, places) == [False, True, True, True, True, False]


@needs_bullet
def test_a_collada_mesh_is_seen_and_met_as_the_same_stl(tmp_path):
    """Rays and contacts, whatever the unit of the file and the nodes of its scene."""
    save(tmp_path / "stl.stl", block(1.0, 2.0, 1.0))
    crate(tmp_path / "dae.dae", (1.0, 2.0, 1.0))
    angles = np.linspace(-np.pi, np.pi, 400)
    rays = np.zeros((400, 6), np.float32)
    rays[:, 0], rays[:, 2] = -3.0, 0.4
    rays[:, 3], rays[:, 4] = np.cos(angles), np.sin(angles)
    places = [(-0.6, 0.0), (-0.8, 0.0), (0.0, 1.1), (0.0, 1.3)]
    seen = []
    for kind in ("stl", "dae"):
        shape = f"<mesh><uri>{kind}.{kind}</uri></mesh>"
        parts = FLAT, solid("m", shape, pose(0, 0, 0.5))
        world = made(tmp_path, *parts, bounds=(-5.0, -5.0, 5.0, 5.0)).world
        seen.append(RayScene(world).cast(rays, np.full(400, np.inf, np.float32))[0])
        assert touched(world, places) == [True, False, True, False]
    assert np.isfinite(seen[0]).sum() > 30
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-5)


@pytest.mark.parametrize(
    "options",
    [
        {"bounds": (0.0, 0.0, 0.0, 5.0)},
        {"bounds": (0.0, 0.0, 400.0, 5.0)},
        {"bounds": (0.0, 0.0, 5.0, 5.0), "cell": 6.0},
        {"cell": -1.0},
    ],
)
def test_bad_bounds_and_cells_are_refused(tmp_path, options):
    """Empty, too large, smaller than a cell."""
    with pytest.raises(ValueError, match="bounds: expected x_min, y_min, x_max, y_max at least"):
        made(tmp_path, FLAT, **options)
