"""Rows of numbers: text and records by name, round trips, and damage that is named."""

import numpy as np
import pytest

from traversability.formats.error import FormatError
from traversability.formats.table import (
    MAX_POINTS,
    check_count,
    header_lines,
    packed_columns,
    packed_records,
    record_columns,
    record_type,
    text_columns,
)


def test_columns_of_a_text_are_those_of_their_places():
    """Line ends are no more than spaces; what follows the last row is left alone."""
    body = b"1 2 3\n4 5\n6 7 8 9 rest"
    found = text_columns(body, 3, {"x": 0, "z": 2}, 3)
    assert {name: column.tolist() for name, column in found.items()} == {
        "x": [1.0, 4.0, 7.0],
        "z": [3.0, 6.0, 9.0],
    }


def test_a_text_that_is_too_short_or_no_number_is_refused():
    """Rows and numbers are counted; the word that is none is shown."""
    with pytest.raises(FormatError, match="expected 2 rows of 3 numbers, got 5 numbers"):
        text_columns(b"1 2 3 4 5", 2, {"x": 0}, 3)
    with pytest.raises(FormatError, match=r"expected numbers, got .*seven"):
        text_columns(b"1 2 seven", 1, {"x": 0}, 3)


@pytest.mark.parametrize("count", [-1, MAX_POINTS + 1])
def test_a_number_of_points_that_cannot_be_is_refused(count):
    """Before anything of that size is made."""
    with pytest.raises(FormatError, match=f"expected 0 to {MAX_POINTS} points, got {count}"):
        check_count(count)
    assert check_count(MAX_POINTS) == MAX_POINTS


def test_records_come_back_as_they_were_packed():
    """Little-endian, without padding, each column of its own type."""
    columns = {
        "x": np.array([1.5, -2.0], ">f8"),
        "ring": np.array([3, 700], "u2"),
        "t": np.array([-1, 5], "i1"),
    }
    body = packed_records(columns)
    assert len(body) == 2 * (8 + 2 + 1)
    assert body[:8] == np.array(1.5, "<f8").tobytes()
    kinds = np.dtype([("x", "<f8"), ("ring", "<u2"), ("t", "i1")])
    found = packed_columns(body + b"more", 2, kinds)
    assert {name: column.tolist() for name, column in found.items()} == {
        name: column.tolist() for name, column in columns.items()
    }
    assert packed_columns(body, 2, kinds)["t"].tolist() == [-1, 5]
    with pytest.raises(FormatError, match="expected 22 bytes of 2 points, got 21"):
        packed_columns(body[:-1], 2, kinds)


def test_fields_of_several_numbers_are_as_many_columns():
    """Numbered; fields whose name begins with an underscore are padding."""
    kind = np.dtype([("normal", "f4", 2), ("_", "u1", 3), ("x", "f4")])
    records = np.zeros((1, 2), dtype=kind)
    records["normal"], records["x"] = [[1, 2], [3, 4]], [5, 6]
    found = record_columns(records)
    assert {name: column.tolist() for name, column in found.items()} == {
        "normal_0": [1, 3],
        "normal_1": [2, 4],
        "x": [5, 6],
    }


def test_two_fields_of_one_name_are_refused():
    """Which one would be meant is unknown."""
    assert record_type(["x", "y"], ["f4", "u1"]).itemsize == 5
    with pytest.raises(FormatError, match="expected fields with different names"):
        record_type(["x", "x"], ["f4", "f4"])


def test_a_header_ends_with_its_last_line():
    """Its words by line, and the bytes after it as they are; within a limit."""
    data = b"ply\nformat ascii\nend_header\n\x00\n1"
    assert header_lines(data, b"end_header") == (
        [["ply"], ["format", "ascii"], ["end_header"]],
        b"\x00\n1",
    )
    assert header_lines(b"data ascii\n1", b"DATA", any_case=True) == ([["data", "ascii"]], b"1")
    for wrong in ({"last": b"DATA"}, {"last": b"end_header", "limit": 10}):
        with pytest.raises(FormatError, match="expected a header that ends with"):
            header_lines(data, **wrong)
