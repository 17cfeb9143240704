"""ROS 1 bags are read whatever a recorder left of them."""

import struct

import pytest

from andabata.records.bags import Bag, BagError
from tests.recordings import bag_record, stamp, write_bag


def notes_of(path, damaged=False):
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


EVERY = [f"note {k}" for k in range(10)]


@pytest.mark.parametrize("compression", [None, "bz2", "lz4"])
def test_every_publisher_of_a_topic_is_read_in_every_compression(tmp_path, compression):
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
    from rosbags.rosbag1 import Writer

    from andabata.records.topics import message_types
    from tests.recordings import STRING, note

    writer = Writer(tmp_path / "x.bag")
    writer.chunk_threshold = 60
    with writer:
        own = writer.add_connection("/notes", STRING, typestore=message_types(1))
        for k in (3, 1, 2, 0):
            writer.write(own, stamp(k), note(1, k))
    assert notes_of(tmp_path / "x.bag") == [f"note {k}" for k in range(4)]


def test_a_bag_without_its_index_is_read_and_says_so(tmp_path):
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
def test_a_packed_chunk_that_is_cut_short_gives_what_is_whole(tmp_path, compression):
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


def test_what_the_index_tells_and_the_file_lacks_is_counted(tmp_path):
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


def test_an_index_that_tells_other_counts_is_said(tmp_path):
    data = bytearray(write_bag(tmp_path / "x.bag").read_bytes())
    _, end = bag_record(data, 6)
    data[end - 4 : end] = struct.pack("<I", 99)
    path = tmp_path / "x2.bag"
    path.write_bytes(data)
    with Bag(path) as bag:
        assert bag.topics["/notes"][1] == 10
        assert "/notes: the index counts 104 messages, the file holds 10" in bag.notes[0]


def test_a_damaged_index_costs_no_message(tmp_path):
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
def test_what_is_no_bag_is_said(tmp_path, begin, match):
    path = tmp_path / "x.bag"
    path.write_bytes(begin)
    with pytest.raises(BagError, match=match), Bag(path):
        pass


def test_an_encrypted_bag_is_refused_with_what_to_do(tmp_path):
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
