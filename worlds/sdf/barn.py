"""Folders of the BARN benchmark: ``world_N.world`` with cylinders, ``path_N.npy`` with its path.

Worlds are plain or packed by gzip, and lie in the folder itself or in ``world_files``; paths there
or in ``path_files``. A row of a path is a cell (a, b) of the field: x = 0.15 a - 4.575 m and
y = 0.15 b + 5.075 m. A world's other shapes, such as boxes and meshes, count like its cylinders.

Worlds of DynaBARN, whose models move by plugins, need no path; see ``worlds.sdf.moving_barn``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worlds.rooms.barn import HALF, MIDDLE, RADIUS, TASK, BarnWorld
from worlds.rooms.edges import outline_edges
from worlds.rooms.room import Room
from worlds.sdf.moving_barn import motion_files, plugins, read_moving_world
from worlds.sdf.room import SLAB, room_of
from worlds.sdf.world import read_sdf

_WORLD = re.compile(r"world_(\d+)\.world(\.gz)?")
_WORLD_FOLDERS = (".", "world_files")
_PATH_FOLDERS = (".", "path_files")

_PATH_ORIGIN = (-30 * 2 * RADIUS - RADIUS, 5 + RADIUS)
"""Place of the cell (0, 0) of a path in the benchmark's own frame [m]."""

_LARGEST = 1000
"""Largest number of a cell of a path, either way."""

_REACH = 40.0
"""Distance from the middle within which obstacles count: what a laser of 30 m may see [m]."""


class BarnFileError(ValueError):
    """Folder or path file that is not as the benchmark has them."""


@dataclass(frozen=True)
class BarnFile:
    """Files of one world.

    Attributes:
        number: Number of the world.
        world: Path of the world file.
        path: Path of the file with the path; None for a world whose models move.
    """

    number: int
    world: Path
    path: Path | None

    @property
    def name(self) -> str:
        """Name of the world."""
        return f"world_{self.number}"

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that it is read from.

        Raises:
            MotionFileError: If the motion of a model is in none.
        """
        motions = motion_files(self.world).values() if self.path is None else (self.path,)
        return self.world, *motions


def barn_files(folder: Path) -> tuple[BarnFile, ...]:
    """Return the worlds of a folder by their numbers.

    Raises:
        BarnFileError: If there is no such folder, no world in it, one twice, or one without a path
            in which nothing moves.
        SdfError: If a world without a path is none.
    """
    if not folder.is_dir():
        raise BarnFileError(f"{folder}: expected a folder with world_N.world and path_N.npy")
    files: dict[int, Path] = {}
    for inner in _WORLD_FOLDERS:
        for file in sorted((folder / inner).glob("world_*")):
            match = _WORLD.fullmatch(file.name)
            if match is None:
                continue
            number = int(match[1])
            if number in files:
                raise BarnFileError(
                    f"{folder}: expected one file of world {number}, got {files[number]} and {file}"
                )
            files[number] = file
    if not files:
        raise BarnFileError(f"{folder}: expected world_1.world, packed by gzip or not, got none")
    return tuple(
        BarnFile(number, files[number], _path_of(folder, number, files[number]))
        for number in sorted(files)
    )


def read_barn_world(file: BarnFile) -> BarnWorld:
    """Return a world of the benchmark.

    Raises:
        SdfError: If the world file is none, or not flat.
        BarnFileError: If the path is no list of cells.
        MotionFileError: If the motion of a model cannot be read.
        OSError: If a file cannot be read.
    """
    if file.path is None:
        return read_moving_world(file.world, file.name)
    x, y = MIDDLE
    bounds = (x - _REACH, y - _REACH, x + _REACH, y + _REACH)
    plan = room_of(read_sdf(file.world), SLAB, bounds).plan
    room = Room(
        name=file.name,
        half=HALF,
        boxes=_rows(plan.boxes, 4),
        circles=_rows(plan.circles, 3),
        tasks=(TASK,),
        judges=True,
        edges=outline_edges(plan.outlines),
    )
    return BarnWorld(room, read_barn_path(file.path))


def read_barn_path(path: Path) -> NDArray[np.float64]:
    """Return the places of a path in the room's frame [m], shape (k, 2).

    Raises:
        BarnFileError: If the file is no array of cells.
        OSError: If it cannot be read.
    """
    try:
        cells = np.lib.format.read_array(BytesIO(path.read_bytes()), allow_pickle=False)
    except Exception as error:  # numpy's reading of a damaged header raises many kinds.
        raise BarnFileError(f"{path}: expected a .npy file of numbers, got {error}") from error
    if cells.dtype.kind not in "iuf":
        raise BarnFileError(f"{path}: expected an array of numbers, got type {cells.dtype}")
    if cells.ndim != 2 or cells.shape[1] != 2 or not len(cells):
        raise BarnFileError(f"{path}: expected rows of two cells, (k, 2), got shape {cells.shape}")
    cells = cells.astype(np.float64)
    if not (np.isfinite(cells).all() and np.abs(cells).max() <= _LARGEST):
        raise BarnFileError(f"{path}: expected cells of a field of 30 x 30, got other numbers")
    shift = np.array(_PATH_ORIGIN) - MIDDLE
    return np.asarray(cells * 2 * RADIUS + shift)


def _path_of(folder: Path, number: int, world: Path) -> Path | None:
    """Return the file with the path of a world, None for one whose models move.

    Raises:
        BarnFileError: If it is missing.
    """
    name = f"path_{number}.npy"
    for inner in _PATH_FOLDERS:
        if (folder / inner / name).is_file():
            return folder / inner / name
    if plugins(world):
        return None
    raise BarnFileError(
        f"{folder}: expected {name} for world_{number}, here or in path_files, got none; "
        "the optimal time needs it"
    )


def _rows(values: Sequence[Sequence[float]], width: int) -> NDArray[np.float64]:
    """Return rows as an array, shape (n, width)."""
    return np.array(values, dtype=np.float64).reshape(-1, width)
