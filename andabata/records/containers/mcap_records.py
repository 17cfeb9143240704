"""Records of the MCAP format: https://mcap.dev/spec."""

import re
import struct
import zlib
from io import BytesIO
from typing import NamedTuple, TypeVar

from andabata.records.containers.compression import decompress

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of an MCAP file."""

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS = 8, 9, 10, 11
METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 12, 13, 14, 15
PRIVATE = 0x80
"""Smallest operation code of records of applications."""

_PREFIX_BYTES = 9
"""Size of operation code and length, before a record's content [bytes]."""

_MESSAGE_HEADER = struct.Struct("<HIQQ")
_CHUNK_HEADER = struct.Struct("<QQQI")

_CANDIDATE = re.compile(
    rb"\x06.{6}\x00\x00.{28}(?:\x00\x00\x00\x00|\x03\x00\x00\x00lz4|\x04\x00\x00\x00zstd)"
    rb"|[\x05\x07\x09\x0c\x0f].{6}\x00\x00",
    re.DOTALL,
)
"""Pattern of a record's begin: operation code, length below 2**48, compression of a chunk."""

Buffer = bytes | memoryview
"""Bytes of a file or of a decompressed chunk."""

Found = TypeVar("Found")


class DamagedRecordError(ValueError):
    """Bytes that are no record, or a record that is cut short."""


class Record(NamedTuple):
    """Record: operation code, offset, and offsets of begin and end of its content."""

    operation: int
    offset: int
    start: int
    end: int


class MessageHeader(NamedTuple):
    """Header of a message: channel, sequence number, times [ns]."""

    channel: int
    sequence: int
    log_time: int
    publish_time: int


class ChunkHeader(NamedTuple):
    """Header of a chunk: times [ns], decompressed size, checksum, and place of its records."""

    begin_time: int
    end_time: int
    size: int
    crc: int
    compression: str
    start: int
    end: int


def record_at(data: Buffer, offset: int) -> Record:
    """Return the record at an offset.

    Raises:
        DamagedRecordError: If there is no whole record.
    """
    start = offset + _PREFIX_BYTES
    if start > len(data):
        raise DamagedRecordError("expected a record, got the end of the file inside one")
    operation, length = data[offset], int.from_bytes(data[offset + 1 : start], "little")
    if not (0 < operation <= DATA_END or operation >= PRIVATE):
        raise DamagedRecordError(f"expected a known operation code, got {operation}")
    if start + length > len(data):
        raise DamagedRecordError("expected a whole record, got the end of the file inside one")
    return Record(operation, offset, start, start + length)


def message_header(data: Buffer, record: Record) -> MessageHeader:
    """Return the header of a message.

    Raises:
        DamagedRecordError: If the record is too short.
    """
    if record.end - record.start < _MESSAGE_HEADER.size:
        raise DamagedRecordError("expected a message, got a shorter record")
    return MessageHeader(*_MESSAGE_HEADER.unpack_from(data, record.start))


MESSAGE_HEADER_SIZE = _MESSAGE_HEADER.size


def chunk_header(data: Buffer, record: Record) -> ChunkHeader:
    """Return the header of a chunk.

    Raises:
        DamagedRecordError: If the record is no chunk.
    """
    offset = record.start + _CHUNK_HEADER.size
    if offset + 12 > record.end:
        raise DamagedRecordError("expected a chunk, got a shorter record")
    begin, last, size, crc = _CHUNK_HEADER.unpack_from(data, record.start)
    length = int.from_bytes(data[offset : offset + 4], "little")
    start = offset + 4 + length + 8
    if start > record.end or length > 32:
        raise DamagedRecordError("expected a chunk, got a record that holds none")
    compression = bytes(data[offset + 4 : offset + 4 + length]).decode(errors="replace")
    if start + int.from_bytes(data[start - 8 : start], "little") != record.end:
        raise DamagedRecordError("expected a chunk as long as its record, got another length")
    return ChunkHeader(begin, last, size, crc, compression, start, record.end)


def chunk_content(data: Buffer, header: ChunkHeader) -> Buffer:
    """Return the decompressed records of a chunk after a check of their checksum.

    Raises:
        ValueError: If they are damaged.
    """
    content = decompress(
        header.compression, memoryview(data)[header.start : header.end], header.size
    )
    if header.crc and zlib.crc32(content) != header.crc:
        raise DamagedRecordError("expected a chunk with its checksum, got another checksum")
    return content


def index_count(data: Buffer, record: Record) -> tuple[int, int]:
    """Return channel and number of messages of a message index.

    Raises:
        DamagedRecordError: If the record is no message index.
    """
    if record.end - record.start < 6:
        raise DamagedRecordError("expected a message index, got a shorter record")
    channel, length = struct.unpack_from("<HI", data, record.start)
    if record.end - record.start != 6 + length or length % 16:
        raise DamagedRecordError("expected a message index, got one of another length")
    return int(channel), int(length) // 16


def parse(kind: type[Found], data: Buffer, record: Record) -> Found:
    """Return a record, parsed by the ``mcap`` package.

    Args:
        kind: Class of ``mcap.records`` with a method ``read``.
        data: Bytes of the file, or of a decompressed chunk.
        record: Place of the record.

    Raises:
        DamagedRecordError: If the record holds something else.
    """
    from mcap.data_stream import ReadDataStream

    stream = ReadDataStream(BytesIO(bytes(data[record.start : record.end])))
    try:
        parsed: Found = kind.read(stream)  # type: ignore[attr-defined]
    except Exception as error:  # struct's, Unicode's and the package's own errors.
        raise DamagedRecordError(f"expected a {kind.__name__} record, got damage") from error
    return parsed


def find_record(data: Buffer, offset: int) -> int | None:
    """Return the offset of the next record that is certainly whole; None without one.

    Args:
        data: Bytes of the file.
        offset: Offset from which to search.
    """
    for match in _CANDIDATE.finditer(data, offset):
        if _plausible(data, match.start()):
            return match.start()
    return None


def _plausible(data: Buffer, offset: int) -> bool:
    """Return True if a record begins here: a chunk with its checksum, or one of several."""
    try:
        record = record_at(data, offset)
        if record.operation == CHUNK:
            chunk_content(data, chunk_header(data, record))
            return True
        # Random bytes resemble one record now and then, but hardly several in a row.
        for _ in range(3):
            check(data, record)
            if record.operation == FOOTER or record.end == len(data):
                return True
            record = record_at(data, record.end)
    except ValueError:
        return False
    return True


def check(data: Buffer, record: Record) -> None:
    """Check the content of a record as far as that needs no decompression.

    Raises:
        DamagedRecordError: If the content does not fit the operation code.
    """
    from mcap.records import Attachment, Metadata

    if record.operation == MESSAGE:
        message_header(data, record)
    elif record.operation == MESSAGE_INDEX:
        index_count(data, record)
    elif record.operation == ATTACHMENT:
        parse(Attachment, data, record)
    elif record.operation == METADATA:
        parse(Metadata, data, record)
    elif record.operation == DATA_END and record.end - record.start != 4:
        raise DamagedRecordError("expected the end of the data, got a record of another length")
    elif record.operation == CHUNK:
        chunk_header(data, record)
