"""MCAP files of any recorder are read, finished or not, whole or damaged."""

import numpy as np
import pytest
from mcap.writer import IndexType, Writer

from andabata.exports.topics import decode_bag_cloud
from andabata.records.bags import Bag, BagError
from andabata.records.messages import MessageBuilder
from andabata.records.topics import POINT_CLOUD, message_types
from tests.support.recordings import mcap_records, note, stamp, write_mcap
from traversability.cloud import PointCloud

EVERY = [f"note {k}" for k in range(10)]


def notes_of(path, damaged=False):
    """Return the texts of all messages of a recording."""
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


def offset_of(data, operation, skip=0):
    """Return the offset of a record."""
    return [each[1:] for each in mcap_records(data) if each[0] == operation][skip]


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_every_channel_is_read_in_every_compression_and_encoding(tmp_path, compression, ros):
    """Both channels are read, whatever compression and version of ROS."""
    path = write_mcap(tmp_path / "x.mcap", compression=compression, chunk=100, ros=ros)
    with Bag(path) as bag:
        assert bag.topics == {"/notes": ("std_msgs/msg/String", 10)}
        assert [c.publisher for c in bag.connections] == ["/node0", "/node1"]
        assert bag.left_out == []
        assert list(bag.notes) == []
        found = list(bag.messages())
    assert [m.content.data for m in found] == EVERY
    assert [m.stamp_ns for m in found] == [stamp(k) for k in range(10)]


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"use_statistics": False, "use_summary_offsets": False},
        {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False},
        {"enable_crcs": False},
    ],
)
def test_optional_records_may_be_missing(tmp_path, options):
    """A file without the optional records of the format is read."""
    path = write_mcap(tmp_path / "x.mcap", **options)
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] == 10
        assert bag.left_out == []
    assert notes_of(path) == EVERY


def test_an_unfinished_file_is_read_with_a_note(tmp_path):
    """A file without a summary is read, and a note reports it."""
    path = write_mcap(tmp_path / "x.mcap", chunk=60, finish=False)
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] >= 8
        assert "no summary" in bag.notes[0]
    assert notes_of(path) == EVERY[: len(notes_of(path))]


def test_a_bag_converted_to_mcap_gives_its_clouds(tmp_path):
    """Clouds in ROS 1 encoding are read from an MCAP file."""
    builder, types = MessageBuilder(1), message_types(1)
    points = np.random.default_rng(0).uniform(-8, 8, (50, 3)).astype(np.float32)
    message = builder.cloud(0.0, PointCloud(points, "base_link"))
    path = tmp_path / "ros1.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1", library="converted")
        text, _ = types.generate_msgdef(POINT_CLOUD, ros_version=1)
        schema = writer.register_schema("sensor_msgs/PointCloud2", "ros1msg", text.encode())
        channel = writer.register_channel("/points", "ros1", schema)
        data = bytes(types.serialize_ros1(message, POINT_CLOUD))
        writer.add_message(channel, stamp(0), data, stamp(0))
        writer.finish()
    np.testing.assert_array_equal(decode_bag_cloud(path, None).cloud.points, points)


def test_channels_of_other_encodings_are_skipped_alone(tmp_path):
    """Channels that are not of ROS are listed as unreadable; the others are read."""
    path = tmp_path / "mixed.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="studio")
        string = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        other = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\nint8 more")
        fox = writer.register_schema("foxglove.Log", "protobuf", b"\x0a\x03")
        idl = writer.register_schema(
            "my_msgs/msg/Speed",
            "ros2idl",
            b"=" * 80
            + b"\nIDL: my_msgs/msg/Speed\nmodule my_msgs { module msg { struct Speed "
            + b"{ float speed; }; }; };\n",
        )
        json = writer.register_schema("Any", "jsonschema", b"{}")
        longer = note(2, 1) + b"\x07"
        channels = {
            "good": (writer.register_channel("/notes", "cdr", string), note(2, 0)),
            "json too": (writer.register_channel("/notes", "json", json), b"{}"),
            "fox": (writer.register_channel("/log", "protobuf", fox), b"\x00"),
            "none": (writer.register_channel("/raw", "cdr", 0), note(2, 0)),
            "idl": (writer.register_channel("/speed", "cdr", idl), b"\0\1\0\0" + b"\0\0\x80?"),
            "other": (writer.register_channel("/other", "cdr", other), longer),
        }
        for channel, data in channels.values():
            writer.add_message(channel, stamp(0), data, stamp(0))
        writer.finish()
    with Bag(path) as bag:
        assert bag.topics["/notes"] == ("std_msgs/msg/String", 2)
        assert set(bag.unreadable) == {"/log", "/raw"}
        assert "protobuf" in bag.unreadable["/log"]
        found = {m.topic: m.content for m in bag.messages()}
        left_out = {each.topic: each for each in bag.left_out}
    assert set(found) == {"/notes", "/speed", "/other"}
    assert found["/speed"].speed == 1.0
    assert found["/other"].more == 7
    assert set(left_out) == {"/notes", "/log", "/raw"}
    assert left_out["/notes"].messages == 1
    assert "json" in left_out["/notes"].reason


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_reading_goes_on_behind_a_damaged_chunk_and_counts_its_messages(tmp_path, compression):
    """The messages of a damaged chunk are counted as lost; all others are read."""
    data = bytearray(
        write_mcap(tmp_path / "x.mcap", 40, compression=compression, chunk=200).read_bytes()
    )
    begin, end = offset_of(data, 6, skip=1)
    data[(begin + end) // 2] ^= 1
    path = tmp_path / "bad.mcap"
    path.write_bytes(data)
    with pytest.raises(BagError, match=r"bag salvage bad\.mcap --out NEW"), Bag(path):
        pass
    with Bag(path, damaged=True) as bag:
        found = [m.content.data for m in bag.messages()]
        (lost,) = bag.left_out
    assert 30 < len(found) < 40
    assert lost.messages == 40 - len(found)
    assert (found[0], found[-1]) == ("note 0", "note 39")


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("unchunked", [False, True])
def test_reading_goes_on_at_the_next_certain_record(tmp_path, compression, unchunked):
    """Bytes that only resemble a record do not stop the search for the next one."""
    options = {"use_chunking": False} if unchunked else {"chunk": 200}
    path = write_mcap(tmp_path / "x.mcap", 40, compression=compression, **options)
    data = bytearray(path.read_bytes())
    begin, _ = offset_of(data, 5 if unchunked else 6, skip=2 if unchunked else 1)
    data[begin : begin + 30] = b"\xff" * 30
    path.write_bytes(data)
    with Bag(path, damaged=True) as bag:
        found = [m.content.data for m in bag.messages()]
        assert bag.left_out[-1].messages == 40 - len(found)
    assert 25 < len(found) < 40 or (compression == "none" and len(found) == 40)
    assert (found[0], found[-1]) == ("note 0", "note 39")


def test_channels_lost_with_their_chunk_are_taken_from_the_summary(tmp_path):
    """The summary replaces channel records of a damaged chunk."""
    path = write_mcap(tmp_path / "x.mcap", 40, chunk=200)
    data = bytearray(path.read_bytes())
    _, end = offset_of(data, 6)
    data[end - 20] ^= 1
    path.write_bytes(data)
    found = notes_of(path, damaged=True)
    assert 25 < len(found) < 40
    assert found[-1] == "note 39"


def test_a_summary_with_other_counts_is_noted(tmp_path):
    """A note reports that summary and file differ in their numbers of messages."""
    path = write_mcap(tmp_path / "x.mcap")
    data = bytearray(path.read_bytes())
    _, end = offset_of(data, 11)
    data[end - 8] = 99  # The count of the last channel.
    path.write_bytes(data)
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] == 10
        assert "/notes: the index counts 104 messages, the file holds 10" in bag.notes[0]


def test_a_damaged_summary_loses_no_message(tmp_path):
    """A damaged summary is noted, and all messages are read."""
    path = write_mcap(tmp_path / "x.mcap")
    data = path.read_bytes()
    begin, _ = offset_of(data, 11)
    path.write_bytes(data[: begin + 5])
    with Bag(path) as bag:
        assert bag.left_out == []
        assert "summary" in bag.notes[0]
    assert notes_of(path) == EVERY
