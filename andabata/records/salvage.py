"""What is whole of a damaged or unfinished recording, as a new one."""

import bz2
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from andabata.records.bags import BagError

_MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_MOST = 1 << 30
"""No record is longer [bytes]: a length beyond is damage."""


@dataclass(frozen=True)
class Salvaged:
    """What came of it.

    Attributes:
        messages: Messages that were whole.
        lost: Whether something was not.
        reason: What ended the reading, or was left out; empty when nothing was lost.
    """

    messages: int
    lost: bool
    reason: str


def salvage(source: Path, target: Path) -> Salvaged:
    """Write what is whole of a recording to a new file of the same kind.

    Args:
        source: A ``.bag`` or an ``.mcap``, finished or not.
        target: A new file with the same suffix.

    Raises:
        BagError: If the kind is another, or the target is there already.
    """
    if target.exists():
        raise BagError(f"{target}: expected a new file, got one that is there")
    if source.suffix != target.suffix:
        raise BagError(f"{target}: expected a name in {source.suffix}, as the recording has")
    if source.suffix == ".mcap":
        return _salvage_mcap(source, target)
    if source.suffix == ".bag":
        return _salvage_bag(source, target)
    raise BagError(f"{source}: expected a .bag or an .mcap, got {source.suffix!r}")


def _salvage_mcap(source: Path, target: Path) -> Salvaged:
    """Read records from the begin, checksums looked at, until one is damaged."""
    from mcap.records import Channel, Footer, Message, Schema
    from mcap.stream_reader import StreamReader
    from mcap.writer import CompressionType, Writer

    count, reason, ended = 0, "", False
    with source.open("rb") as file, target.open("wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="andabata salvage")
        schemas: dict[int, int] = {0: 0}
        channels: dict[int, int] = {}
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if isinstance(record, Schema) and record.id not in schemas:
                    made = writer.register_schema(record.name, record.encoding, record.data)
                    schemas[record.id] = made
                elif isinstance(record, Channel) and record.id not in channels:
                    channels[record.id] = writer.register_channel(
                        record.topic,
                        record.message_encoding,
                        schemas[record.schema_id],
                        dict(record.metadata),
                    )
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    writer.add_message(
                        channel, record.log_time, record.data, record.publish_time, record.sequence
                    )
                    count += 1
                elif isinstance(record, Footer):
                    ended = True
        except Exception as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        writer.finish()
    if not ended and not reason:
        reason = "the file ends before its summary"
    return Salvaged(count, bool(reason), reason)


def _salvage_bag(source: Path, target: Path) -> Salvaged:
    """Read the chunks of a ROS 1 bag one by one; the index at its end is not needed."""
    from rosbags.rosbag1 import Writer

    count, reason = 0, ""
    with source.open("rb") as file:
        data = file.read()
    if not data.startswith(_MAGIC):
        raise BagError(f"{source}: expected a ROS 1 bag, got another file")
    made: dict[int, object] = {}
    with Writer(target) as writer:
        try:
            for op, header, body in _bag_records(data, len(_MAGIC)):
                if op != _CHUNK:
                    continue
                for inner, about, content in _bag_records(_unpacked(header, body), 0):
                    number = struct.unpack("<I", about[b"conn"])[0]
                    if inner == _CONNECTION and number not in made:
                        kind = dict(_fields(content))
                        made[number] = writer.add_connection(
                            about[b"topic"].decode(),
                            kind[b"type"].decode().replace("/", "/msg/", 1),
                            msgdef=kind[b"message_definition"].decode(),
                            md5sum=kind[b"md5sum"].decode(),
                        )
                    elif inner == _MESSAGE:
                        seconds, rest = struct.unpack("<II", about[b"time"])
                        stamp = seconds * 1_000_000_000 + rest
                        writer.write(made[number], stamp, content)  # type: ignore[arg-type]
                        count += 1
        except (KeyError, struct.error, ValueError, OSError, EOFError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return Salvaged(count, bool(reason), reason)


def _unpacked(header: dict[bytes, bytes], body: bytes) -> bytes:
    """Return a chunk's records."""
    kind = header[b"compression"]
    if kind == b"none":
        return body
    if kind == b"bz2":
        return bz2.decompress(body)
    if kind == b"lz4":
        import lz4.frame  # type: ignore[import-untyped]

        unpacked: bytes = lz4.frame.decompress(body)
        return unpacked
    raise ValueError(f"a chunk packed by {kind.decode(errors='replace')}")


def _bag_records(data: bytes, place: int) -> Iterator[tuple[int, dict[bytes, bytes], bytes]]:
    """Yield operation, header and data of each record.

    Raises:
        ValueError: If a record reaches beyond the end.
    """
    while place < len(data):
        parts = []
        for _ in range(2):
            if place + 4 > len(data):
                raise ValueError("the file ends inside a record")
            length = struct.unpack_from("<I", data, place)[0]
            place += 4
            if length > _MOST or place + length > len(data):
                raise ValueError("the file ends inside a record")
            parts.append(data[place : place + length])
            place += length
        header = dict(_fields(parts[0]))
        yield header[b"op"][0], header, parts[1]


def _fields(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the fields of a record's header.

    Raises:
        ValueError: If a field is cut short.
    """
    place = 0
    while place < len(data):
        length = struct.unpack_from("<I", data, place)[0]
        field = data[place + 4 : place + 4 + length]
        name, sign, value = field.partition(b"=")
        if len(field) < length or not sign:
            raise ValueError("a damaged header")
        yield name, value
        place += 4 + length
