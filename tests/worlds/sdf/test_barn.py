"""Folders of BARN: worlds with their paths, in the room's frame, and what is wrong with others."""

import gzip
import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.support.barn_folders import world_text, write_world
from tests.support.sdf_worlds import pose, solid
from worlds.rooms.barn import MIDDLE, TASK
from worlds.sdf.barn import BarnFileError, barn_files, read_barn_path, read_barn_world
from worlds.sdf.elements import SdfError

REAL = Path(os.environ.get("ANDABATA_REAL_DATA", "/nowhere")) / "barn"


def test_posts_and_path_are_in_the_rooms_frame(tmp_path):
    """Cylinders shift with the middle; a cell (a, b) is 0.15 a - 4.575, 0.15 b + 5.075 m."""
    (file,) = barn_files(write_world(tmp_path))
    world = read_barn_world(file)
    np.testing.assert_allclose(world.room.circles[0], [0.9 - MIDDLE[0], 4.0 - MIDDLE[1], 0.1])
    assert (len(world.room.circles), len(world.room.boxes)) == (2, 0)
    first = (0.15 * 14 - 4.575 - MIDDLE[0], 5.075 - MIDDLE[1])
    np.testing.assert_allclose(world.path[0], first)
    ends = [(TASK.start.x, TASK.start.y), *world.path, TASK.goal]
    length = sum(np.hypot(*np.subtract(a, b)) for a, b in pairwise(ends))
    assert world.optimal_time == pytest.approx(length / 2)
    assert world.room.name == "world_1"
    assert world.room.judges


def test_other_shapes_count_too(tmp_path):
    """A box along the axes is a box, one at an angle an outline."""
    extra = solid("a", at=pose(0, 9, 0.5)) + solid("b", at=pose(0, 5, 0.5, 0, 0, 0.5))
    (file,) = barn_files(write_world(tmp_path, extra=extra))
    room = read_barn_world(file).room
    middle = (0 - MIDDLE[0], 9 - MIDDLE[1])
    np.testing.assert_allclose(room.boxes, [[*np.subtract(middle, 0.5), *np.add(middle, 0.5)]])
    assert len(room.edges) >= 4
    turned = np.array([(0 - MIDDLE[0], 5 - MIDDLE[1]), (0.8 - MIDDLE[0], 5 - MIDDLE[1])])
    clear = 0.8 * np.cos(0.5) - 0.5
    np.testing.assert_allclose(room.clearance(turned), (-0.5, clear), atol=1e-5)


def test_worlds_may_be_packed_and_in_folders_of_their_own(tmp_path):
    """world_files and path_files, gzip, and numbers in order, whatever else is there."""
    for number in (12, 2):
        write_world(tmp_path, number)
        (tmp_path / "path_files").mkdir(exist_ok=True)
        name = f"path_{number}.npy"
        (tmp_path / name).rename(tmp_path / "path_files" / name)
    (tmp_path / "world_files").mkdir()
    packed = tmp_path / "world_files" / "world_7.world.gz"
    packed.write_bytes(gzip.compress(world_text().encode()))
    np.save(tmp_path / "path_7.npy", np.array([[1, 2]]))
    (tmp_path / "world_x.world").write_text("no")
    assert [file.number for file in barn_files(tmp_path)] == [2, 7, 12]
    assert len(read_barn_world(barn_files(tmp_path)[1]).room.circles) == 2


def test_folders_that_are_none_are_refused(tmp_path):
    """No folder, no world, a world twice, a world without a path: each by its name."""
    with pytest.raises(BarnFileError, match=r"nowhere: expected a folder with world_N.world"):
        barn_files(tmp_path / "nowhere")
    with pytest.raises(BarnFileError, match=r"expected world_1.world, packed by gzip or not, got"):
        barn_files(tmp_path)
    write_world(tmp_path, 3)
    (tmp_path / "world_3.world.gz").write_bytes(b"")
    with pytest.raises(BarnFileError, match="expected one file of world 3"):
        barn_files(tmp_path)
    (tmp_path / "world_3.world.gz").unlink()
    (tmp_path / "path_3.npy").unlink()
    with pytest.raises(BarnFileError, match=r"expected path_3.npy for world_3, here or in"):
        barn_files(tmp_path)


def test_a_broken_world_is_named_with_file_line_and_element(tmp_path):
    """A post without a radius, and a file that is no XML."""
    folder = write_world(tmp_path)
    (file,) = barn_files(folder)
    text = file.world.read_text().replace("<radius>0.1</radius>", "", 1)
    file.world.write_text(text)
    with pytest.raises(SdfError, match=r"world_1.world:\d+: <cylinder>.*radius"):
        read_barn_world(file)
    file.world.write_text(text[: len(text) // 2])
    with pytest.raises(SdfError, match=r"world_1.world:\d+"):
        read_barn_world(file)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (np.zeros((0, 2)), r"shape \(0, 2\)"),
        (np.zeros(4), r"shape \(4,\)"),
        (np.array([[np.nan, 1.0]]), "cells of a field"),
        (np.array([[1e9, 1.0]]), "cells of a field"),
        (np.array([["a", "b"]]), "array of numbers"),
    ],
)
def test_other_paths_are_refused(tmp_path, cells, message):
    """Empty, of another shape, not finite, far away, no numbers."""
    path = tmp_path / "path_1.npy"
    np.save(path, cells)
    with pytest.raises(BarnFileError, match=rf"path_1.npy: .*{message}"):
        read_barn_path(path)


_OPEN_BRACE = b"\x93NUMPY\x01\x00\x08\x00{'a':({ \n"


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00v\x00{", _OPEN_BRACE])
def test_what_is_no_array_is_refused(tmp_path, content):
    """Empty, another kind of file, cut off, a header that numpy cannot parse."""
    path = tmp_path / "path_1.npy"
    path.write_bytes(content)
    with pytest.raises(BarnFileError, match=r"path_1.npy: expected"):
        read_barn_path(path)


@pytest.mark.skipif(not REAL.is_dir(), reason="ANDABATA_REAL_DATA names no folder of BARN's worlds")
def test_real_worlds_have_the_published_geometry():
    """Of one: cylinders of 0.075 m where the walls are, each once, and a path that can be driven.

    The mean optimal time of the benchmark's public worlds is 5.8 s.
    """
    files = barn_files(REAL)
    world = read_barn_world(files[0])
    circles = world.room.circles
    assert 181 <= len(circles) <= 365
    np.testing.assert_allclose(circles[:, 2], 0.075)
    np.testing.assert_allclose(circles[:, :2].min(axis=0), (-2.175, -6.925), atol=1e-6)
    np.testing.assert_allclose(circles[:, :2].max(axis=0), (2.175, 2.525), atol=1e-6)
    assert (len(world.room.boxes), len(world.room.edges)) == (0, 0)
    shift = TASK.start.x, TASK.start.y
    times = []
    for file in files:
        way = np.vstack([[shift], read_barn_path(file.path), [TASK.goal]])
        times.append(np.hypot(*np.diff(way, axis=0).T).sum() / 2)
    assert min(times) >= 5.0
    assert max(times) < 7.5
    assert np.mean(times) == pytest.approx(5.8, abs=0.2)
