"""Rooms in files of one's own: the plan as TOML, as the catalogue's rooms are."""

import hashlib
import json
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from worlds.rooms.room import Room, RoomPlan

SUFFIX = ".toml"
"""End of the names of room files."""


class RoomFileError(ValueError):
    """A file that is no room; the text names the file."""


def plan_to_toml(plan: RoomPlan) -> str:
    """Return a plan as TOML, fields at their defaults left out; lists of lists one item a line."""
    return "".join(
        f"{name} = {_text(value, lines=True)}\n"
        for name, value in plan.model_dump(mode="json", exclude_defaults=True).items()
    )


def is_room_file(name: str) -> bool:
    """Return True if a room's name is that of a file."""
    return name.endswith(SUFFIX)


def load_plan(path: Path) -> RoomPlan:
    """Return the plan of a file.

    Raises:
        RoomFileError: If it is no plan.
        OSError: If it cannot be read.
    """
    try:
        content = tomllib.loads(path.read_bytes().decode())
    except (ValueError, RecursionError) as error:  # Also numbers of 5,000 digits, and depth.
        raise RoomFileError(f"{path}: expected a room as TOML, got {error}") from error
    try:
        return RoomPlan.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"]))
        raise RoomFileError(f"{path}: {field}: expected a room, got {first['msg']}") from error


def plan_digest(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        OSError: If it cannot be read.
    """
    return hashlib.sha256(path.read_bytes()).hexdigest()


def load_room(path: Path) -> Room:
    """Return the room of a file, named after it: the same object as long as the file is the same.

    Raises:
        RoomFileError: If it is no plan, or one with a wall that is none.
        OSError: If it cannot be read.
    """
    about = path.stat()
    return _loaded(path.resolve(), about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=64)
def _loaded(path: Path, stamp: int, size: int) -> Room:
    """Return the room of a file as it is at a time."""
    try:
        return Room.of(path.stem, load_plan(path))
    except RoomFileError:
        raise
    except ValueError as error:
        raise RoomFileError(f"{path}: {error}") from error


def _text(value: Any, lines: bool = False) -> str:  # noqa: ANN401 - any JSON value.
    """Return a JSON value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {_text(each)}" for name, each in value.items()) + " }"
    if isinstance(value, list):
        items = [_text(each) for each in value]
        if lines and value and isinstance(value[0], list | dict):
            return "[\n" + "".join(f"  {item},\n" for item in items) + "]"
        return "[" + ", ".join(items) + "]"
    # TOML writes texts, numbers and truths as JSON does; texts of plans have no rarer characters.
    return json.dumps(value, ensure_ascii=False)
