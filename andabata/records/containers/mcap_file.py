"""Reader of MCAP files, record by record: the summary may be missing, chunks may be damaged."""

import mmap
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from andabata.records.containers import mcap_records as records
from andabata.records.containers.blocks import MessageTable
from andabata.records.containers.container import (
    BagError,
    Connection,
    Damage,
    RawMessage,
    count_mismatches,
    is_latched,
    ros_type_name,
)
from andabata.records.containers.mcap_records import Buffer, ChunkHeader, DamagedRecordError, Record

if TYPE_CHECKING:
    from mcap.records import Channel, Schema, Statistics


@dataclass(frozen=True)
class Block:
    """Chunk, or run of messages outside of chunks.

    Attributes:
        record: Record of the chunk; None for a run of messages outside of chunks.
        header: Header of the chunk; None for a run of messages outside of chunks.
        channels: Numbers of the channels whose records the chunk holds.
    """

    record: Record | None
    header: ChunkHeader | None
    channels: frozenset[int] = frozenset()


class McapFile:
    """Reader of an ``.mcap`` file.

    Attributes:
        connections: Channels, as connections.
        counts: Number of whole messages of each channel.
        damage: Parts that cannot be read.
        lost: Number of messages that the summary or the chunks' indexes count and the file no
            longer holds; None if there is damage and neither is there.
        notes: Facts that a user should know although no message is missing.
        blocks: Chunks and runs of messages, in the file's order.
        top: Records outside of chunks up to the end of the data, in the file's order.
        table: Messages by the channel's number in the file.
        channels: Channels by their number in the file.
        schemas: Schemas by their number in the file.
        numbers: Number in the file of each connection.
        lost_schemas: Placeholders of the schemas that the file lacks.
        data: Bytes of the file, mapped into memory.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan a file.

        Raises:
            BagError: If the file is no MCAP file.
        """
        self.path = path
        self._file = path.open("rb")
        try:
            mapped = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
            self.data = memoryview(mapped)
            if self.data[: len(records.MAGIC)] != records.MAGIC:
                raise BagError(f"{path}: expected an MCAP file, got another one")
            self._scan()
        except BaseException:
            self.close()
            raise

    def _scan(self) -> None:
        """Read all records of the file once."""
        self.blocks: list[Block] = []
        self.top: list[Record] = []
        self.table = MessageTable()
        self.damage: list[Damage] = []
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self._statistics: Statistics | None = None
        self._indexed: Counter[int] = Counter()
        self._unchunked: int | None = None
        self._ended, finished, data_end = False, False, len(self.data)
        for record in self._records():
            try:
                self._add(record)
            except ValueError as error:
                self.damage.append(Damage(record.offset, record.end - record.offset, str(error)))
                continue
            if record.operation == records.DATA_END:
                self._ended, data_end = True, record.end
            elif record.operation in (records.CHUNK, records.MESSAGE):
                self._ended = False  # Damaged bytes looked like the end of the data.
            if record.operation == records.FOOTER:
                finished = True
                break
            if not self._ended:
                self.top.append(record)
        # The summary repeats what the data section holds: damage in it loses no message.
        beyond = [each for each in self.damage if self._ended and each.offset >= data_end]
        self.damage = [each for each in self.damage if each not in beyond]
        self._finish(finished and not beyond)

    def _records(self) -> Iterator[Record]:
        """Yield the records of the file's top level, going on behind damage."""
        offset, end = len(records.MAGIC), len(self.data)
        while offset < end:
            try:
                record = records.record_at(self.data, offset)
            except DamagedRecordError as error:
                behind = self._behind(offset + 1)
                self.damage.append(Damage(offset, behind - offset, str(error)))
                offset = behind
                continue
            behind = record.end if self._follows(record) else self._behind(offset + 1)
            if behind < record.end:
                # The length is damaged: it skips records that are whole.
                reason = "expected a record behind this one, got other bytes"
                self.damage.append(Damage(offset, behind - offset, reason))
                offset = behind
                continue
            yield record
            offset = record.end

    def _follows(self, record: Record) -> bool:
        """Return True if a record, or the end of the file, follows a record."""
        if record.operation == records.FOOTER or record.end == len(self.data):
            return True
        try:
            records.record_at(self.data, record.end)
        except DamagedRecordError:
            return self._is_whole_chunk(record)
        return True

    def _is_whole_chunk(self, record: Record) -> bool:
        """Return True if a record is a chunk with the right checksum."""
        try:
            records.chunk_content(self.data, records.chunk_header(self.data, record))
        except ValueError:
            return False
        return record.operation == records.CHUNK

    def _behind(self, offset: int) -> int:
        """Return the offset at which reading goes on behind damage."""
        begin = records.find_record(self.data, offset)
        return len(self.data) if begin is None else begin

    def _add(self, record: Record) -> None:
        """Add a record of the top level.

        Raises:
            ValueError: If it is damaged.
        """
        from mcap.records import Statistics

        if record.operation == records.MESSAGE:
            if self._unchunked is None:
                self._unchunked = len(self.blocks)
                self.blocks.append(Block(None, None))
            self._add_message(self.data, record, self._unchunked)
            return
        self._unchunked = None
        if record.operation == records.CHUNK:
            self._add_chunk(record)
        elif record.operation == records.MESSAGE_INDEX and not self._ended:
            channel, count = records.index_count(self.data, record)
            self._indexed[channel] += count
        elif record.operation == records.DATA_END:
            records.check(self.data, record)
        elif record.operation == records.STATISTICS:
            self._statistics = records.parse(Statistics, self.data, record)
        else:
            self._add_definition(self.data, record)

    def _add_chunk(self, record: Record) -> None:
        """Add the messages and definitions of a chunk.

        Raises:
            ValueError: If it is damaged; then nothing of it is added.
        """
        header = records.chunk_header(self.data, record)
        content = records.chunk_content(self.data, header)
        # First all records, then the table: a damaged chunk must not be added in part.
        inner = []
        offset, end = 0, len(content)
        while offset < end:
            entry = records.record_at(content, offset)
            inner.append(entry)
            offset = entry.end
        block = len(self.blocks)
        channels = set()
        for entry in inner:
            if entry.operation == records.MESSAGE:
                self._add_message(content, entry, block)
            else:
                channels |= self._add_definition(content, entry)
        self.blocks.append(Block(record, header, frozenset(channels)))

    def _add_message(self, data: Buffer, record: Record, block: int) -> None:
        """Add a message to the table."""
        header = records.message_header(data, record)
        start = record.start + records.MESSAGE_HEADER_SIZE
        self.table.add(block, header.channel, header.log_time, start, record.end - start)

    def _add_definition(self, data: Buffer, record: Record) -> set[int]:
        """Add a channel or a schema that is not known yet; return the number of a channel."""
        from mcap.records import Channel, Schema

        if record.operation == records.CHANNEL:
            channel = records.parse(Channel, data, record)
            self.channels.setdefault(channel.id, channel)
            return {channel.id}
        if record.operation == records.SCHEMA:
            schema = records.parse(Schema, data, record)
            self.schemas.setdefault(schema.id, schema)
        return set()

    def _finish(self, finished: bool) -> None:
        """Make connections of the channels and compare the counts with the summary."""
        self._replace_lost_schemas()
        counts = self.table.counts()
        self.numbers = sorted(self.channels)
        self.connections: list[Connection] = [
            self._connection(self.channels[n]) for n in self.numbers
        ]
        self.counts = [counts.get(number, 0) for number in self.numbers]
        orphaned = {number: n for number, n in counts.items() if number not in self.channels}
        for number, n in orphaned.items():
            reason = f"expected the record of channel {number}, got none for its messages"
            self.damage.append(Damage(0, 0, reason, n))
        stated = self._statistics.channel_message_counts if self._statistics else self._indexed
        missing = sum(max(n - counts.get(number, 0), 0) for number, n in stated.items())
        missing += sum(orphaned.values())
        self.lost = missing if self._statistics or not self.damage else missing or None
        self.notes: list[str] = []
        self.finished = finished or self._ended
        if not finished:
            why = "it is damaged" if self._ended else "the recorder did not finish"
            self.notes.append(f"no summary: {why}; read without it")
        elif self._statistics and not self.damage:
            by_index = {index: stated.get(n, 0) for index, n in enumerate(self.numbers)}
            self.notes += count_mismatches(self.connections, self.counts, by_index)

    def _replace_lost_schemas(self) -> None:
        """Give channels without their schema an empty one: readers expect a schema."""
        from mcap.records import Schema

        self.lost_schemas: list[Schema] = []
        for channel in self.channels.values():
            number = channel.schema_id
            if number and number not in self.schemas:
                reason = f"expected the schema of {channel.topic}, got none"
                self.damage.append(Damage(0, 0, reason, 0))
                self.schemas[number] = Schema(id=number, data=b"", encoding="", name="unknown")
                self.lost_schemas.append(self.schemas[number])

    def _connection(self, channel: "Channel") -> Connection:
        """Return a channel as a connection."""
        schema = self.schemas.get(channel.schema_id)
        qos = channel.metadata.get("offered_qos_profiles", "")
        latching = channel.metadata.get("latching", "").lower() in ("1", "true")
        return Connection(
            channel.topic,
            ros_type_name(schema.name) if schema else "",
            channel.message_encoding,
            schema.data.decode(errors="replace") if schema else "",
            schema.encoding if schema else "",
            channel.metadata.get("callerid", ""),
            latching or is_latched(qos),
            qos,
            channel.metadata.get("md5sum", ""),
        )

    def content(self, block: int) -> Buffer:
        """Return the decompressed bytes of a block, by its index."""
        header = self.blocks[block].header
        return self.data if header is None else records.chunk_content(self.data, header)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some channels in the order of their times of recording."""
        indices = {self.numbers[k]: k for k in wanted}
        for message in self.table.read(indices, self.content):
            yield RawMessage(indices[message.connection], message.stamp_ns, message.data)

    def close(self) -> None:
        """Close the file; its memory is freed with the last view of it."""
        self._file.close()
