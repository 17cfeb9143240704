"""Records of compiled code: the same names and values as the named tuples that they replace."""

from typing import NamedTuple

import numpy as np

from terrain.kernel import borrowing_kernel
from terrain.record import packed


class Inner(NamedTuple):
    """A named tuple within another."""

    table: np.ndarray
    is_open: bool


class Outer(NamedTuple):
    """A named tuple of numbers, an array and a named tuple."""

    number: float
    inner: Inner
    counts: np.ndarray


VALUES = Outer(2, Inner(np.arange(6.0).reshape(2, 3), True), np.array([7, 8]))


@borrowing_kernel
def scaled(records, factor):
    """Return number and truth value of a record, after scaling its table and counting."""
    outer = records[0]
    for i in range(2):
        for j in range(3):
            outer.inner.table[i, j] *= factor
    outer.counts[0] += 1
    return outer.number, outer.inner.is_open


def test_a_record_holds_the_values_of_a_named_tuple():
    """Numbers are float64, arrays keep type and shape, and the tuple's own stay as they are."""
    record = packed(VALUES)
    assert record.shape == (1,)
    assert record["number"].dtype == np.float64
    assert record["counts"].dtype == np.int64
    record["inner"]["table"][0, 0, 0] = 9.0
    assert VALUES.inner.table[0, 0] == 0.0


def test_a_kernel_reads_and_writes_a_record():
    """Names lead to the same places in compiled code; what it writes is seen outside."""
    record = packed(VALUES)
    assert scaled(record, 2.0) == (2.0, True)
    np.testing.assert_array_equal(record["inner"]["table"][0], 2 * VALUES.inner.table)
    assert record["counts"][0].tolist() == [8, 8]
