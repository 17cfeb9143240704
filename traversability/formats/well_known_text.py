"""Units of coordinates by the well-known text of their reference system: WKT 1, ESRI's and WKT 2.

Source: OGC 01-009 (WKT 1), OGC 18-010r7 (WKT 2).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from traversability.formats.coordinate_units import (
    GEOCENTRIC,
    GEOGRAPHIC,
    GIVE,
    CoordinateUnits,
)
from traversability.formats.error import FormatError
from traversability.formats.length_units import LengthUnit, UnknownUnitError, unit_of_length

_TOKEN = re.compile(r'\s*(?:"((?:[^"]|"")*)"|([\[\](),])|([^\s\[\](),"]+))')

_PLANAR = (
    "PROJCS",
    "PROJCRS",
    "PROJECTEDCRS",
    "DERIVEDPROJCRS",
    "LOCAL_CS",
    "ENGCRS",
    "ENGINEERINGCRS",
)
_ANGULAR = ("GEOGCS", "GEOGCRS", "GEOGRAPHICCRS")
_GEODETIC = ("GEODCRS", "GEODETICCRS")
_FROM_THE_CENTRE = ("GEOCCS",)
_VERTICAL = ("VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS")
_UNIT = ("UNIT", "LENGTHUNIT")
_AXIS = "AXIS"


@dataclass(frozen=True)
class Node:
    """Keyword of a text with what its brackets hold.

    Attributes:
        keyword: Keyword in capitals.
        values: Texts and numbers in its brackets, as they are written.
        children: Keywords in its brackets.
    """

    keyword: str
    values: list[str] = field(default_factory=list)
    children: list["Node"] = field(default_factory=list)

    def walk(self) -> Iterator["Node"]:
        """Yield this node and all below it, from left to right."""
        yield self
        for child in self.children:
            yield from child.walk()


def units_of_text(text: str) -> CoordinateUnits | None:
    """Return the units of the coordinates of a reference system, None for an empty text.

    Args:
        text: One system, a compound of a horizontal and a vertical one, or both beside each other.

    Raises:
        UnknownUnitError: If the text cannot be read, or names no unit.
        FormatError: If the coordinates are angles, count from the Earth's centre, or are depths.
    """
    if not text.strip("\0 \r\n\t"):
        return None
    nodes = [node for root in parse_text(text) for node in root.walk()]
    planar = next((node for node in nodes if node.keyword in _PLANAR), None)
    if planar is None:
        raise _without_a_plane(nodes)
    across = _unit_of(planar, 0)
    if across is None:
        raise UnknownUnitError(f"{planar.keyword}: expected a unit of length, got none; {GIVE}")
    vertical = next((node for node in nodes if node.keyword in _VERTICAL), None)
    third = planar if _count_of_axes(planar) > 2 else None
    upright = vertical or third
    up = None if upright is None else _unit_of(upright, 0 if vertical else 2)
    if vertical is not None:
        _check_heights(vertical)
    return CoordinateUnits(across, up)


def parse_text(text: str) -> list[Node]:
    """Return the nodes of a text that stand in no other node's brackets.

    Raises:
        UnknownUnitError: If its brackets and commas do not fit.
    """
    top = Node("")
    stack, place = [top], 0
    word: str | None = None
    text = text.rstrip("\0 \r\n\t")
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise _unreadable(text)
        place = match.end()
        quoted, sign, plain = match.groups()
        if sign in ("[", "("):
            # A node begins with its keyword, which stands before the bracket.
            stack[-1].children.append(Node((word or "").upper()))
            stack.append(stack[-1].children[-1])
        elif word is not None and sign:
            stack[-1].values.append(word)
        if sign in ("]", ")"):
            stack.pop()
            if not stack:
                raise _unreadable(text)
        word = None if sign else quoted if plain is None else plain
    if len(stack) != 1 or not top.children:
        raise _unreadable(text)
    return top.children


def _unreadable(text: str) -> UnknownUnitError:
    """Return the error of a text that is none of a reference system."""
    begin = " ".join(text[:40].split())
    return UnknownUnitError(f"expected a coordinate system as WKT, got {begin!r}; {GIVE}")


def _without_a_plane(nodes: list[Node]) -> FormatError:
    """Return the error of a text without a system of plane coordinates."""
    words = {node.keyword for node in nodes}
    cartesian = any(
        node.keyword == "CS" and node.values[:1] and node.values[0].lower() == "cartesian"
        for node in nodes
    )
    if words & set(_FROM_THE_CENTRE) or (words & set(_GEODETIC) and cartesian):
        return FormatError(GEOCENTRIC)
    if words & {*_ANGULAR, *_GEODETIC}:
        return FormatError(GEOGRAPHIC)
    return UnknownUnitError(
        f"expected a projected coordinate system, got {nodes[0].keyword or 'none'}; {GIVE}"
    )


def _axes(node: Node) -> list[Node]:
    """Return the axes of a system."""
    return [child for child in node.children if child.keyword == _AXIS]


def _count_of_axes(node: Node) -> int:
    """Return the number of axes of a system."""
    return len(_axes(node))


def _unit_of(node: Node, axis: int) -> LengthUnit | None:
    """Return the unit of a system, or that of one of its axes where those have their own."""
    axes = _axes(node)
    places = [*(axes[axis].children if axis < len(axes) else ()), *node.children]
    for child in places:
        if child.keyword in _UNIT and len(child.values) > 1:
            return _length(child)
    return None


def _length(node: Node) -> LengthUnit:
    """Return the unit that a node names.

    Raises:
        UnknownUnitError: If its length is no positive number.
    """
    try:
        metres = float(node.values[1])
    except ValueError:
        metres = 0.0
    if not 0 < metres < float("inf"):
        raise UnknownUnitError(
            f"unit {node.values[0]}: expected its length in metres, got {node.values[1]}; {GIVE}"
        )
    return unit_of_length(metres)


def _check_heights(vertical: Node) -> None:
    """Check that a vertical system counts upwards.

    Raises:
        FormatError: If it counts downwards.
    """
    for axis in _axes(vertical):
        if any(value.lower() == "down" for value in axis.values):
            raise FormatError("expected heights, got depths by the file's WKT; negate z")
