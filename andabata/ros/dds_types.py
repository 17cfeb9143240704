"""Types of ROS 2 messages for DDS, made from rosbags' definitions; their bytes pass through."""

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

_BASE, _NAME, _ARRAY = 1, 2, 3
"""Kinds of a field in rosbags' definitions; any other is a sequence."""


@cache
def dds_struct(kind: str, store: "Typestore") -> Any:  # noqa: ANN401 - a class made at run time.
    """Return the DDS type of a message type, with its fields.

    Args:
        kind: Message type, as ``package/msg/Name``.
        store: Definitions of the types.
    """
    from cyclonedds.idl import make_idl_struct

    _, fields = store.fielddefs[kind]
    return make_idl_struct(
        kind.rpartition("/")[2],
        dds_name(kind),
        {field: _field_type(int(node), spec, store) for field, (node, spec) in fields},
    )


def dds_name(kind: str) -> str:
    """Return the name under which ROS 2 announces a message type in DDS."""
    package, _, name = kind.partition("/msg/")
    return f"{package}::msg::dds_::{name}_"


def message_kind(dds_type: str) -> str:
    """Return the message type, ``package/msg/Name``, of a name in DDS; foreign ones unchanged."""
    package, found, name = dds_type.partition("::msg::dds_::")
    return f"{package}/msg/{name.removesuffix('_')}" if found else dds_type


@cache
def raw_type(kind: str, store: "Typestore") -> Any:  # noqa: ANN401 - a class made at run time.
    """Return the DDS type of a message type whose samples are bytes.

    cyclonedds' own serialiser takes 154 ms for a cloud, rosbags' 0.5.

    Args:
        kind: Message type, as ``package/msg/Name``.
        store: Definitions of the types.
    """
    struct = dds_struct(kind, store)

    def serialize(sample: Any, *_: object, **__: object) -> bytes:  # noqa: ANN401 - a sample.
        """Return the message's bytes."""
        data: bytes = sample.data_bytes
        return data

    def deserialize(cls: Any, data: bytes, /, *_: object, **__: object) -> Any:  # noqa: ANN401
        """Keep the message's bytes."""
        return raw_sample(cls, data)

    struct.serialize, struct.deserialize = serialize, classmethod(deserialize)
    return struct


def raw_sample(raw: Any, data: bytes) -> Any:  # noqa: ANN401 - a class made at run time.
    """Return a sample of a ``raw_type`` with the bytes of a message, their header included."""
    sample: Any = raw.__new__(raw)
    sample.data_bytes = data
    return sample


def _field_type(node: int, spec: Any, store: "Typestore") -> Any:  # noqa: ANN401 - types of DDS.
    """Return the DDS type of a field of rosbags' definition."""
    from cyclonedds.idl import types

    if node == _NAME:
        return dds_struct(spec, store)
    if node == _BASE:
        return _base_types()[spec[0]]
    (item_node, item_spec), length = spec
    item = _field_type(int(item_node), item_spec, store)
    if node == _ARRAY:
        return types.array[item, length]
    return types.sequence[item, length] if length else types.sequence[item]


@cache
def _base_types() -> dict[str, Any]:
    """Return the DDS types of base types; a ``char`` of ROS 2 is an unsigned byte."""
    from cyclonedds.idl import types

    named = {"bool": bool, "byte": types.uint8, "octet": types.uint8, "char": types.uint8}
    numbers = ("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
    exact = {name: getattr(types, name) for name in (*numbers, "float32", "float64")}
    return {**named, **exact, "string": str}
