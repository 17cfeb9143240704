"""Reader of ROS 1 bags, record by record: the index may be missing, chunks may be damaged."""

import mmap
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from andabata.records.containers import rosbag1_records as records
from andabata.records.containers.blocks import MessageTable
from andabata.records.containers.compression import decompress, decompress_prefix
from andabata.records.containers.container import (
    BagError,
    Connection,
    Damage,
    RawMessage,
    count_mismatches,
    ros_type_name,
)
from andabata.records.containers.rosbag1_records import Buffer, DamagedRecordError, Record

# Operation codes of the records inside and outside of chunks.
_IN_CHUNK = (records.MESSAGE, records.CONNECTION)
_OUTSIDE = (records.INDEX, records.CHUNK, records.CHUNK_INFO)


@dataclass(frozen=True)
class Block:
    """Chunk, or run of messages outside of chunks.

    Attributes:
        offset: Offset of the chunk's record; 0 for messages outside of chunks.
        start: Offset of the block's bytes in the file.
        end: Offset after these bytes.
        compression: Name of the compression: ``none``, ``bz2`` or ``lz4``.
        size: Number of decompressed bytes; None if the chunk is cut short.
        whole: True if all of its records are readable.
    """

    offset: int
    start: int
    end: int
    compression: str
    size: int | None
    whole: bool


class Rosbag1File:
    """Reader of a ``.bag`` or ``.bag.active`` file.

    Attributes:
        connections: Connections of the bag.
        counts: Number of whole messages of each connection.
        damage: Parts that cannot be read.
        lost: Number of messages that the index counts and the file no longer holds, the least
            possible one if a part of the index is missing; None if it is unknown.
        notes: Facts that a user should know although no message is missing.
        blocks: Chunks and runs of messages, in the file's order.
        table: Messages by the connection's number in the file.
        fields: Header and data fields of each connection's record, by its number in the file.
        numbers: Number in the file of each connection.
        data: Bytes of the file, mapped into memory.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan a file.

        Raises:
            BagError: If the file is no ROS 1 bag of version 2.0, or is encrypted.
        """
        self.path = path
        self._file = path.open("rb")
        try:
            mapped = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
            self.data = memoryview(mapped)
            if self.data[: len(records.MAGIC)] != records.MAGIC:
                raise BagError(
                    f"{path}: expected a ROS 1 bag of version 2.0, got "
                    f"{bytes(self.data[:13]).decode(errors='replace').strip()!r}; "
                    "`rosbag fix` of an old ROS 1 turns older bags into it"
                )
            self._scan()
        except BaseException:
            self.close()
            raise

    def _scan(self) -> None:
        """Read all records of the file once."""
        self.blocks: list[Block] = []
        self.table = MessageTable()
        self.damage: list[Damage] = []
        self.fields: dict[int, tuple[dict[bytes, bytes], dict[bytes, bytes]]] = {}
        self._index_offset, self._chunk_count = 0, 0
        self._chunk_stated: dict[int, Counter[int]] = {}
        self._indexed: dict[int, Counter[int]] = {}
        self._unchunked: int | None = None
        chunk = -1
        for record in self._records():
            if record.operation in (records.MESSAGE, records.CONNECTION):
                self._add_unchunked(record)
                continue
            self._unchunked = None
            if record.operation == records.BAG_HEADER:
                self._add_header(record)
            elif record.operation == records.CHUNK:
                chunk = record.offset
                self._add_chunk(record)
            elif record.operation == records.CHUNK_INFO:
                stated = Counter(dict(records.index_counts(record, self.data)))
                self._chunk_stated[record.number(b"chunk_pos")] = stated
            elif record.operation == records.INDEX:
                # The index of a destroyed chunk follows the one of the chunk before: add them up.
                indexed = self._indexed.setdefault(chunk, Counter())
                indexed.update(dict(records.index_counts(record, self.data)))
        self._finish()

    def _records(self) -> Iterator[Record]:
        """Yield the records of the file's top level, going on behind damage."""
        offset, end = len(records.MAGIC), len(self.data)
        while offset < end:
            try:
                record = records.record_at(self.data, offset)
            except DamagedRecordError as error:
                cut_chunk = self._cut_chunk(offset)
                if cut_chunk is not None:  # Its first messages can still be read.
                    yield cut_chunk
                    offset = cut_chunk.end
                    continue
                # Skip to the next bytes that look like a record.
                begin = records.find_record(self.data, offset + 1, _OUTSIDE + _IN_CHUNK, end)
                behind = end if begin is None else begin
                self.damage.append(Damage(offset, behind - offset, str(error)))
                offset = behind
                continue
            yield record
            offset = record.end

    def _cut_chunk(self, offset: int) -> Record | None:
        """Return the chunk that begins here and is cut short; None without one."""
        try:
            record = records.record_at(self.data, offset, cut=True)
        except DamagedRecordError:
            return None
        if record.operation != records.CHUNK:
            return None
        end = records.find_record(self.data, record.start, _OUTSIDE, len(self.data))
        reason = "expected a whole chunk, got one cut short"
        behind = len(self.data) if end is None else end
        self.damage.append(Damage(offset, behind - offset, reason))
        return Record(record.operation, record.fields, offset, record.start, behind)

    def _add_header(self, record: Record) -> None:
        """Add the file's first record, which points to the index.

        Raises:
            BagError: If the bag is encrypted.
        """
        if record.fields.get(b"encryptor", b"rosbag/NoEncryptor") != b"rosbag/NoEncryptor":
            raise BagError(
                f"{self.path}: expected a bag without encryption, got an encrypted one; "
                "decrypt it with ROS first"
            )
        self._index_offset = record.number(b"index_pos")
        self._chunk_count = int.from_bytes(record.fields.get(b"chunk_count", b""), "little")

    def _add_unchunked(self, record: Record) -> None:
        """Add a record outside of chunks: one of the index, or of a recorder that was killed."""
        if record.operation == records.CONNECTION:
            self._add_connection(record, self.data)
            return
        if self._unchunked is None:
            self._unchunked = len(self.blocks)
            self.blocks.append(Block(0, 0, len(self.data), "none", len(self.data), False))
        self._add_message(record, self._unchunked)

    def _add_chunk(self, record: Record) -> None:
        """Add the messages and connections of a chunk."""
        compression = record.fields[b"compression"].decode(errors="replace")
        body = self.data[record.start : record.end]
        # Damage was noted already where the chunk is cut short.
        size: int | None = record.number(b"size")
        end = record.end
        damaged = bool(self.damage) and self.damage[-1].offset == record.offset
        if not size and not body and compression != "none":
            # A recorder that was killed leaves the length of its last chunk at zero.
            end, damaged = len(self.data), True
            body.release()
            body = self.data[record.start : end]
            self.damage.append(
                Damage(record.offset, len(body), "expected a whole chunk, got an unfinished one")
            )
        try:
            content = decompress(compression, body, size or 0) if not damaged else None
        except ValueError as error:
            content, damaged = None, True
            self.damage.append(Damage(record.offset, record.end - record.offset, str(error)))
        if content is None:
            # Read what precedes the damage; None makes ``content`` do the same later.
            size = None
            content = _prefix(compression, body)
        known = len(self.damage)
        block = len(self.blocks)
        self._scan_chunk(content, block, record.offset)
        whole = not damaged and len(self.damage) == known
        self.blocks.append(Block(record.offset, record.start, end, compression, size, whole))
        # Views of the mapped file would keep it open.
        del content
        body.release()

    def _scan_chunk(self, content: Buffer, block: int, chunk: int) -> None:
        """Add the records of a decompressed chunk, going on behind damage.

        Args:
            content: Bytes of the decompressed chunk.
            block: Index of its block.
            chunk: Offset of its record in the file.
        """
        offset, end = 0, len(content)
        while offset < end:
            try:
                record = records.record_at(content, offset)
                if record.operation not in _IN_CHUNK:
                    raise DamagedRecordError("expected a message, got another record in a chunk")
            except DamagedRecordError as error:
                begin = records.find_record(content, offset + 1, _IN_CHUNK, end)
                behind = end if begin is None else begin
                if not (self.damage and self.damage[-1].offset == chunk):
                    self.damage.append(Damage(chunk, behind - offset, str(error)))
                offset = behind
                continue
            if record.operation == records.CONNECTION:
                self._add_connection(record, content)
            else:
                self._add_message(record, block)
            offset = record.end

    def _add_message(self, record: Record, block: int) -> None:
        """Add a message to the table."""
        number, stamp = record.number(b"conn"), record.stamp_ns()
        self.table.add(block, number, stamp, record.start, record.end - record.start)

    def _add_connection(self, record: Record, data: Buffer) -> None:
        """Add a connection that is not known yet, or was known incompletely."""
        try:
            about = records.header_fields(bytes(data[record.start : record.end]))
        except DamagedRecordError as error:
            self.damage.append(Damage(record.offset, record.end - record.offset, str(error)))
            return
        known = self.fields.get(record.number(b"conn"))
        # A chunk and the index hold a copy each, and one may be damaged.
        if known is None or (_missing_fields(known[1]) and not _missing_fields(about)):
            self.fields[record.number(b"conn")] = (dict(record.fields), about)

    def _finish(self) -> None:
        """Make connections of the records and compare the counts with the index."""
        self.notes: list[str] = []
        self._ignore_index_damage()
        counts = self.table.counts()
        self.numbers = sorted(self.fields)
        for number in self.numbers:
            self._fill_fields(number)
        self.connections = [_connection(*self.fields[number]) for number in self.numbers]
        self.counts = [counts.get(number, 0) for number in self.numbers]
        orphaned = {number: n for number, n in counts.items() if number not in self.fields}
        for number, n in orphaned.items():
            reason = f"expected the record of connection {number}, got none for its messages"
            self.damage.append(Damage(0, 0, reason, n))
        stated = self._stated()
        missing = sum(max(n - counts.get(number, 0), 0) for number, n in stated.items())
        missing += sum(orphaned.values())
        complete = self._index_is_whole()
        self.lost = missing if complete or not self.damage else missing or None
        self.finished = bool(self._index_offset)
        if not self.finished:
            self.notes.append("no index: the recorder did not finish; read without it")
        elif not self.damage:
            by_index = {index: stated.get(n, 0) for index, n in enumerate(self.numbers)}
            self.notes += count_mismatches(self.connections, self.counts, by_index)

    def _fill_fields(self, number: int) -> None:
        """Give a damaged connection placeholders of the fields that readers expect."""
        fields, about = self.fields[number]
        lacking = _missing_fields(about)
        if lacking:
            names = ", ".join(name.decode() for name in lacking)
            self.damage.append(Damage(0, 0, f"expected a connection with {names}, got none", 0))
            self.fields[number] = fields, {**about, **lacking}

    def _ignore_index_damage(self) -> None:
        """Replace damage of the index, which is not needed, by a note."""
        if not self._index_offset:
            return
        # The chunks hold all that the index holds: damage in it loses no message.
        beyond = [each for each in self.damage if each.offset >= self._index_offset]
        self.damage = [each for each in self.damage if each.offset < self._index_offset]
        if beyond or self._index_offset >= len(self.data):
            self.notes.append("the index is damaged or cut off: read without it")
        # A file that ends before its index, between two records, looks whole otherwise.
        missing = self._index_offset - len(self.data)
        if missing > 0 and not self.damage:
            reason = "expected messages up to the index, got the end of the file"
            self.damage.append(Damage(len(self.data), missing, reason))

    def _index_is_whole(self) -> bool:
        """Return True if the index at the file's end has an entry for every chunk."""
        return bool(self._index_offset) and len(self._chunk_stated) >= self._chunk_count > 0

    def _stated(self) -> dict[int, int]:
        """Return the number of messages by connection, as the index counts them."""
        total: Counter[int] = Counter()
        whole = self._index_is_whole() or not self._indexed
        for counts in (self._chunk_stated if whole else self._indexed).values():
            total.update(counts)
        return total

    def content(self, block: int) -> Buffer:
        """Return the decompressed bytes of a block, by its index."""
        about = self.blocks[block]
        body = self.data[about.start : about.end]
        if about.size is None:
            return _prefix(about.compression, body)
        return decompress(about.compression, body, about.size)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections by the time at which they were recorded."""
        indices = {self.numbers[k]: k for k in wanted}
        for message in self.table.read(indices, self.content):
            yield RawMessage(indices[message.connection], message.stamp_ns, message.data)

    def close(self) -> None:
        """Close the file; its memory is freed with the last view of it."""
        self._file.close()


def _prefix(compression: str, body: memoryview) -> Buffer:
    """Return the decompressed bytes of a chunk up to its first damage."""
    if compression == "none":
        return body
    try:
        return decompress_prefix(compression, body)
    except ValueError:
        return b""


_EXPECTED = {
    b"type": b"unknown/unknown",
    b"md5sum": b"*",
    b"message_definition": b"",
}
"""Fields of a connection that readers need, and their placeholders."""


def _missing_fields(about: dict[bytes, bytes]) -> dict[bytes, bytes]:
    """Return the fields that a connection's record lacks, with their placeholders."""
    return {name: value for name, value in _EXPECTED.items() if name not in about}


def _connection(fields: dict[bytes, bytes], about: dict[bytes, bytes]) -> Connection:
    """Return a connection from the fields of its record."""

    def text(name: bytes) -> str:
        return about.get(name, b"").decode(errors="replace")

    return Connection(
        fields[b"topic"].decode(errors="replace"),
        ros_type_name(text(b"type")),
        "ros1",
        text(b"message_definition"),
        "ros1msg",
        text(b"callerid"),
        text(b"latching") == "1",
        digest=text(b"md5sum"),
    )
