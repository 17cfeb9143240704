"""Copy of a ROS 1 bag, chunk by chunk, with a new index."""

import struct
from collections.abc import Mapping
from typing import IO

from andabata.records.containers import rosbag1_records as records
from andabata.records.containers.compression import compress
from andabata.records.containers.rosbag1_file import Block, Rosbag1File

_CHUNK_BYTES = 1 << 20
"""Size from which a rebuilt chunk is written [bytes]."""

_HEADER_BYTES = 4096
"""Size of the file's first record [bytes], padded: it is overwritten at the end."""

Entries = dict[int, list[tuple[int, int]]]
"""Stamp [ns] and offset in the chunk of each message, by connection."""


def copy_bag(source: Rosbag1File, out: IO[bytes]) -> int:
    """Write the whole messages of a bag to a new one; whole chunks are copied byte by byte.

    Connections keep their numbers, call ids, latching and checksums, chunks their compression.

    Args:
        source: Open bag.
        out: File to write and seek in.

    Returns:
        Number of messages written.
    """
    return _BagCopy(source, out).run()


class _BagCopy:
    """Copy of one bag in progress."""

    def __init__(self, source: Rosbag1File, out: IO[bytes]) -> None:
        self._source, self._out = source, out
        self._infos: list[tuple[int, Entries]] = []
        self._count = 0

    def run(self) -> int:
        """Copy the chunks and write the index; return the number of messages."""
        self._out.write(records.MAGIC)
        self._write_header(0)
        for number, block in enumerate(self._source.blocks):
            if not block.whole or not self._all_known(number):
                self._rebuild_chunk(number, block)
            elif block.size:
                self._copy_chunk(number, block)
        index_offset = self._out.tell()
        for fields, about in self._source.fields.values():
            self._out.write(records.encode_header(fields) + records.encode_header(about))
        for offset, entries in self._infos:
            self._out.write(_chunk_info(offset, entries))
        self._out.seek(len(records.MAGIC))
        self._write_header(index_offset)
        return self._count

    def _write_header(self, index_offset: int) -> None:
        """Write the file's first record."""
        fields = {
            b"op": bytes([records.BAG_HEADER]),
            b"index_pos": struct.pack("<Q", index_offset),
            b"conn_count": struct.pack("<I", len(self._source.fields)),
            b"chunk_count": struct.pack("<I", len(self._infos)),
        }
        padding = _HEADER_BYTES - len(records.encode_record(fields, b""))
        self._out.write(records.encode_record(fields, b" " * padding))

    def _all_known(self, number: int) -> bool:
        """Return True if every message of a block has a known connection."""
        known = self._source.fields
        return all(each[0] in known for each in self._source.table.of_block(number))

    def _copy_chunk(self, number: int, block: Block) -> None:
        """Copy a whole chunk byte by byte."""
        content = self._source.content(number)
        entries: Entries = {}
        offset = 0
        while offset < len(content):
            record = records.record_at(content, offset)
            if record.operation == records.MESSAGE:
                entries.setdefault(record.number(b"conn"), []).append((record.stamp_ns(), offset))
            offset = record.end
        self._finish_chunk(bytes(self._source.data[block.offset : block.end]), entries)

    def _rebuild_chunk(self, number: int, block: Block) -> None:
        """Write the messages of a damaged chunk, or from outside of chunks, into new chunks."""
        content = self._source.content(number)
        body, entries = bytearray(), Entries()
        for connection, stamp, offset, size in self._source.table.of_block(number):
            if connection not in self._source.fields:
                continue
            if connection not in entries:
                fields, about = self._source.fields[connection]
                body += records.encode_header(fields) + records.encode_header(about)
            entries.setdefault(connection, []).append((stamp, len(body)))
            header = {
                b"op": bytes([records.MESSAGE]),
                b"conn": struct.pack("<I", connection),
                b"time": _time(stamp),
            }
            body += records.encode_record(header, bytes(content[offset : offset + size]))
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
        self._finish_chunk(records.encode_record(fields, compress(compression, body)), entries)

    def _finish_chunk(self, record: bytes, entries: Entries) -> None:
        """Write a chunk's record and an index record for each connection."""
        self._infos.append((self._out.tell(), entries))
        self._out.write(record)
        for connection, offsets in entries.items():
            self._count += len(offsets)
            fields = {
                b"op": bytes([records.INDEX]),
                b"ver": struct.pack("<I", 1),
                b"conn": struct.pack("<I", connection),
                b"count": struct.pack("<I", len(offsets)),
            }
            data = b"".join(_time(stamp) + struct.pack("<I", offset) for stamp, offset in offsets)
            self._out.write(records.encode_record(fields, data))


def _chunk_info(offset: int, entries: Mapping[int, list[tuple[int, int]]]) -> bytes:
    """Return the chunk info record of the file's index."""
    stamps = [stamp for offsets in entries.values() for stamp, _ in offsets] or [0]
    fields = {
        b"op": bytes([records.CHUNK_INFO]),
        b"ver": struct.pack("<I", 1),
        b"chunk_pos": struct.pack("<Q", offset),
        b"start_time": _time(min(stamps)),
        b"end_time": _time(max(stamps)),
        b"count": struct.pack("<I", len(entries)),
    }
    data = b"".join(struct.pack("<II", number, len(each)) for number, each in entries.items())
    return records.encode_record(fields, data)


def _time(stamp_ns: int) -> bytes:
    """Return a stamp as bags encode it: seconds and nanoseconds, 32 bits each."""
    return struct.pack("<II", *divmod(stamp_ns, 1_000_000_000))
