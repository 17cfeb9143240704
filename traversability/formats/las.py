"""LAS and LAZ through laspy, which comes with the extra ``las``."""

import io

import numpy as np

from traversability.formats.error import FormatError
from traversability.formats.table import Columns


def parse(data: bytes) -> Columns:
    """Return coordinates [m], GPS times [s] and classification codes.

    Raises:
        FormatError: If the bytes are no such file, or laspy is not installed.
    """
    try:
        import laspy
    except ImportError as error:
        raise FormatError(
            "expected laspy for LAS and LAZ, got none; install the extra `las`"
        ) from (error)
    try:
        cloud = laspy.read(io.BytesIO(data))
        columns = {name: np.asarray(getattr(cloud, name), dtype=np.float64) for name in "xyz"}
        if "gps_time" in cloud.point_format.dimension_names:
            columns["stamps"] = np.asarray(cloud.gps_time, dtype=np.float64)
        columns["classes"] = np.asarray(cloud.classification, dtype=np.uint8)
    except Exception as error:  # laspy and its LAZ backends raise many kinds on damaged input.
        raise FormatError(f"expected a whole LAS or LAZ file, got {error}") from error
    return columns


def render(columns: Columns, packed: bool) -> bytes:
    """Return the file of points; a tenth of a millimetre is kept.

    Args:
        columns: x, y, z [m] and, where known, ``stamps`` [s] and ``classes``.
        packed: LAZ instead of LAS.
    """
    import laspy

    header = laspy.LasHeader(point_format=1, version="1.2")
    header.scales = np.full(3, 1e-4)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = (columns[name].astype(np.float64) for name in "xyz")
    if "stamps" in columns:
        cloud.gps_time = columns["stamps"]
    if "classes" in columns:
        cloud.classification = columns["classes"]
    stream = io.BytesIO()
    cloud.write(stream, do_compress=packed)
    return stream.getvalue()
