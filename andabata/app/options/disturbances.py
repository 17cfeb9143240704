"""Text of ``--perturb`` to disturbances and their strengths."""

import math

from andabata.configuration.usage import UsageError
from andabata.evaluation.perturbation import with_disturbance
from andabata.machine.reality import LEVELS, Reality

_OPTION = "--perturb"
_WHOLE = tuple(name for name in LEVELS if name != "ideal")


def read_disturbances(text: str | None, reality: Reality) -> dict[str, float]:
    """Return the strengths of disturbances by their names.

    Args:
        text: Comma-separated ``NAME=NUMBER``, or ``field`` or ``harsh`` for all that differs there;
            None for none.
        reality: Reality of the robot that the disturbances are added to.

    Raises:
        UsageError: If there is no such disturbance or level, or a strength is none.
    """
    found: dict[str, float] = {}
    for word in () if text is None else map(str.strip, text.split(",")):
        found |= _of_level(LEVELS[word]) if word in _WHOLE else _of_word(word)
    for name, strength in found.items():
        try:
            with_disturbance(reality, name, strength)
        except ValueError as error:
            raise UsageError(f"{_OPTION} {error}") from error
    return found


def _of_word(word: str) -> dict[str, float]:
    """Return the strength of one ``NAME=NUMBER`` by its name.

    Raises:
        UsageError: If there is no such disturbance, or its strength is no finite number.
    """
    name, sign, text = (part.strip() for part in word.partition("="))
    if not sign or name not in Reality.model_fields:
        known = ", ".join(Reality.model_fields)
        raise UsageError(
            f"{_OPTION}: expected NAME=NUMBER with a NAME of {known}, or {' or '.join(_WHOLE)} for "
            f"all of a level, got {word!r}"
        )
    try:
        strength = float(text)
    except ValueError:
        strength = math.nan
    if not math.isfinite(strength):
        raise UsageError(f"{_OPTION} {name}: expected a number, got {text!r}")
    return {name: strength}


def _of_level(level: Reality) -> dict[str, float]:
    """Return what differs at a level from the ideal robot."""
    ideal = Reality()
    return {
        name: getattr(level, name)
        for name in Reality.model_fields
        if getattr(level, name) != getattr(ideal, name)
    }
