"""Rows of numbers, as text or as packed records."""

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.formats.error import FormatError

MAX_POINTS = 100_000_000
"""Number of points above which a header is taken for damaged."""

COORDINATES = ("x", "y", "z")
"""Names of the columns that every cloud has."""

Columns = dict[str, NDArray[Any]]
"""Columns of a cloud by name: arrays of equal length, one value per point."""


def check_count(count: int) -> int:
    """Return a number of points if it is possible.

    Raises:
        FormatError: If it is negative or above ``MAX_POINTS``.
    """
    if not 0 <= count <= MAX_POINTS:
        raise FormatError(f"expected 0 to {MAX_POINTS} points, got {count}")
    return count


def text_columns(body: bytes, count: int, places: dict[str, int], width: int) -> Columns:
    """Return some columns of a text table of numbers.

    Args:
        body: Text after the header.
        count: Number of rows.
        places: Index in a row of each wanted column, by name.
        width: Number of numbers in a row.

    Raises:
        FormatError: If there are fewer numbers, or words that are none.
    """
    wanted = check_count(count) * width
    try:
        numbers = np.array(body.split(None, wanted)[:wanted], dtype=np.float64)
    except ValueError as error:
        raise FormatError(f"expected numbers, got {error}") from error
    if len(numbers) < wanted:
        raise FormatError(f"expected {count} rows of {width} numbers, got {len(numbers)} numbers")
    rows = numbers.reshape(count, width)
    return {name: rows[:, place] for name, place in places.items()}


def packed_columns(body: bytes, count: int, dtype: np.dtype[np.void]) -> Columns:
    """Return the columns of packed records.

    Args:
        body: Bytes after the header.
        count: Number of records.
        dtype: Type of a record.

    Raises:
        FormatError: If there are fewer bytes.
    """
    wanted = check_count(count) * dtype.itemsize
    if len(body) < wanted:
        raise FormatError(f"expected {wanted} bytes of {count} points, got {len(body)}")
    return record_columns(np.frombuffer(body, dtype=dtype, count=count))


def record_columns(records: NDArray[np.void]) -> Columns:
    """Return the columns of structured records; a field of k numbers is k columns."""
    records = records.ravel()
    columns: Columns = {}
    for name in records.dtype.names or ():
        column = records[name]
        if column.ndim == 1:
            columns[name] = column
        elif column.ndim == 2 and not name.startswith("_"):
            columns |= {f"{name}_{k}": column[:, k] for k in range(column.shape[1])}
    return columns


def packed_records(columns: Columns) -> bytes:
    """Return columns as little-endian records without padding."""
    kinds = [(name, column.dtype.newbyteorder("<")) for name, column in columns.items()]
    records = np.empty(len(next(iter(columns.values()))), dtype=kinds)
    for name, column in columns.items():
        records[name] = column
    return records.tobytes()


def record_type(names: list[str], formats: list[str]) -> np.dtype[np.void]:
    """Return the record type of named fields.

    Raises:
        FormatError: If two fields have one name.
    """
    try:
        return np.dtype({"names": names, "formats": formats})
    except (ValueError, TypeError) as error:
        raise FormatError(f"expected fields with different names, got {error}") from error


def header_lines(
    data: bytes, last: bytes, limit: int = 65_536, any_case: bool = False
) -> tuple[list[list[str]], bytes]:
    """Return the words of each header line up to the one that begins with ``last``, and the rest.

    Args:
        data: Bytes of the file.
        last: Beginning of the header's last line.
        limit: Number of bytes within which that line has to begin.
        any_case: True if that line may begin with small letters, too; ``last`` has capitals.

    Raises:
        FormatError: If there is no such line.
    """
    stream = io.BytesIO(data)
    lines: list[list[str]] = []
    while stream.tell() < limit:
        line = stream.readline(limit)
        if not line:
            break
        lines.append(line.decode("latin-1").split())
        if (line.upper() if any_case else line).startswith(last):
            return lines, data[stream.tell() :]
    raise FormatError(f"expected a header that ends with {last.decode()!r}, got none")
