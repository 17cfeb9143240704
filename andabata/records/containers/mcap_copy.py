"""Copy of an MCAP file, record by record, with a new summary."""

import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import IO, TYPE_CHECKING

from andabata.records.containers import mcap_records as records
from andabata.records.containers.compression import compress
from andabata.records.containers.container import Damage
from andabata.records.containers.mcap_file import Block, McapFile
from andabata.records.containers.mcap_records import Buffer, ChunkHeader, Record

_CHUNK_BYTES = 1 << 20
"""Size from which messages outside of chunks are written as a chunk [bytes]."""

if TYPE_CHECKING:
    from mcap.records import AttachmentIndex, ChunkIndex, McapRecord, MetadataIndex


def copy_mcap(source: McapFile, out: IO[bytes]) -> tuple[int, list[Damage]]:
    """Write the whole records of an MCAP file to a new one, each byte by byte.

    Profile, library, numbers, channel metadata, compression, metadata records, attachments and
    records of applications are kept.

    Args:
        source: Open file.
        out: File to write to.

    Returns:
        Number of messages written, and the attachments that are damaged.
    """
    return _McapCopy(source, out).run()


class _McapCopy:
    """Copy of one file in progress."""

    def __init__(self, source: McapFile, out: IO[bytes]) -> None:
        self._source, self._out = source, out
        self._crc = 0
        self._schemas: set[int] = set()
        self._channels: set[int] = set()
        self._counts: dict[int, int] = {}
        self._span: tuple[int, int] | None = None
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._damage: list[Damage] = []
        # Header of a chunk for messages outside of chunks; None in files without chunks.
        self._chunked: ChunkHeader | None = None
        self._unchunked = bytearray()

    def run(self) -> tuple[int, list[Damage]]:
        """Copy the records and write the summary; return number of messages and new damage."""
        from mcap.records import DataEnd, Header

        self._write(records.MAGIC)
        top = self._source.top
        if not top or top[0].operation != records.HEADER:
            self._write(_encoded([Header("", "andabata salvage")]))
        blocks = {each.record: each for each in self._source.blocks if each.record is not None}
        headers = [each.header for each in blocks.values() if each.header is not None]
        # In a file with chunks readers ignore messages outside of them: these go into chunks.
        self._chunked = headers[0] if headers else None
        for k, record in enumerate(top):
            if record.operation == records.HEADER and k:
                continue  # A second one is damage.
            if record.operation != records.MESSAGE or len(self._unchunked) >= _CHUNK_BYTES:
                self._flush()
            self._copy(record, blocks.get(record))
            if k == 0:
                self._write(_encoded(self._source.lost_schemas))
        self._flush()
        self._write(_encoded([DataEnd(self._crc)]))
        self._write_summary()
        return sum(self._counts.values()), self._damage

    def _write(self, data: bytes) -> None:
        """Write bytes of the data section and update its checksum."""
        self._crc = zlib.crc32(data, self._crc)
        self._out.write(data)

    def _copy(self, record: Record, block: Block | None) -> None:
        """Copy a record of the top level."""
        data = self._source.data
        if record.operation == records.CHUNK and block is not None:
            self._copy_chunk(record, block)
            return
        if record.operation in (records.MESSAGE_INDEX, records.CHUNK):
            return  # Indexes are computed anew; a chunk without a block is damaged.
        if record.operation == records.MESSAGE:
            header = records.message_header(data, record)
            if header.channel not in self._source.channels:
                return
            if self._chunked is not None:
                self._unchunked += data[record.offset : record.end]
                return
            self._define([header.channel], frozenset())
            self._count(header.channel, header.log_time)
        self._note_definition(data, record)
        if record.operation == records.ATTACHMENT and not self._index_attachment(record):
            return
        if record.operation == records.METADATA:
            self._index_metadata(record)
        self._write(bytes(data[record.offset : record.end]))

    def _note_definition(self, data: Buffer, record: Record) -> None:
        """Note that the new file defines a schema or a channel."""
        if record.operation in (records.SCHEMA, records.CHANNEL):
            number = int.from_bytes(data[record.start : record.start + 2], "little")
            (self._schemas if record.operation == records.SCHEMA else self._channels).add(number)

    def _count(self, channel: int, stamp: int) -> None:
        """Count a message."""
        self._counts[channel] = self._counts.get(channel, 0) + 1
        first, last = self._span or (stamp, stamp)
        self._span = min(first, stamp), max(last, stamp)

    def _define(self, used: Iterable[int], own: frozenset[int]) -> None:
        """Write the used channels whose records were lost; the summary has copies of them.

        Args:
            used: Numbers of the channels of the messages that follow.
            own: Numbers of the channels that the next chunk defines itself.
        """
        for number in used:
            if number in self._channels or number in own:
                continue
            channel = self._source.channels[number]
            schema = self._source.schemas.get(channel.schema_id)
            if schema is not None and schema.id not in self._schemas:
                self._write(_encoded([schema]))
                self._schemas.add(schema.id)
            self._write(_encoded([channel]))
            self._channels.add(number)

    def _copy_chunk(self, record: Record, block: Block) -> None:
        """Copy a chunk and index it; one with messages of unknown channels is compressed anew."""
        header = block.header
        if header is None:
            return
        content = records.chunk_content(self._source.data, header)
        inner = list(_inner(content))
        used = {
            records.message_header(content, each).channel
            for each in inner
            if each.operation == records.MESSAGE
        }
        raw = bytes(self._source.data[record.offset : record.end])
        # Readers fail at messages without a channel: write the chunk without them.
        unknown = used - self._source.channels.keys()
        if unknown:
            content = _without(content, inner, unknown)
            inner, used = list(_inner(content)), used - unknown
            raw, header = _chunk_record(content, header)
        self._define(sorted(used), block.channels)
        self._write_chunk(raw, header, content, inner)

    def _flush(self) -> None:
        """Write the collected messages outside of chunks as a chunk."""
        if self._chunked is None or not self._unchunked:
            return
        content = bytes(self._unchunked)
        self._unchunked.clear()
        inner = list(_inner(content))
        headers = [records.message_header(content, each) for each in inner]
        self._define(sorted({header.channel for header in headers}), frozenset())
        stamps = [header.log_time for header in headers]
        span = self._chunked._replace(begin_time=min(stamps), end_time=max(stamps))
        raw, header = _chunk_record(content, span)
        self._write_chunk(raw, header, content, inner)

    def _write_chunk(
        self, raw: bytes, header: ChunkHeader, content: Buffer, inner: list[Record]
    ) -> None:
        """Write a chunk's record and its index.

        Args:
            raw: Record of the chunk.
            header: Header of the chunk.
            content: Decompressed records of the chunk.
            inner: Places of these records.
        """
        from mcap.records import ChunkIndex

        entries: dict[int, list[tuple[int, int]]] = {}
        for each in inner:
            self._note_definition(content, each)
            if each.operation == records.MESSAGE:
                message = records.message_header(content, each)
                self._count(message.channel, message.log_time)
                entry = (message.log_time, each.offset)
                entries.setdefault(message.channel, []).append(entry)
        start = self._out.tell()
        self._write(raw)
        end = self._out.tell()
        index_offsets = self._write_message_indexes(entries)
        self._chunks.append(
            ChunkIndex(
                chunk_length=end - start,
                chunk_start_offset=start,
                compression=header.compression,
                compressed_size=header.end - header.start,
                message_end_time=header.end_time,
                message_index_length=self._out.tell() - end,
                message_index_offsets=index_offsets,
                message_start_time=header.begin_time,
                uncompressed_size=header.size,
            )
        )

    def _write_message_indexes(self, entries: dict[int, list[tuple[int, int]]]) -> dict[int, int]:
        """Write an index for each channel of a chunk; return their offsets in the file.

        Args:
            entries: Times [ns] and offsets in the chunk of the messages, by channel.
        """
        from mcap.records import MessageIndex

        offsets = {}
        for channel, messages in entries.items():
            offsets[channel] = self._out.tell()
            self._write(_encoded([MessageIndex(channel, sorted(messages))]))
        return offsets

    def _index_attachment(self, record: Record) -> bool:
        """Index an attachment; return True if its checksum is right."""
        from mcap.records import Attachment, AttachmentIndex

        data = self._source.data
        about = records.parse(Attachment, data, record)
        crc = int.from_bytes(data[record.end - 4 : record.end], "little")
        if crc and zlib.crc32(data[record.start : record.end - 4]) != crc:
            reason = f"expected the attachment {about.name!r} with its checksum, got another one"
            self._damage.append(Damage(record.offset, record.end - record.offset, reason, 0))
            return False
        self._attachments.append(
            AttachmentIndex(
                offset=self._out.tell(),
                length=record.end - record.offset,
                log_time=about.log_time,
                create_time=about.create_time,
                data_size=len(about.data),
                name=about.name,
                media_type=about.media_type,
            )
        )
        return True

    def _index_metadata(self, record: Record) -> None:
        """Add a metadata record to the index."""
        from mcap.records import Metadata, MetadataIndex

        about = records.parse(Metadata, self._source.data, record)
        length = record.end - record.offset
        self._metadata.append(
            MetadataIndex(offset=self._out.tell(), length=length, name=about.name)
        )

    def _write_summary(self) -> None:
        """Write the summary, the offsets of its groups, and the end of the file."""
        from mcap.records import Footer, SummaryOffset

        start = self._out.tell()
        summary, offsets = b"", []
        for group in self._summary_groups():
            if group:
                encoded = _encoded(group)
                offset = start + len(summary)
                offsets.append(SummaryOffset(encoded[0], offset, len(encoded)))
                summary += encoded
        offset_start = start + len(summary)
        summary += _encoded(offsets)
        # The checksum covers the footer up to itself.
        header = struct.pack("<BQQQ", records.FOOTER, 20, start, offset_start)
        crc = zlib.crc32(header, zlib.crc32(summary))
        self._out.write(summary + _encoded([Footer(start, offset_start, crc)]) + records.MAGIC)

    def _summary_groups(self) -> "Iterator[list[McapRecord]]":
        """Yield the groups of the summary's records."""
        from mcap.records import Statistics

        first, last = self._span or (0, 0)
        yield list(self._source.schemas.values())
        yield list(self._source.channels.values())
        yield [
            Statistics(
                attachment_count=len(self._attachments),
                channel_count=len(self._source.channels),
                channel_message_counts=self._counts,
                chunk_count=len(self._chunks),
                message_count=sum(self._counts.values()),
                message_end_time=last,
                message_start_time=first,
                metadata_count=len(self._metadata),
                schema_count=len(self._source.schemas),
            )
        ]
        yield list(self._chunks)
        yield list(self._attachments)
        yield list(self._metadata)


def _inner(content: Buffer) -> Iterator[Record]:
    """Yield the places of a chunk's records."""
    offset = 0
    while offset < len(content):
        record = records.record_at(content, offset)
        yield record
        offset = record.end


def _without(content: Buffer, inner: list[Record], unknown: set[int]) -> bytes:
    """Return a chunk's records without the messages of some channels."""
    return b"".join(
        bytes(content[each.offset : each.end])
        for each in inner
        if each.operation != records.MESSAGE
        or records.message_header(content, each).channel not in unknown
    )


def _chunk_record(content: Buffer, header: ChunkHeader) -> tuple[bytes, ChunkHeader]:
    """Return a chunk's record with other contents, and its header."""
    from mcap.records import Chunk

    data = compress(header.compression, bytes(content))
    crc = zlib.crc32(content)
    chunk = Chunk(
        compression=header.compression,
        data=data,
        message_end_time=header.end_time,
        message_start_time=header.begin_time,
        uncompressed_crc=crc,
        uncompressed_size=len(content),
    )
    about = header._replace(size=len(content), crc=crc, start=0, end=len(data))
    return _encoded([chunk]), about


def _encoded(encoded: "Iterable[McapRecord]") -> bytes:
    """Return encoded records."""
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    for record in encoded:
        record.write(builder)
    return builder.end()
