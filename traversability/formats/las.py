"""LAS and LAZ: parser and writer on top of laspy, which comes with the extra ``las``."""

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from traversability.formats.coordinate_units import METRES, CoordinateUnits
from traversability.formats.error import FormatError
from traversability.formats.geo_keys import units_of_geo_keys
from traversability.formats.las_check import check_chunks, check_header, laz_record
from traversability.formats.table import COORDINATES, Columns
from traversability.formats.well_known_text import units_of_text

if TYPE_CHECKING:
    import laspy

_FINE = 1e-4
"""Step of coordinates where 32 bits have room for it [m]."""

_STEPS = 2.0**31 - 2
"""Largest number of steps that 32 bits hold."""

_DIMENSIONS = {"gps_time": "stamps", "classification": "classes"}
"""Names of columns here, by LAS's names of the same."""

_OWN_NAMES = {ours: name for name, ours in _DIMENSIONS.items()}
_LONGEST_NAME = 32
"""Number of bytes that the name of an extra dimension may have."""

_COLOURS, _WIDE = ("red", "green", "blue"), ("scanner_channel", "scan_angle", "overlap")
"""Dimensions of the later point formats."""

_PLAIN_CLASSES = 31
"""Largest class of the older point formats."""


_SYSTEMS = "LASF_Projection"
_WKT, _GEO_KEYS, _GEO_DOUBLES, _GEO_TEXTS = 2112, 34735, 34736, 34737
"""Name and numbers of the records that hold the coordinate reference system."""


class LasPoints(NamedTuple):
    """Points of a LAS file, in the file's own units.

    Attributes:
        columns: Columns by name, shape (n,) each: coordinates, ``stamps`` [s], ``classes``, others.
        spacing: Step and zero of the coordinates, shape (2, 3).
        units: Units of the coordinates.
        remarks: Sentences about the units.
    """

    columns: Columns
    spacing: NDArray[np.float64]
    units: CoordinateUnits
    remarks: tuple[str, ...]


def parse(data: bytes, units: CoordinateUnits | None = None) -> LasPoints:
    """Return coordinates, GPS times [s], classes and all other dimensions of the points.

    Args:
        data: Bytes of the file.
        units: Units that the user gives; None reads what the file says.

    Raises:
        UnknownUnitError: If the file does not say clearly in which unit its coordinates are.
        FormatError: If the bytes are no such file, its coordinates are angles, or laspy is not
            installed.
    """
    try:
        cloud = _read(data)
        columns = {name: np.asarray(getattr(cloud, name), dtype=np.float64) for name in "xyz"}
        for name in cloud.point_format.dimension_names:
            values = np.asarray(cloud[name])
            # Most files leave most of LAS's own dimensions at zero; those carry no information.
            if name not in ("X", "Y", "Z") and values.ndim == 1 and values.any():
                columns.setdefault(_DIMENSIONS.get(name, name), values)
        spacing = np.array([cloud.header.scales, cloud.header.offsets], dtype=np.float64)
        records = _system_records(cloud)
    except FormatError:
        raise
    except ImportError as error:
        raise FormatError(
            "expected laspy for LAS and LAZ, got none; install the extra `las`"
        ) from error
    except BaseException as error:  # Panics of the LAZ library are no Exception.
        if isinstance(error, KeyboardInterrupt | SystemExit | GeneratorExit):
            raise
        raise FormatError(f"expected a whole LAS or LAZ file, got {error}") from error
    if units is not None:
        return LasPoints(columns, spacing, units, ())
    return LasPoints(columns, spacing, *_units(records, bool(cloud.header.global_encoding.wkt)))


def _read(data: bytes) -> "laspy.LasData":
    """Return a file's content; its sizes are checked before a native library reads it.

    Raises:
        FormatError: If a size or a count is more than the file holds.
    """
    import laspy

    check_header(data)
    reader = laspy.LasReader(io.BytesIO(data), laz_backend=laspy.LazBackend.LazrsParallel)
    header = reader.header
    if header.are_points_compressed and header.point_count:
        content = bytes(header.vlrs.get("LasZipVlr")[0].record_data)
        laz = laz_record(content, header.point_format.size)
        if laz.has_chunks:
            check_chunks(data, header.offset_to_point_data, header.point_count, content, laz)
        else:
            reader.laz_backend = laspy.LazBackend.Lazrs
    return reader.read()


def _system_records(cloud: "laspy.LasData") -> dict[int, bytes]:
    """Return the records of the coordinate reference system by number, the first of each."""
    extended: Iterable[laspy.vlrs.vlr.IVLR] = getattr(cloud, "evlrs", None) or ()
    records: dict[int, bytes] = {}
    for record in (*cloud.header.vlrs, *extended):
        if str(record.user_id).rstrip("\0 ") == _SYSTEMS:
            records.setdefault(int(record.record_id), bytes(record.record_data_bytes()))
    return records


def _units(
    records: dict[int, bytes], prefers_text: bool
) -> tuple[CoordinateUnits, tuple[str, ...]]:
    """Return the units that a file names, metres if it names none, and what to say of them.

    Args:
        records: Records of the coordinate reference system by number.
        prefers_text: True if the header says that the WKT counts, not the GeoKeys.
    """
    order = (_WKT, _GEO_KEYS) if prefers_text else (_GEO_KEYS, _WKT)
    for number in order:
        data = records.get(number, b"")
        if number == _WKT:
            units, source = units_of_text(data.decode("utf-8", "replace")), "its WKT"
        else:
            texts = (records.get(each, b"") for each in (_GEO_DOUBLES, _GEO_TEXTS))
            units, source = units_of_geo_keys(data, *texts), "its GeoKeys"
        if units is not None:
            return units, units.remarks(source)
    return METRES, ()


def render(columns: Columns, packed: bool, spacing: NDArray[np.float64] | None = None) -> bytes:
    """Return the file of points; a tenth of a millimetre is kept where 32 bits have room for it.

    Args:
        columns: Columns x, y, z [m] and, where known, ``stamps`` [s] and ``classes``; others become
            extra dimensions.
        packed: True for LAZ, False for LAS.
        spacing: Step and zero of the coordinates of the file that they come from, shape (2, 3);
            None chooses.
    """
    import laspy

    coordinates = np.stack([columns[name].astype(np.float64) for name in COORDINATES])
    header = laspy.LasHeader(point_format=_point_format(columns), version="1.4")
    header.scales, header.offsets = _spacing(coordinates, spacing)
    cloud = laspy.LasData(header)
    names = {}
    for name, column in columns.items():
        if name in COORDINATES:
            continue
        own = _OWN_NAMES.get(name, name)
        known = own in header.point_format.dimension_names
        limits = header.point_format.dimension_by_name(own) if known else None
        if limits is not None and not _fits(column, limits.min, limits.max, limits.kind.name):
            own = name if name != own else f"{name}_value"
            known = False
        names[name] = own[:_LONGEST_NAME]
        if not known:
            cloud.add_extra_dim(laspy.ExtraBytesParams(name=names[name], type=column.dtype))
    cloud.x, cloud.y, cloud.z = coordinates
    for name, own in names.items():
        cloud[own] = columns[name]
    stream = io.BytesIO()
    cloud.write(stream, do_compress=packed)
    return stream.getvalue()


def _point_format(columns: Columns) -> int:
    """Return the number of the oldest point format that has room for the columns."""
    classes = columns.get("classes")
    if any(name in columns for name in _COLOURS):
        return 7
    if any(name in columns for name in _WIDE):
        return 6
    return 6 if classes is not None and len(classes) and classes.max() > _PLAIN_CLASSES else 1


def _fits(column: NDArray[Any], low: float, high: float, kind: str) -> bool:
    """Return True if a dimension of LAS holds numbers as they are."""
    if kind == "FloatingPoint" or not len(column):
        return True
    whole = column.dtype.kind in "iub" or bool((column % 1 == 0).all())
    return whole and bool(column.min() >= low and column.max() <= high)


def _spacing(
    coordinates: NDArray[np.float64], given: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return step and zero that hold coordinates, shape (3, n), in 32 bits [m]."""
    if not coordinates.size:
        return np.full(3, _FINE), np.zeros(3)
    low, high = coordinates.min(axis=1), coordinates.max(axis=1)
    if given is not None:
        ends = (np.stack([low, high]) - given[1]) / given[0]
        if np.abs(ends).max() <= _STEPS:
            return given[0], given[1]
    reach = np.maximum(np.abs(low), np.abs(high))
    offsets = np.where(reach / _FINE > _STEPS, np.floor((low + high) / 2), 0.0)
    widest = np.maximum(np.abs(low - offsets), np.abs(high - offsets))
    # A power of two, where a tenth of a millimetre is too fine for 32 bits.
    steps = np.exp2(np.ceil(np.log2(np.maximum(widest / _STEPS, 1e-9))))
    return np.where(widest / _FINE <= _STEPS, _FINE, steps), offsets
