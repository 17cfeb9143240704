"""Functions that deserialise, by encoding and definition."""

from dataclasses import replace

import pytest

from andabata.records.containers.container import Connection
from andabata.records.deserialization import Deserializers, UnreadableConnectionError, one_line
from andabata.records.topics import message_types
from tests.support.foreign_messages import vector

KIND = "geometry_msgs/msg/Vector3"
TEXT = "float64 x\nfloat64 y\nfloat64 z\n"
ROS1 = Connection("/x", KIND, "ros1", TEXT, "ros1msg")


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"definition": "", "definition_format": "standard"},
        {"encoding": "cdr", "definition_format": "ros2msg"},
    ],
)
def test_messages_come_back(changes):
    """Bytes of either encoding give the numbers that were serialised."""
    connection = replace(ROS1, **changes)
    store = message_types(1 if connection.encoding == "ros1" else 2)
    serialize = store.serialize_ros1 if connection.encoding == "ros1" else store.serialize_cdr
    found = Deserializers().deserializer(connection)(bytes(serialize(vector(1, 2, 3), KIND)))
    assert (found.x, found.y, found.z) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"encoding": "json"}, "encoded as ros1 or cdr, got json"),
        ({"encoding": ""}, "got nothing"),
        ({"definition": " "}, "definition of my_msgs/msg/Thing, got an empty one"),
        ({"definition": "my_msgs/msg/Thing"}, "of my_msgs/msg/Thing, got its name alone"),
        ({"definition": "my_msgs/Thing\n"}, "of my_msgs/msg/Thing, got its name alone"),
        ({"definition": "Part part"}, "that includes my_msgs/msg/Part, got one without"),
        ({"definition": "{"}, "got '{', which can't be parsed"),
        ({"definition_format": "proto"}, "ros1msg, ros2msg or ros2idl, got proto"),
    ],
)
def test_unreadable_connections_have_a_reason(changes, text):
    """The error says what was expected and got, and of which type."""
    with pytest.raises(UnreadableConnectionError, match=text):
        Deserializers().deserializer(replace(ROS1, **({"kind": "my_msgs/msg/Thing"} | changes)))


@pytest.mark.parametrize("encoding", ["ros1", "cdr"])
@pytest.mark.parametrize("text", ["", " ", KIND, "geometry_msgs/Vector3", "{", "# no fields", "\0"])
def test_a_standard_type_without_its_definition_is_read_by_the_standard_one(encoding, text):
    """An empty, damaged or missing definition of a standard type is replaced, and that is noted."""
    form = {"ros1": "ros1msg", "cdr": "ros2msg"}[encoding]
    connection = replace(ROS1, encoding=encoding, definition=text, definition_format=form)
    store = message_types(1 if encoding == "ros1" else 2)
    serialize = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    deserializers = Deserializers()
    decode = deserializers.deserializer(connection)
    deserializers.deserializer(connection)
    found = decode(bytes(serialize(vector(1, 2, 3), KIND)))
    assert (found.x, found.y, found.z) == (1.0, 2.0, 3.0)
    (note,) = deserializers.notes
    assert note.startswith(f"/x: expected a message definition of {KIND}, got ")
    assert note.endswith("; read by the standard definition")


def test_a_type_of_another_checksum_is_no_standard_one():
    """The checksum of a ROS 1 type decides whether the standard definition is its own."""
    digest = message_types(1).generate_msgdef(KIND, ros_version=1)[1]
    for own in (digest, "*"):
        Deserializers().deserializer(replace(ROS1, definition="", digest=own))
    with pytest.raises(UnreadableConnectionError, match="got an empty one"):
        Deserializers().deserializer(replace(ROS1, definition="", digest="0" * 32))
    with pytest.raises(UnreadableConnectionError, match="got proto"):
        Deserializers().deserializer(replace(ROS1, definition_format="proto"))


def test_standard_types_inside_of_a_definition_are_added():
    """A definition that lacks the standard types that it is made of is completed."""
    kind = "my_msgs/msg/Pair"
    text = "geometry_msgs/Vector3 a\ngeometry_msgs/Vector3Stamped b\n"
    connection = replace(ROS1, kind=kind, definition=text)
    deserializers = Deserializers()
    decode = deserializers.deserializer(connection)
    store = message_types(1)
    header = bytes(12) + (3).to_bytes(4, "little") + b"map"
    numbers = [bytes(store.serialize_ros1(vector(*each), KIND)) for each in ((1, 2, 3), (4, 5, 6))]
    found = decode(numbers[0] + header + numbers[1])
    assert (found.a.y, found.b.header.frame_id, found.b.vector.z) == (2.0, "map", 6.0)
    names = "geometry_msgs/msg/Vector3, geometry_msgs/msg/Vector3Stamped, std_msgs/msg/Header"
    assert deserializers.notes == [
        f"/x: the definition of {kind} lacks {names}; read by the standard definitions"
    ]


def test_a_definition_is_parsed_once():
    """Connections of one definition share a store, others do not."""
    found = Deserializers()
    one, same = (found.deserializer(replace(ROS1, topic=name)) for name in ("/a", "/b"))
    other = found.deserializer(replace(ROS1, definition=TEXT + "float64 w\n"))
    assert one.func.__self__ is same.func.__self__
    assert one.func.__self__ is not other.func.__self__


def test_errors_are_shortened_to_a_line():
    """An error without text is named by its class."""
    assert one_line(ValueError("a\nb")) == "a"
    assert one_line(KeyError()) == "KeyError"
