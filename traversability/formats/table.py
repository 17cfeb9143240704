"""Rows of numbers, as text or as packed records."""

import io

import numpy as np
from numpy.typing import NDArray

from traversability.formats.error import FormatError

MAX_POINTS = 100_000_000
"""More points than this are a damaged header."""

COORDINATES = ("x", "y", "z")


def check_count(count: int) -> int:
    """Return a number of points that is possible."""
    if not 0 <= count <= MAX_POINTS:
        raise FormatError(f"expected 0 to {MAX_POINTS} points, got {count}")
    return count


def text_rows(body: bytes, count: int, columns: list[int], width: int) -> NDArray[np.float32]:
    """Return some columns of a text table with a number a word.

    Args:
        body: The text after the header.
        count: Number of rows.
        columns: Wanted columns.
        width: Numbers of a row.
    """
    wanted = check_count(count) * width
    try:
        numbers = np.array(body.split(None, wanted)[:wanted], dtype=np.float64)
    except ValueError as error:
        raise FormatError(f"expected numbers, got {error}") from error
    if len(numbers) < wanted:
        raise FormatError(f"expected {count} rows of {width} numbers, got {len(numbers)} numbers")
    return numbers.reshape(count, width)[:, columns].astype(np.float32)


def packed_rows(body: bytes, count: int, dtype: np.dtype[np.void]) -> NDArray[np.float32]:
    """Return x, y, z of packed records."""
    wanted = check_count(count) * dtype.itemsize
    if len(body) < wanted:
        raise FormatError(f"expected {wanted} bytes of {count} points, got {len(body)}")
    return coordinates(np.frombuffer(body, dtype=dtype, count=count))


def coordinates(records: NDArray[np.void]) -> NDArray[np.float32]:
    """Return x, y, z of structured records, shape (n, 3)."""
    names = records.dtype.names or ()
    missing = [name for name in COORDINATES if name not in names]
    if missing:
        raise FormatError(f"expected fields x, y, z, got {', '.join(names) or 'none'}")
    with np.errstate(over="ignore", invalid="ignore"):
        columns = [records[name].ravel().astype(np.float32) for name in COORDINATES]
    return np.stack(columns, axis=1)


def record_type(names: list[str], formats: list[str]) -> np.dtype[np.void]:
    """Return the record type of named fields."""
    try:
        return np.dtype({"names": names, "formats": formats})
    except (ValueError, TypeError) as error:
        raise FormatError(f"expected fields with different names, got {error}") from error


def header_lines(data: bytes, last: bytes, limit: int = 65_536) -> tuple[list[list[str]], bytes]:
    """Return the words of each header line up to the line that begins with ``last``, and the rest.

    Raises:
        FormatError: If no such line is near the beginning.
    """
    stream = io.BytesIO(data)
    lines: list[list[str]] = []
    while stream.tell() < limit:
        line = stream.readline(limit)
        if not line:
            break
        lines.append(line.decode("latin-1").split())
        if line.startswith(last):
            return lines, data[stream.tell() :]
    raise FormatError(f"expected a header that ends with {last.decode()!r}, got none")
