"""A ROS 1 bag copied chunk by chunk, with a new index."""

import struct
from collections.abc import Mapping
from typing import IO

from andabata.records.containers import rosbag1_records as records
from andabata.records.containers.compression import pack
from andabata.records.containers.rosbag1_file import Block, Rosbag1File

_CHUNK_BYTES = 1 << 20
_HEADER_BYTES = 4096
"""Size of the file's first record, padded so that it can be written anew at the end."""

Entries = dict[int, list[tuple[int, int]]]
"""Stamp [ns] and offset in the chunk of each message, by connection."""


def copy_bag(source: Rosbag1File, out: IO[bytes]) -> int:
    """Write what is whole of a bag; whole chunks are copied to the byte.

    Connections keep their numbers, call ids, latching and checksums, chunks their compression.

    Args:
        source: The bag.
        out: A file to write and to seek in.

    Returns:
        Number of messages written.
    """
    return _Copy(source, out).run()


class _Copy:
    """One bag on its way."""

    def __init__(self, source: Rosbag1File, out: IO[bytes]) -> None:
        self._source, self._out = source, out
        self._infos: list[tuple[int, Entries]] = []
        self._count = 0

    def run(self) -> int:
        """Copy the chunks and write the index."""
        self._out.write(records.MAGIC)
        self._write_header(0)
        for number, block in enumerate(self._source.blocks):
            if not block.whole or not self._all_known(number):
                self._rebuild(number, block)
            elif block.size:
                self._copy(number, block)
        index_place = self._out.tell()
        for fields, about in self._source.fields.values():
            self._out.write(records.encode_header(fields) + records.encode_header(about))
        for place, entries in self._infos:
            self._out.write(_chunk_info(place, entries))
        self._out.seek(len(records.MAGIC))
        self._write_header(index_place)
        return self._count

    def _write_header(self, index_place: int) -> None:
        """Write the file's first record."""
        fields = {
            b"op": bytes([records.BAG_HEADER]),
            b"index_pos": struct.pack("<Q", index_place),
            b"conn_count": struct.pack("<I", len(self._source.fields)),
            b"chunk_count": struct.pack("<I", len(self._infos)),
        }
        padding = _HEADER_BYTES - len(records.encode_record(fields, b""))
        self._out.write(records.encode_record(fields, b" " * padding))

    def _all_known(self, number: int) -> bool:
        """Return whether every message of a block has a connection."""
        known = self._source.fields
        return all(each[0] in known for each in self._source.table.of_block(number))

    def _copy(self, number: int, block: Block) -> None:
        """Copy a whole chunk."""
        content = self._source.content(number)
        entries: Entries = {}
        place = 0
        while place < len(content):
            record = records.record_at(content, place)
            if record.operation == records.MESSAGE:
                entries.setdefault(record.number(b"conn"), []).append((record.stamp_ns(), place))
            place = record.end
        self._finish_chunk(bytes(self._source.data[block.place : block.end]), entries)

    def _rebuild(self, number: int, block: Block) -> None:
        """Write the messages of a damaged chunk, or of none, into new chunks."""
        content = self._source.content(number)
        body, entries = bytearray(), Entries()
        for connection, stamp, place, size in self._source.table.of_block(number):
            if connection not in self._source.fields:
                continue
            if connection not in entries:
                fields, about = self._source.fields[connection]
                body += records.encode_header(fields) + records.encode_header(about)
            entries.setdefault(connection, []).append((stamp, len(body)))
            head = {
                b"op": bytes([records.MESSAGE]),
                b"conn": struct.pack("<I", connection),
                b"time": _time(stamp),
            }
            body += records.encode_record(head, bytes(content[place : place + size]))
            if len(body) >= _CHUNK_BYTES:
                self._write_chunk(bytes(body), block.compression, entries)
                body, entries = bytearray(), Entries()
        if entries:
            self._write_chunk(bytes(body), block.compression, entries)

    def _write_chunk(self, body: bytes, compression: str, entries: Entries) -> None:
        """Write a new chunk."""
        fields = {
            b"op": bytes([records.CHUNK]),
            b"compression": compression.encode(),
            b"size": struct.pack("<I", len(body)),
        }
        self._finish_chunk(records.encode_record(fields, pack(compression, body)), entries)

    def _finish_chunk(self, record: bytes, entries: Entries) -> None:
        """Write a chunk's record and its index."""
        self._infos.append((self._out.tell(), entries))
        self._out.write(record)
        for connection, places in entries.items():
            self._count += len(places)
            fields = {
                b"op": bytes([records.INDEX]),
                b"ver": struct.pack("<I", 1),
                b"conn": struct.pack("<I", connection),
                b"count": struct.pack("<I", len(places)),
            }
            data = b"".join(_time(stamp) + struct.pack("<I", place) for stamp, place in places)
            self._out.write(records.encode_record(fields, data))


def _chunk_info(place: int, entries: Mapping[int, list[tuple[int, int]]]) -> bytes:
    """Return the record of the file's index that tells of a chunk."""
    stamps = [stamp for places in entries.values() for stamp, _ in places] or [0]
    fields = {
        b"op": bytes([records.CHUNK_INFO]),
        b"ver": struct.pack("<I", 1),
        b"chunk_pos": struct.pack("<Q", place),
        b"start_time": _time(min(stamps)),
        b"end_time": _time(max(stamps)),
        b"count": struct.pack("<I", len(entries)),
    }
    data = b"".join(struct.pack("<II", number, len(each)) for number, each in entries.items())
    return records.encode_record(fields, data)


def _time(stamp_ns: int) -> bytes:
    """Return a time as bags hold it."""
    return struct.pack("<II", *divmod(stamp_ns, 1_000_000_000))
