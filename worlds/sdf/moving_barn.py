"""Worlds of DynaBARN: ``world_N.world`` with cylinders, each moved by the plugin of its name.

A world names for each cylinder the library of a plugin, and the plugin's source holds its motion:
an animation that repeats, with a place at each of some times. Sources are read, in the folder of
the world or in ``plugins`` there, as the benchmark's generator writes them; libraries are not,
since their motion is compiled into them. The ``libobs_3.so`` of a world is made of ``obs_3.cc``.

Between its places a cylinder goes straight (the simulator itself smooths the corners). A model's
own pose has no part in its motion.
"""

import re
from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from worlds.rooms.barn import BarnWorld
from worlds.rooms.movers import MoverPlan
from worlds.rooms.moving_fields import HALF, field_world
from worlds.sdf.elements import read_xml
from worlds.sdf.files import OPAQUE
from worlds.sdf.room import SLAB, room_of
from worlds.sdf.shapes import Cylinder
from worlds.sdf.world import read_sdf

_FOLDERS = (".", "plugins")

_NUMBER = r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*"
_FRAME = re.compile(
    rf"CreateKeyFrame\({_NUMBER}\)|Translation\([\w:]*Vector3d\({_NUMBER},{_NUMBER},{_NUMBER}\)\)"
)
"""Time of a key frame, or its place."""

_ANIMATION = re.compile(rf'PoseAnimation\(\s*"[^"]*",{_NUMBER},\s*(true|false)\s*\)')
"""Duration of an animation, and whether it repeats."""

_LARGEST = 2**20
"""Largest size of a source [bytes]; a motion of twenty places has four thousand."""

_CLOSE = 0.05
"""Time between two key frames below which the first one is left out [s]: times are rounded to
0.01 s, which of places that close makes any speed."""


_ROUNDED = 0.02
"""Largest difference of times that are rounded to 0.01 s each [s]."""


class MotionFileError(ValueError):
    """Motion of a model that cannot be read; the text names file and fault."""


def plugins(world: Path) -> dict[str, str]:
    """Return the library of the plugin that moves a model, by the names of the models.

    Raises:
        SdfError: If the file is no XML.
        OSError: If it cannot be read.
    """
    root = read_xml(world, OPAQUE)
    found = {}
    for each in root.all("world"):
        for model in each.all("model"):
            plugin = model.child("plugin")
            if plugin is not None:
                name = model.attributes.get("name") or model.fail("expected a name, got none")
                found[name] = plugin.attributes.get("filename") or plugin.fail(
                    "expected an attribute filename, got none"
                )
    return found


def faults(world: Path) -> tuple[str, ...]:
    """Return the faults of a world file that are read past, with file and line.

    Raises:
        SdfError: If the file is no XML.
        OSError: If it cannot be read.
    """
    return tuple(f"{world}:{line}: {text}" for line, text in read_xml(world, OPAQUE).forgiven)


def motion_files(world: Path) -> dict[str, Path]:
    """Return the source of the plugin of each model that moves, by the names of the models.

    Raises:
        MotionFileError: If one is missing.
        SdfError: If the world is no XML.
    """
    return {name: _source(world, library) for name, library in plugins(world).items()}


def read_moving_world(world: Path, name: str) -> BarnWorld:
    """Return a world whose cylinders move.

    Args:
        world: World file, plain or packed by gzip.
        name: Name of the world.

    Raises:
        SdfError: If the file is none, or not flat.
        MotionFileError: If a model that moves is no cylinder, or its motion cannot be read.
        OSError: If a file cannot be read.
    """
    sources, read = motion_files(world), read_sdf(world)
    solids = {each.name.partition("::")[0]: each for each in read.solids}
    movers = []
    for model, source in sources.items():
        shape = solids[model].shape if model in solids else None
        if not isinstance(shape, Cylinder):
            raise MotionFileError(
                f"{world}: expected one cylinder in {model}, which a plugin moves, got another "
                f"shape or none"
            )
        course = read_motion(source)
        movers.append(_plan(source, shape.radius, course))
    standing = [each for each in read.solids if each.name.partition("::")[0] not in sources]
    bounds = (-HALF[0], -HALF[1], HALF[0], HALF[1])
    plan = room_of(replace(read, solids=tuple(standing)), SLAB, bounds).plan
    return field_world(name, tuple(movers), judges=True, walls=plan.boxes)


def read_motion(source: Path) -> tuple[tuple[float, float, float], ...]:
    """Return the motion of a plugin: times [s] and places [m], over and over again.

    Key frames less than 0.05 s before another are left out.

    Raises:
        MotionFileError: If the file holds no such motion.
        OSError: If it cannot be read.
    """
    with source.open("rb") as file:
        data = file.read(_LARGEST + 1)
    if len(data) > _LARGEST:
        raise MotionFileError(f"{source}: expected at most {_LARGEST} bytes, got more")
    text = data.decode("utf-8", errors="replace")
    animation = _ANIMATION.search(text)
    if animation is None or animation[2] != "true":
        raise MotionFileError(
            f"{source}: expected an animation that repeats, PoseAnimation(name, seconds, true), "
            "got none"
        )
    frames: list[list[float]] = []
    for match in _FRAME.finditer(text):
        numbers = [_number(source, each) for each in match.groups() if each is not None]
        is_time = len(numbers) == 1
        if is_time == bool(frames and len(frames[-1]) == 1):
            raise MotionFileError(
                f"{source}: expected a time and a place by turns, got {match[0]!r} after another "
                "of its kind"
            )
        if is_time:
            frames.append(numbers)
        else:
            frames[-1] += numbers[:2]
    if len(frames) < 2 or len(frames[-1]) != 3:
        raise MotionFileError(f"{source}: expected two key frames or more, got {len(frames)}")
    length = _number(source, animation[1])
    if abs(length - frames[-1][0] + frames[0][0]) > _ROUNDED:
        raise MotionFileError(
            f"{source}: expected an animation that ends with its last key frame, got {length} s "
            f"and key frames from {frames[0][0]} to {frames[-1][0]} s"
        )
    kept = [
        frame
        for frame, later in zip(frames, [*frames[1:], [float("inf")]], strict=True)
        if not 0 <= later[0] - frame[0] < _CLOSE or frame is frames[0]
    ]
    return tuple((frame[0], frame[1], frame[2]) for frame in kept)


def _number(source: Path, text: str) -> float:
    """Return a number of a source.

    Raises:
        MotionFileError: If it is none.
    """
    try:
        return float(text)
    except ValueError:
        raise MotionFileError(f"{source}: expected a number, got {text!r}") from None


def _plan(source: Path, radius: float, course: tuple[tuple[float, float, float], ...]) -> MoverPlan:
    """Return the plan of a cylinder with its motion.

    Raises:
        MotionFileError: If its times do not ascend from 0, or it is too fast.
    """
    try:
        return MoverPlan(radius=radius, place=course[0][1:], course=course)
    except ValidationError as error:
        raise MotionFileError(f"{source}: {error.errors()[0]['msg']}") from None


def _source(world: Path, library: str) -> Path:
    """Return the source of a plugin.

    Raises:
        MotionFileError: If there is none beside the world.
    """
    stem = Path(library).stem
    names = [f"{stem}.cc", *([f"{stem.removeprefix('lib')}.cc"] if stem.startswith("lib") else [])]
    for folder in _FOLDERS:
        for name in names:
            # A library is named without folders: what climbs out of the world's is not looked at.
            if Path(library).name == library and (path := world.parent / folder / name).is_file():
                return path
    raise MotionFileError(
        f"{world}: expected {names[-1]}, the source of the plugin {library}, beside it or in "
        "plugins, got none; compiled plugins are not read: the benchmark's generator makes sources"
    )
