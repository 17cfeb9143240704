"""Checks of a LAS or LAZ file's sizes and counts, before a native library allocates by them.

The library of LAZ trusts the sizes in a file: a damaged one ends the process, with no exception.
"""

import io
import struct
from typing import NamedTuple

from traversability.formats.error import FormatError
from traversability.unpacked_size import largest_unpacked

_HEADER_BYTES, _HEADER_BYTES_14 = 227, 375
"""Size of the header up to LAS 1.2, and of LAS 1.4."""

_RECORD_BYTES, _EXTENDED_BYTES = 54, 60
"""Size of the header of a record, and of an extended record."""

_ITEM_START, _ITEM_BYTES = 34, 6
"""Begin and size of the items in LAZ's own record."""

_POINTWISE, _LAYERED = 1, 3
"""Compressors without chunks, and with a layer for each field in a chunk."""

_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
"""Number of layers by the type of an item; extra bytes (14) have a layer for each byte."""
_EXTRA_BYTES_ITEM = 14


class LazRecord(NamedTuple):
    """Record of LAZ: kind of compression, and the items that a point consists of.

    Attributes:
        compressor: Number of the compressor.
        items: Type and size [bytes] of each item.
    """

    compressor: int
    items: tuple[tuple[int, int], ...]

    @property
    def has_chunks(self) -> bool:
        """Return True if points are compressed in chunks, which a table lists."""
        return self.compressor != _POINTWISE

    @property
    def point_bytes(self) -> int:
        """Return the size of an unpacked point [bytes]."""
        return sum(size for _, size in self.items)

    @property
    def n_layers(self) -> int:
        """Return the number of layers in a chunk."""
        return sum(
            size if kind == _EXTRA_BYTES_ITEM else _LAYERS.get(kind, 0) for kind, size in self.items
        )


def check_header(data: bytes) -> None:
    """Check that a file has room for the records and the points that its header counts.

    Args:
        data: Bytes of the file.

    Raises:
        FormatError: If it has not.
    """
    if len(data) < _HEADER_BYTES or not data.startswith(b"LASF"):
        raise FormatError("expected a LAS or LAZ file, got other bytes")
    header_bytes, start, n_records = struct.unpack_from("<HII", data, 94)
    kind, point_bytes, n_points = struct.unpack_from("<BHI", data, 104)
    _check_room("points", start, 1, len(data))
    _check_room("records", header_bytes + n_records * _RECORD_BYTES, 0, start)
    if data[25] >= 4 and len(data) >= _HEADER_BYTES_14:
        first, n_extended, n_points = struct.unpack_from("<QIQ", data, 235)
        if n_extended:
            _check_room("extended records", first, n_extended * _EXTENDED_BYTES, len(data))
    packed = bool(kind & 0xC0)
    if packed:
        _check_ratio(n_points * point_bytes, len(data))
    else:
        _check_room(f"{n_points} points", start, n_points * point_bytes, len(data))


def laz_record(data: bytes, point_bytes: int) -> LazRecord:
    """Return LAZ's own record.

    Args:
        data: Content of the record.
        point_bytes: Size of a point that the file's header says [bytes].

    Raises:
        FormatError: If it is cut short, or describes points of another size.
    """
    _check_room("items of LAZ", _ITEM_START, 0, len(data))
    (count,) = struct.unpack_from("<H", data, _ITEM_START - 2)
    _check_room("items of LAZ", _ITEM_START, count * _ITEM_BYTES, len(data))
    offsets = range(_ITEM_START, _ITEM_START + count * _ITEM_BYTES, _ITEM_BYTES)
    items = tuple(struct.unpack_from("<HH", data, offset) for offset in offsets)
    record = LazRecord(int.from_bytes(data[:2], "little"), items)
    if record.point_bytes != point_bytes:
        raise FormatError(f"expected points of {point_bytes} bytes, got {record.point_bytes}")
    return record


def check_chunks(data: bytes, start: int, n_points: int, content: bytes, laz: LazRecord) -> None:
    """Check that the chunks of a LAZ file and their layers lie inside of it.

    Args:
        data: Bytes of the file.
        start: Begin of the points, where the place of the chunk table is.
        n_points: Number of points that the header counts.
        content: Content of LAZ's own record.
        laz: Parsed record of that content.

    Raises:
        FormatError: If they do not.
    """
    import lazrs  # type: ignore[import-untyped]

    end = _chunk_table(data, start, n_points)
    stream = io.BytesIO(data)
    stream.seek(start)
    chunks = lazrs.read_chunk_table(stream, lazrs.LazVlr(content))
    begin = start + 8
    _check_room("chunks", begin, sum(size for _, size in chunks), end)
    for points, size in chunks:
        _check_ratio(points * laz.point_bytes, len(data))
        if laz.compressor == _LAYERED:
            _check_layers(data, begin, size, laz)
        begin += size


def _chunk_table(data: bytes, start: int, n_points: int) -> int:
    """Return the begin of the chunk table, which is no longer than the points allow.

    Raises:
        FormatError: If it lies outside of the file, or counts more chunks than points.
    """
    _check_room("chunk table", start, 8, len(data))
    (table,) = struct.unpack_from("<q", data, start)
    if table == -1:  # A file that was written in one go names the place in its last bytes.
        (table,) = struct.unpack_from("<q", data, len(data) - 8)
    if not start + 8 <= table <= len(data) - 8:
        raise FormatError(f"expected a chunk table inside the file, got one at byte {table:,}")
    (count,) = struct.unpack_from("<I", data, table + 4)
    if count > n_points:
        raise FormatError(f"expected at most {n_points} chunks, one a point, got {count:,}")
    return int(table)


def _check_layers(data: bytes, begin: int, size: int, laz: LazRecord) -> None:
    """Check that the layers of a chunk fill it: a whole point, their sizes, and then they.

    Raises:
        FormatError: If they do not.
    """
    sizes = begin + laz.point_bytes + 4
    layers = sizes + 4 * laz.n_layers
    _check_room("sizes of layers", sizes, 4 * laz.n_layers, begin + size)
    total = sum(struct.unpack_from(f"<{laz.n_layers}I", data, sizes))
    _check_room("layers", layers, total, begin + size)


def _check_ratio(unpacked: int, packed: int) -> None:
    """Check that a file does not unpack to far more than itself.

    Raises:
        FormatError: If it does.
    """
    limit = largest_unpacked(packed)
    if unpacked > limit:
        raise FormatError(f"expected at most {limit:,} bytes unpacked, got {unpacked:,}")


def _check_room(name: str, begin: int, size: int, end: int) -> None:
    """Check that a part of a file lies before an end.

    Raises:
        FormatError: If it does not.
    """
    if begin + size > end:
        missing = begin + size - end
        raise FormatError(f"expected room for {name}, got {missing:,} bytes too few")
