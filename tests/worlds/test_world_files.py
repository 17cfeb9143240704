"""World files: a world comes back as it was, and damaged files are named."""

import json
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import load, save

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box, frustum
from tests.support.walking_worlds import agent, peopled, walker
from worlds.catalogue import make_world, patch
from worlds.scenes import SceneCache
from worlds.truth import TruthConfig, build_truth
from worlds.world import MapDatum, Start, Task, World
from worlds.world_files import (
    WorldFileError,
    is_world_file,
    load_world,
    world_to_bytes,
)

KIND = "andabata-world-1"


def small(objects=True, tasks=True):
    """Return a small world."""
    heights = np.random.default_rng(0).normal(0, 0.01, (21, 31)).astype(np.float32)
    ground = Heightfield(heights, 0.5)
    things = (
        box(SemanticClass.WALL, (1.0, 2.0, 0.5), (1.0, 0.2, 1.0), 0.3),
        frustum(SemanticClass.TRUNK, (-2.0, 1.0, 0.0), (0.2, 0.1), 3.0),
    )
    things = things if objects else ()
    surface = np.full((20, 30), SemanticClass.GROUND, dtype=np.uint8)
    surface[3, 4] = SemanticClass.WATER
    drives = (Task(Start(-3.0, 0.25, 0.1), ((3.0, 1.0), (2.0, -1.0))),) if tasks else ()
    truth = build_truth(ground, things, TruthConfig(), surface)
    return World("small", 3, 0.25, ground, surface, things, drives, truth)


def same(one, other):
    """Check that two worlds are the same to the last bit."""
    assert (one.name, one.seed, one.difficulty) == (other.name, other.seed, other.difficulty)
    assert one.tasks == other.tasks
    assert one.ground.cell == other.ground.cell
    np.testing.assert_array_equal(one.ground.heights, other.ground.heights)
    np.testing.assert_array_equal(one.surface, other.surface)
    np.testing.assert_array_equal(one.truth.reason, other.truth.reason)
    np.testing.assert_array_equal(one.truth.severity, other.truth.severity)
    assert len(one.objects) == len(other.objects)
    for a, b in zip(one.objects, other.objects, strict=True):
        assert a.semantic is b.semantic
        np.testing.assert_array_equal(a.vertices, b.vertices)
        np.testing.assert_array_equal(a.triangles, b.triangles)


@pytest.mark.parametrize(("objects", "tasks"), [(True, True), (False, False)])
def test_a_world_comes_back_as_it_was(tmp_path, objects, tasks):
    """Ground, surface, objects, tasks, and the true map that follows from them."""
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(small(objects, tasks)))
    same(load_world(path), small(objects, tasks))
    assert world_to_bytes(load_world(path)) == path.read_bytes()


def test_walkers_come_back_and_no_others_are_named(tmp_path):
    """A world without walkers has no word of them in its file, as before there were any."""
    made = walker((1.0, 2.0), (0.3, -0.4), 0.2, 1.6, appears_at=3.0, duration=9.0)
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(peopled(small(), made, walker((0.0, 0.0)))))
    found = load_world(path)
    same(found, small())
    assert found.movers == (made, walker((0.0, 0.0)))
    assert world_to_bytes(found) == path.read_bytes()
    assert b"movers" not in world_to_bytes(small())


def test_behaviours_come_back_and_no_others_are_named(tmp_path):
    """People, their groups and vehicles' tracks; one without has the bytes that it ever had."""
    made = (
        agent("person", (0.0, 0.0), yields=True, seed=7),
        agent("person", (0.0, -0.8), leader=0, slot=(0.0, -0.8)),
        agent("vehicle", (5.0, 0.0), radius=0.9, track=((5.0, 0.0), (9.0, 1.0))),
    )
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(peopled(small(), *made)))
    assert load_world(path).movers == made
    assert b"behaviour" not in world_to_bytes(peopled(small(), walker((0.0, 0.0))))


def test_movers_that_a_world_cannot_have_are_refused_by_name(tmp_path):
    """One that outruns its radius, and more than 500."""
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(peopled(small(), agent("animal", (0.0, 0.0), speed=4.0))))
    with pytest.raises(WorldFileError, match=r"walkers\[0\].speed: expected at most 2.5"):
        load_world(path)
    crowd = [walker((0.0, 0.0))] * 501
    path.write_bytes(world_to_bytes(peopled(small(), *crowd)))
    with pytest.raises(WorldFileError, match="expected at most 500, got 501"):
        load_world(path)


def test_rough_ground_comes_back_with_its_base(tmp_path):
    """The true map is that of the base; a world without roughness has no word of it."""
    rng = np.random.default_rng(1)
    made = small(objects=False)
    rough = Heightfield(
        made.ground.refined(2).heights + rng.normal(0, 0.05, (41, 61)).astype(np.float32), 0.25
    )
    surface = made.surface.repeat(2, 0).repeat(2, 1)
    truth = build_truth(rough, (), TruthConfig(), surface, made.ground)
    made = replace(made, ground=rough, base=made.ground, surface=surface, truth=truth)
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(made))
    found = load_world(path)
    same(found, made)
    np.testing.assert_array_equal(found.base.heights, made.base.heights)
    assert world_to_bytes(found) == path.read_bytes()
    assert b"base" not in world_to_bytes(small())
    other = replace(made, base=Heightfield(np.zeros((3, 3), dtype=np.float32), 0.5))
    path.write_bytes(world_to_bytes(other))
    with pytest.raises(WorldFileError, match=r"base: expected the size of the ground"):
        load_world(path)


def test_low_plants_come_back(tmp_path):
    """Their heights are in the file where there are any, and have the grid's shape."""
    cover = np.random.default_rng(0).integers(0, 15, (20, 30)).astype(np.uint8)
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(replace(small(), cover=cover)))
    np.testing.assert_array_equal(load_world(path).cover, cover)
    assert load_world(path).truth.reason.tolist() == small().truth.reason.tolist()
    assert b"cover" not in world_to_bytes(small())
    path.write_bytes(world_to_bytes(replace(small(), cover=cover[1:])))
    with pytest.raises(WorldFileError, match=r"cover: expected uint8, one value a cell"):
        load_world(path)


def test_a_datum_comes_back(tmp_path):
    """A world that is nowhere on Earth has no word of it; a latitude beyond the pole is damage."""
    datum = MapDatum(latitude_deg=46.5, longitude_deg=-7.25, altitude=1234.5)
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(replace(small(), datum=datum)))
    assert load_world(path).datum == datum
    assert b"datum" not in world_to_bytes(small())
    path.write_bytes(path.read_bytes().replace(b"46.5", b"96.5"))
    with pytest.raises(WorldFileError, match="latitude_deg"):
        load_world(path)


def test_a_world_from_a_seed_comes_back_too(tmp_path):
    """With its plants and their classes."""
    world = make_world("natural", 5, config=patch("natural", 40.0, 0.5))
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(world))
    same(load_world(path), world)


def test_a_file_is_a_world_of_the_catalogue(tmp_path):
    """By its path, for every seed the same; a scene of it is made once."""
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(small()))
    assert is_world_file(str(path))
    assert not is_world_file("hill")
    same(make_world(str(path), 9, 0.9), small())
    scenes = SceneCache()
    assert scenes.get(str(path), 1) is scenes.get(str(path), 2, 0.5)


def edited(change):
    """Return the bytes of a world after a change of its arrays."""
    arrays = {name: array.copy() for name, array in load(world_to_bytes(small())).items()}
    about = {KIND: header()}
    change(arrays, about)
    return save(arrays, about)


def header(**fields):
    """Return a header with some fields."""
    base = {"name": "a", "seed": 0, "difficulty": 0.0, "cell": 0.5, "tasks": []}
    return json.dumps(base | fields)


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays, about: arrays.pop("surface"),
        lambda arrays, about: arrays.update(kinds=arrays["kinds"] + np.uint8(200)),
        lambda arrays, about: arrays.update(kinds=arrays["kinds"][:1]),
        lambda arrays, about: arrays.update(heights=arrays["heights"].astype(np.float64)),
        lambda arrays, about: arrays.update(surface=arrays["surface"][1:]),
        lambda arrays, about: arrays["heights"].fill(np.nan),
        lambda arrays, about: arrays["vertices"].fill(np.inf),
        lambda arrays, about: arrays["vertices"].fill(2e34),
        lambda arrays, about: arrays["triangles"].fill(99),
        lambda arrays, about: arrays["vertex_starts"].fill(0),
        lambda arrays, about: arrays.update(triangle_starts=arrays["triangle_starts"][::-1].copy()),
        lambda arrays, about: arrays.update(triangle_starts=np.array([0, 0, 48])),
        lambda arrays, about: about.update({KIND: "{"}),
        lambda arrays, about: about.update({KIND: "[" * 100_000 + "]" * 100_000}),
        lambda arrays, about: about.update({KIND: header(cell=10**400)}),
        lambda arrays, about: about.update({KIND: header(cell=-1.0)}),
        lambda arrays, about: about.update({KIND: header(cell=1e4)}),
        lambda arrays, about: about.update({KIND: header(extra=1)}),
        lambda arrays, about: about.update({KIND: header(tasks=[{"start": [0], "goals": []}])}),
        lambda arrays, about: about.update({"andabata-policy": about.pop(KIND)}),
        lambda arrays, about: about.clear(),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path, change):
    """Missing arrays, other types and shapes, unknown classes, indices out of bounds."""
    path = tmp_path / "bad.safetensors"
    path.write_bytes(edited(change))
    with pytest.raises(WorldFileError, match=r"bad\.safetensors: expected"):
        load_world(path)


def test_a_right_edit_is_read(tmp_path):
    """The edits above fail for what they change, not for being edits."""
    path = tmp_path / "a.safetensors"
    path.write_bytes(edited(lambda arrays, about: None))
    assert len(load_world(path).objects) == 2


@pytest.mark.parametrize("size", [0, 4, 100, -1])
def test_files_that_are_cut_off_are_refused(tmp_path, size):
    """At any length; a file that is not there is plainly not there."""
    path = tmp_path / "cut.safetensors"
    path.write_bytes(world_to_bytes(small())[:size])
    with pytest.raises(WorldFileError, match=r"cut\.safetensors: expected a whole world"):
        load_world(path)
    with pytest.raises(FileNotFoundError):
        load_world(tmp_path / "lost.safetensors")


def test_wind_comes_back_and_still_air_is_not_named(tmp_path):
    """A world without wind has the bytes that it had before there was any."""
    path = tmp_path / "a.safetensors"
    path.write_bytes(world_to_bytes(replace(small(), wind=0.2)))
    assert load_world(path).wind == 0.2
    assert b"wind" not in world_to_bytes(small())
