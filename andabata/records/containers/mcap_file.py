"""An MCAP file, scanned record by record: its summary may be missing and its chunks damaged."""

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
from andabata.records.containers.mcap_records import Buffer, ChunkHead, DamagedRecordError, Record

if TYPE_CHECKING:
    from mcap.records import Channel, Schema, Statistics


@dataclass(frozen=True)
class Block:
    """One chunk, or a run of records outside of chunks.

    Attributes:
        record: Chunk's record; None for a run of messages outside of chunks.
        head: What stands before the chunk's records.
        channels: Numbers of the channels whose records the chunk holds.
    """

    record: Record | None
    head: ChunkHead | None
    channels: frozenset[int] = frozenset()


class McapFile:
    """An ``.mcap`` file.

    Attributes:
        connections: All channels.
        counts: Number of whole messages of each channel.
        damage: What cannot be read.
        lost: Number of messages that the summary or the chunks' indexes tell and the file no
            longer holds; None where there is damage and neither tells.
        notes: What a user should know although no message is missing.
        blocks: Chunks and runs of messages, in the file's order.
        top: Records outside of chunks up to the end of the data, in the file's order.
        table: All messages, by the channel's number in the file.
        channels: Channels by their number in the file.
        schemas: Schemas by their number in the file.
        numbers: Each connection's number in the file.
        lost_schemas: What stands for the schemas that the file lacks.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan a file.

        Raises:
            BagError: If it is no MCAP file.
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
        """Walk through the file once."""
        self.blocks: list[Block] = []
        self.top: list[Record] = []
        self.table = MessageTable()
        self.damage: list[Damage] = []
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self._statistics: Statistics | None = None
        self._indexed: Counter[int] = Counter()
        self._loose: int | None = None
        self._ended, finished, data_end = False, False, len(self.data)
        for record in self._records():
            try:
                self._take(record)
            except ValueError as error:
                self.damage.append(Damage(record.place, record.end - record.place, str(error)))
                continue
            if record.operation == records.DATA_END:
                self._ended, data_end = True, record.end
            elif record.operation in (records.CHUNK, records.MESSAGE):
                self._ended = False  # Damage looked like the end of the data.
            if record.operation == records.FOOTER:
                finished = True
                break
            if not self._ended:
                self.top.append(record)
        beyond = [each for each in self.damage if self._ended and each.place >= data_end]
        self.damage = [each for each in self.damage if each not in beyond]
        self._conclude(finished and not beyond)

    def _records(self) -> Iterator[Record]:
        """Yield the records of the file's top level, going on behind damage."""
        place, end = len(records.MAGIC), len(self.data)
        while place < end:
            try:
                record = records.record_at(self.data, place)
            except DamagedRecordError as error:
                behind = self._behind(place + 1)
                self.damage.append(Damage(place, behind - place, str(error)))
                place = behind
                continue
            behind = record.end if self._follows(record) else self._behind(place + 1)
            if behind < record.end:
                # The length is damaged: it leads behind records that are whole.
                reason = "expected a record behind this one, got other bytes"
                self.damage.append(Damage(place, behind - place, reason))
                place = behind
                continue
            yield record
            place = record.end

    def _follows(self, record: Record) -> bool:
        """Return whether a record, or the end of the file, follows another."""
        if record.operation == records.FOOTER or record.end == len(self.data):
            return True
        try:
            records.record_at(self.data, record.end)
        except DamagedRecordError:
            return self._is_whole_chunk(record)
        return True

    def _is_whole_chunk(self, record: Record) -> bool:
        """Return whether a record is a chunk with its checksum."""
        try:
            records.chunk_content(self.data, records.chunk_head(self.data, record))
        except ValueError:
            return False
        return record.operation == records.CHUNK

    def _behind(self, place: int) -> int:
        """Return where to go on behind damage."""
        begin = records.find_record(self.data, place)
        return len(self.data) if begin is None else begin

    def _take(self, record: Record) -> None:
        """Take a record of the top level.

        Raises:
            ValueError: If it is damaged.
        """
        from mcap.records import Statistics

        if record.operation == records.MESSAGE:
            if self._loose is None:
                self._loose = len(self.blocks)
                self.blocks.append(Block(None, None))
            self._take_message(self.data, record, self._loose)
            return
        self._loose = None
        if record.operation == records.CHUNK:
            self._take_chunk(record)
        elif record.operation == records.MESSAGE_INDEX and not self._ended:
            channel, count = records.index_count(self.data, record)
            self._indexed[channel] += count
        elif record.operation == records.DATA_END:
            records.check(self.data, record)
        elif record.operation == records.STATISTICS:
            self._statistics = records.parse(Statistics, self.data, record)
        else:
            self._take_definition(self.data, record)

    def _take_chunk(self, record: Record) -> None:
        """Take what a chunk holds.

        Raises:
            ValueError: If it is damaged; then nothing of it is taken.
        """
        head = records.chunk_head(self.data, record)
        content = records.chunk_content(self.data, head)
        inner = []
        place, end = 0, len(content)
        while place < end:
            found = records.record_at(content, place)
            inner.append(found)
            place = found.end
        block = len(self.blocks)
        channels = set()
        for found in inner:
            if found.operation == records.MESSAGE:
                self._take_message(content, found, block)
            else:
                channels |= self._take_definition(content, found)
        self.blocks.append(Block(record, head, frozenset(channels)))

    def _take_message(self, data: Buffer, record: Record, block: int) -> None:
        """Take a message."""
        head = records.message_head(data, record)
        start = record.start + records.MESSAGE_HEAD_SIZE
        self.table.add(block, head.channel, head.log_time, start, record.end - start)

    def _take_definition(self, data: Buffer, record: Record) -> set[int]:
        """Take a channel or a schema that is not known yet; return a channel's number."""
        from mcap.records import Channel, Schema

        if record.operation == records.CHANNEL:
            channel = records.parse(Channel, data, record)
            self.channels.setdefault(channel.id, channel)
            return {channel.id}
        if record.operation == records.SCHEMA:
            schema = records.parse(Schema, data, record)
            self.schemas.setdefault(schema.id, schema)
        return set()

    def _conclude(self, finished: bool) -> None:
        """Name the channels and compare what was found with the summary."""
        self._complete()
        found = self.table.counts()
        self.numbers = sorted(self.channels)
        self.connections: list[Connection] = [
            self._connection(self.channels[n]) for n in self.numbers
        ]
        self.counts = [found.get(number, 0) for number in self.numbers]
        nameless = {number: n for number, n in found.items() if number not in self.channels}
        for number, n in nameless.items():
            reason = f"expected the record of channel {number}, got none for its messages"
            self.damage.append(Damage(0, 0, reason, n))
        stated = self._statistics.channel_message_counts if self._statistics else self._indexed
        missing = sum(max(n - found.get(number, 0), 0) for number, n in stated.items())
        missing += sum(nameless.values())
        self.lost = missing if self._statistics or not self.damage else missing or None
        self.notes: list[str] = []
        if not finished:
            why = "it is damaged" if self._ended else "the recorder did not finish"
            self.notes.append(f"no summary: {why}; read without it")
        elif self._statistics and not self.damage:
            by_place = {place: stated.get(n, 0) for place, n in enumerate(self.numbers)}
            self.notes += count_mismatches(self.connections, self.counts, by_place)

    def _complete(self) -> None:
        """Give channels whose schema is lost one without a definition, as readers expect one."""
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
        """Return the unpacked bytes of a block."""
        head = self.blocks[block].head
        return self.data if head is None else records.chunk_content(self.data, head)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some channels by the time at which they were recorded."""
        places = {self.numbers[k]: k for k in wanted}
        for message in self.table.read(places, self.content):
            yield RawMessage(places[message.connection], message.stamp_ns, message.data)

    def close(self) -> None:
        """Close the file; its memory goes when the last reader lets it go."""
        self._file.close()
