"""Texts of options to values, with errors that name the option."""

from collections.abc import Sequence
from math import isfinite

from andabata.own_code import is_own


class UsageError(ValueError):
    """Options that contradict each other, or a value that is not one of an option."""


def words(
    text: str, known: Sequence[str], option: str, *, takes_own: bool = False
) -> tuple[str, ...]:
    """Return the comma-separated words of an option.

    Args:
        text: Value of the option.
        known: Words that the option takes.
        option: Name of the option, for the error.
        takes_own: True if it takes code of the user's own, too; see ``andabata.own_code``.

    Raises:
        UsageError: If there is no word, or one that is not in ``known``.
    """
    parts = tuple(word.strip() for word in text.split(",") if word.strip())
    for word in parts:
        if word not in known and not (takes_own and is_own(word)):
            own = " or FILE.py:NAME" if takes_own else ""
            raise UsageError(f"{option}: expected some of {', '.join(known)}{own}, got {word!r}")
    if not parts:
        raise UsageError(f"{option}: expected some of {', '.join(known)}, got nothing")
    return parts


def one_word(text: str, known: Sequence[str], option: str) -> str:
    """Return the value of an option that takes one of some words.

    Raises:
        UsageError: If it is none of them.
    """
    if text not in known:
        raise UsageError(f"{option}: expected one of {', '.join(known)}, got {text!r}")
    return text


def numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    """Return the comma-separated numbers of an option.

    Raises:
        UsageError: If they are not ``count`` finite numbers.
    """
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(isfinite(number) for number in values):
        raise UsageError(f"{option}: expected {count} numbers separated by commas, got {text!r}")
    return values


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Return the two sides of options of the form ``a=b``.

    Raises:
        UsageError: If one has no equals sign or an empty side.
    """
    sides = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise UsageError(f"{option}: expected a=b, got {text!r}")
        sides[name] = value
    return sides


def units(texts: Sequence[str]) -> dict[str, str]:
    """Return the units by quantity of options of the form ``quantity=unit``.

    Raises:
        UsageError: If there is no such quantity or unit.
    """
    from andabata.machine.robot import RobotModel
    from andabata.records.decoding.units import si_factor

    names = pairs(texts, "--unit")
    try:
        for quantity, unit in names.items():
            si_factor(quantity, unit, RobotModel())
    except ValueError as error:
        raise UsageError(str(error)) from None
    return names


_MAX_TIME_OFFSET = 1.0
"""Largest time by which stamps are shifted [s]: readings are put in order within it."""


def time_offsets(texts: Sequence[str]) -> dict[str, float]:
    """Return the times of options of the form ``topic=seconds`` [s], by topic.

    Raises:
        UsageError: If there is no such topic, or a time is not a number of seconds below 1.
    """
    known = ("/imu", "/encoder_data", "/mag_orientation", "/fix")
    offsets = {}
    for topic, text in pairs(texts, "--time-offset").items():
        one_word(topic, known, "--time-offset")
        (seconds,) = numbers(text, 1, f"--time-offset {topic}")
        if abs(seconds) > _MAX_TIME_OFFSET:
            limit = f"at most {_MAX_TIME_OFFSET:g} s before or after"
            raise UsageError(f"--time-offset {topic}: expected {limit}, got {text}")
        offsets[topic] = seconds
    return offsets


def span(text: str, most: int, option: str) -> range:
    """Return the indices, from 0, of numbers from 1 on that an option names as ``1`` or ``1-3``.

    Raises:
        UsageError: If it names none, or one above ``most``.
    """
    known = [str(number) for number in range(1, most + 1)]
    first, _, last = text.partition("-")
    last = last or first
    if not (first in known and last in known and int(first) <= int(last)):
        raise UsageError(
            f"{option}: expected {', '.join(known)} or a span as 1-{most}, got {text!r}"
        )
    return range(int(first) - 1, int(last))
