"""Functions that deserialise, by encoding and definition."""

from dataclasses import replace

import pytest

from andabata.records.containers.container import Connection
from andabata.records.deserialization import Deserializers, UnreadableConnectionError, one_line
from andabata.records.topics import message_types
from tests.made_messages import vector

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
        ({"definition": " "}, "expected a message definition, got an empty one"),
        ({"definition": "Part part"}, "one without it|can't be parsed"),
        ({"definition": "{"}, "can't be parsed"),
        ({"definition_format": "proto"}, "ros1msg, ros2msg or ros2idl, got proto"),
    ],
)
def test_unreadable_connections_have_a_reason(changes, text):
    """The error says what was expected and got."""
    with pytest.raises(UnreadableConnectionError, match=text):
        Deserializers().deserializer(replace(ROS1, **changes))


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
