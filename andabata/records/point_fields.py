"""All fields of a PointCloud2's points, as columns with their own types."""

import numpy as np
from numpy.typing import NDArray

from andabata.records.point_cloud2 import PointCloudError
from andabata.records.topics import RosMessage
from traversability.formats.table import Columns

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""numpy's names of PointField's numbers."""


def point_columns(message: RosMessage) -> Columns:
    """Return every field of every point, shape (n,) each; points without a return are kept too.

    Fields of several numbers become several columns: ``name_0``, ``name_1``.

    Args:
        message: A PointCloud2 with any fields, offsets, padding and byte order.

    Raises:
        PointCloudError: If it has no fields, or its data do not fit.
    """
    step, width, height = int(message.point_step), int(message.width), int(message.height)
    row = int(message.row_step) or step * width
    if row < step * width or len(message.data) < row * height:
        raise PointCloudError(
            f"data: expected {height} rows of {row} bytes for {width} points of {step}, got "
            f"{len(message.data)} bytes"
        )
    order = ">" if message.is_bigendian else "<"
    data = np.asarray(message.data, dtype=np.uint8)
    columns: Columns = {}
    for field in message.fields:
        kind = np.dtype(_type(field, order, step))
        count = max(int(field.count), 1)
        for k in range(count):
            name = str(field.name) if count == 1 else f"{field.name}_{k}"
            offset = int(field.offset) + k * kind.itemsize
            values: NDArray[np.generic] = np.zeros(0, kind)
            if height * width:
                values = np.ndarray((height, width), kind, data, offset, (row, step)).ravel()
            columns[_unused(name, columns)] = values.astype(kind.newbyteorder("="))
    if not columns:
        raise PointCloudError("fields: expected x, y and z, got none")
    return columns


def _type(field: RosMessage, order: str, step: int) -> str:
    """Return a field's type as numpy names it.

    Raises:
        PointCloudError: If it is unknown, or the field lies outside the point.
    """
    kind = _TYPES.get(int(field.datatype))
    size = 0 if kind is None else np.dtype(kind).itemsize * max(int(field.count), 1)
    if kind is None or int(field.offset) + size > step:
        raise PointCloudError(
            f"field {field.name}: expected numbers inside {step} bytes, got {field.count} of type "
            f"{field.datatype} at {field.offset}"
        )
    return order + kind


def _unused(name: str, columns: Columns) -> str:
    """Return a field's name as PLY can hold it, and as no other column has it."""
    plain = "_".join(name.split()) or "field"
    number, found = 1, plain
    while found in columns:
        number += 1
        found = f"{plain}_{number}"
    return found
