"""Texts of options to rooms, lasers, memories and policies, with errors that name the option."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from andabata.configuration.settings import explain
from andabata.configuration.usage import UsageError, words
from andabata.evaluation.room_policies import TRAINED, fitted, law_policy
from andabata.evaluation.rooms import REACTIVE, WITH_MAP
from andabata.machine.planar.lidar import PLANAR_LIDARS, PlanarLidarConfig
from andabata.models import shipped_policy
from andabata.tasks.rooms.catalogue import RoomTaskConfig
from rl.laws import LAWS, NULL_LAWS
from rl.policy import Policy, load_policy
from worlds.rooms.catalogue import UnknownRoomError, make_room, room_names

SHIPPED = "shipped"
"""Policy without a file: the one that comes with the package. Laws have none either."""

NULLS = "nulls"
"""Word of ``--policy`` for all null controllers of rooms, ``NULL_LAWS``."""

_GATES = "gates"
"""Word for all gates of a family."""


def room_words(text: str, family: str = "spn") -> tuple[str, ...]:
    """Return the rooms of ``--rooms``; ``env4`` is short for ``spn-env4``, ``gates`` for all gates.

    Args:
        text: Value of the option.
        family: Beginning of room names that may be left out: the name of a task.

    Raises:
        UsageError: If there is none, or no room of a name.
    """
    given = (word.strip() for word in text.split(",") if word.strip())
    rooms = tuple(name for word in given for name in _rooms_of(word, family))
    if not rooms:
        raise UsageError(f"--rooms: expected names as {', '.join(room_names())}, got nothing")
    # Made here once, so that a wrong name is refused before anything is driven.
    for word in rooms:
        try:
            make_room(word)
        except UnknownRoomError as error:
            raise UsageError(f"--rooms: {str(error).removeprefix('room: ')}") from error
    return rooms


def _rooms_of(word: str, family: str) -> tuple[str, ...]:
    """Return the rooms of a word, or the word itself where it is no short one."""
    if word == _GATES:
        gates = tuple(name for name in room_names() if name.startswith(f"{family}-gate-"))
        return gates or (word,)
    full = f"{family}-{word}"
    return (full,) if full in room_names() else (word,)


def lidar_words(text: str, option: str = "--lidars") -> tuple[str, ...]:
    """Return the lasers of an option: ``all``, ``trained``, names and labels.

    Raises:
        UsageError: If there is none, or one is neither a name nor a label of a laser.
    """
    names = tuple(word.strip() for word in text.split(",") if word.strip())
    if names == ("all",):
        return tuple(PLANAR_LIDARS)
    if not names:
        raise UsageError(f"{option}: expected all, names or labels of lasers, got nothing")
    for word in names:
        if word == TRAINED:
            continue
        try:
            PlanarLidarConfig.parse(word)
        except ValidationError as error:
            raise UsageError(f"{option}: {word!r}: {explain(error)}") from error
        except ValueError as error:
            raise UsageError(f"{option}: {str(error).removeprefix('lidar: ')}") from error
    return names


def lidar_word(text: str) -> str:
    """Return the laser of ``--lidar``.

    Raises:
        UsageError: If it is not one, by name or label.
    """
    names = lidar_words(text, "--lidar")
    if len(names) > 1 or names == (TRAINED,):
        raise UsageError(f"--lidar: expected one laser, got {text!r}")
    return names[0]


def memory_words(text: str) -> tuple[str, ...]:
    """Return the memories of ``--memory``.

    Raises:
        UsageError: If it is none of reactive, map and both.
    """
    (word, *more) = words(text, (REACTIVE, WITH_MAP, "both"), "--memory")
    if more:
        raise UsageError(f"--memory: expected {REACTIVE}, {WITH_MAP} or both, got {text!r}")
    return (REACTIVE, WITH_MAP) if word == "both" else (word,)


def load_policies(texts: Sequence[str], task: RoomTaskConfig) -> dict[str, Policy]:
    """Return policies by name: files, ``shipped``, laws as ``heading``, all ``nulls``.

    A file's name is that of its folder where several are called alike, as those of several seeds.
    What ``nulls`` adds to laws that are named comes once.

    Args:
        texts: Values of ``--policy``.
        task: Task, whose robot and terms the laws take.

    Raises:
        UsageError: If one is given twice.
        ValueError: If a file is no policy, or one that cannot drive in rooms.
        OSError: If a file cannot be read.
    """
    twice = [text for text, count in Counter(texts).items() if count > 1]
    if twice:
        raise UsageError(f"--policy: expected each once, got {twice[0]} twice")
    texts = _with_nulls(texts)
    policies = {}
    for name, text in zip(_names(texts), texts, strict=True):
        policy = _load(text, task)
        try:
            fitted(policy, task)
        except ValueError as error:
            raise ValueError(f"{text}: {error}") from error
        policies[name] = policy
    return policies


def _with_nulls(texts: Sequence[str]) -> list[str]:
    """Return values of ``--policy`` with the null controllers in the place of ``nulls``."""
    if NULLS not in texts:
        return list(texts)
    place = list(texts).index(NULLS)
    added = [name for name in NULL_LAWS if name not in texts]
    return [*texts[:place], *added, *texts[place + 1 :]]


def _load(text: str, task: RoomTaskConfig) -> Policy:
    """Return one policy."""
    if text == SHIPPED:
        return shipped_policy(task.task)
    if text in LAWS:
        return law_policy(text, task)
    return load_policy(Path(text))


def _names(texts: Sequence[str]) -> list[str]:
    """Return a name of each policy: as short as they can be and still differ."""
    paths = [Path(text) for text in texts]
    for names in (
        [path.stem for path in paths],
        [path.absolute().parent.name if path.suffix else path.name for path in paths],
    ):
        if len(set(names)) == len(names):
            return names
    return list(texts)
