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

_FORMATS = ("", "ros1msg", "ros2msg", "ros2idl")
"""Formats of definitions of ROS, and none: what an empty definition may be said to be in."""

_SHOWN = 80
"""Number of letters of a definition that an error shows."""

_PAGE = "=" * 80 + "\n"
"""Line that separates the types of an IDL definition."""

Deserialize = Callable[[bytes], RosMessage]
"""Function that returns the message of serialised bytes."""


class UnreadableConnectionError(ValueError):
    """A connection whose messages cannot be deserialised."""


class Deserializers:
    """Creates deserialising functions, with one type store per definition.

    Attributes:
        notes: Sentences on definitions that were replaced or completed by standard ones.
    """

    def __init__(self) -> None:
        """Create a factory without type stores."""
        self._stores: dict[tuple[str, str, str], Typestore] = {}
        self._added: dict[tuple[str, str, str], list[str]] = {}
        self.notes: list[str] = []

    def deserializer(self, connection: Connection) -> Deserialize:
        """Return the function that deserialises a connection's messages.

        A standard type whose definition is empty or damaged is read by the standard one.

        Raises:
            UnreadableConnectionError: If the encoding is not one of ROS, or the definition cannot
                be used.
        """
        ros = _ENCODINGS.get(connection.encoding)
        if ros is None:
            raise UnreadableConnectionError(
                f"expected messages encoded as ros1 or cdr, got {connection.encoding or 'nothing'}"
            )
        try:
            store = self._store(connection, ros)
        except UnreadableConnectionError as error:
            if not _is_standard(connection, ros):
                raise
            store = message_types(ros)
            self._note(f"{connection.topic}: {error}; read by the standard definition")
        if ros == 1:
            return partial(store.deserialize_ros1, typename=connection.kind)
        return partial(_decode_cdr, store, connection.kind)

    def _note(self, text: str) -> None:
        """Add a note, once."""
        if text not in self.notes:
            self.notes.append(text)

    def _store(self, connection: Connection, ros: Ros) -> "Typestore":
        """Return a type store with a connection's type.

        Raises:
            UnreadableConnectionError: If the definition cannot be used.
        """
        kind = connection.kind
        if connection.definition_format == "standard":
            store = message_types(ros)
            _complete(store, kind, ros)
            return store
        key = (kind, connection.definition_format, connection.definition)
        if key not in self._stores:
            from rosbags.typesys import Stores, get_typestore

            empty_is_wrong = not _has_no_fields(connection, ros)
            if not connection.definition.strip() and empty_is_wrong:
                raise UnreadableConnectionError(
                    f"expected a message definition of {kind}, got an empty one"
                )
            store = get_typestore(Stores.EMPTY)
            try:
                types = _types(connection)
                hollow = kind in types and not types[kind][1] and empty_is_wrong
                if hollow and _is_standard(connection, ros):
                    raise UnreadableConnectionError(
                        f"expected a message definition of {kind}, got one without fields"
                    )
                store.register(types)
            except UnreadableConnectionError:
                raise
            except Exception as error:  # Garbage makes the parser fail in many ways.
                raise UnreadableConnectionError(_unusable(connection, error)) from error
            self._added[key] = _complete(store, kind, ros)
            self._stores[key] = store
        if missing := ", ".join(self._added[key]):
            self._note(
                f"{connection.topic}: the definition of {kind} lacks {missing}; read by the "
                "standard definitions"
            )
        return self._stores[key]


def _complete(store: "Typestore", kind: str, ros: Ros) -> list[str]:
    """Add the standard types that a definition needs and lacks to a store; return their names.

    Raises:
        UnreadableConnectionError: If another type is missing.
    """
    standard, added = message_types(ros).fielddefs, list[str]()
    expected = f"expected a message definition of {kind}"
    while True:
        try:
            store.get_msgdef(kind)
        except KeyError as error:
            missing = str(error.args[0])
            if missing == kind:
                text = f"expected a definition of {kind}, got none"
                raise UnreadableConnectionError(text) from error
            if missing in added or missing not in standard:
                text = f"that includes {missing}, got one without it"
                raise UnreadableConnectionError(f"{expected} {text}") from error
            store.register({missing: standard[missing]})
            added.append(missing)
        except Exception as error:  # Code generation fails in many ways.
            text = f"{expected}, got one that can't be used: {one_line(error)}"
            raise UnreadableConnectionError(text) from error
        else:
            return added


def _is_standard(connection: Connection, ros: Ros) -> bool:
    """Return True if a type is a standard one, as far as its checksum says."""
    known = message_types(ros)
    if connection.definition_format not in _FORMATS or connection.kind not in known.fielddefs:
        return False
    if ros != 1 or connection.digest in ("", "*"):
        return True
    return known.generate_msgdef(connection.kind, ros_version=1)[1] == connection.digest


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
    types: Typesdict = {}
    for page in pages[1:]:
        types.update(get_types_from_idl(page.partition("\n")[2]))
    return types


def _unusable(connection: Connection, error: Exception) -> str:
    """Return the reason why a definition cannot be parsed, in one line."""
    begin = " ".join(connection.definition[:_SHOWN].split())
    kind = connection.kind
    if begin.replace("/msg/", "/") == kind.replace("/msg/", "/"):
        return f"expected a message definition of {kind}, got its name alone"
    reason = one_line(error).removesuffix("Could not parse:").strip()
    text = f"expected a message definition of {kind}, got {begin!r}, which can't be parsed"
    return f"{text}: {reason}" if reason else text


def _decode_cdr(store: "Typestore", kind: str, data: bytes) -> RosMessage:
    """Return a message of ROS 2, decompressed if the recorder compressed each message."""
    if data.startswith(ZSTD_MAGIC):
        data = decompress_prefix("zstd", data)
    return store.deserialize_cdr(data, kind)


def one_line(error: BaseException) -> str:
    """Return the first line of an error's text, else the name of its class."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
