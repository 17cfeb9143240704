"""Worlds of DynaBARN: walls, motions, the faults of the public files, and what is wrong."""

import numpy as np
import pytest

from tests.support.moving_barn_folders import (
    LEFT,
    moving_text,
    source_text,
    write_moving_world,
)
from tests.support.sdf_worlds import CUBE
from worlds.rooms.moving_fields import TASK, WALLS
from worlds.sdf.barn import BarnFileError, barn_files, read_barn_world
from worlds.sdf.elements import SdfError
from worlds.sdf.moving_barn import MotionFileError, faults, plugins, read_motion


def test_a_world_is_its_walls_and_its_moving_cylinders(tmp_path):
    """In the frame of the square's middle; the straight line is its path, and it judges alone."""
    (file,) = barn_files(write_moving_world(tmp_path, 3, (LEFT, LEFT[:2])))
    assert file.path is None
    world = read_barn_world(file)
    np.testing.assert_allclose(sorted(world.room.boxes.tolist()), sorted(map(list, WALLS)))
    assert len(world.room.circles) == 0
    assert world.room.tasks == (TASK,)
    assert [mover.course for mover in world.room.movers] == [LEFT, LEFT[:2]]
    assert [mover.radius for mover in world.room.movers] == [0.5, 0.5]
    assert (world.room.name, world.room.judges, world.optimal_time) == ("world_3", True, 10.0)
    assert [path.name for path in file.files] == ["world_3.world", "obs_0.cc", "obs_1.cc"]


def test_the_faults_of_the_public_files_are_read_past_and_told(tmp_path):
    """Poses whose attribute has no value, and a backslash: by file and line."""
    world = write_moving_world(tmp_path) / "world_0.world"
    notes = faults(world)
    assert len(notes) == 4
    lines = world.read_text().splitlines()
    for note in notes:
        line = lines[int(note.removeprefix(str(world)).split(":")[1]) - 1]
        assert ("<pose frame=>" in line) or ("</static>\\" in line)
    assert sum("backslash" in note for note in notes) == 1


def test_other_faults_are_refused(tmp_path):
    """An attribute without a value elsewhere, or a pose that is not closed."""
    folder = write_moving_world(tmp_path)
    world = folder / "world_0.world"
    text = world.read_text()
    for fault in (text.replace("<pose frame=>", "<pose frame= >"), text.replace("</link>", "", 1)):
        world.write_text(fault)
        with pytest.raises(SdfError, match=r"world_0.world:\d+: .*well-formed"):
            barn_files(folder)


def test_a_library_is_that_of_a_source_with_or_without_lib(tmp_path):
    """Sources lie beside the world or in plugins."""
    folder = write_moving_world(tmp_path)
    (folder / "plugins" / "obs_0.cc").rename(folder / "libobs_0.cc")
    (file,) = barn_files(folder)
    assert plugins(file.world) == {"m0": "libobs_0.so"}
    assert file.files[1] == folder / "libobs_0.cc"


@pytest.mark.parametrize("library", ["libother.so", "../libobs_0.so", "easylibobs_51.so"])
def test_a_motion_that_is_nowhere_is_named(tmp_path, library):
    """Compiled plugins are not read, and no library climbs out of the folder."""
    folder = write_moving_world(tmp_path / "inner")
    (tmp_path / "obs_0.cc").write_text(source_text())
    (folder / "world_0.world").write_text(moving_text((library,)))
    with pytest.raises(MotionFileError, match="compiled plugins are not read"):
        read_barn_world(barn_files(folder)[0])


def test_a_folder_of_standing_worlds_still_needs_its_paths(tmp_path):
    """A world without a plugin and without a path is refused as before."""
    (tmp_path / "world_0.world").write_text(moving_text(()))
    with pytest.raises(BarnFileError, match=r"expected path_0.npy for world_0"):
        barn_files(tmp_path)


def test_what_moves_is_a_cylinder(tmp_path):
    """A box that a plugin moves is refused."""
    folder = write_moving_world(tmp_path)
    (folder / "world_0.world").write_text(moving_text(shape=CUBE))
    with pytest.raises(MotionFileError, match="expected one cylinder in m0"):
        read_barn_world(barn_files(folder)[0])


def test_key_frames_right_before_another_are_left_out(tmp_path):
    """Rounded times of near places would make any speed; the first and the last place stay."""
    path = tmp_path / "obs.cc"
    frames = ((0.0, 0.0, 0.0), (1.99, 1.0, 0.0), (2.0, 1.3, 0.0), (4.0, 3.0, 0.0))
    path.write_text(source_text(frames))
    assert read_motion(path) == (frames[0], *frames[2:])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected an animation that repeats"),
        (source_text(repeats="false"), "expected an animation that repeats"),
        (source_text(LEFT[:1]), "expected two key frames or more, got 1"),
        (source_text(length=99.0), "ends with its last key frame, got 99.0 s"),
        (source_text().replace("Translation", "Other", 1), "a time and a place by turns"),
        (source_text().replace("CreateKeyFrame(4.00)", "x"), "a time and a place by turns"),
        (source_text().replace("(4.00)", "(4.0.0)"), "expected a number, got '4.0.0'"),
    ],
)
def test_sources_without_a_motion_are_refused(tmp_path, text, message):
    """Each fault by its name."""
    path = tmp_path / "obs.cc"
    path.write_text(text)
    with pytest.raises(MotionFileError, match=rf"obs.cc: .*{message}"):
        read_motion(path)


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        (((0.0, 0.0, 0.0), (1.0, 9.0, 0.0)), "expected at most 5.0 m/s, got 9"),
        (((0.0, 0.0, 0.0), (3.0, 1.0, 0.0), (1.0, 2.0, 0.0)), "expected ascending times"),
    ],
)
def test_motions_that_nothing_follows_are_refused(tmp_path, motion, message):
    """Too fast, or back in time."""
    folder = write_moving_world(tmp_path, motions=(motion,))
    with pytest.raises(MotionFileError, match=rf"obs_0.cc: .*{message}"):
        read_barn_world(barn_files(folder)[0])
