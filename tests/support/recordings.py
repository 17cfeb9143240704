"""Small recordings as other recorders write them."""

import sqlite3
import struct

from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter

from andabata.records.messages import MessageBuilder
from andabata.records.topics import message_types

STRING = "std_msgs/msg/String"
QOS = """- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
NAME_OF = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}


def note(ros, k):
    """Return the bytes of one message."""
    message = MessageBuilder(ros).new(STRING, data=f"note {k}")
    types = message_types(ros)
    encode = types.serialize_ros1 if ros == 1 else types.serialize_cdr
    return bytes(encode(message, STRING))


def stamp(k):
    """Return the k-th stamp [ns]."""
    return 1_700_000_000_000_000_000 + k * 1_000_000_001


def write_bag(path, count=10, publishers=2, compression=None, chunk=1 << 20):
    """Write a bag with two latched publishers of one topic, as /tf_static mostly has."""
    writer = BagWriter(path)
    if compression:
        writer.set_compression(getattr(BagWriter.CompressionFormat, compression.upper()))
    writer.chunk_threshold = chunk
    with writer:
        nodes = [
            writer.add_connection(
                "/notes", STRING, typestore=message_types(1), callerid=f"/node{k}", latching=1
            )
            for k in range(publishers)
        ]
        for k in range(count):
            writer.write(nodes[k % publishers], stamp(k), note(1, k))
    return path


def write_mcap(path, count=10, compression="zstd", chunk=1 << 20, finish=True, ros=2, **options):
    """Write two channels of one topic, an attachment and a metadata record."""
    with path.open("wb") as file:
        packed = NAME_OF[compression]
        writer = McapWriter(file, chunk_size=chunk, compression=packed, **options)
        writer.start(profile=f"ros{ros}", library="library of a writer")
        kind = STRING if ros == 2 else "std_msgs/String"
        schema = writer.register_schema(kind, f"ros{ros}msg", b"string data\n")
        encoding = "cdr" if ros == 2 else "ros1"
        channels = [
            writer.register_channel("/notes", encoding, schema, {"callerid": f"/node{k}"})
            for k in range(2)
        ]
        for k in range(count):
            writer.add_message(channels[k % 2], stamp(k), note(ros, k), stamp(k) - 5, k)
        writer.add_attachment(1, 2, "map.txt", "text/plain", b"here be dragons")
        writer.add_metadata("robot", {"name": "husky"})
        if finish:
            writer.finish()
    return path


def write_db3(path, count=10, definitions=False, data=lambda k: note(2, k), first=0):
    """Write a sqlite3 file with the tables of Foxy to Humble, or with definitions as of Iron."""
    database = sqlite3.connect(path)
    database.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)"
    )
    database.execute(
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL)"
    )
    database.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    database.execute("INSERT INTO topics VALUES(1, '/notes', ?, 'cdr', ?)", (STRING, QOS))
    if definitions:
        database.execute(
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, "
            "encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, "
            "type_description_hash TEXT NOT NULL)"
        )
        database.execute(
            "INSERT INTO message_definitions VALUES(1, ?, 'ros2msg', 'string data', '')", (STRING,)
        )
    for k in range(first, first + count):
        database.execute(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)", (stamp(k), data(k))
        )
    database.commit()
    database.close()
    return path


def bag_record(data, operation, skip=0):
    """Return begin and end of a bag's record on the top level, by its operation."""
    place = 13
    while place < len(data):
        begin = place
        (length,) = struct.unpack_from("<I", data, place)
        header = data[place + 4 : place + 4 + length]
        place += 4 + length
        (length,) = struct.unpack_from("<I", data, place)
        place += 4 + length
        if b"op=" + bytes([operation]) in header:
            if not skip:
                return begin, place
            skip -= 1
    raise ValueError(f"no record {operation}")


def mcap_records(data):
    """Yield operation code, begin and end of an MCAP file's records on the top level."""
    place = 8
    while place < len(data) - 8:
        (length,) = struct.unpack_from("<Q", data, place + 1)
        yield data[place], place, place + 9 + length
        place += 9 + length
