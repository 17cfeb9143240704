"""An MCAP file copied record by record, with a new summary."""

import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import IO, TYPE_CHECKING

from andabata.records.containers import mcap_records as records
from andabata.records.containers.compression import pack
from andabata.records.containers.container import Damage
from andabata.records.containers.mcap_file import Block, McapFile
from andabata.records.containers.mcap_records import Buffer, ChunkHead, Record

_CHUNK_BYTES = 1 << 20

if TYPE_CHECKING:
    from mcap.records import AttachmentIndex, ChunkIndex, McapRecord, MetadataIndex


def copy_mcap(source: McapFile, out: IO[bytes]) -> tuple[int, list[Damage]]:
    """Write what is whole of an MCAP file; whole records are copied to the byte.

    Profile, library, numbers, channel metadata, compression, metadata records, attachments and
    records of applications are kept.

    Args:
        source: The file.
        out: A file to write.

    Returns:
        Number of messages written, and the attachments that are damaged.
    """
    return _Copy(source, out).run()


class _Copy:
    """One file on its way."""

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
        self._chunked: ChunkHead | None = None
        self._loose = bytearray()

    def run(self) -> tuple[int, list[Damage]]:
        """Copy the records and write the summary."""
        from mcap.records import DataEnd, Header

        self._write(records.MAGIC)
        top = self._source.top
        if not top or top[0].operation != records.HEADER:
            self._write(_encoded([Header("", "andabata salvage")]))
        blocks = {each.record: each for each in self._source.blocks if each.record is not None}
        heads = [each.head for each in blocks.values() if each.head is not None]
        # Readers take messages outside of chunks for none where there are chunks.
        self._chunked = heads[0] if heads else None
        for place, record in enumerate(top):
            if record.operation == records.HEADER and place:
                continue  # A second one is damage.
            if record.operation != records.MESSAGE or len(self._loose) >= _CHUNK_BYTES:
                self._flush()
            self._copy(record, blocks.get(record))
            if not place:
                self._write(_encoded(self._source.lost_schemas))
        self._flush()
        self._write(_encoded([DataEnd(self._crc)]))
        self._write_summary()
        return sum(self._counts.values()), self._damage

    def _write(self, data: bytes) -> None:
        """Write bytes of the data section."""
        self._crc = zlib.crc32(data, self._crc)
        self._out.write(data)

    def _copy(self, record: Record, block: Block | None) -> None:
        """Copy a record of the top level."""
        data = self._source.data
        if record.operation == records.CHUNK and block is not None:
            self._copy_chunk(record, block)
            return
        if record.operation in (records.MESSAGE_INDEX, records.CHUNK):
            return  # Indexes are made anew; a chunk without a block is damaged.
        if record.operation == records.MESSAGE:
            head = records.message_head(data, record)
            if head.channel not in self._source.channels:
                return
            if self._chunked is not None:
                self._loose += data[record.place : record.end]
                return
            self._define([head.channel], frozenset())
            self._count(head.channel, head.log_time)
        self._note(data, record)
        if record.operation == records.ATTACHMENT and not self._index_attachment(record):
            return
        if record.operation == records.METADATA:
            self._index_metadata(record)
        self._write(bytes(data[record.place : record.end]))

    def _note(self, data: Buffer, record: Record) -> None:
        """Remember which schemas and channels the new file defines."""
        if record.operation in (records.SCHEMA, records.CHANNEL):
            number = int.from_bytes(data[record.start : record.start + 2], "little")
            (self._schemas if record.operation == records.SCHEMA else self._channels).add(number)

    def _count(self, channel: int, stamp: int) -> None:
        """Count a message."""
        self._counts[channel] = self._counts.get(channel, 0) + 1
        first, last = self._span or (stamp, stamp)
        self._span = min(first, stamp), max(last, stamp)

    def _define(self, used: Iterable[int], own: frozenset[int]) -> None:
        """Write the channels whose records were lost, and which the summary tells."""
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
        """Copy a chunk and index it; one with messages of unknown channels is packed anew."""
        head = block.head
        if head is None:
            return
        content = records.chunk_content(self._source.data, head)
        inner = list(_inner(content))
        used = {
            records.message_head(content, each).channel
            for each in inner
            if each.operation == records.MESSAGE
        }
        raw = bytes(self._source.data[record.place : record.end])
        unknown = used - self._source.channels.keys()
        if unknown:
            content = _without(content, inner, unknown)
            inner, used = list(_inner(content)), used - unknown
            raw, head = _packed(content, head)
        self._define(sorted(used), block.channels)
        self._write_chunk(raw, head, content, inner)

    def _flush(self) -> None:
        """Write the messages that lay outside of chunks as a chunk."""
        if self._chunked is None or not self._loose:
            return
        content = bytes(self._loose)
        self._loose.clear()
        inner = list(_inner(content))
        heads = [records.message_head(content, each) for each in inner]
        self._define(sorted({head.channel for head in heads}), frozenset())
        stamps = [head.log_time for head in heads]
        about = self._chunked._replace(begin_time=min(stamps), end_time=max(stamps))
        raw, about = _packed(content, about)
        self._write_chunk(raw, about, content, inner)

    def _write_chunk(
        self, raw: bytes, head: ChunkHead, content: Buffer, inner: list[Record]
    ) -> None:
        """Write a chunk's record and its index."""
        from mcap.records import ChunkIndex, MessageIndex

        entries: dict[int, list[tuple[int, int]]] = {}
        for each in inner:
            self._note(content, each)
            if each.operation == records.MESSAGE:
                about = records.message_head(content, each)
                self._count(about.channel, about.log_time)
                entries.setdefault(about.channel, []).append((about.log_time, each.place))
        start = self._out.tell()
        self._write(raw)
        offsets, behind = {}, self._out.tell()
        for channel, places in entries.items():
            offsets[channel] = self._out.tell()
            self._write(_encoded([MessageIndex(channel, sorted(places))]))
        self._chunks.append(
            ChunkIndex(
                chunk_length=behind - start,
                chunk_start_offset=start,
                compression=head.compression,
                compressed_size=head.end - head.start,
                message_end_time=head.end_time,
                message_index_length=self._out.tell() - behind,
                message_index_offsets=offsets,
                message_start_time=head.begin_time,
                uncompressed_size=head.size,
            )
        )

    def _index_attachment(self, record: Record) -> bool:
        """Index an attachment; return whether its checksum fits."""
        from mcap.records import Attachment, AttachmentIndex

        data = self._source.data
        about = records.parse(Attachment, data, record)
        crc = int.from_bytes(data[record.end - 4 : record.end], "little")
        if crc and zlib.crc32(data[record.start : record.end - 4]) != crc:
            reason = f"expected the attachment {about.name!r} with its checksum, got another one"
            self._damage.append(Damage(record.place, record.end - record.place, reason, 0))
            return False
        self._attachments.append(
            AttachmentIndex(
                offset=self._out.tell(),
                length=record.end - record.place,
                log_time=about.log_time,
                create_time=about.create_time,
                data_size=len(about.data),
                name=about.name,
                media_type=about.media_type,
            )
        )
        return True

    def _index_metadata(self, record: Record) -> None:
        """Index a metadata record."""
        from mcap.records import Metadata, MetadataIndex

        about = records.parse(Metadata, self._source.data, record)
        length = record.end - record.place
        self._metadata.append(
            MetadataIndex(offset=self._out.tell(), length=length, name=about.name)
        )

    def _write_summary(self) -> None:
        """Write the summary, where each group of it lies, and the end of the file."""
        from mcap.records import Footer, SummaryOffset

        start = self._out.tell()
        summary, offsets = b"", []
        for group in self._summary_groups():
            if group:
                encoded = _encoded(group)
                place = start + len(summary)
                offsets.append(SummaryOffset(encoded[0], place, len(encoded)))
                summary += encoded
        offset_start = start + len(summary)
        summary += _encoded(offsets)
        # The checksum covers the footer up to itself.
        head = struct.pack("<BQQQ", records.FOOTER, 20, start, offset_start)
        crc = zlib.crc32(head, zlib.crc32(summary))
        self._out.write(summary + _encoded([Footer(start, offset_start, crc)]) + records.MAGIC)

    def _summary_groups(self) -> "Iterator[list[McapRecord]]":
        """Yield the groups of the summary."""
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
    """Yield a chunk's records."""
    place = 0
    while place < len(content):
        record = records.record_at(content, place)
        yield record
        place = record.end


def _without(content: Buffer, inner: list[Record], unknown: set[int]) -> bytes:
    """Return a chunk's records without the messages of some channels."""
    return b"".join(
        bytes(content[each.place : each.end])
        for each in inner
        if each.operation != records.MESSAGE
        or records.message_head(content, each).channel not in unknown
    )


def _packed(content: Buffer, head: ChunkHead) -> tuple[bytes, ChunkHead]:
    """Return a chunk's record with other contents, and what stands before them."""
    from mcap.records import Chunk

    data = pack(head.compression, bytes(content))
    crc = zlib.crc32(content)
    chunk = Chunk(
        compression=head.compression,
        data=data,
        message_end_time=head.end_time,
        message_start_time=head.begin_time,
        uncompressed_crc=crc,
        uncompressed_size=len(content),
    )
    about = head._replace(size=len(content), crc=crc, start=0, end=len(data))
    return _encoded([chunk]), about


def _encoded(found: "Iterable[McapRecord]") -> bytes:
    """Return records as they stand in a file."""
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    for record in found:
        record.write(builder)
    return builder.end()
