"""Records of the ROS 1 bag format, version 2.0: http://wiki.ros.org/Bags/Format/2.0."""

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

MAGIC = b"#ROSBAG V2.0\n"
"""First bytes of a bag."""

MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7

_REQUIRED = {
    MESSAGE: (b"conn", b"time"),
    BAG_HEADER: (b"index_pos",),
    INDEX: (b"conn", b"count"),
    CHUNK: (b"compression", b"size"),
    CHUNK_INFO: (b"chunk_pos", b"count"),
    CONNECTION: (b"conn", b"topic"),
}
"""Fields that a record's header must have, by operation."""

_FIELD_SIZES = {b"conn": 4, b"time": 8, b"count": 4, b"size": 4, b"chunk_pos": 8, b"index_pos": 8}
"""Sizes of fixed fields [bytes]."""

_LONGEST_HEADER = 4096
"""Longest header that is accepted [bytes]; real ones have a hundred."""

_OPERATION = re.compile(rb"\x04\x00\x00\x00op=([\x02\x04\x05\x06\x07])")

Buffer = bytes | memoryview
"""Bytes of a file or of a decompressed chunk."""


class DamagedRecordError(ValueError):
    """Bytes that are no record, or a record that is cut short."""


@dataclass(frozen=True)
class Record:
    """Record of a bag.

    Attributes:
        operation: Operation code.
        fields: Fields of the header, by name.
        offset: Offset of its first byte.
        start: Offset of its data.
        end: Offset after its data.
    """

    operation: int
    fields: Mapping[bytes, bytes]
    offset: int
    start: int
    end: int

    def number(self, name: bytes) -> int:
        """Return a header field that is an integer."""
        return int.from_bytes(self.fields[name], "little")

    def stamp_ns(self) -> int:
        """Return a message's time [ns]."""
        seconds, rest = struct.unpack("<II", self.fields[b"time"])
        return int(seconds) * 1_000_000_000 + int(rest)


def record_at(data: Buffer, offset: int, end: int | None = None, cut: bool = False) -> Record:
    """Return the record at an offset.

    Args:
        data: Bytes of the file, or of a decompressed chunk.
        offset: Offset of the record.
        end: Offset that no record crosses; None for the end of ``data``.
        cut: True to accept data that are cut short by ``end``.

    Raises:
        DamagedRecordError: If there is no whole record.
    """
    end = len(data) if end is None else end
    if offset + 4 > end:
        raise DamagedRecordError("expected a record, got the end of the file inside one")
    (length,) = struct.unpack_from("<I", data, offset)
    start = offset + 4 + length
    if not 0 < length <= _LONGEST_HEADER or start + 4 > end:
        raise DamagedRecordError(f"expected a record's header, got one of {length:,} bytes")
    fields = header_fields(bytes(data[offset + 4 : start]))
    operation = fields.get(b"op", b"")
    if len(operation) != 1 or operation[0] not in _REQUIRED:
        raise DamagedRecordError("expected a known operation, got another")
    for name in _REQUIRED[operation[0]]:
        value = fields.get(name)
        if value is None or len(value) != _FIELD_SIZES.get(name, len(value)):
            raise DamagedRecordError(f"expected the field {name.decode()}, got none that fits")
    (length,) = struct.unpack_from("<I", data, start)
    start += 4
    if start + length > end and not cut:
        raise DamagedRecordError("expected a whole record, got the end of the file inside one")
    return Record(operation[0], fields, offset, start, min(start + length, end))


def header_fields(data: bytes) -> dict[bytes, bytes]:
    """Return the fields of a record's header, by name.

    Raises:
        DamagedRecordError: If a field is cut short or has no name.
    """
    fields: dict[bytes, bytes] = {}
    offset = 0
    while offset < len(data):
        if offset + 4 > len(data):
            raise DamagedRecordError("expected a field, got the end of the header")
        (length,) = struct.unpack_from("<I", data, offset)
        field = data[offset + 4 : offset + 4 + length]
        name, sign, value = field.partition(b"=")
        if len(field) < length or not sign:
            raise DamagedRecordError("expected a field with a name, got none")
        fields[name] = value
        offset += 4 + length
    return fields


def find_record(data: Buffer, offset: int, operations: tuple[int, ...], end: int) -> int | None:
    """Return the offset of the next record of some kinds; None without one.

    A record begins with a length, which any bytes may resemble. So the search is for the field of
    its operation code, and goes back from there to the begin of the record.

    Args:
        data: Bytes of the file, or of a decompressed chunk.
        offset: Offset from which to search.
        operations: Operation codes.
        end: Offset that no record crosses.
    """
    for match in _OPERATION.finditer(data, offset, end):
        if match[1][0] not in operations:
            continue
        field = match.start()
        for begin in range(field - 4, max(offset, field - _LONGEST_HEADER) - 1, -1):
            if _begins_header(data, begin, field):
                try:
                    record_at(data, begin, end)
                except DamagedRecordError:
                    continue
                return begin
    return None


def _begins_header(data: Buffer, begin: int, field: int) -> bool:
    """Return True if a header that begins at ``begin`` can hold a field at ``field``."""
    (length,) = struct.unpack_from("<I", data, begin)
    return field + 8 <= begin + 4 + length and length <= _LONGEST_HEADER


def index_counts(record: Record, data: Buffer) -> Iterator[tuple[int, int]]:
    """Yield connection and number of messages of an index or chunk info record."""
    if record.operation == INDEX:
        yield record.number(b"conn"), record.number(b"count")
        return
    for offset in range(record.start, record.end - 7, 8):
        number, count = struct.unpack_from("<II", data, offset)
        yield int(number), int(count)


def encode_header(fields: Mapping[bytes, bytes]) -> bytes:
    """Return an encoded header with its length."""
    parts = [struct.pack("<I", len(k) + 1 + len(v)) + k + b"=" + v for k, v in fields.items()]
    body = b"".join(parts)
    return struct.pack("<I", len(body)) + body


def encode_record(fields: Mapping[bytes, bytes], data: bytes) -> bytes:
    """Return an encoded record."""
    return encode_header(fields) + struct.pack("<I", len(data)) + data
