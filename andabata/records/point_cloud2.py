"""Decodes PointCloud2 messages of any driver."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.records.messages import NS, header_ns
from andabata.records.topics import RosMessage
from traversability.cloud import BASE_FRAMES, PointCloud
from traversability.decoding import DecodedCloud, decode_columns
from traversability.formats.table import COORDINATES, MAX_POINTS, Columns
from traversability.point_times import time_unit_of

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""numpy's names of PointField's numbers."""


class PointCloudError(ValueError):
    """A PointCloud2 whose parts contradict each other."""


def cloud_of(
    message: RosMessage, frame: str | None = None, stamp: float | None = None
) -> PointCloud:
    """Return the points of a PointCloud2; ``decode_point_cloud2`` tells what was done, too."""
    return decode_point_cloud2(message, frame, stamp).cloud


def decode_point_cloud2(
    message: RosMessage, frame: str | None = None, stamp: float | None = None
) -> DecodedCloud:
    """Return the points of a PointCloud2: any fields, offsets, padding and byte order.

    Points that are not finite are left out, and so are those at (0, 0, 0) of a sensor's frame.

    Args:
        message: The message.
        frame: Its frame; None for the header's where that is one of the base's, else ``sensor``.
        stamp: Time of its header [s]; the points then get times of their own, by the driver's
            field if there is one that can be believed. None leaves them out.

    Raises:
        PointCloudError: If x, y or z is missing, or the data do not fit.
    """
    fields = {str(field.name): field for field in message.fields}
    if not set(COORDINATES) <= set(fields):
        found = ", ".join(fields) or "none"
        raise PointCloudError(f"fields: expected x, y and z, got {found}")
    wanted = [*COORDINATES, *(n for n in fields if stamp is not None and time_unit_of(n)[0])]
    rows = _rows(message)
    table: Columns = {}
    remarks = []
    for name in wanted:
        count = int(fields[name].count)
        if count <= 1:
            table[name] = _column(message, fields[name], rows)
        elif name in COORDINATES:
            raise PointCloudError(f"field {name}: expected one number a point, got {count}")
        else:
            remarks.append(f"field {name}: expected one number a point, got {count}; not used")
    own = str(message.header.frame_id)
    frame = frame or (own if own in BASE_FRAMES else "sensor")
    decoded = decode_columns(table, frame, header_ns(message) / NS, stamp is not None)
    cloud = decoded.cloud
    if stamp is not None:
        after = np.zeros(len(cloud)) if cloud.stamps is None else cloud.stamps
        cloud = replace(cloud, stamps=stamp + after)
    return replace(decoded, cloud=cloud).noting(*remarks)


def _rows(message: RosMessage) -> int:
    """Return the bytes of a row, the message's sizes checked.

    Raises:
        PointCloudError: If the data do not hold as many points as the message says.
    """
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    if not 0 <= width * height <= MAX_POINTS:
        raise PointCloudError(f"width, height: expected points, got {width} times {height}")
    # The bytes of a row matter only to a second row; drivers leave them at zero or write others.
    row = (int(message.row_step) if height > 1 else 0) or step * width
    if row < step * width or len(message.data) < row * height:
        raise PointCloudError(
            f"data: expected {height} rows of {row} bytes for {width} points of {step}, got "
            f"{len(message.data)} bytes"
        )
    return row


def _column(message: RosMessage, field: RosMessage, row: int) -> NDArray[Any]:
    """Return one number of each point, shape (height * width,).

    Raises:
        PointCloudError: If the field lies outside the point.
    """
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    kind = _TYPES.get(int(field.datatype))
    if kind is None or int(field.offset) + np.dtype(kind).itemsize > step:
        raise PointCloudError(
            f"field {field.name}: expected a number inside {step} bytes, got type "
            f"{field.datatype} at {field.offset}"
        )
    order = ">" if message.is_bigendian else "<"
    data = np.asarray(message.data, dtype=np.uint8)
    strides = (row, step)
    return np.ndarray((height, width), f"{order}{kind}", data, int(field.offset), strides).ravel()
