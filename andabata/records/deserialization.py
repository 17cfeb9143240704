"""Deserialisation of messages by the definitions that a recording holds."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from andabata.records.containers.compression import ZSTD_MAGIC, decompress_prefix
from andabata.records.containers.container import Connection
from andabata.records.topics import Ros, RosMessage, message_types

if TYPE_CHECKING:
    from rosbags.interfaces.typing import Typesdict
    from rosbags.typesys.store import Typestore

_ENCODINGS: dict[str, Ros] = {"ros1": 1, "cdr": 2}
_EMPTY_DIGEST = "d41d8cd98f00b204e9800998ecf8427e"
"""ROS 1's checksum of a definition that has no fields."""

_PLACEHOLDER = "structure_needs_at_least_one_member"
"""Name of the field that rosbags gives to types without fields."""

_PAGE = "=" * 80 + "\n"
"""Line that separates the types of an IDL definition."""

Deserialize = Callable[[bytes], RosMessage]
"""Function that returns the message of serialised bytes."""


class UnreadableConnectionError(ValueError):
    """A connection whose messages cannot be deserialised."""


class Deserializers:
    """Creates deserialising functions, with one type store per definition."""

    def __init__(self) -> None:
        """Create a factory without type stores."""
        self._stores: dict[tuple[str, str, str], Typestore] = {}

    def deserializer(self, connection: Connection) -> Deserialize:
        """Return the function that deserialises a connection's messages.

        Raises:
            UnreadableConnectionError: If the encoding is not one of ROS, or the definition cannot
                be used.
        """
        ros = _ENCODINGS.get(connection.encoding)
        if ros is None:
            raise UnreadableConnectionError(
                f"expected messages encoded as ros1 or cdr, got {connection.encoding or 'nothing'}"
            )
        store = self._store(connection, ros)
        try:
            store.get_msgdef(connection.kind)
        except KeyError as error:
            missing = str(error.args[0])
            if missing == connection.kind:
                text = f"expected a definition of {missing}, got none"
            else:
                text = f"expected a definition that includes {missing}, got one without it"
            raise UnreadableConnectionError(text) from error
        except Exception as error:  # Code generation fails in many ways.
            raise UnreadableConnectionError(_unusable(error)) from error
        if ros == 1:
            return partial(store.deserialize_ros1, typename=connection.kind)
        return partial(_decode_cdr, store, connection.kind)

    def _store(self, connection: Connection, ros: Ros) -> "Typestore":
        """Return a type store with a connection's type.

        Raises:
            UnreadableConnectionError: If the definition cannot be used.
        """
        if connection.definition_format == "standard":
            return message_types(ros)
        key = (connection.kind, connection.definition_format, connection.definition)
        if key not in self._stores:
            from rosbags.typesys import Stores, get_typestore

            if not connection.definition.strip() and not _has_no_fields(connection, ros):
                raise UnreadableConnectionError("expected a message definition, got an empty one")
            store = get_typestore(Stores.EMPTY)
            try:
                store.register(_types(connection))
            except UnreadableConnectionError:
                raise
            except Exception as error:  # Garbage makes the parser fail in many ways.
                raise UnreadableConnectionError(_unusable(error)) from error
            self._stores[key] = store
        return self._stores[key]


def _has_no_fields(connection: Connection, ros: Ros) -> bool:
    """Return whether a type is known to have no fields, as ``std_msgs/msg/Empty``."""
    known = message_types(ros).fielddefs.get(connection.kind)
    names = None if known is None else [name for name, _ in known[1]]
    return connection.digest == _EMPTY_DIGEST or names in ([], [_PLACEHOLDER])


def _types(connection: Connection) -> "Typesdict":
    """Return the types of a definition.

    Raises:
        UnreadableConnectionError: If the definition's format is unknown.
    """
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    text = connection.definition
    if connection.definition_format in ("ros1msg", "ros2msg"):
        return get_types_from_msg(text, connection.kind)
    if connection.definition_format != "ros2idl":
        raise UnreadableConnectionError(
            "expected a definition in ros1msg, ros2msg or ros2idl, got "
            f"{connection.definition_format or 'none'}"
        )
    pages = text.split(f"{_PAGE}IDL: ")
    if len(pages) == 1:
        return get_types_from_idl(text)
    found: Typesdict = {}
    for page in pages[1:]:
        found.update(get_types_from_idl(page.partition("\n")[2]))
    return found


def _unusable(error: Exception) -> str:
    """Return the reason why a definition cannot be used, in one line."""
    return f"expected a message definition, got one that can't be parsed: {one_line(error)}"


def _decode_cdr(store: "Typestore", kind: str, data: bytes) -> RosMessage:
    """Return a message of ROS 2, decompressed if the recorder compressed each message."""
    if data.startswith(ZSTD_MAGIC):
        data = decompress_prefix("zstd", data)
    return store.deserialize_cdr(data, kind)


def one_line(error: BaseException) -> str:
    """Return the first line of an error's text, else the name of its class."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
