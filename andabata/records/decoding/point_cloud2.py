"""Points of PointCloud2 messages of any driver, and of the older PointCloud."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.records.decoding.accepted_types import OLD_POINT_CLOUD, message_type
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.messages import NS, header_ns
from andabata.records.topics import POINT_CLOUD, RosMessage, message_types
from traversability.cloud import BASE_FRAMES, PointCloud
from traversability.decoding import DecodedCloud, decode_columns
from traversability.formats.bare_floats import are_zero, no_lengths
from traversability.formats.coordinate_units import CoordinateUnits
from traversability.formats.table import COORDINATES, MAX_POINTS, Columns
from traversability.point_times import time_unit_of

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""numpy's names of the data types that PointField numbers."""

_FLOAT32 = 7
"""PointField's number of a float32."""

_SAMPLE = 300
"""Number of coordinates of an axis by which the byte order is judged, or up to twice as many."""

_NONSENSE, _SENSE = 0.5, 0.05
"""Shares of coordinates that are no lengths: from the first on the byte order is wrong, up to the
second it is right (assumption); in the wrong order it is 0.7 of float32 and more of float64."""


class PointCloudError(ValueError):
    """A PointCloud2 whose parts contradict each other."""


def cloud_of(
    message: RosMessage, frame: str | None = None, stamp: float | None = None
) -> PointCloud:
    """Return the points of a PointCloud2 without remarks; see ``decode_point_cloud2``."""
    return decode_point_cloud2(message, frame, stamp).cloud


def decode_point_cloud2(
    message: RosMessage,
    frame: str | None = None,
    stamp: float | None = None,
    units: CoordinateUnits | None = None,
) -> DecodedCloud:
    """Return the points of a PointCloud2: any fields, offsets, padding and byte order.

    Points that are not finite are left out, and so are those at (0, 0, 0) of a sensor's frame.

    Args:
        message: Message to decode.
        frame: Frame of the points; None for the header's where that is one of the base's, else
            ``sensor``.
        stamp: Time of its header [s]; the points then get times of their own, by the driver's
            field if there is a credible one. None leaves times out.
        units: Units of the coordinates that the user gives; None for metres, ROS's unit.

    Raises:
        PointCloudError: If x, y or z is missing, or the data do not fit.
    """
    fields = {str(field.name): field for field in message.fields}
    if not set(COORDINATES) <= set(fields):
        listed = ", ".join(fields) or "none"
        raise PointCloudError(f"fields: expected x, y and z, got {listed}")
    names = [*COORDINATES, *(n for n in fields if stamp is not None and time_unit_of(n)[0])]
    layout = _Layout.of(message)
    if not layout.width * layout.height:
        sizes = f"{layout.width} times {layout.height}"
        raise PointCloudError(f"width, height: expected points, got {sizes}")
    table: Columns = {}
    remarks = [*layout.remarks]
    for name in names:
        count = int(fields[name].count)
        if count <= 1:
            (table[name],) = layout.columns(fields[name], 1)
        elif name in COORDINATES:
            raise PointCloudError(f"field {name}: expected one number a point, got {count}")
        else:
            remarks.append(f"field {name}: expected one number a point, got {count}; not used")
    own = str(message.header.frame_id)
    frame = frame or (own if own in BASE_FRAMES else "sensor")
    decoded = decode_columns(table, frame, header_ns(message) / NS, stamp is not None, units)
    cloud = decoded.cloud
    if stamp is not None:
        after = np.zeros(len(cloud)) if cloud.stamps is None else cloud.stamps
        cloud = replace(cloud, stamps=stamp + after)
    return replace(decoded, cloud=cloud).noting(*remarks)


def point_columns(message: RosMessage) -> tuple[Columns, tuple[str, ...]]:
    """Return every field of every point with its own type; points without a return are kept.

    Fields of several numbers become several columns: ``name_0``, ``name_1``.

    Args:
        message: PointCloud2 with any fields, offsets, padding and byte order.

    Returns:
        Columns by name, shape (n,) each, in the machine's byte order; and remarks on the layout.

    Raises:
        PointCloudError: If it has no fields, or its data do not fit.
    """
    layout = _Layout.of(message)
    columns: Columns = {}
    for field in message.fields:
        count = max(int(field.count), 1)
        for k, values in enumerate(layout.columns(field, count)):
            name = str(field.name) if count == 1 else f"{field.name}_{k}"
            native = values.astype(values.dtype.newbyteorder("="))
            columns[_unused(name, columns)] = native
    if not columns:
        raise PointCloudError("fields: expected x, y and z, got none")
    return columns, layout.remarks


@dataclass(frozen=True)
class _Layout:
    """Arrangement of the points in a message's bytes, its sizes checked.

    Attributes:
        data: Bytes of the message, shape (n,).
        order: Byte order of the numbers, ``>`` or ``<``.
        width: Number of points per row.
        height: Number of rows.
        point_step: Number of bytes per point.
        row_step: Number of bytes per row.
        remarks: Sentences on what the message says of itself and is not so.
    """

    data: NDArray[np.uint8]
    order: str
    width: int
    height: int
    point_step: int
    row_step: int
    remarks: tuple[str, ...] = ()

    @classmethod
    def of(cls, message: RosMessage) -> "_Layout":
        """Return the layout of a PointCloud2.

        Raises:
            PointCloudError: If the data do not hold as many points as the message says.
        """
        step, width, height = int(message.point_step), int(message.width), int(message.height)
        if not 0 <= width * height <= MAX_POINTS:
            raise PointCloudError(f"width, height: expected points, got {width} times {height}")
        data = np.asarray(message.data, dtype=np.uint8)
        row, remarks = _row_step(message, len(data))
        layout = cls(data, ">" if message.is_bigendian else "<", width, height, step, row, remarks)
        return layout._in_a_sensible_order(message.fields)

    def _in_a_sensible_order(self, fields: Iterable[RosMessage]) -> "_Layout":
        """Return the layout in the byte order in which the coordinates are lengths.

        Drivers set the flag at will, but in the wrong order floats have any exponent.

        Raises:
            PointCloudError: If the coordinates are nonsense in both orders.
        """
        places = [field for field in fields if str(field.name) in COORDINATES]
        if self._nonsense(places) < _NONSENSE:
            return self
        other = replace(self, order="<" if self.order == ">" else ">")
        if other._nonsense(places) > _SENSE:
            raise PointCloudError(
                "fields x, y, z: expected coordinates in metres, got numbers that are no lengths "
                "in either byte order"
            )
        names = {">": "big-endian", "<": "little-endian"}
        text = f"is_bigendian: the coordinates are {names[other.order]}, against the flag; read so"
        return replace(other, remarks=(*self.remarks, text))

    def _nonsense(self, places: Iterable[RosMessage]) -> float:
        """Return the share of coordinates that no sensor gives, of a sample without zeros."""
        shares = []
        for field in places:
            (values,) = self.columns(field, 1)
            # Slots without a return are zero in both orders.
            is_float = values.dtype.kind == "f"
            values = values[~are_zero(values) if is_float else values != 0]
            values = values[:: max(len(values) // _SAMPLE, 1)]
            kind = values.dtype.newbyteorder("=") if is_float else np.float64
            shares.append(no_lengths(values.astype(kind)))
        judged = np.concatenate(shares) if shares else np.zeros(0)
        return float(judged.mean()) if len(judged) else 0.0

    def columns(self, field: RosMessage, count: int) -> Iterator[NDArray[Any]]:
        """Yield the numbers of a field one after the other, shape (height * width,) each.

        Args:
            field: PointField of the message.
            count: Number of numbers per point that are read.

        Raises:
            PointCloudError: If the field lies outside the point.
        """
        kind = _TYPES.get(int(field.datatype))
        size = 0 if kind is None else np.dtype(kind).itemsize
        if kind is None or int(field.offset) + count * size > self.point_step:
            raise PointCloudError(
                f"field {field.name}: expected numbers inside {self.point_step} bytes, got "
                f"{count} of type {field.datatype} at {field.offset}"
            )
        shape, strides = (self.height, self.width), (self.row_step, self.point_step)
        dtype = np.dtype(self.order + kind)
        for k in range(count):
            if not self.width * self.height:  # numpy refuses an offset into no bytes.
                yield np.zeros(0, dtype)
                continue
            offset = int(field.offset) + k * size
            yield np.ndarray(shape, dtype, self.data, offset, strides).ravel()


def _row_step(message: RosMessage, size: int) -> tuple[int, tuple[str, ...]]:
    """Return the number of bytes per row, and a remark if it is not what the message says.

    Args:
        message: PointCloud2 to read.
        size: Number of bytes of its data.

    Raises:
        PointCloudError: If the data do not hold as many points as the message says.
    """
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    # Only a second row needs the length of a row; drivers leave it at zero or write anything.
    row = (int(message.row_step) if height > 1 else 0) or step * width
    if row != step * width and size == step * width * height:
        return step * width, (
            "row_step: is not the length of a row; the data are rows without gaps, and read so",
        )
    if row < step * width or size < row * height:
        raise PointCloudError(
            f"data: expected {height} rows of {row} bytes for {width} points of {step}, got "
            f"{size} bytes"
        )
    return row, ()


def _unused(name: str, columns: Columns) -> str:
    """Return a field's name in PLY's characters that no other column has."""
    plain = "_".join(name.split()) or "field"
    number, candidate = 1, plain
    while candidate in columns:
        number += 1
        candidate = f"{plain}_{number}"
    return candidate


def as_point_cloud2(message: RosMessage) -> RosMessage:
    """Return a cloud as a PointCloud2: the older PointCloud with its channels as fields.

    Raises:
        UnusableMessageError: If a channel has another number of values than there are points.
    """
    if message_type(message) != OLD_POINT_CLOUD:
        return message
    store = message_types(1)
    count = len(message.points)
    columns = [np.array([[p.x, p.y, p.z] for p in message.points], np.float32).reshape(-1, 3)]
    names = ["x", "y", "z"]
    for channel in message.channels:
        if len(channel.values) != count:
            raise UnusableMessageError(
                f"channel {channel.name}: expected a value for each point, got another number"
            )
        names.append(str(channel.name))
        columns.append(np.asarray(channel.values, dtype=np.float32).reshape(-1, 1))
    data = np.ascontiguousarray(np.hstack(columns), dtype="<f4").view(np.uint8).ravel()
    field: Any = store.types["sensor_msgs/msg/PointField"]
    cloud: Any = store.types[POINT_CLOUD]
    return cloud(
        header=message.header,
        height=1,
        width=count,
        fields=[
            field(name=name, offset=4 * k, datatype=_FLOAT32, count=1)
            for k, name in enumerate(names)
        ],
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=len(data),
        data=data,
        is_dense=True,
    )
