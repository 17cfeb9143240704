"""Records of the MCAP format: https://mcap.dev/spec."""

import re
import struct
import zlib
from io import BytesIO
from typing import NamedTuple, TypeVar

from andabata.records.containers.compression import unpack

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS = 8, 9, 10, 11
METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 12, 13, 14, 15
PRIVATE = 0x80
"""Least operation code of records that applications add."""

_HEAD = 9
"""Size of operation code and length [bytes]."""

_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHUNK_HEAD = struct.Struct("<QQQI")

_CANDIDATE = re.compile(
    rb"\x06.{6}\x00\x00.{28}(?:\x00\x00\x00\x00|\x03\x00\x00\x00lz4|\x04\x00\x00\x00zstd)"
    rb"|[\x05\x07\x09\x0c\x0f].{6}\x00\x00",
    re.DOTALL,
)
"""What a record looks like from outside: no length reaches 2**48 bytes."""

Buffer = bytes | memoryview
Found = TypeVar("Found")


class DamagedRecordError(ValueError):
    """Bytes that are no record, or reach beyond the end."""


class Record(NamedTuple):
    """One record: its operation code and where its content starts and ends."""

    operation: int
    place: int
    start: int
    end: int


class MessageHead(NamedTuple):
    """What stands before a message's bytes."""

    channel: int
    sequence: int
    log_time: int
    publish_time: int


class ChunkHead(NamedTuple):
    """What stands before a chunk's records, and where these lie in the file."""

    begin_time: int
    end_time: int
    size: int
    crc: int
    compression: str
    start: int
    end: int


def record_at(data: Buffer, place: int) -> Record:
    """Return the record at a place.

    Raises:
        DamagedRecordError: If there is none.
    """
    start = place + _HEAD
    if start > len(data):
        raise DamagedRecordError("expected a record, got the end of the file inside one")
    operation, length = data[place], int.from_bytes(data[place + 1 : start], "little")
    if not (0 < operation <= DATA_END or operation >= PRIVATE):
        raise DamagedRecordError(f"expected a known operation code, got {operation}")
    if start + length > len(data):
        raise DamagedRecordError("expected a whole record, got the end of the file inside one")
    return Record(operation, place, start, start + length)


def message_head(data: Buffer, record: Record) -> MessageHead:
    """Return what stands before a message's bytes.

    Raises:
        DamagedRecordError: If the record is too short.
    """
    if record.end - record.start < _MESSAGE_HEAD.size:
        raise DamagedRecordError("expected a message, got a shorter record")
    return MessageHead(*_MESSAGE_HEAD.unpack_from(data, record.start))


MESSAGE_HEAD_SIZE = _MESSAGE_HEAD.size


def chunk_head(data: Buffer, record: Record) -> ChunkHead:
    """Return what stands before a chunk's records.

    Raises:
        DamagedRecordError: If the record is no chunk.
    """
    place = record.start + _CHUNK_HEAD.size
    if place + 12 > record.end:
        raise DamagedRecordError("expected a chunk, got a shorter record")
    begin, last, size, crc = _CHUNK_HEAD.unpack_from(data, record.start)
    length = int.from_bytes(data[place : place + 4], "little")
    start = place + 4 + length + 8
    if start > record.end or length > 32:
        raise DamagedRecordError("expected a chunk, got a record that holds none")
    compression = bytes(data[place + 4 : place + 4 + length]).decode(errors="replace")
    if start + int.from_bytes(data[start - 8 : start], "little") != record.end:
        raise DamagedRecordError("expected a chunk as long as its record, got another length")
    return ChunkHead(begin, last, size, crc, compression, start, record.end)


def chunk_content(data: Buffer, head: ChunkHead) -> Buffer:
    """Return a chunk's records, unpacked and with their checksum looked at.

    Raises:
        ValueError: If they are damaged.
    """
    content = unpack(head.compression, memoryview(data)[head.start : head.end], head.size)
    if head.crc and zlib.crc32(content) != head.crc:
        raise DamagedRecordError("expected a chunk with its checksum, got another checksum")
    return content


def index_count(data: Buffer, record: Record) -> tuple[int, int]:
    """Return channel and number of messages of a message index.

    Raises:
        DamagedRecordError: If the record is none.
    """
    if record.end - record.start < 6:
        raise DamagedRecordError("expected a message index, got a shorter record")
    channel, length = struct.unpack_from("<HI", data, record.start)
    if record.end - record.start != 6 + length or length % 16:
        raise DamagedRecordError("expected a message index, got one of another length")
    return int(channel), int(length) // 16


def parse(kind: type[Found], data: Buffer, record: Record) -> Found:
    """Return a record as the ``mcap`` package makes it.

    Args:
        kind: Class of ``mcap.records`` with a method ``read``.
        data: The file, or an unpacked chunk.
        record: The record.

    Raises:
        DamagedRecordError: If the record holds something else.
    """
    from mcap.data_stream import ReadDataStream

    stream = ReadDataStream(BytesIO(bytes(data[record.start : record.end])))
    try:
        found: Found = kind.read(stream)  # type: ignore[attr-defined]
    except Exception as error:  # struct's, Unicode's and the package's own errors.
        raise DamagedRecordError(f"expected a {kind.__name__} record, got damage") from error
    return found


def find_record(data: Buffer, place: int) -> int | None:
    """Return the offset of the next record that is whole beyond doubt, or None.

    Args:
        data: The file.
        place: Offset from which to look.
    """
    for match in _CANDIDATE.finditer(data, place):
        if _plausible(data, match.start()):
            return match.start()
    return None


def _plausible(data: Buffer, place: int) -> bool:
    """Return whether a record lies here: a chunk with its checksum, or one followed by others."""
    try:
        record = record_at(data, place)
        if record.operation == CHUNK:
            chunk_content(data, chunk_head(data, record))
            return True
        for _ in range(3):
            check(data, record)
            if record.operation == FOOTER or record.end == len(data):
                return True
            record = record_at(data, record.end)
    except ValueError:
        return False
    return True


def check(data: Buffer, record: Record) -> None:
    """Look into a record that needs no unpacking.

    Raises:
        DamagedRecordError: If it is not what it says.
    """
    from mcap.records import Attachment, Metadata

    if record.operation == MESSAGE:
        message_head(data, record)
    elif record.operation == MESSAGE_INDEX:
        index_count(data, record)
    elif record.operation == ATTACHMENT:
        parse(Attachment, data, record)
    elif record.operation == METADATA:
        parse(Metadata, data, record)
    elif record.operation == DATA_END and record.end - record.start != 4:
        raise DamagedRecordError("expected the end of the data, got a record of another length")
    elif record.operation == CHUNK:
        chunk_head(data, record)
