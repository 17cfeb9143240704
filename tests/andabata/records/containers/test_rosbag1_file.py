"""ROS 1 bags are read, finished or not, whole or damaged."""

import struct

import pytest

from andabata.records.bags import Bag, BagError
from tests.support.recordings import bag_record, stamp, write_bag


def notes_of(path, damaged=False):
    """Return the texts of all messages of a recording."""
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


EVERY = [f"note {k}" for k in range(10)]


@pytest.mark.parametrize("compression", [None, "bz2", "lz4"])
def test_every_publisher_of_a_topic_is_read_in_every_compression(tmp_path, compression):
    """Messages of both publishers are read, whatever the compression."""
    path = write_bag(tmp_path / "x.bag", compression=compression, chunk=100)
    with Bag(path) as bag:
        assert bag.topics == {"/notes": ("std_msgs/msg/String", 10)}
        assert [c.publisher for c in bag.connections] == ["/node0", "/node1"]
        assert all(c.latching for c in bag.connections)
        found = list(bag.messages())
        assert bag.left_out == []
        assert list(bag.notes) == []
    assert [m.content.data for m in found] == EVERY
    assert [m.stamp_ns for m in found] == [stamp(k) for k in range(10)]


def test_messages_come_by_time_and_not_by_their_place_in_the_file(tmp_path):
    """Messages come in the order of their stamps, not of their offsets."""
    from rosbags.rosbag1 import Writer

    from andabata.records.topics import message_types
    from tests.support.recordings import STRING, note

    writer = Writer(tmp_path / "x.bag")
    writer.chunk_threshold = 60
    with writer:
        own = writer.add_connection("/notes", STRING, typestore=message_types(1))
        for k in (3, 1, 2, 0):
            writer.write(own, stamp(k), note(1, k))
    assert notes_of(tmp_path / "x.bag") == [f"note {k}" for k in range(4)]


def test_a_bag_without_its_index_is_read_with_a_note(tmp_path):
    """An unfinished bag is read, and a note reports the missing index."""
    data = bytearray(write_bag(tmp_path / "x.bag", chunk=100).read_bytes())
    index = bag_record(data, 7)[0]
    place = data.index(b"index_pos=") + len(b"index_pos=")
    data[place : place + 8] = bytes(8)
    path = tmp_path / "x.bag.active"
    path.write_bytes(data[:index])
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] == 10
        assert "no index" in bag.notes[0]


def test_the_last_chunk_of_a_killed_recorder_is_read(tmp_path):
    """Whole messages of an unfinished last chunk are read."""
    # The recorder writes a chunk's length when the chunk is full; until then it is zero.
    data = write_bag(tmp_path / "x.bag").read_bytes()
    begin, end = bag_record(data, 5)
    header = struct.unpack_from("<I", data, begin)[0]
    start = begin + 4 + header
    cut = bytearray(data[:start] + bytes(4) + data[start + 4 : end - 7])
    place = cut.index(b"size=", begin) + 5
    cut[place : place + 4] = bytes(4)
    place = cut.index(b"index_pos=") + len(b"index_pos=")
    cut[place : place + 8] = bytes(8)
    path = tmp_path / "killed.bag.active"
    path.write_bytes(cut)
    assert notes_of(path, damaged=True) == EVERY[:-1]


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_a_compressed_chunk_that_is_cut_short_gives_its_whole_messages(tmp_path, compression):
    """A cut chunk gives its messages up to the cut, if the compression allows it."""
    data = write_bag(tmp_path / "x.bag", 4000, compression=compression).read_bytes()
    _, end = bag_record(data, 5)
    path = tmp_path / "cut.bag"
    path.write_bytes(data[: end - 1000])
    if compression == "bz2":
        with pytest.raises(BagError, match="got none that is whole"), Bag(path, damaged=True):
            pass  # bzip2 packs 900 kB at once, and what is cut off can't be unpacked.
        return
    found = notes_of(path, damaged=True)
    assert 0 < len(found) < 4000
    assert found == [f"note {k}" for k in range(len(found))]


def test_damage_in_the_middle_is_an_error_unless_expected_and_reading_goes_on_behind(tmp_path):
    """Damage is an error by default; on request all messages around it are read."""
    data = bytearray(write_bag(tmp_path / "x.bag", chunk=100).read_bytes())
    begin, _ = bag_record(data, 5, skip=1)
    data[begin : begin + 40] = b"\xff" * 40
    path = tmp_path / "bad.bag"
    path.write_bytes(data)
    with pytest.raises(BagError, match=r"bag salvage bad\.bag --out NEW"), Bag(path):
        pass
    with Bag(path, damaged=True) as bag:
        found = [m.content.data for m in bag.messages()]
        (lost,) = bag.left_out
    # The chunk's header is gone; the messages in it are found one by one.
    assert found == EVERY
    assert lost.messages == 0


def test_messages_of_the_index_that_the_file_lacks_are_counted(tmp_path):
    """Lost messages are those of the index minus those found."""
    data = bytearray(write_bag(tmp_path / "x.bag", chunk=100).read_bytes())
    begin, end = bag_record(data, 5, skip=1)
    data[begin:end] = b"\xff" * (end - begin)
    path = tmp_path / "bad.bag"
    path.write_bytes(data)
    with Bag(path, damaged=True) as bag:
        found = [m.content.data for m in bag.messages()]
        (lost,) = bag.left_out
    assert 0 < len(found) < 10
    assert lost.messages == 10 - len(found)
    assert found[0] == EVERY[0]
    assert found[-1] == EVERY[-1]


def test_an_index_with_other_counts_is_noted(tmp_path):
    """A note reports that index and file differ in their numbers of messages."""
    data = bytearray(write_bag(tmp_path / "x.bag").read_bytes())
    _, end = bag_record(data, 6)
    data[end - 4 : end] = struct.pack("<I", 99)
    path = tmp_path / "x2.bag"
    path.write_bytes(data)
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] == 10
        assert "/notes: the index counts 104 messages, the file holds 10" in bag.notes[0]


def test_a_damaged_index_loses_no_message(tmp_path):
    """A damaged index is noted, and all messages are read."""
    data = bytearray(write_bag(tmp_path / "x.bag").read_bytes())
    begin, _ = bag_record(data, 6)
    data[begin : begin + 30] = b"\xff" * 30
    path = tmp_path / "x2.bag"
    path.write_bytes(data)
    with Bag(path) as bag:
        assert bag.left_out == []
        assert "index" in bag.notes[0]
    assert notes_of(path) == EVERY


def test_a_bag_cut_between_two_records_is_damaged_and_one_cut_before_its_index_is_not(tmp_path):
    """A cut before the end of the messages is damage, a cut at the index is not."""
    data = write_bag(tmp_path / "x.bag", chunk=100).read_bytes()
    path = tmp_path / "cut.bag"
    path.write_bytes(data[: bag_record(data, 5, skip=2)[0]])
    with pytest.raises(BagError, match="up to the index"), Bag(path):
        pass
    path.write_bytes(data[: bag_record(data, 7)[0]])
    assert notes_of(path) == EVERY


@pytest.mark.parametrize(
    ("begin", "match"),
    [(b"", "an empty file"), (b"#ROSBAG V1.2\n" + bytes(9), "version 2.0"), (b"hello", "hello")],
)
def test_a_file_that_is_no_bag_is_an_error(tmp_path, begin, match):
    """Empty files, old bags and other files are errors that name what was found."""
    path = tmp_path / "x.bag"
    path.write_bytes(begin)
    with pytest.raises(BagError, match=match), Bag(path):
        pass


def test_an_encrypted_bag_is_refused_with_the_next_step(tmp_path):
    """An encrypted bag is an error that asks for decryption."""
    data = write_bag(tmp_path / "x.bag").read_bytes()
    begin, end = bag_record(data, 3)
    field = b"encryptor=rosbag/AesCbcEncryptor"
    (length,) = struct.unpack_from("<I", data, begin)
    head = data[begin + 4 : begin + 4 + length] + struct.pack("<I", len(field)) + field
    path = tmp_path / "secret.bag"
    rest = data[begin + 4 + length : end] + data[end:]
    path.write_bytes(data[:begin] + struct.pack("<I", len(head)) + head + rest)
    with pytest.raises(BagError, match="got an encrypted one; decrypt it"), Bag(path):
        pass
