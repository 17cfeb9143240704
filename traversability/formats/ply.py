"""PLY: parser of ASCII and binary files with any scalar vertex properties, binary writer."""

import re

import numpy as np

from traversability.formats.coordinate_units import CoordinateUnits
from traversability.formats.error import FormatError
from traversability.formats.length_units import unit_of_name
from traversability.formats.table import (
    Columns,
    check_count,
    header_lines,
    packed_columns,
    packed_records,
    record_type,
    text_columns,
)

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}

_UNIT = re.compile(
    r"(?:comment|obj_info) (?:(?:coordinate|length|linear)[ _])?units?(?: ?[:=] ?| )([a-z -]+)",
    re.I,
)
"""Comment on the unit of the coordinates: PLY has no field for it."""


def parse(data: bytes) -> Columns:
    """Return the vertices' properties by name; the vertices have to be the first element.

    Raises:
        FormatError: If the bytes are no such file.
    """
    if not data.startswith(b"ply"):
        raise FormatError(f"expected a file that begins with 'ply', got {data[:8]!r}")
    lines, body = header_lines(data, b"end_header")
    form, count, names, types = _header(lines)
    if form == "ascii":
        places = {name: place for place, name in enumerate(names)}
        return text_columns(body, count, places, len(names))
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}.get(form)
    if order is None:
        raise FormatError(f"expected format ascii or binary, got {form!r}")
    return packed_columns(body, count, record_type(names, [order + kind for kind in types]))


def units(data: bytes) -> tuple[CoordinateUnits | None, tuple[str, ...]]:
    """Return the units of the coordinates that a comment names, None without, and a remark.

    Raises:
        FormatError: If the header has no end.
    """
    for words in header_lines(data, b"end_header")[0]:
        match = _UNIT.fullmatch(" ".join(words))
        unit = None if match is None else unit_of_name(match.group(1))
        if unit is not None:
            named = CoordinateUnits(unit, unit)
            return named, named.remarks("a comment in its header")
    return None, ()


def render(columns: Columns) -> bytes:
    """Return the binary file of vertices with these properties, whose types PLY has to have."""
    types = {np.dtype(code): name for name, code in _TYPES.items() if not name[-1].isdigit()}
    count = len(next(iter(columns.values())))
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    head += [f"property {types[column.dtype]} {name}" for name, column in columns.items()]
    return "\n".join([*head, "end_header\n"]).encode() + packed_records(columns)


def _header(lines: list[list[str]]) -> tuple[str, int, list[str], list[str]]:
    """Return format, number of vertices, and names and types of their properties."""
    form, count, element = "", -1, ""
    names: list[str] = []
    types: list[str] = []
    for words in lines:
        match words:
            case ["format", name, *_]:
                form = name
            case ["element", "vertex", number] if not element:
                element, count = "vertex", int(number) if number.isdigit() else -1
            case ["element", name, *_]:
                element = element or name
                if count < 0:
                    raise FormatError(f"expected vertices as the first element, got {name!r}")
                element = name
            case ["property", kind, name] if element == "vertex":
                if kind not in _TYPES:
                    raise FormatError(f"expected a scalar property type, got {kind!r}")
                names.append(name)
                types.append(_TYPES[kind])
            case ["property", *_] if element == "vertex":
                raise FormatError("expected scalar vertex properties, got a list")
    return form, check_count(count), names, types
