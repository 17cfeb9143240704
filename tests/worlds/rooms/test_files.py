"""Room files: what is written is read again, and what is no room is named."""

import pytest

from worlds.rooms.catalogue import UnknownRoomError, make_room, room_names, room_plan
from worlds.rooms.files import (
    RoomFileError,
    is_room_file,
    load_plan,
    load_room,
    plan_digest,
    plan_to_toml,
)
from worlds.rooms.room import RoomPlan

PLAN = RoomPlan(
    about='a "room" \\ with\ttabs, ü',
    half=(2.0, 1.0),
    boxes=((0.1, -0.25, 1e-7, 0.2),),
    outlines=(((0.0, 0.0), (0.5, 0.5), (0.0, 1.0)), ((1.0, 1.0), (1.5, 0.5))),
    goals=((1.0, 0.5),),
    judges=True,
    origin=(-2.25, 4.8),
)


@pytest.mark.parametrize("plan", [PLAN, *map(room_plan, room_names())], ids=lambda plan: plan.about)
def test_a_plan_is_read_as_it_was_written(tmp_path, plan):
    """All fields, to the last bit; defaults are not written."""
    path = tmp_path / "a.toml"
    path.write_text(plan_to_toml(plan), encoding="utf-8")
    assert load_plan(path) == plan
    assert ("tour" in path.read_text(encoding="utf-8")) is plan.tour


def test_items_stand_on_lines_of_their_own():
    """A file of many obstacles can be read and compared."""
    lines = plan_to_toml(PLAN).splitlines()
    assert "outlines = [" in lines
    assert "  [[1.0, 1.0], [1.5, 0.5]]," in lines
    assert "half = [2.0, 1.0]" in lines


def test_a_file_is_a_room_of_the_catalogue(tmp_path):
    """By its path, named after the file; the same object until the file changes."""
    path = tmp_path / "mine.toml"
    path.write_text(plan_to_toml(PLAN), encoding="utf-8")
    made = make_room(str(path))
    assert (made.name, len(made.edges), made.judges) == ("mine", 5, True)
    assert make_room(str(path)) is made is load_room(path)
    before = plan_digest(path)
    path.write_text(plan_to_toml(PLAN.model_copy(update={"boxes": ()})), encoding="utf-8")
    assert len(make_room(str(path)).boxes) == len(made.boxes) - 1
    assert plan_digest(path) != before


def test_names_that_end_in_toml_are_files():
    """Others are of the catalogue; a file that is not there is an unknown room."""
    assert is_room_file("a/b.toml")
    assert not is_room_file("spn-env0")
    with pytest.raises(UnknownRoomError, match=r"expected the file lost\.toml, got No such file"):
        make_room("lost.toml")


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("half = [", "expected a room as TOML, got"),
        ("half = " + 5000 * "[", "expected a room as TOML, got"),
        ("half = " + 5000 * "9", "expected a room as TOML, got"),
        ("about = '\udcff'", "expected a room as TOML, got"),
        ("half = [1.0, 1.0]", "about: expected a room, got Field required"),
        ('about = ""\nhalf = [1.0, 1.0]\nwals = []', "wals: expected a room, got Extra inputs"),
        ('about = ""\nhalf = [1.0, 1.0]\noutlines = [[[0.0, nan]]]', "outlines.0.0.1: expected"),
        ('about = ""\nhalf = [1.0, 1.0]\noutlines = [[[0.0, 0.0]]]', "2 or more different corners"),
        ('about = ""\nhalf = [1.0, 1.0]\nwalls = [[0.0, 0.0, 1.0, 1.0]]', "walls along x or y"),
    ],
)
def test_what_is_no_room_is_refused(tmp_path, text, wrong):
    """The error names the file, and the field if there is one."""
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(RoomFileError, match=rf"bad\.toml: .*{wrong}"):
        load_room(path)
