"""LAS and LAZ through laspy, which comes with the extra ``las``."""

import io

import numpy as np
from numpy.typing import NDArray

from traversability.formats.error import FormatError
from traversability.formats.table import COORDINATES, Columns

_FINE = 1e-4
_STEPS = 2.0**31 - 2

_DIMENSIONS = {"gps_time": "stamps", "classification": "classes"}
"""LAS's own names of what we call otherwise."""

_PLAIN_CLASSES, _BYTE_CLASSES = 31, 255


def parse(data: bytes) -> tuple[Columns, NDArray[np.float64]]:
    """Return coordinates [m], GPS times [s], classes and all else that the points have.

    Returns:
        The columns; and the step and zero of the coordinates [m], shape (2, 3).

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
        for name in cloud.point_format.dimension_names:
            values = np.asarray(cloud[name])
            # Most files leave most of LAS's own dimensions at zero; those say nothing.
            if name not in ("X", "Y", "Z") and values.ndim == 1 and values.any():
                columns.setdefault(_DIMENSIONS.get(name, name), values)
        spacing = np.array([cloud.header.scales, cloud.header.offsets], dtype=np.float64)
    except Exception as error:  # laspy and its LAZ backends raise many kinds on damaged input.
        raise FormatError(f"expected a whole LAS or LAZ file, got {error}") from error
    return columns, spacing


def render(columns: Columns, packed: bool, spacing: NDArray[np.float64] | None = None) -> bytes:
    """Return the file of points; a tenth of a millimetre is kept where 32 bits have room for it.

    Args:
        columns: x, y, z [m] and, where known, ``stamps`` [s] and ``classes``; others become extra
            dimensions.
        packed: LAZ instead of LAS.
        spacing: Step and zero of the coordinates of the file that they come from, shape (2, 3);
            None chooses.
    """
    import laspy

    coordinates = np.stack([columns[name].astype(np.float64) for name in COORDINATES])
    scales, offsets = _spacing(coordinates) if spacing is None else spacing
    classes = columns.get("classes")
    most = 0 if classes is None or not len(classes) else int(classes.max())
    least = 0 if classes is None or not len(classes) else int(classes.min())
    own_classes = least >= 0 and most <= _BYTE_CLASSES
    wide = most > _PLAIN_CLASSES
    header = laspy.LasHeader(point_format=6 if wide else 1, version="1.4" if wide else "1.2")
    header.scales, header.offsets = scales, offsets
    written = {"stamps": "gps_time"} | ({"classes": "classification"} if own_classes else {})
    own = set(header.point_format.dimension_names)
    cloud = laspy.LasData(header)
    extra = {n: c for n, c in columns.items() if n not in (*COORDINATES, *written) and n not in own}
    cloud.add_extra_dims(
        [laspy.ExtraBytesParams(name=n[:32], type=c.dtype) for n, c in extra.items()]
    )
    cloud.x, cloud.y, cloud.z = coordinates
    for name, column in columns.items():
        if name not in COORDINATES:
            cloud[written.get(name, name)[:32]] = column
    stream = io.BytesIO()
    cloud.write(stream, do_compress=packed)
    return stream.getvalue()


def _spacing(coordinates: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return step and zero that hold coordinates, shape (3, n), in 32 bits [m]."""
    if not coordinates.size:
        return np.full(3, _FINE), np.zeros(3)
    low, high = coordinates.min(axis=1), coordinates.max(axis=1)
    reach = np.maximum(np.abs(low), np.abs(high))
    offsets = np.where(reach / _FINE > _STEPS, np.floor((low + high) / 2), 0.0)
    widest = np.maximum(np.abs(low - offsets), np.abs(high - offsets))
    return np.maximum(_FINE, np.exp2(np.ceil(np.log2(np.maximum(widest / _STEPS, 1e-9))))), offsets
