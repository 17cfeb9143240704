"""Catalogue of rooms by name: plans in TOML files, and random rooms by their seed.

Plans stand in ``plans``. SPN (Zhang et al., arXiv 2010.10209) trains in ``spn-env0`` to
``spn-env3`` and is judged in ``spn-env4`` to ``spn-env7``. Its own layouts of the first four are a
picture only; the others are those of its references [9] and [10] (assumption). ``td3-env1`` to
``td3-env4`` and the other ``td3-`` rooms judge the improved TD3 (Guo et al.), whose layouts are
pictures too; ``gdae`` is in the spirit of the world that GDAE trains in.

Random rooms of seed K are for training and to develop in: ``random-K`` has thin walls,
``clutter-K`` pieces of all kinds that cover 8 to 27 %, ``clutter-movers-K`` the same with one to
four movers, ``barn-K`` and ``barn-narrow-K`` cylinders after the rules of BARN, ``crowd-5-K``,
``crowd-10-K`` and ``crowd-20-K`` as many people.

A name that ends in ``.toml`` is that of a file.
"""

import tomllib
from collections.abc import Callable
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

from worlds.rooms.barn import NARROW, barn_room
from worlds.rooms.clutter import random_cluttered_room
from worlds.rooms.crowds import SIZES, crowd_room
from worlds.rooms.files import is_room_file, load_room
from worlds.rooms.random_rooms import random_walled_room
from worlds.rooms.room import Room, RoomPlan
from worlds.splits import refuse_judging

_PLANS = "plans"

_RANDOM: dict[str, Callable[[int], Room]] = {
    "random": random_walled_room,
    "clutter": random_cluttered_room,
    "clutter-movers": partial(random_cluttered_room, movers=(1, 4)),
    **{f"crowd-{people}": partial(crowd_room, people=people) for people in SIZES},
    "barn": barn_room,
    "barn-narrow": partial(barn_room, config=NARROW),
}
"""What makes the random room of a seed, by kind."""


class UnknownRoomError(ValueError):
    """Name without a room."""


@cache
def room_names() -> tuple[str, ...]:
    """Return the names of the rooms, sorted."""
    names = (entry.name for entry in files("worlds.rooms").joinpath(_PLANS).iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


@cache
def room_plan(name: str) -> RoomPlan:
    """Return the plan of a room.

    Raises:
        UnknownRoomError: If there is no room of that name.
    """
    return RoomPlan.model_validate(_data(name))


def _data(name: str) -> dict[str, Any]:
    """Return the data of a plan; what it lacks is that of the plan that it is ``like``.

    Raises:
        UnknownRoomError: If there is no room of that name.
    """
    if name not in room_names():
        known = ", ".join((*room_names(), "a .toml file", *(f"{kind}-K" for kind in _RANDOM)))
        raise UnknownRoomError(f"room: expected one of {known}, got {name!r}")
    text = files("worlds.rooms").joinpath(_PLANS, f"{name}.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    return _data(data.pop("like")) | data if "like" in data else data


def make_room(name: str) -> Room:
    """Return a room by its name: that of a plan, a kind of random room and its seed, or a file's.

    Raises:
        UnknownRoomError: If there is no room of that name, or no such file.
        RoomFileError: If the file is no room.
        JudgingSeedError: If the seed of a random room judges a release.
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
    kind, _, number = name.rpartition("-")
    if kind in _RANDOM and number.isdecimal():
        seed = int(number)
        refuse_judging(seed)
        return _RANDOM[kind](seed)
    return Room.of(name, room_plan(name))
