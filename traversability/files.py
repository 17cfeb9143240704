"""Reading and writing of point clouds in the file formats of ``formats``."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from traversability.arrays import ArrayFileError, pack, unpack
from traversability.class_table import ClassTable
from traversability.cloud import COLUMNS, PointCloud, are_returns
from traversability.decoding import DecodedCloud, decode_columns
from traversability.formats import bare_floats, las, pcd, ply, vtk
from traversability.formats.coordinate_units import CoordinateUnits
from traversability.formats.error import FormatError
from traversability.formats.table import COORDINATES, Columns, record_columns
from traversability.kitti_labels import labelled, read_labels
from traversability.viewpoint import Viewpoint

_FORMAT = "andabata-cloud"
_OTHERS = "others/"
_STORED = {"bool": np.uint8, "float16": np.float32}  # Types that other formats do not have.
_LONG, _EXACT = ("int64", "uint64"), 2.0**53
_MAX_BYTES = 1 << 30
_READERS = {".ply": ply.parse, ".pcd": pcd.parse, ".vtk": vtk.parse}
_LAS = (".las", ".laz")
_KINDS = (".npz", *_READERS, *_LAS, ".bin")
_NUSCENES_COLUMNS, _KITTI_COLUMNS = 5, 4


class CloudFileError(ValueError):
    """A file that holds no point cloud that can be used."""


def read_cloud(path: Path, columns: int | None = None) -> PointCloud:
    """Return the cloud of a file; ``decode_cloud_file`` returns how it was read, too.

    Coordinates too far from their origin for float32, as in UTM, are float64.
    """
    return decode_cloud_file(path, columns).cloud.absolute()


def decode_cloud_file(
    path: Path,
    columns: int | None = None,
    unit: float | None = None,
    labels: ClassTable | None = None,
) -> DecodedCloud:
    """Return the cloud of a file: npz, ply, pcd, vtk, las, laz or bin (KITTI, nuScenes).

    Points that are not finite, or lie in a foreign sensor's origin, are no-returns of organised
    clouds and are left out. Clouds of other programs keep their coordinates, far ones as an
    ``origin`` and what is beyond it; their frame is called ``sensor``. Stamps and labels are kept
    where the file has them. Beside ``velodyne/NAME.bin`` the labels are in ``labels/NAME.label``.
    Coordinates in feet and the like become metres where the file names its unit, with a remark.

    Args:
        path: Path of the file.
        columns: Number of columns of a bin file; None infers it from the content.
        unit: Length of the unit of the coordinates [m]; None for what the file says, else metres.
        labels: Meaning of the classes in the file or in a label file beside it; None for what the
            files themselves say.

    Raises:
        CloudFileError: If the file is empty, damaged, of an unknown kind, has no finite point, or
            coordinates that are no lengths, or its labels are missing or too few.
        OSError: If it cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in _KINDS:
        known = ", ".join(kind[1:] for kind in _KINDS)
        raise CloudFileError(f"{path}: expected a file of kind {known}, got {path.suffix!r}")
    if columns is not None and suffix != ".bin":
        raise CloudFileError(f"--columns: expected with bin files only, got {path.name}")
    data = path.read_bytes()
    if not data:
        raise CloudFileError(f"{path}: expected a point cloud, got an empty file")
    try:
        units = None if unit is None else CoordinateUnits.given(unit)
        decoded = _decode(data, suffix, path, columns, units, labels)
    except (FormatError, ArrayFileError, ValueError) as error:
        text = str(error).splitlines()[0]
        # A text with a semicolon names the next step already.
        hint = "" if ";" in text else "; is the file whole?"
        raise CloudFileError(f"{path}: {text}{hint}") from error
    if not len(decoded.cloud):
        raise CloudFileError(
            f"{path}: expected finite points, got none among {decoded.no_returns}; check the "
            "recording"
        )
    return decoded


def _decode(
    data: bytes,
    suffix: str,
    path: Path,
    columns: int | None,
    units: CoordinateUnits | None,
    labels: ClassTable | None,
) -> DecodedCloud:
    """Return the cloud of a file's bytes, by the suffix of its name."""
    if suffix == ".npz":
        decoded = _from_npz(data, path, units, labels)
    elif suffix == ".bin":
        decoded = _from_bare_floats(data, path, columns, units, labels)
    elif suffix in _LAS:
        decoded = _from_las(las.parse(data, units))
    elif suffix == ".pcd":
        decoded = _from_pcd(data, _with_classes(pcd.parse(data), path, labels), units)
    else:
        table = _with_classes(_READERS[suffix](data), path, labels)
        remarks: tuple[str, ...] = ()
        if suffix == ".ply" and units is None:
            units, remarks = ply.units(data)
        decoded = decode_columns(table, units=units).noting(*remarks)
    return decoded if labels is None else labels.apply(decoded)


def _with_classes(table: Columns, path: Path, labels: ClassTable | None) -> Columns:
    """Return columns with the classes of the label file beside a cloud, where there is one."""
    beside = None if labels is None else labels.file_beside(path)
    if beside is None:
        return table
    numbers = read_labels(beside, len(table["x"]))
    return table | {"classes": numbers & 0xFFFF, "instances": numbers >> 16}


def _from_las(points: las.LasPoints) -> DecodedCloud:
    """Return the cloud of a LAS file, in metres."""
    decoded = decode_columns(points.columns, units=points.units)
    across, up = points.units.metres
    spacing = points.spacing * (across, across, up)
    return replace(decoded, spacing=spacing).noting(*points.remarks)


def _from_pcd(data: bytes, table: Columns, units: CoordinateUnits | None) -> DecodedCloud:
    """Return the cloud of a PCD file's columns, with the pose that it was measured from."""
    decoded = decode_columns(table, units=units)
    numbers = pcd.viewpoint(data)
    if numbers is None:
        return decoded
    across, up = decoded.units.metres
    w, x, y, z = numbers[3:]
    position = np.array(numbers[:3]) * (across, across, up)
    viewpoint = Viewpoint(position, Rotation.from_quat([x, y, z, w]))
    return decoded if viewpoint.is_origin else replace(decoded, viewpoint=viewpoint)


def cloud_to_bytes(
    cloud: PointCloud,
    kind: str = "npz",
    others: Columns | None = None,
    spacing: NDArray[np.float64] | None = None,
    viewpoint: Viewpoint | None = None,
) -> bytes:
    """Return a cloud's file; equal clouds give equal bytes.

    Args:
        cloud: Cloud to write.
        kind: Format, one of npz, ply, pcd, las, laz and bin; ``kitti_labels`` returns the labels
            beside the last.
        others: Other columns by name; bin has room for ``intensity`` alone.
        spacing: Step and zero of the coordinates of a LAS file [m], shape (2, 3); None chooses.
        viewpoint: Pose of the sensor in a PCD file's coordinates; None if they are its own.

    Raises:
        CloudFileError: If the kind is unknown, or cannot hold the coordinates.
    """
    columns = {name: col for name in COLUMNS if (col := getattr(cloud, name)) is not None}
    if cloud.points.dtype != np.float32:
        cloud = PointCloud.from_coordinates(cloud.coordinates(), cloud.frame)
    others = others or {}
    if kind == "npz":
        header: dict[str, Any] = {"format": _FORMAT, "version": 2, "frame": cloud.frame}
        if cloud.origin.any():
            header["origin"] = cloud.origin.tolist()
        beside = {_OTHERS + name: column for name, column in others.items()}
        # Points stay as they are: their noise does not shrink, and any program can read them.
        floats = [name for name, column in columns.items() if column.dtype.kind == "f"]
        return pack({"points": cloud.points, **columns, **beside}, header, floats)
    if kind == "bin":
        return _to_bin(cloud, others.get("intensity"))
    far = bool(cloud.origin.any())
    places = cloud.coordinates() if far else cloud.points
    table: Columns = {name: places[:, k] for k, name in enumerate(COORDINATES)}
    table |= columns | {
        name: column
        for name, column in others.items()
        if name not in table and name not in columns and _held(kind, name, column)
    }
    table = {
        name: column.astype(_STORED.get(column.dtype.name, column.dtype))
        for name, column in table.items()
    }
    if kind == "ply":
        table = {n: c.astype(np.float64) if c.dtype.name in _LONG else c for n, c in table.items()}
    match kind:
        case "ply":
            return ply.render(table)
        case "pcd":
            return pcd.render(table) if viewpoint is None else pcd.render(table, viewpoint.numbers)
        case "las" | "laz":
            return las.render(table, kind == "laz", spacing)
    raise CloudFileError(f"kind: expected npz, ply, pcd, las, laz or bin, got {kind!r}")


def columns_lost_by(kind: str, decoded: DecodedCloud) -> tuple[str, ...]:
    """Return the names of what a kind of file cannot hold: columns, and ``VIEWPOINT``."""
    lost = () if decoded.viewpoint is None or kind == "pcd" else ("VIEWPOINT",)
    if kind == "bin":
        known = [name for name in COLUMNS if getattr(decoded.cloud, name) is not None]
        return (*known, *(name for name in decoded.others if name != "intensity"), *lost)
    if kind == "npz":
        return lost
    others = (name for name, col in decoded.others.items() if not _held(kind, name, col))
    return (*others, *lost)


def _held(kind: str, name: str, column: NDArray[Any]) -> bool:
    """Return True if a kind of file holds a column: PLY has no integers of 64 bits."""
    if len(name.split()) != 1 or not name.isascii():
        return False
    long = kind == "ply" and column.dtype.name in _LONG and len(column) > 0
    return not long or bool(np.abs(column.astype(np.float64)).max() <= _EXACT)


def _to_bin(cloud: PointCloud, intensity: NDArray[Any] | None) -> bytes:
    """Return KITTI's rows, x, y, z and intensity as float32."""
    if cloud.origin.any():
        x, y, _ = cloud.origin
        raise CloudFileError(
            f"kind: expected a file that holds coordinates near {x:.0f}, {y:.0f} m, got bin, whose "
            "float32 does not to a millimetre; write npz, ply, pcd or las"
        )
    fourth = np.zeros(len(cloud), np.float32) if intensity is None else intensity.astype("<f4")
    return np.column_stack([cloud.points, fourth]).astype("<f4").tobytes()


def _from_npz(
    data: bytes, path: Path, units: CoordinateUnits | None, labels: ClassTable | None
) -> DecodedCloud:
    """Return a cloud of ``cloud_to_bytes``, or that of another program's arrays."""
    arrays, header = unpack(data, _MAX_BYTES)
    if header.get("format") == _FORMAT:
        return _in_metres(_own(arrays, header), units)
    return decode_columns(_with_classes(_foreign_columns(arrays), path, labels), units=units)


def _foreign_columns(arrays: dict[str, NDArray[Any]]) -> Columns:
    """Return the columns of the first array that looks like a cloud.

    Arrays with a number for each point, such as labels, are columns beside bare coordinates.

    Raises:
        FormatError: If no array looks like one.
    """
    for array in arrays.values():
        if array.dtype.names:
            return record_columns(array)
    if set(COORDINATES) <= set(arrays):
        count = arrays["x"].size
        return {n: a.ravel() for n, a in arrays.items() if a.size == count}
    for array in arrays.values():
        if array.ndim == 2 and 3 <= array.shape[1] <= 8 and array.dtype.kind in "fiu":
            names = bare_floats.names(array)
            beside = {n: a.ravel() for n, a in arrays.items() if a.size == len(array)}
            return beside | dict(zip(names, array.T, strict=True))
    known = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
    raise FormatError(f"expected an array with fields x, y, z or of shape (n, 3), got {known}")


def _in_metres(decoded: DecodedCloud, units: CoordinateUnits | None) -> DecodedCloud:
    """Return a cloud whose coordinates count in other units in metres."""
    if units is None:
        return decoded
    across, up = units.metres
    cloud = decoded.cloud
    scaled = PointCloud.from_coordinates(cloud.coordinates() * (across, across, up), cloud.frame)
    cloud = replace(cloud, points=scaled.points, origin=scaled.origin)
    return replace(decoded, cloud=cloud, units=units)


def _own(arrays: dict[str, NDArray[Any]], header: dict[str, Any]) -> DecodedCloud:
    """Return a cloud that ``cloud_to_bytes`` wrote."""
    points = arrays.get("points")
    if points is None or points.dtype != np.float32:
        raise FormatError("expected points of float32, got none")
    columns = {name: arrays[name] for name in COLUMNS if name in arrays}
    for name, column in columns.items():
        if not np.issubdtype(column.dtype, COLUMNS[name]):
            raise FormatError(f"{name}: expected {COLUMNS[name].__name__}, got {column.dtype}")
    origin = np.asarray(header.get("origin", (0.0, 0.0, 0.0)), dtype=np.float64)
    frame = str(header.get("frame", "base_footprint"))
    cloud = PointCloud(points, frame, origin=origin, **columns)
    others = {
        name.removeprefix(_OTHERS): column
        for name, column in arrays.items()
        if name.startswith(_OTHERS) and column.shape == (len(points),)
    }
    real = are_returns(cloud.coordinates() if origin.any() else points, frame)
    decoded = DecodedCloud(cloud, others=others)
    if real.all():
        return decoded
    return replace(decoded.select(real), no_returns=int(len(real) - real.sum()))


def _from_bare_floats(
    data: bytes,
    path: Path,
    width: int | None,
    units: CoordinateUnits | None,
    labels: ClassTable | None,
) -> DecodedCloud:
    """Return the points of a file without a header, with the labels beside it if it has any.

    Without a table, labels are SemanticKITTI's, and points without a label are left out.
    """
    nuscenes = path.name.lower().endswith(".pcd.bin")
    likely = _NUSCENES_COLUMNS if nuscenes else _KITTI_COLUMNS
    table, remark = bare_floats.parse(data, width, likely)
    rows = len(table)
    beside = path.parent.parent / "labels" / f"{path.stem}.label"
    labelling = None
    if labels is not None:
        decoded = decode_columns(_with_classes(table, path, labels), units=units)
        return replace(decoded, columns=rows).noting(*([remark] if remark else []))
    if path.parent.name == "velodyne" and beside.is_file():
        table, labelling = labelled(table, beside)
    decoded = decode_columns(table, units=units)
    decoded = replace(decoded, columns=rows, labelling=labelling)
    remarks = [remark] if remark else []
    if labelling is not None and labelling.assumed:
        good = ", ".join(map(str, labelling.traversable))
        remarks.append(
            f"labels: that {good} are traversable and all others obstacles is SemanticKITTI's "
            "numbering, assumed; a traversable.txt beside velodyne/ overrides it"
        )
    if labelling is not None and labelling.unlabelled:
        remarks.append(f"labels: {labelling.unlabelled} points without a label are left out")
    return decoded.noting(*remarks)
