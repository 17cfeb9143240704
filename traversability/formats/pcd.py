"""PCD 0.7: parser of ASCII, binary and binary_compressed files, binary writer."""

import math

import numpy as np
from numpy.typing import NDArray

from traversability.formats.error import FormatError
from traversability.formats.table import (
    Columns,
    check_count,
    header_lines,
    packed_columns,
    packed_records,
    record_columns,
    record_type,
    text_columns,
)

_IDENTITY = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Viewpoint of points in the sensor's own frame."""


def parse(data: bytes) -> Columns:
    """Return the fields by name.

    Raises:
        FormatError: If the bytes are no such file.
    """
    entries, body = _header(data)
    try:
        # The first versions of the format call the fields COLUMNS, and count by WIDTH and HEIGHT.
        fields = entries["FIELDS"] if "FIELDS" in entries else entries["COLUMNS"]
        kinds = [kind.upper() for kind in entries["TYPE"]]
        sizes, counts = entries["SIZE"], entries.get("COUNT", ["1"] * len(fields))
        factors = ("POINTS",) if "POINTS" in entries else ("WIDTH", "HEIGHT")
        points = check_count(math.prod(int(entries[name][0]) for name in factors))
        repeats = [check_count(int(count)) for count in counts]
        form = (entries["DATA"] or [""])[0].lower()
    except (KeyError, IndexError, ValueError) as error:
        raise FormatError(f"expected FIELDS, SIZE, TYPE, POINTS and DATA, got {error}") from error
    if not len(fields) == len(kinds) == len(sizes) == len(repeats):
        raise FormatError("expected FIELDS, SIZE, TYPE and COUNT of one length")
    if form == "ascii":
        begins = [int(begin) for begin in np.concatenate([[0], np.cumsum(repeats)])]
        single = zip(fields, begins, repeats, strict=False)
        places = {name: begin for name, begin, repeat in single if repeat == 1}
        return text_columns(body, points, places, begins[-1])
    names, formats = _records(fields, kinds, sizes, repeats)
    dtype = record_type(names, formats)
    if form == "binary":
        return packed_columns(body, points, dtype)
    if form == "binary_compressed":
        return record_columns(_columns(body, points, dtype))
    raise FormatError(f"expected DATA ascii, binary or binary_compressed, got {form!r}")


def viewpoint(data: bytes) -> tuple[float, ...] | None:
    """Return the pose of the sensor in the coordinates of the points, None without one.

    Returns:
        Position and quaternion w, x, y, z of unit length.

    Raises:
        FormatError: If these are no seven numbers, or no rotation.
    """
    words = _header(data)[0].get("VIEWPOINT")
    if not words:
        return None
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError:
        numbers = np.zeros(0)
    length = float(np.linalg.norm(numbers[3:])) if len(numbers) == 7 else np.nan
    if not numbers.any() and len(numbers) == 7:
        return None  # Programs that know no viewpoint write zeros.
    if not (np.isfinite(numbers).all() and length > 0.01):
        raise FormatError(
            "VIEWPOINT: expected X Y Z and a quaternion W X Y Z of length 1, got "
            f"{' '.join(words)}; write the sensor's pose there, or {_text(_IDENTITY)}"
        )
    return (*numbers[:3].tolist(), *(numbers[3:] / length).tolist())


def render(columns: Columns, viewpoint: tuple[float, ...] = _IDENTITY) -> bytes:
    """Return the binary file of these fields.

    Args:
        columns: Columns by name, shape (n,) each.
        viewpoint: Position and quaternion w, x, y, z of the sensor.
    """
    kinds = {"f": "F", "i": "I", "u": "U"}
    types = [column.dtype for column in columns.values()]
    count = len(next(iter(columns.values())))
    head = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS " + " ".join(columns),
        "SIZE " + " ".join(str(kind.itemsize) for kind in types),
        "TYPE " + " ".join(kinds[kind.kind] for kind in types),
        "COUNT " + " ".join("1" for _ in types),
        f"WIDTH {count}",
        "HEIGHT 1",
        f"VIEWPOINT {_text(viewpoint)}",
        f"POINTS {count}",
        "DATA binary\n",
    ]
    return "\n".join(head).encode() + packed_records(columns)


def _header(data: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Return the words of each entry by its keyword in capitals, and the bytes after them."""
    lines, body = header_lines(data, b"DATA", any_case=True)
    return {words[0].upper(): words[1:] for words in lines if words}, body


def _text(numbers: tuple[float, ...]) -> str:
    """Return numbers with all of their digits."""
    return " ".join(np.format_float_positional(number, trim="-") for number in numbers)


def _records(
    fields: list[str], kinds: list[str], sizes: list[str], repeats: list[int]
) -> tuple[list[str], list[str]]:
    """Return the names and types of a record's fields; padding fields get unique names."""
    codes = {"F": "f", "I": "i", "U": "u"}
    names: list[str] = []
    formats: list[str] = []
    for place, (field, kind, size, repeat) in enumerate(
        zip(fields, kinds, sizes, repeats, strict=True)
    ):
        code = f"<{codes.get(kind, '')}{size}"
        if kind not in codes or size not in ("1", "2", "4", "8") or code == "<f1":
            raise FormatError(f"expected TYPE F, I or U of SIZE 1, 2, 4 or 8, got {kind}{size}")
        names.append(field if field != "_" else f"_{place}")
        formats.append(code if repeat == 1 else f"({repeat},){code}")
    return names, formats


def _columns(body: bytes, points: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return the records of compressed columns."""
    if len(body) < 8:
        raise FormatError(f"expected two sizes after the header, got {len(body)} bytes")
    packed, unpacked = (int(size) for size in np.frombuffer(body, dtype="<u4", count=2))
    if unpacked != points * dtype.itemsize:
        raise FormatError(f"expected {points * dtype.itemsize} bytes unpacked, got {unpacked}")
    if packed > len(body) - 8:
        raise FormatError(f"expected {packed} compressed bytes, got {len(body) - 8}")
    flat = _lzf(body[8 : 8 + packed], unpacked)
    records = np.zeros(points, dtype=dtype)
    begin = 0
    for name in dtype.names or ():
        kind = dtype[name]
        end = begin + points * kind.itemsize
        records[name] = np.frombuffer(flat[begin:end], dtype=kind)
        begin = end
    return records


def _lzf(data: bytes, size: int) -> bytes:
    """Return the unpacked bytes of an LZF stream.

    Args:
        data: Packed bytes: runs of literals, and references back into what is unpacked already.
        size: Expected number of unpacked bytes.

    Raises:
        FormatError: If the stream is damaged, or another size comes out.
    """
    out = bytearray()
    place = 0
    try:
        while place < len(data):
            control = data[place]
            place += 1
            if control < 32:
                out += data[place : place + control + 1]
                place += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[place]
                place += 1
            back = ((control & 0x1F) << 8) + data[place] + 1
            place += 1
            begin = len(out) - back
            if begin < 0 or len(out) > size:
                raise FormatError("expected a whole LZF stream, got a damaged one")
            for k in range(length + 2):
                out.append(out[begin + k])
    except IndexError as error:
        raise FormatError("expected a whole LZF stream, got a truncated one") from error
    if len(out) != size:
        raise FormatError(f"expected {size} bytes from the LZF stream, got {len(out)}")
    return bytes(out)
