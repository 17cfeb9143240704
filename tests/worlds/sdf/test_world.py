"""Worlds of Gazebo as a whole: what collides is read once, what is left out is named."""

import gzip
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.sdf_worlds import (
    CUBE,
    POST,
    collision,
    document,
    link,
    model,
    model_document,
    places,
    pose,
    read,
    solid,
    write,
)
from worlds.sdf.elements import SdfError
from worlds.sdf.shapes import Cylinder, Plane
from worlds.sdf.world import read_sdf

ROOT = os.environ.get("ANDABATA_REAL_DATA")
BARN = sorted(Path(ROOT).glob("barn/*.world*")) if ROOT else []


def test_what_is_seen_but_does_not_collide_is_no_shape(tmp_path):
    """A visual is none; a model of visuals alone is named."""
    seen = '<visual name="v"><geometry><box><size>9 9 9</size></box></geometry></visual>'
    world = read(tmp_path, model("m", link(seen, collision())), model("n", link(seen)))
    assert [each.name for each in world.solids] == ["m::l::c"]
    (warning,) = world.warnings
    assert warning == (
        f'{tmp_path / "test.world"}:4: <model name="n">: a model that is seen but does not collide'
    )


def test_a_model_may_have_many_links_and_collisions(tmp_path):
    """Each is a shape with its own name."""
    parts = [link(collision(name="a"), collision(POST, name="b"), name=n) for n in "pq"]
    names = [each.name for each in read(tmp_path, model("m", *parts)).solids]
    assert names == ["m::p::a", "m::p::b", "m::q::a", "m::q::b"]


def test_what_is_left_out_is_listed(tmp_path):
    """One warning a kind, with the number and the first place; the rest is read all the same."""
    light = '<light name="sun" type="directional"><direction>0 0 1</direction></light>'
    joint = '<joint name="j" type="fixed"><parent>l</parent><child>l</child></joint>'
    plugin = '<plugin name="p" filename="f"><anything/></plugin>'
    sensor = '<sensor name="s" type="ray"/>'
    parts = [light, plugin, model("m", joint, plugin, link(sensor, collision())), "<magic/>", light]
    world = read(tmp_path, *parts)
    assert len(world.solids) == 1
    file = tmp_path / "test.world"
    assert world.warnings == (
        f'{file}:3: <light name="sun">: light left out (2 of them)',
        f'{file}:4: <plugin name="p">: plugin left out (2 of them)',
        f'{file}:5: <joint name="j">: joint left out',
        f"{file}:6: <magic>: unknown element <magic> left out",
        f'{file}:5: <sensor name="s">: sensor left out',
    )


@pytest.mark.parametrize("tag", ["actor", "population", "road", "gripper", "projector", "battery"])
def test_other_parts_of_sdf_are_listed_too(tmp_path, tag):
    """Wherever they stand."""
    place = {"gripper": model("m", "<gripper/>"), "projector": model("m", link("<projector/>"))}
    place["battery"] = model("m", link("<battery/>"))
    world = read(tmp_path, place.get(tag, f"<{tag}/>"))
    assert [tag in line and "left out" in line for line in world.warnings] == [True]


def test_unknown_elements_are_named_wherever_they_are(tmp_path):
    """In a model, a link, a collision."""
    body = model("m", "<a/>", link("<b/>", collision(inside="<c/>")))
    assert [line.split(": ")[1] for line in read(tmp_path, body).warnings] == ["<a>", "<b>", "<c>"]


def test_what_has_no_part_in_shapes_is_no_warning(tmp_path):
    """Physics, scene, gravity, friction, inertia and so on."""
    physics = "<physics><x/></physics><scene><y/></scene><gravity>0 0 -9.8</gravity><wind/><gui/>"
    inside = "<surface><friction/></surface><max_contacts>1</max_contacts>"
    body = link("<inertial><mass>1</mass></inertial><gravity>1</gravity>", collision(inside=inside))
    assert not read(tmp_path, physics, model("m", "<self_collide>0</self_collide>", body)).warnings


def test_models_that_can_move_stand_still_with_a_warning(tmp_path):
    """Unless model, include or the model around say that they are static."""
    loose = solid("m").replace("<static>1</static>", "")
    world = read(tmp_path, loose, loose.replace('"m"', '"n"'))
    assert len(world.solids) == 2
    assert "a model that can move stands still (2 of them)" in world.warnings[0]
    assert not read(tmp_path, model("around", loose)).warnings


def test_a_packed_world_is_the_same(tmp_path):
    """Plain and by gzip."""
    text = document(solid("m", at=pose(1, 2, 3)))
    path = tmp_path / "a.world.gz"
    path.write_bytes(gzip.compress(text.encode()))
    np.testing.assert_allclose(places(read_sdf(path))["m"], [1, 2, 3])


def test_of_several_worlds_one_is_taken(tmp_path):
    """The first one, with a warning about the others, or the one that is asked for."""
    worlds = "".join(
        f'<world name="{name}">{solid(name, at=pose(x, 0, 0))}</world>' for name, x in ("a1", "b2")
    )
    path = write(tmp_path / "two.sdf", f'<sdf version="1.7">{worlds}</sdf>')
    first, second = read_sdf(path), read_sdf(path, name="b")
    assert (first.name, list(places(first))) == ("a", ["a"])
    assert "second world" in first.warnings[0]
    assert (second.name, list(places(second)), second.warnings) == ("b", ["b"], ())
    with pytest.raises(SdfError, match="expected one of the worlds a, b, got 'c'"):
        read_sdf(path, name="c")


def test_a_model_alone_is_a_world(tmp_path):
    """At its own pose."""
    world = read_sdf(write(tmp_path / "m.sdf", model_document(solid("m", at=pose(1, 0, 0)))))
    assert (world.name, world.version) == ("m", "1.7")
    np.testing.assert_allclose(places(world)["m"], [1, 0, 0])


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ('<sdf version="1.6"/>', r":1: <sdf>: expected <world> or <model> inside"),
        ("<robot/>", r":1: <robot>: expected <sdf> as the outermost"),
        ('<sdf version="1.6">\n<world/></sdf>', r":2: <world>: expected an attribute name"),
        (document('<model name="m"><link/></model>'), r":3: <link>: expected an attribute name"),
        (document("<model/>"), r":3: <model>: expected an attribute name"),
        (document("<include/>"), r":3: <include>: expected <uri> inside"),
        (
            document("<model name='m'>"),
            r":4: <model>: expected well-formed XML, got mismatched tag",
        ),
        (document(solid("m", at=pose(float("nan")))), r":3: <pose>: expected 6 finite numbers"),
        (document(solid("m", at="<pose>1 2 3</pose>")), r":3: <pose>: expected 6 finite numbers"),
    ],
)
def test_what_is_no_world_is_refused(tmp_path, text, wrong):
    """With file, line and element."""
    with pytest.raises(SdfError, match=r"bad\.world" + wrong):
        read_sdf(write(tmp_path / "bad.world", text))


def test_a_file_that_is_not_there_is_plainly_not_there(tmp_path):
    """As for any other file."""
    with pytest.raises(FileNotFoundError):
        read_sdf(tmp_path / "lost.world")


def test_models_very_deep_inside_each_other_are_refused(tmp_path):
    """With an error, not with the end of a program's stack; thirty are no trouble."""

    def nested(count):
        opening = "".join(f'<model name="m{k}">' for k in range(count))
        return opening + link(collision()) + "</model>" * count

    assert len(read(tmp_path, nested(30)).solids) == 1
    with pytest.raises(SdfError, match="at most 100 elements inside each other"):
        read(tmp_path, nested(3000))


@pytest.mark.parametrize("seed", range(3))
def test_whatever_happens_to_a_file_is_a_world_or_a_refusal(tmp_path, seed):
    """Digits changed, bytes cut out, cut off or repeated: never another error."""
    parts = [
        solid("a", CUBE, pose(0, 0, 0.5)),
        solid("b", POST, pose(2, 2, 0.5, 0, 0, 0.6, relative_to="a")),
        model("n", '<frame name="f"><pose>1 0 0 0 0 0</pose></frame>', link(collision())),
        f'<state><model name="a">{pose(1, 1, 1)}<scale>1 2 1</scale></model></state>',
    ]
    whole, rng = document(*parts).encode(), np.random.default_rng(seed)
    read_count = 0
    for _ in range(150):
        data = bytearray(whole)
        a, b = np.sort(rng.integers(0, len(data), 2)).tolist()
        match int(rng.integers(4)):
            case 0:
                digits = [k for k, byte in enumerate(whole) if chr(byte).isdigit()]
                data[rng.choice(digits)] = rng.choice(list(b"0123456789.-en "))
            case 1:
                del data[a : min(b, a + 40)]
            case 2:
                del data[b:]
            case 3:
                data[a:a] = data[b : b + 40]
        path = tmp_path / "mutant.world"
        path.write_bytes(bytes(data))
        try:
            read_count += len(read_sdf(path).solids) > 0
        except SdfError as error:
            assert "mutant.world:" in str(error)
    assert read_count > 5


def calls(path):
    """Return the number of calls of functions, ours and others', that reading a file takes."""
    count = 0

    def watch(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(watch)
    try:
        read_sdf(path)
    finally:
        sys.setprofile(None)
    return count


def test_the_work_grows_with_the_number_of_models_and_no_faster(tmp_path):
    """Each of 600 models, with its state, takes as many calls as each of 300, below 350."""
    found = []
    for count in (300, 600):
        bodies = [solid(f"m{k}", POST, pose(k, 0, 0)) for k in range(count)]
        states = [
            f'<model name="m{k}">{pose(k, 1, 0)}{link(pose(k, 1, 0))}</model>' for k in range(count)
        ]
        text = document(*bodies, f"<state>{''.join(states)}</state>")
        found.append(calls(write(tmp_path / f"{count}.world", text)))
    assert found[1] - found[0] < 1.02 * found[0]
    assert found[0] < 300 * 350


@pytest.mark.skipif(not BARN, reason="ANDABATA_REAL_DATA names no folder with worlds")
@pytest.mark.parametrize("path", BARN, ids=lambda path: path.name)
def test_a_real_world_has_each_cylinder_once(path):
    """As many as the file has models, though each stands in model, visual and state; one plane."""
    text = gzip.decompress(path.read_bytes()).decode()
    models = text.partition("<state")[0].count("<model name='unit_cylinder_")
    world = read_sdf(path)
    posts = [each for each in world.solids if isinstance(each.shape, Cylinder)]
    assert len(posts) == models > 180
    assert text.count("<cylinder>") == 2 * models
    assert [type(each.shape) for each in world.solids if each not in posts] == [Plane]
    assert len({tuple(each.pose[:3, 3]) for each in posts}) == models
    # They stand on a grid of 0.15 m, with the radius of half a cell.
    cells = np.array(
        [(each.pose[0, 3] / 0.15 + 0.5, each.pose[1, 3] / 0.15 + 0.5) for each in posts]
    )
    np.testing.assert_allclose(cells, cells.round(), atol=1e-6)
    assert {each.shape for each in posts} == {Cylinder(0.075, 1.0)}
    assert [line.split(": ")[-1] for line in world.warnings] == ["light left out"]
