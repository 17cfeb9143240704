"""Frames: every way in which a pose says what it stands in, with known answers."""

import numpy as np
import pytest

from tests.support.sdf_worlds import (
    CUBE,
    collision,
    include,
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

QUARTER = np.pi / 2
UP = pose(0, 0, 1)


def at(folder, *parts, name="m", **options):
    """Return the place of the shape of a model in a world of some parts [m]."""
    return places(read(folder, *parts, **options))[name]


def test_poses_add_up_from_model_to_link_to_collision(tmp_path):
    """Each stands in what it is part of, turned with it."""
    inner = collision(CUBE, pose(0, 0, 0.5))
    parts = model("m", pose(1, 2, 0, 0, 0, QUARTER), link(pose(2, 0, 0, 0, 0, QUARTER), inner))
    world = read(tmp_path, parts)
    np.testing.assert_allclose(places(world)["m"], [1, 4, 0.5], atol=1e-12)
    np.testing.assert_allclose(world.solids[0].pose[:2, 0], [-1, 0], atol=1e-12)


def test_a_pose_may_stand_in_any_frame_of_its_model(tmp_path):
    """A link in a link, a frame in a frame, a collision in a frame; order does not count."""
    parts = [
        link(pose(1, 0, 0, relative_to="f"), collision(), name="a"),
        '<frame name="f" attached_to="b"><pose>0 1 0 0 0 0</pose></frame>',
        link(pose(5, 0, 0, 0, 0, QUARTER), name="b"),
    ]
    # b at (5, 0) turned by a quarter; f one metre to its left, at (4, 0); a one metre along y.
    np.testing.assert_allclose(at(tmp_path, model("m", *parts), name="m"), [4, 1, 0], atol=1e-12)
    seen = model("m", *parts[1:], link(collision(CUBE, pose(1, 0, 0, relative_to="f")), name="a"))
    np.testing.assert_allclose(at(tmp_path, seen), [4, 1, 0], atol=1e-12)


def test_a_frame_stands_in_what_its_pose_names_rather_than_in_what_it_is_attached_to(tmp_path):
    """``relative_to`` comes before ``attached_to``, and that before the model."""
    frame = '<frame name="f" attached_to="b"><pose relative_to="c">0 0 1 0 0 0</pose></frame>'
    links = link(pose(7, 0, 0), name="b"), link(pose(0, 3, 0), name="c")
    found = at(tmp_path, model("m", frame, *links, link(pose(relative_to="f"), collision())))
    np.testing.assert_allclose(found, [0, 3, 1])


def test_a_joint_is_a_frame_of_its_child(tmp_path):
    """A pose in a joint stands where the joint is on its child link."""
    joint = f'<joint name="j" type="fixed"><parent>l</parent><child>b</child>{UP}</joint>'
    parts = link(pose(0, 2, 0), name="b"), joint, link(pose(1, 0, 0, relative_to="j"), collision())
    np.testing.assert_allclose(at(tmp_path, model("m", *parts)), [1, 2, 1])


def test_the_model_frame_and_the_world_have_names(tmp_path):
    """``__model__`` inside of a model, ``world`` in the world."""
    body = link(pose(0, 1, 0, relative_to="__model__"), collision())
    found = at(tmp_path, model("m", pose(3, 0, 0, relative_to="world"), body))
    np.testing.assert_allclose(found, [3, 1, 0])
    with pytest.raises(SdfError, match="got 'world'"):
        read(tmp_path, model("m", link(pose(relative_to="world"), collision())))


def test_models_may_stand_in_each_other_and_in_frames_of_the_world(tmp_path):
    """A model in a frame that is attached to another one's link."""
    parts = [
        model("m", pose(1, 0, 0, relative_to="f"), link(collision())),
        '<frame name="f" attached_to="base::top"/>',
        model("base", pose(5, 5, 0, 0, 0, QUARTER), link(pose(1, 0, 2), name="top")),
    ]
    np.testing.assert_allclose(at(tmp_path, *parts), [5, 7, 2], atol=1e-12)


def test_nested_models_stand_in_the_models_around_them(tmp_path):
    """Three levels, and a pose in a frame two levels down."""
    inner = model("c", pose(0, 0, 1), link(pose(0, 0, 1), collision(), name="top"))
    outer = model("a", pose(1, 0, 0), model("b", pose(0, 1, 0, 0, 0, QUARTER), inner))
    above = model("m", UP, link(pose(1, 0, 0, relative_to="n::b::c::top"), collision()))
    found = places(
        read(tmp_path, outer, above.replace("<link", outer.replace('"a"', '"n"') + "<link", 1))
    )
    np.testing.assert_allclose(found["a::b::c"], [1, 1, 2])
    np.testing.assert_allclose(found["m"], [1, 2, 3], atol=1e-12)


def test_a_model_may_be_placed_by_one_of_its_frames(tmp_path):
    """``placement_frame``: the pose is that of the frame, of models and of includes."""
    parts = link(pose(0, 0, 1, 0, 0, QUARTER), name="top"), link(collision())
    placed = model("m", pose(3, 0, 0), *parts, attributes='placement_frame="top"')
    np.testing.assert_allclose(at(tmp_path, placed), [3, 0, -1], atol=1e-12)
    write(tmp_path / "thing/model.sdf", model_document(model("m", *parts)))
    asked = include("model://thing", pose(3, 0, 0), "<placement_frame>top</placement_frame>")
    np.testing.assert_allclose(at(tmp_path, asked), [3, 0, -1], atol=1e-12)


def test_frames_of_a_merged_model_are_those_of_the_model_around(tmp_path):
    """``merge="true"``: a name inside of it needs no name of the model before it."""
    write(tmp_path / "part/model.sdf", model_document(model("p", link(pose(1, 0, 0), name="deep"))))
    asked = include("model://part", pose(0, 2, 0), attributes='merge="true"')
    body = link(pose(0, 0, 3, relative_to="deep"), collision())
    np.testing.assert_allclose(at(tmp_path, model("m", asked, body), version="1.9"), [1, 2, 3])


@pytest.mark.parametrize("version", ["1.4", "1.5", "1.6"])
def test_the_old_attribute_frame_is_read_over(tmp_path, version):
    """It never had a meaning; where it is not empty a warning says so."""
    world = read(tmp_path, model("m", pose(1, 0, 0, frame="x"), link(collision())), version=version)
    np.testing.assert_allclose(places(world)["m"], [1, 0, 0])
    assert [w for w in world.warnings if "the attribute frame" in w and "test.world:3" in w]
    assert not read(tmp_path, solid("m", at=pose(1, 0, 0, frame="")), version=version).warnings


def test_an_unknown_frame_is_refused_with_those_there_are(tmp_path):
    """The error names file, line and element, and all frames of the scope."""
    body = link(collision()), '\n<frame name="f">', pose(relative_to="x"), "</frame>"
    with pytest.raises(SdfError) as error:
        read(
            tmp_path,
            model(
                "m",
                *body,
                link(pose(relative_to="f"), name="k"),
            ),
        )
    assert str(error.value) == (
        f"{tmp_path / 'test.world'}:4: <pose>: expected one of the frames f, k, l, got 'x'"
    )


def test_frames_in_each_other_are_refused(tmp_path):
    """The error shows the circle."""
    circle = [f'<frame name="{a}">{pose(relative_to=b)}</frame>' for a, b in ("fg", "gh", "hf")]
    with pytest.raises(SdfError, match=r"not given in each other, got f in g in h in f"):
        read(tmp_path, model("m", *circle, link(pose(relative_to="f"), collision())))


def test_a_very_long_row_of_frames_is_refused(tmp_path):
    """A hundred in a row are the most; a program's stack is never the limit."""
    frames = [f'<frame name="f{k}">{pose(1, relative_to=f"f{k + 1}")}</frame>' for k in range(5000)]
    frames.append('<frame name="f5000"/>')
    for first, right in ((4910, True), (0, False)):
        body = model("m", *frames, link(pose(relative_to=f"f{first}"), collision()))
        if right:
            np.testing.assert_allclose(at(tmp_path, body), [90, 0, 0])
            continue
        with pytest.raises(SdfError, match="at most 100 frames in a row"):
            read(tmp_path, body)


def test_of_frames_of_one_name_the_first_one_counts(tmp_path):
    """No shape is lost, and a warning tells of the name."""
    twice = link(pose(1, 0, 0), collision(), name="a"), link(pose(2, 0, 0), collision(), name="a")
    world = read(tmp_path, model("m", *twice, link(pose(0, 1, 0, relative_to="a"), collision())))
    found = [each.pose[:2, 3].tolist() for each in world.solids]
    assert found == [[1, 0], [2, 0], [1, 1]]
    assert "a name is used twice" in world.warnings[0]
