"""Rows of floats without a header: KITTI's x, y, z, intensity, nuScenes's with a ring, others."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.formats.error import FormatError
from traversability.formats.table import Columns

WIDTHS = range(3, 9)
"""Numbers of columns that are inferred from the content."""

_LIKELY = 4
"""Number of KITTI's columns."""

_ALIKE = 0.9
"""Share of the best width's information from which on a smaller width is as good."""

_MAX_NUMBERS = 840 * 2500
"""Largest number of numbers that are looked at: whole rows of any width."""

_GARBAGE = 0.05
"""Share of numbers that no sensor gives, above which they are of another type."""

_LOWER = 0.7
"""Share of lower halves that are zero or garbage, above which pairs of floats are doubles."""

_NANS = {
    4: (0x7FC00000, 0xFFC00000, 0x7FFFFFFF),
    8: (0x7FF8 << 48, 0xFFF8 << 48, (1 << 63) - 1),
}
"""Bit patterns of NaN that processors and compilers write, by the size of a number [bytes]."""

_EXPONENTS = {4: 0x7F800000, 8: 0x7FF << 52}
"""Bits of the exponent, by the size of a number [bytes]; none is set in subnormal numbers."""


@np.errstate(over="ignore", invalid="ignore")  # Damaged files hold any bit pattern.
def parse(data: bytes, width: int | None = None, likely: int = _LIKELY) -> tuple[Columns, str]:
    """Return the columns of a file without a header, and how its layout was inferred.

    The right width is the one whose columns differ most from each other: rows of a wrong width mix
    heights with distances. Doubles are distinguished from floats by values that no sensor gives.

    Args:
        data: Bytes of the file.
        width: Number of columns; None infers it from the content.
        likely: Width that the file's name suggests, taken where the content leaves it open.

    Returns:
        Columns x, y, z, ``intensity``, ``ring`` where the fifth is whole, ``column_6`` and so on;
        and a remark, empty for the usual layout.

    Raises:
        FormatError: If no width fits, or several do.
    """
    kind = _kind(data)
    size = np.dtype(kind).itemsize
    words = np.frombuffer(data, dtype=kind, count=len(data) // size)
    remark = "" if size == 4 else "holds float64"
    if width is None:
        width = _width(words, len(data), size, likely)
        if width != _LIKELY:
            remark = f"{remark}{', ' if remark else ''}{width} columns, inferred from its content"
    elif width < 3:
        raise FormatError(f"--columns: expected at least 3 (x, y, z), got {width}")
    if len(data) % (size * width):
        raise FormatError(
            f"expected a multiple of {size * width} bytes ({width} columns of {kind[1:]}), got "
            f"{len(data)}"
        )
    rows = words.reshape(-1, width)
    return dict(zip(names(rows), rows.T, strict=True)), remark


def names(rows: NDArray[Any]) -> list[str]:
    """Return the names of columns that have none."""
    columns = ["x", "y", "z", "intensity"][: rows.shape[1]]
    for place in range(4, rows.shape[1]):
        column = rows[:, place]
        ring = place == 4 and bool(((column >= 0) & (column < 256) & (column % 1 == 0)).all())
        columns.append("ring" if ring else f"column_{place + 1}")
    return columns


def _kind(data: bytes) -> str:
    """Return the type of the numbers: float32, or float64 where only that gives lengths."""
    words = np.frombuffer(data, dtype="<f4", count=len(data) // 4)[:_MAX_NUMBERS]
    pairs = words[: len(words) // 2 * 2].reshape(-1, 2)
    pairs = pairs[pairs[:, 1] != 0]
    # The lower half of a double is zero, or nothing that a float would hold.
    lower = bool(len(pairs)) and (no_lengths(pairs[:, 0]) | (pairs[:, 0] == 0)).mean() > _LOWER
    garbage = no_lengths(words).mean() if len(words) else 0.0
    if garbage < _GARBAGE and not lower:
        return "<f4"
    doubles = np.frombuffer(data, dtype="<f8", count=len(data) // 8)[:_MAX_NUMBERS]
    if len(doubles) and no_lengths(doubles).mean() < _GARBAGE / 5:
        return "<f8"
    if garbage < _GARBAGE:
        return "<f4"
    raise FormatError(
        "expected little-endian float32 or float64 numbers of points, got "
        f"{100 * garbage:.0f} % that are no lengths"
    )


def no_lengths(words: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which numbers no sensor gives; zeros, NaN and infinity are no-returns.

    Of the many bit patterns of NaN, programs write few; others are negative integers.
    """
    bits = np.ascontiguousarray(words).view(f"<u{words.itemsize}")
    # By their bits: a processor that takes subnormal numbers for zero would not show them.
    tiny = ~are_zero(words) & (bits & _EXPONENTS[words.itemsize] == 0)
    with np.errstate(invalid="ignore"):
        size = np.abs(words.astype(np.float64))
        odd = np.isnan(size) & ~np.isin(bits, _NANS[words.itemsize])
        beyond = np.isfinite(size) & (size > 0) & ((size > 1e8) | (size < 1e-9))
        return np.asarray(odd | tiny | beyond)


def are_zero(words: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which numbers are zero, of either sign, in any byte order, by their bits."""
    order = words.dtype.str[0]
    bits = np.ascontiguousarray(words).view(np.dtype(f"{order}u{words.itemsize}"))
    return np.asarray(bits << bits.dtype.type(1) == 0)


def _width(words: NDArray[np.floating], length: int, size: int, likely: int) -> int:
    """Return the number of columns that the content shows."""
    fitting = [width for width in WIDTHS if length % (size * width) == 0]
    sample = words[:_MAX_NUMBERS]
    if likely in fitting and _void(sample.reshape(-1, likely))[:, :3].all():
        return likely  # No returns at all: the content shows nothing.
    shown_by = {width: _difference(sample, width) for width in WIDTHS if len(words) >= 4 * width}
    best = max(shown_by.values(), default=0.0)
    if best > 0:
        # Twice a width carries as much information as the width itself.
        shown = min(width for width, difference in shown_by.items() if difference >= _ALIKE * best)
        if shown in fitting:
            return shown
        if fitting != [likely]:
            raise FormatError(
                f"expected a multiple of {size * shown} bytes, as the content looks like {shown} "
                f"columns, got {length}"
            )
    if likely in fitting and (len(fitting) == 1 or likely != _LIKELY):
        return likely
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        raise FormatError(
            f"expected a multiple of {size * _LIKELY} bytes (x, y, z, intensity), got {length}"
        )
    listed = ", ".join(map(str, fitting))
    raise FormatError(
        f"expected a content that shows how many numbers a point has, got {length} bytes that fit "
        f"{listed}; say which with --columns"
    )


def _void(rows: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which numbers a driver may have written for no return."""
    return np.asarray(~(np.isfinite(rows) & (rows != 0)))


def _difference(words: NDArray[np.floating], width: int) -> float:
    """Return the mutual information of a number's column and its value [nats], beyond chance.

    Columns of nothing but zeros or NaN count as a value of their own; other zeros and NaN are
    left out, since slots without a return come in patterns.
    """
    rows = words[: len(words) // width * width].reshape(-1, width)
    void = _void(rows)
    empty: NDArray[np.bool_] = np.asarray(void.all(axis=0))
    if empty[:3].all():
        return 0.0
    column = np.broadcast_to(np.arange(width), rows.shape)
    kept = ~void | empty
    values, column, hollow = rows[kept], column[kept], np.broadcast_to(empty, rows.shape)[kept]
    bins = 32 if len(values) > 4096 else 8
    full = values[~hollow]
    if not len(full):
        return 0.0
    edges = np.unique(np.quantile(full, np.linspace(0, 1, bins + 1)[1:-1]))
    whole = values % 1 == 0
    code = np.where(hollow, 0, 1 + np.searchsorted(edges, values) + whole * (len(edges) + 1))
    n_codes = 2 * (len(edges) + 1) + 1
    counts = np.bincount(column * n_codes + code, minlength=width * n_codes)
    counts = counts.reshape(width, n_codes)
    counts = counts[counts.any(axis=1)][:, counts.any(axis=0)]
    share = counts / len(values)
    alone = share.sum(axis=1, keepdims=True) * share.sum(axis=0, keepdims=True)
    there = share > 0
    known = float((share[there] * np.log(share[there] / alone[there])).sum())
    freedom = (counts.shape[0] - 1) * (counts.shape[1] - 1)
    chance = (freedom + 3 * np.sqrt(2 * freedom)) / (2 * len(values))
    return known - chance
