"""Left and right wheels among the joints of a robot, by the names of the joints."""

import re
from functools import lru_cache

from andabata.records.decoding.unusable_message import UnusableMessageError

_LEFT = frozenset({"left", "l", "lf", "fl", "lb", "bl", "rl", "lr", "ml", "lm", "lh"})
_RIGHT = frozenset({"right", "r", "rf", "fr", "rb", "br", "rr", "mr", "rm", "rh"})
"""Tokens of a joint's name that imply its side; ``rl`` is rear left and ``lr`` left rear."""

_WHEEL = ("wheel", "whl", "tire", "tyre")
_DRIVE = ("track", "drive", "motor", "axle")
_NO_DRIVE = ("caster", "castor", "steer", "suspension")
"""Parts of names of wheels, of other driven joints, and of joints that are not driven."""

_PLAIN = frozenset(
    {"front", "rear", "back", "middle", "mid", "centre", "center", "base", "joint", "link"}
)
"""Tokens that may stand beside the side in the name of a wheel that is not called one."""

Sides = tuple[tuple[int, ...], tuple[int, ...]]
"""Indices of the left and of the right wheels."""


@lru_cache(maxsize=64)
def wheel_sides(names: tuple[str, ...]) -> Sides | None:
    """Return the indices of left and right wheels among joints, None without a wheel.

    Args:
        names: Names of the joints in any spelling: ``front_left_wheel``, ``wheel_l_joint``,
            ``fl_wheel``, ``RearRightWheel``.

    Raises:
        UnusableMessageError: If there are wheels without a side.
    """
    tokens = {k: _tokens(name) for k, name in enumerate(names)}
    driven = {k: t for k, t in tokens.items() if not any(w in p for p in t for w in _NO_DRIVE)}
    for words in (_WHEEL, _DRIVE):
        chosen = [k for k, t in driven.items() if any(w in p for p in t for w in words)]
        if chosen:
            break
    else:
        plain = _PLAIN | _LEFT | _RIGHT
        chosen = [k for k, t in driven.items() if t and set(t) <= plain and _side(t) is not None]
    if not chosen:
        return None
    sides = [tuple(k for k in chosen if _side(tokens[k]) == side) for side in (0, 1)]
    if not all(sides):
        listed = ", ".join(names[k] for k in chosen)
        raise UnusableMessageError(f"name: expected left and right wheels, got {listed}")
    return sides[0], sides[1]


def _tokens(name: str) -> list[str]:
    """Return the parts of a joint's name, lower case, without numbers."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)
    joined = re.sub(r"(wheel|whl|left|right|front|rear|joint|drive)", r"_\1_", apart.lower())
    return [token for token in re.split(r"[^a-z]+", joined) if token]


def _side(tokens: list[str]) -> int | None:
    """Return 0 for left, 1 for right, None where the name implies none or both."""
    words = set(tokens)
    if ("left" in words) != ("right" in words):
        return int("right" in words)
    left, right = bool(_LEFT & words), bool(_RIGHT & words)
    return int(right) if left != right else None
