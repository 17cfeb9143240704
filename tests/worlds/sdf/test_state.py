"""States: poses are taken once, in the world's frame, in the place of those that were described."""

import numpy as np
import pytest

from tests.support.sdf_worlds import (
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
from worlds.sdf.shapes import Box


def state(*parts: str) -> str:
    """Return a state of some parts."""
    return f'<state world_name="w"><sim_time>0 0</sim_time>{"".join(parts)}</state>'


def moved(name: str, *parts: str) -> str:
    """Return the state of a model."""
    return f'<model name="{name}">{"".join(parts)}</model>'


def test_a_state_moves_a_model_and_adds_none(tmp_path):
    """Model, link and visual once each: one shape, where the state says."""
    seen = '<visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual>'
    body = model("m", pose(1, 0, 0), link(pose(0, 1, 0), collision(), seen))
    where = state(moved("m", pose(5, 0, 0), link(pose(5, 1, 0))))
    world = read(tmp_path, body, where)
    assert len(world.solids) == 1
    np.testing.assert_allclose(places(world)["m"], [5, 1, 0])


def test_without_the_state_of_a_link_it_goes_with_its_model(tmp_path):
    """Turned with the model, too."""
    body = model("m", pose(1, 0, 0), link(pose(1, 0, 0), collision()))
    where = state(moved("m", pose(5, 0, 0, 0, 0, np.pi / 2)))
    np.testing.assert_allclose(places(read(tmp_path, body, where))["m"], [5, 1, 0], atol=1e-12)


def test_the_pose_of_a_link_is_that_in_the_world(tmp_path):
    """It is not added to that of the model; the link's collisions go with it."""
    body = model("m", pose(1, 0, 0), link(collision(inside=pose(0, 0, 0.5))))
    where = state(moved("m", pose(5, 0, 0), link(pose(7, 0, 0))))
    np.testing.assert_allclose(places(read(tmp_path, body, where))["m"], [7, 0, 0.5])


def test_a_collision_in_another_frame_stays_where_it_is_on_its_link(tmp_path):
    """A frame of the model at the begin, not where the state left the model."""
    frame = f'<frame name="f">{pose(0, 0, 2)}</frame>'
    body = link(pose(1, 0, 0), collision(inside=pose(relative_to="f")))
    where = state(moved("m", pose(0, 0, 0), link(pose(5, 0, 0))))
    found = places(read(tmp_path, model("m", frame, body), where))
    np.testing.assert_allclose(found["m"], [4, 0, 2])


def test_nested_models_have_states_in_the_world(tmp_path):
    """A state in a state, and one of a link under the old name of an included model's."""
    inner = model("in", pose(0, 0, 1), link(collision()))
    body = model("m", pose(1, 0, 0), inner)
    nested = state(moved("m", pose(5, 0, 0), moved("in", pose(6, 0, 1))))
    np.testing.assert_allclose(places(read(tmp_path, body, nested))["m::in"], [6, 0, 1])
    old = state(moved("m", pose(5, 0, 0), link(pose(7, 0, 1), name="in::l")))
    np.testing.assert_allclose(places(read(tmp_path, body, old))["m::in"], [7, 0, 1])
    np.testing.assert_allclose(
        places(read(tmp_path, body, state(moved("m", pose(5, 0, 0)))))["m::in"], [5, 0, 1]
    )


def test_included_models_have_states(tmp_path):
    """Under the name that the include gives."""
    write(tmp_path / "thing/model.sdf", model_document(solid("thing")))
    asked = include("model://thing", "<name>x</name>", pose(1, 0, 0))
    world = read(tmp_path, asked, state(moved("x", pose(2, 0, 0))))
    np.testing.assert_allclose(places(world)["x"], [2, 0, 0])


def test_models_without_a_state_stay(tmp_path):
    """A state of others is none of theirs; a pose that is not there either."""
    where = state(moved("a", pose(5, 0, 0)), moved("b"))
    found = places(read(tmp_path, *(solid(n, at=pose(1, 0, 0)) for n in "abc"), where))
    assert [found[name][0] for name in "abc"] == [5, 1, 1]


def test_a_scale_comes_on_top_of_the_measures(tmp_path):
    """Sizes grow, places do not."""
    where = state(moved("m", pose(1, 0, 0), "<scale>2 1 3</scale>"))
    (found,) = read(tmp_path, solid("m"), where).solids
    assert found.shape == Box((2.0, 1.0, 3.0))
    np.testing.assert_allclose(found.pose[:3, 3], [1, 0, 0])


def test_models_come_and_go_with_a_state(tmp_path):
    """Insertions are models like others, with a state if they have one; deletions are gone."""
    where = state(
        f"<insertions>{solid('new', at=pose(3, 0, 0))}</insertions>",
        "<deletions><name>old</name></deletions>",
        moved("new", pose(4, 0, 0)),
    )
    found = places(read(tmp_path, solid("old"), solid("kept"), where))
    assert sorted(found) == ["kept", "new"]
    np.testing.assert_allclose(found["new"], [4, 0, 0])


def test_of_several_states_the_last_one_counts(tmp_path):
    """They are applied one after the other."""
    states = [state(moved("m", pose(x, 0, 0))) for x in (2, 3)]
    np.testing.assert_allclose(places(read(tmp_path, solid("m"), *states))["m"], [3, 0, 0])


def test_a_state_of_nothing_is_named(tmp_path):
    """A warning, and no shape; a model that a deletion took is no surprise."""
    world = read(tmp_path, solid("m"), state(moved("lost", pose(1, 0, 0))))
    assert len(world.solids) == 1
    assert ':4: <model name="lost">: a state names a model that is not there' in world.warnings[0]
    gone = state("<deletions><name>m</name></deletions>", moved("m", pose(1, 0, 0)))
    assert not read(tmp_path, solid("m"), gone).warnings


@pytest.mark.parametrize(
    "part", [pose(0, 0, float("nan")), "<scale>0 1 1</scale>", "<pose>1</pose>"]
)
def test_what_is_no_state_is_refused(tmp_path, part):
    """File, line and element."""
    with pytest.raises(SdfError, match=r"test\.world:4: <(pose|scale)>: expected"):
        read(tmp_path, solid("m"), state(moved("m", part)))
