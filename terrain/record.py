"""Records of compiled code: many numbers and arrays in one argument.

A call from Python takes every array and number of a named tuple apart, some 0.1 us each, and three
times that where caches are cold. A structured array of one element is taken apart once, whatever it
holds, and a kernel that knows the sizes of its arrays is faster itself. In the kernel ``record[0]``
has the tuple's names.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def packed(values: tuple[Any, ...]) -> NDArray[np.void]:
    """Return a named tuple as a structured array of one element, with copies of its arrays.

    Numbers become float64, but for truth values.

    Args:
        values: Named tuple of numbers, arrays and further named tuples. Arrays of truth values are
            refused by the compiler: uint8 takes their place.
    """
    record = np.zeros(1, _type_of(values))
    _fill(record, values)
    return record


def _type_of(value: object) -> np.dtype[Any]:
    """Return the type of a record's field."""
    if isinstance(value, tuple):
        parts = [(name, _type_of(part)) for name, part in _parts(value)]
        return np.dtype(parts, align=True)
    if isinstance(value, np.ndarray):
        return np.dtype((value.dtype, value.shape))
    return np.dtype(np.bool_ if isinstance(value, bool) else np.float64)


def _fill(record: NDArray[Any], value: object) -> None:
    """Write a value into a field of a record."""
    if not isinstance(value, tuple):
        record[0] = value
        return
    for name, part in _parts(value):
        _fill(record[name], part)


def _parts(values: tuple[Any, ...]) -> list[tuple[str, Any]]:
    """Return names and values of a named tuple."""
    names: tuple[str, ...] = getattr(values, "_fields")  # noqa: B009 - tuples in general have none.
    return list(zip(names, values, strict=True))
