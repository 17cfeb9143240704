"""Unreadable definitions and messages are skipped one by one and reported."""

import pytest
from rosbags.rosbag1 import Writer

from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag, BagError
from andabata.records.messages import MessageBuilder
from andabata.records.topics import TWIST, message_types
from tests.support.recordings import STRING, note, stamp, write_bag

DEFINITIONS = {
    "an empty one": "",
    "without it": "other_msgs/Part part\n",
    "parsed": "int8 ! no (definition\n",
    "got 'Ä', which can't": "\xc4",
}


@pytest.mark.parametrize("reason", DEFINITIONS)
def test_an_unusable_definition_skips_its_topic_only(tmp_path, reason):
    """An unusable definition makes its topic unreadable, with a reason, and no other."""
    path = tmp_path / "x.bag"
    with Writer(path) as writer:
        good = writer.add_connection("/good", STRING, typestore=message_types(1))
        bad = writer.add_connection(
            "/bad", "my_msgs/msg/X", msgdef=DEFINITIONS[reason], md5sum="0" * 32
        )
        for k in range(3):
            writer.write(good, stamp(k), note(1, k))
            writer.write(bad, stamp(k), b"\0\0\0\0")
    with Bag(path) as bag:
        assert bag.topics == {"/good": (STRING, 3), "/bad": ("my_msgs/msg/X", 3)}
        assert reason in bag.unreadable["/bad"]
        assert [m.content.data for m in bag.messages()] == ["note 0", "note 1", "note 2"]
        assert list(bag.messages(("/bad",))) == []
        (lost,) = bag.left_out
    assert (lost.topic, lost.messages) == ("/bad", 3)


def test_a_standard_type_needs_no_definition(tmp_path):
    """Messages of a standard type are read without its definition, which is noted once."""
    path = tmp_path / "x.bag"
    digest = message_types(1).generate_msgdef(STRING, ros_version=1)[1]
    with Writer(path) as writer:
        for topic in ("/a", "/b"):
            one = writer.add_connection(topic, STRING, msgdef="std_msgs/String", md5sum=digest)
            writer.write(one, stamp(0), note(1, 0))
    with Bag(path) as bag:
        assert [m.content.data for m in bag.messages()] == ["note 0", "note 0"]
        assert not bag.left_out
        assert [text.split(":")[0] for text in bag.notes] == ["/a", "/b"]


def test_types_without_fields_are_read(tmp_path):
    """A type without fields is read, with or without a definition."""
    path = tmp_path / "x.bag"
    with Writer(path) as writer:
        own = writer.add_connection("/go", "std_msgs/msg/Empty", typestore=message_types(1))
        digest = "d41d8cd98f00b204e9800998ecf8427e"
        other = writer.add_connection("/on", "my_msgs/msg/On", msgdef="", md5sum=digest)
        writer.write(own, stamp(0), b"")
        writer.write(other, stamp(1), b"")
    with Bag(path) as bag:
        assert bag.unreadable == {}
        assert len(list(bag.messages())) == 2


def test_one_topic_with_two_definitions_is_read_by_each(tmp_path):
    """Each connection of a topic is read by its own definition."""
    path = tmp_path / "x.bag"
    with Writer(path) as writer:
        old = writer.add_connection("/x", "my_msgs/msg/X", msgdef="int8 a\n", md5sum="1" * 32)
        new = writer.add_connection(
            "/x", "my_msgs/msg/X", msgdef="int8 a\nint8 b\n", md5sum="2" * 32
        )
        writer.write(old, stamp(0), b"\x01")
        writer.write(new, stamp(1), b"\x02\x03")
    with Bag(path) as bag:
        first, second = (m.content for m in bag.messages())
    assert first.a == 1
    assert (second.a, second.b) == (2, 3)


def test_undeserialisable_messages_are_counted_once_per_pass(tmp_path):
    """A second pass over the messages does not count unreadable ones twice."""
    path = tmp_path / "x.bag"
    with Writer(path) as writer:
        own = writer.add_connection("/notes", STRING, typestore=message_types(1))
        for k in range(5):
            data = b"\xff\xff\xff\xff" if k in (1, 3) else note(1, k)
            writer.write(own, stamp(k), data)
    with Bag(path) as bag:
        for _ in range(2):
            assert [m.content.data for m in bag.messages()] == ["note 0", "note 2", "note 4"]
            (lost,) = bag.left_out
            assert (lost.topic, lost.messages) == ("/notes", 2)
        assert bag.topics["/notes"][1] == 5


def test_a_missing_or_closed_bag_is_an_error(tmp_path):
    """A missing file, and reading before opening, raise a BagError with the next step."""
    with pytest.raises(BagError, match="got nothing"):
        Bag(tmp_path / "none.bag")
    with pytest.raises(BagError, match="with statement"):
        list(Bag(write_bag(tmp_path / "x.bag")).messages())


def test_mcap_files_are_read_by_the_reference_reader(tmp_path):
    """The mcap package reads our files with their checksums."""
    from mcap.reader import make_reader

    path = tmp_path / "x.mcap"
    writer, builder = open_writer(path), MessageBuilder(2)
    for k in range(20):
        writer.write(TWIST, builder.stamp_ns(k / 10), builder.twist(0.3, 0.1))
    writer.close()
    with path.open("rb") as file:
        found = list(make_reader(file, validate_crcs=True).iter_messages())
    assert len(found) == 20
    assert found[0][0].name == "geometry_msgs/msg/Twist"
