"""Sizes and counts of LAS and LAZ files, checked before a native library allocates by them."""

import struct

import numpy as np
import pytest

from tests.support.las_files import las_file
from traversability.formats import las
from traversability.formats.error import FormatError

laspy = pytest.importorskip("laspy")
POINTS = np.random.default_rng(0).uniform(-20, 20, (300, 3))
CHUNKED = las_file(POINTS, packed=True)
LAYERED = las_file(POINTS, text="", packed=True)
PLAIN = las_file(POINTS, text="")


def start(data):
    """Return the begin of the points of a file."""
    return struct.unpack_from("<I", data, 96)[0]


def table(data):
    """Return the begin of the chunk table of a file."""
    return struct.unpack_from("<q", data, start(data))[0]


def edited(data, offset, form, value):
    """Return a file with one number replaced."""
    changed = bytearray(data)
    struct.pack_into(form, changed, offset, value)
    return bytes(changed)


@pytest.mark.parametrize("data", [CHUNKED, LAYERED, PLAIN])
def test_whole_files_pass(data):
    """A file that keeps what its header says is read."""
    assert len(las.parse(data).columns["x"]) == len(POINTS)


def test_a_table_named_at_the_end_is_found():
    """The place of the chunk table may stand in the last bytes, as of files written in one go."""
    place = struct.pack("<q", table(LAYERED))
    data = edited(LAYERED, start(LAYERED), "<q", -1) + place
    assert len(las.parse(data).columns["x"]) == len(POINTS)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (edited(CHUNKED, table(CHUNKED) + 4, "<I", 2**32 - 1), "chunks, one a point"),
        (edited(CHUNKED, start(CHUNKED), "<q", 2**60), "chunk table inside"),
        (edited(CHUNKED, start(CHUNKED), "<q", 0), "chunk table inside"),
        (CHUNKED[: table(CHUNKED)], "chunk table inside"),
        # The first of nine sizes of layers behind a whole point and the number of points.
        (edited(LAYERED, start(LAYERED) + 8 + 30 + 4, "<I", 2**32 - 1), "room for layers"),
        (edited(LAYERED, start(LAYERED) + 8 + 30 + 4 + 32, "<I", 2**32 - 1), "room for layers"),
        (edited(LAYERED, 247, "<Q", 2**50), "bytes unpacked"),
        (edited(LAYERED, 243, "<I", 2**32 - 1), "extended records"),
        (edited(LAYERED, 100, "<I", 2**32 - 1), "room for records"),
        (edited(LAYERED, 105, "<H", 60), "(points of|points to|size)"),
        # The number of points in a chunk, behind the header of LAZ's own record.
        (edited(CHUNKED, CHUNKED.index(b"laszip encoded") + 52 + 12, "<I", 2**31), "unpacked"),
        (PLAIN[:-30], "room for 300 points"),
        (b"LASF", "other bytes"),
    ],
)
def test_a_size_that_the_file_does_not_hold_is_refused(data, text):
    """Each count and size is compared with the bytes that are there."""
    with pytest.raises(FormatError, match=text):
        las.parse(data)


def test_a_chunk_that_is_longer_than_the_file_is_refused(monkeypatch):
    """The sizes of the table's chunks lie before the table."""
    import lazrs

    size = table(CHUNKED) - start(CHUNKED) - 8
    for each, text in ((size + 1, "room for chunks"), (size, "")):
        monkeypatch.setattr(lazrs, "read_chunk_table", lambda *_, n=each: [(len(POINTS), n)])
        if text:
            with pytest.raises(FormatError, match=text):
                las.parse(CHUNKED)
        else:
            las.parse(CHUNKED)


def test_a_panic_of_the_library_is_an_error_of_ours(monkeypatch):
    """A panic is no Exception, and is named all the same; an interrupt stays one."""
    for kind, expected in ((BaseException, FormatError), (KeyboardInterrupt, KeyboardInterrupt)):

        def fail(self, kind=kind):
            raise kind("panic")

        monkeypatch.setattr(laspy.LasReader, "read", fail)
        with pytest.raises(expected):
            las.parse(LAYERED)
