"""Catalogue of rooms by name: plans in TOML files, and random rooms by their seed.

Plans stand in ``room_plans``. SPN (Zhang et al., arXiv 2010.10209) trains in ``spn-env0`` to
``spn-env3`` and is judged in ``spn-env4`` to ``spn-env7``. Its own layouts of the first four are a
picture only; the others are those of its references [9] and [10] (assumption). ``random-K`` is the
random room of seed K, to develop in. A name that ends in ``.toml`` is that of a file.
"""

import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path

from worlds.random_rooms import random_walled_room
from worlds.room_files import is_room_file, load_room
from worlds.rooms import Room, RoomPlan

_PLANS = "room_plans"

_RANDOM = "random-"


class UnknownRoomError(ValueError):
    """Name without a room."""


@cache
def room_names() -> tuple[str, ...]:
    """Return the names of the rooms, sorted."""
    names = (entry.name for entry in files("worlds").joinpath(_PLANS).iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


@cache
def room_plan(name: str) -> RoomPlan:
    """Return the plan of a room.

    Raises:
        UnknownRoomError: If there is no room of that name.
    """
    if name not in room_names():
        known = ", ".join(room_names())
        raise UnknownRoomError(
            f"room: expected one of {known}, a .toml file or random-K, got {name!r}"
        )
    text = files("worlds").joinpath(_PLANS, f"{name}.toml").read_text(encoding="utf-8")
    return RoomPlan.model_validate(tomllib.loads(text))


def make_room(name: str) -> Room:
    """Return a room by its name: that of a plan, ``random-K``, or a file's.

    Raises:
        UnknownRoomError: If there is no room of that name, or no such file.
        RoomFileError: If the file is no room.
    """
    if not is_room_file(name):
        return _made(name)
    try:
        return load_room(Path(name))
    except OSError as error:
        raise UnknownRoomError(f"room: expected the file {name}, got {error.strerror}") from error


@cache
def _made(name: str) -> Room:
    """Return a room that is in no file."""
    number = name.removeprefix(_RANDOM)
    if name.startswith(_RANDOM) and number.isdecimal():
        return random_walled_room(int(number))
    return Room.of(name, room_plan(name))
