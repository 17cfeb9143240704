"""What a user typed wrongly."""

from collections.abc import Sequence
from math import isfinite


class UsageError(ValueError):
    """Options that cannot be used together, or words that name nothing."""


def words(text: str, known: Sequence[str], option: str) -> tuple[str, ...]:
    """Return the comma-separated words of an option.

    Raises:
        UsageError: If a word is none of ``known``.
    """
    found = tuple(word.strip() for word in text.split(",") if word.strip())
    for word in found:
        if word not in known:
            raise UsageError(f"{option}: expected some of {', '.join(known)}, got {word!r}")
    if not found:
        raise UsageError(f"{option}: expected some of {', '.join(known)}, got nothing")
    return found


def numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    """Return the comma-separated numbers of an option.

    Raises:
        UsageError: If there are not ``count`` finite ones.
    """
    try:
        found = tuple(float(word) for word in text.split(","))
    except ValueError:
        found = ()
    if len(found) != count or not all(isfinite(number) for number in found):
        raise UsageError(f"{option}: expected {count} numbers with commas between, got {text!r}")
    return found


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Return the two sides of options of the form ``a=b``.

    Raises:
        UsageError: If one has no sign or an empty side.
    """
    found = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise UsageError(f"{option}: expected a=b, got {text!r}")
        found[name] = value
    return found


def units(texts: Sequence[str]) -> dict[str, str]:
    """Return the units by quantity of options of the form ``quantity=unit``.

    Raises:
        UsageError: If there is no such quantity or unit.
    """
    from andabata.machine.robot import RobotModel
    from andabata.records.units import si_factor

    found = pairs(texts, "--unit")
    try:
        for quantity, unit in found.items():
            si_factor(quantity, unit, RobotModel())
    except ValueError as error:
        raise UsageError(str(error)) from None
    return found
