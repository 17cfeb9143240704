"""A ROS 1 bag, scanned record by record: its index may be missing and its chunks damaged."""

import mmap
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from andabata.records.containers import rosbag1_records as records
from andabata.records.containers.blocks import MessageTable
from andabata.records.containers.compression import unpack, unpack_prefix
from andabata.records.containers.container import (
    BagError,
    Connection,
    Damage,
    RawMessage,
    count_mismatches,
    ros_type_name,
)
from andabata.records.containers.rosbag1_records import Buffer, DamagedRecordError, Record

_IN_CHUNK = (records.MESSAGE, records.CONNECTION)
_OUTSIDE = (records.INDEX, records.CHUNK, records.CHUNK_INFO)


@dataclass(frozen=True)
class Block:
    """One chunk, or a run of messages outside of chunks.

    Attributes:
        place: Offset of the chunk's record; of the file's begin for messages outside of chunks.
        start: Offset of the bytes in the file.
        end: Offset behind them.
        compression: ``none``, ``bz2`` or ``lz4``.
        size: Number of unpacked bytes; None where the chunk is cut short.
        whole: Whether all of its records are readable.
    """

    place: int
    start: int
    end: int
    compression: str
    size: int | None
    whole: bool


class Rosbag1File:
    """A ``.bag`` or ``.bag.active`` file.

    Attributes:
        connections: All connections.
        counts: Number of whole messages of each connection.
        damage: What cannot be read.
        lost: Number of messages that the index tells and the file no longer holds, the least
            where a part of the index is missing; None where nothing tells it.
        notes: What a user should know although no message is missing.
        blocks: Chunks and runs of messages, in the file's order.
        table: All messages, by the connection's number in the file.
        fields: Header and data fields of each connection's record, by its number in the file.
        numbers: Each connection's number in the file.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan a file.

        Raises:
            BagError: If it is no ROS 1 bag of version 2.0, or is encrypted.
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
        """Walk through the file once."""
        self.blocks: list[Block] = []
        self.table = MessageTable()
        self.damage: list[Damage] = []
        self.fields: dict[int, tuple[dict[bytes, bytes], dict[bytes, bytes]]] = {}
        self._index_place, self._chunk_count = 0, 0
        self._chunk_stated: dict[int, Counter[int]] = {}
        self._indexed: dict[int, Counter[int]] = {}
        self._loose: int | None = None
        chunk = -1
        for record in self._records():
            if record.operation in (records.MESSAGE, records.CONNECTION):
                self._take_loose(record)
                continue
            self._loose = None
            if record.operation == records.BAG_HEADER:
                self._take_header(record)
            elif record.operation == records.CHUNK:
                chunk = record.place
                self._take_chunk(record)
            elif record.operation == records.CHUNK_INFO:
                stated = Counter(dict(records.index_counts(record, self.data)))
                self._chunk_stated[record.number(b"chunk_pos")] = stated
            elif record.operation == records.INDEX:
                # Where a chunk is destroyed, its index follows the chunk before: so they add up.
                indexed = self._indexed.setdefault(chunk, Counter())
                indexed.update(dict(records.index_counts(record, self.data)))
        self._conclude()

    def _records(self) -> Iterator[Record]:
        """Yield the records of the file's top level, going on behind damage."""
        place, end = len(records.MAGIC), len(self.data)
        while place < end:
            try:
                record = records.record_at(self.data, place)
            except DamagedRecordError as error:
                record_cut = self._cut_chunk(place)
                if record_cut is not None:
                    yield record_cut
                    place = record_cut.end
                    continue
                begin = records.find_record(self.data, place + 1, _OUTSIDE + _IN_CHUNK, end)
                behind = end if begin is None else begin
                self.damage.append(Damage(place, behind - place, str(error)))
                place = behind
                continue
            yield record
            place = record.end

    def _cut_chunk(self, place: int) -> Record | None:
        """Return the chunk that begins here and is not whole, or None."""
        try:
            record = records.record_at(self.data, place, cut=True)
        except DamagedRecordError:
            return None
        if record.operation != records.CHUNK:
            return None
        end = records.find_record(self.data, record.start, _OUTSIDE, len(self.data))
        reason = "expected a whole chunk, got one cut short"
        behind = len(self.data) if end is None else end
        self.damage.append(Damage(place, behind - place, reason))
        return Record(record.operation, record.fields, place, record.start, behind)

    def _take_header(self, record: Record) -> None:
        """Look at the file's header."""
        if record.fields.get(b"encryptor", b"rosbag/NoEncryptor") != b"rosbag/NoEncryptor":
            raise BagError(
                f"{self.path}: expected a bag that anybody may read, got an encrypted one; "
                "decrypt it with ROS first"
            )
        self._index_place = record.number(b"index_pos")
        self._chunk_count = int.from_bytes(record.fields.get(b"chunk_count", b""), "little")

    def _take_loose(self, record: Record) -> None:
        """Take a record that lies outside of chunks: an index's, or a killed recorder's."""
        if record.operation == records.CONNECTION:
            self._take_connection(record, self.data)
            return
        if self._loose is None:
            self._loose = len(self.blocks)
            self.blocks.append(Block(0, 0, len(self.data), "none", len(self.data), False))
        self._take_message(record, self._loose)

    def _take_chunk(self, record: Record) -> None:
        """Take what a chunk holds."""
        compression = record.fields[b"compression"].decode(errors="replace")
        body = self.data[record.start : record.end]
        size: int | None = record.number(b"size")
        end = record.end
        damaged = bool(self.damage) and self.damage[-1].place == record.place
        if not size and not body and compression != "none":
            # A killed recorder had not come to write how long its last chunk is.
            end, damaged = len(self.data), True
            body.release()
            body = self.data[record.start : end]
            self.damage.append(
                Damage(record.place, len(body), "expected a whole chunk, got an unfinished one")
            )
        try:
            content = unpack(compression, body, size or 0) if not damaged else None
        except ValueError as error:
            content, damaged = None, True
            self.damage.append(Damage(record.place, record.end - record.place, str(error)))
        if content is None:
            size = None
            content = _prefix(compression, body)
        known = len(self.damage)
        block = len(self.blocks)
        self._walk(content, block, record.place)
        whole = not damaged and len(self.damage) == known
        self.blocks.append(Block(record.place, record.start, end, compression, size, whole))
        del content
        body.release()

    def _walk(self, content: Buffer, block: int, chunk: int) -> None:
        """Take the records of an unpacked chunk, going on behind damage."""
        place, end = 0, len(content)
        while place < end:
            try:
                record = records.record_at(content, place)
                if record.operation not in _IN_CHUNK:
                    raise DamagedRecordError("expected a message, got another record in a chunk")
            except DamagedRecordError as error:
                begin = records.find_record(content, place + 1, _IN_CHUNK, end)
                behind = end if begin is None else begin
                if not (self.damage and self.damage[-1].place == chunk):
                    self.damage.append(Damage(chunk, behind - place, str(error)))
                place = behind
                continue
            if record.operation == records.CONNECTION:
                self._take_connection(record, content)
            else:
                self._take_message(record, block)
            place = record.end

    def _take_message(self, record: Record, block: int) -> None:
        """Take a message."""
        number, stamp = record.number(b"conn"), record.stamp_ns()
        self.table.add(block, number, stamp, record.start, record.end - record.start)

    def _take_connection(self, record: Record, data: Buffer) -> None:
        """Take a connection that is not known yet."""
        try:
            about = records.header_fields(bytes(data[record.start : record.end]))
        except DamagedRecordError as error:
            self.damage.append(Damage(record.place, record.end - record.place, str(error)))
            return
        known = self.fields.get(record.number(b"conn"))
        # A chunk and the index hold a copy each: one may be damaged.
        if known is None or (_lacking(known[1]) and not _lacking(about)):
            self.fields[record.number(b"conn")] = (dict(record.fields), about)

    def _conclude(self) -> None:
        """Name the connections and compare what was found with the index."""
        self.notes: list[str] = []
        self._excuse_index()
        found = self.table.counts()
        self.numbers = sorted(self.fields)
        for number in self.numbers:
            self._complete(number)
        self.connections = [_connection(*self.fields[number]) for number in self.numbers]
        self.counts = [found.get(number, 0) for number in self.numbers]
        nameless = {number: n for number, n in found.items() if number not in self.fields}
        for number, n in nameless.items():
            reason = f"expected the record of connection {number}, got none for its messages"
            self.damage.append(Damage(0, 0, reason, n))
        stated = self._stated()
        missing = sum(max(n - found.get(number, 0), 0) for number, n in stated.items())
        missing += sum(nameless.values())
        complete = self._index_is_whole()
        self.lost = missing if complete or not self.damage else missing or None
        if not self._index_place:
            self.notes.append("no index: the recorder did not finish; read without it")
        elif not self.damage:
            by_place = {place: stated.get(n, 0) for place, n in enumerate(self.numbers)}
            self.notes += count_mismatches(self.connections, self.counts, by_place)

    def _complete(self, number: int) -> None:
        """Give a damaged connection the fields that every reader expects."""
        fields, about = self.fields[number]
        lacking = _lacking(about)
        if lacking:
            names = ", ".join(name.decode() for name in lacking)
            self.damage.append(Damage(0, 0, f"expected a connection with {names}, got none", 0))
            self.fields[number] = fields, {**about, **lacking}

    def _excuse_index(self) -> None:
        """Turn damage of the index, which is not needed, into notes."""
        if not self._index_place:
            return
        beyond = [each for each in self.damage if each.place >= self._index_place]
        self.damage = [each for each in self.damage if each.place < self._index_place]
        if beyond or self._index_place >= len(self.data):
            self.notes.append("the index is damaged or cut off: read without it")
        missing = self._index_place - len(self.data)
        if missing > 0 and not self.damage:
            reason = "expected messages up to the index, got the end of the file"
            self.damage.append(Damage(len(self.data), missing, reason))

    def _index_is_whole(self) -> bool:
        """Return whether the index at the file's end tells of every chunk."""
        return bool(self._index_place) and len(self._chunk_stated) >= self._chunk_count > 0

    def _stated(self) -> dict[int, int]:
        """Return the number of messages by connection, as the index and its parts tell."""
        total: Counter[int] = Counter()
        whole = self._index_is_whole() or not self._indexed
        for counts in (self._chunk_stated if whole else self._indexed).values():
            total.update(counts)
        return total

    def content(self, block: int) -> Buffer:
        """Return the unpacked bytes of a block."""
        about = self.blocks[block]
        body = self.data[about.start : about.end]
        if about.size is None:
            return _prefix(about.compression, body)
        return unpack(about.compression, body, about.size)

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections by the time at which they were recorded."""
        places = {self.numbers[k]: k for k in wanted}
        for message in self.table.read(places, self.content):
            yield RawMessage(places[message.connection], message.stamp_ns, message.data)

    def close(self) -> None:
        """Close the file; its memory goes when the last reader lets it go."""
        self._file.close()


def _prefix(compression: str, body: memoryview) -> Buffer:
    """Return what a damaged chunk holds up to its first damage."""
    if compression == "none":
        return body
    try:
        return unpack_prefix(compression, body)
    except ValueError:
        return b""


_EXPECTED = {
    b"type": b"unknown/unknown",
    b"md5sum": b"*",
    b"message_definition": b"",
}
"""Fields of a connection that no reader goes without, and what stands for unknown."""


def _lacking(about: dict[bytes, bytes]) -> dict[bytes, bytes]:
    """Return what a connection's record lacks, with what stands for unknown."""
    return {name: value for name, value in _EXPECTED.items() if name not in about}


def _connection(fields: dict[bytes, bytes], about: dict[bytes, bytes]) -> Connection:
    """Return a connection by the fields of its record."""

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
