"""Clouds in and out of files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.arrays import ArrayFileError, pack, unpack
from traversability.cloud import COLUMNS, PointCloud
from traversability.formats import las, pcd, ply, vtk
from traversability.formats.error import FormatError
from traversability.formats.table import Columns, coordinates, record_columns

_FORMAT = "andabata-cloud"
_MAX_BYTES = 1 << 30
_READERS = {
    ".ply": ply.parse,
    ".pcd": pcd.parse,
    ".vtk": vtk.parse,
    ".las": las.parse,
    ".laz": las.parse,
}
_NAMES = {
    "stamps": ("stamps", "time", "timestamp", "t"),
    "classes": ("classes", "class", "label"),
    "nontraversable": ("nontraversable",),
    "severity": ("severity",),
    "forbidden": ("forbidden",),
}

KITTI_TRAVERSABLE = (40, 44, 48, 49, 60, 72)
"""SemanticKITTI's classes that a robot may drive on: road, parking, sidewalk, other ground, lane
marking and terrain. All others are obstacles (assumption)."""

_KITTI_UNKNOWN = (0, 1)


class CloudFileError(ValueError):
    """A file that is not a point cloud that can be used."""


def read_cloud(path: Path) -> PointCloud:
    """Return the cloud of a file: npz, ply, pcd, vtk, las, laz or bin (KITTI).

    Points that are not finite, or lie in a foreign sensor's origin, are no-returns of organised
    clouds and are left out. Clouds of other programs keep their coordinates; their frame is called
    ``sensor``. Stamps and labels are kept where the file has them; integer stamps are taken for
    nanoseconds. Beside ``velodyne/NAME.bin`` the labels are in ``labels/NAME.label``.

    Args:
        path: The file.

    Raises:
        CloudFileError: If the file is empty, damaged, of an unknown kind, or has no finite point.
        OSError: If it cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".bin", *_READERS):
        known = ", ".join(kind[1:] for kind in (".npz", *_READERS, ".bin"))
        raise CloudFileError(f"{path}: expected a file of kind {known}, got {path.suffix!r}")
    data = path.read_bytes()
    if not data:
        raise CloudFileError(f"{path}: expected a point cloud, got an empty file")
    try:
        if suffix == ".npz":
            cloud = _from_npz(data)
        elif suffix == ".bin":
            cloud = _from_kitti(data, path)
        else:
            cloud = _from_columns(_READERS[suffix](data))
    except (FormatError, ArrayFileError, ValueError) as error:
        raise CloudFileError(f"{path}: {str(error).splitlines()[0]}; is the file whole?") from error
    real = np.asarray(np.isfinite(cloud.points).all(axis=1))
    if cloud.frame == "sensor":
        real &= (cloud.points != 0).any(axis=1)
    if not real.any():
        raise CloudFileError(
            f"{path}: expected finite points, got none among {len(real)}; check the recording"
        )
    return cloud if real.all() else cloud.select(real)


def cloud_to_bytes(cloud: PointCloud, kind: str = "npz") -> bytes:
    """Return a cloud's file; equal clouds give equal bytes.

    Args:
        cloud: What to write.
        kind: npz, ply, pcd, las, laz or bin; ``kitti_labels`` gives the labels beside the last.

    Raises:
        CloudFileError: If the kind is unknown.
    """
    columns = {name: col for name in COLUMNS if (col := getattr(cloud, name)) is not None}
    if kind == "npz":
        header = {"format": _FORMAT, "version": 1, "frame": cloud.frame}
        return pack({"points": cloud.points, **columns}, header)
    if kind == "bin":
        return np.column_stack([cloud.points, np.zeros(len(cloud), np.float32)]).tobytes()
    table: Columns = {name: cloud.points[:, k] for k, name in enumerate("xyz")}
    table |= {
        name: col.astype(np.uint8) if col.dtype == np.bool_ else col
        for name, col in columns.items()
    }
    match kind:
        case "ply":
            return ply.render(table)
        case "pcd":
            return pcd.render(table)
        case "las" | "laz":
            return las.render(table, kind == "laz")
    raise CloudFileError(f"kind: expected npz, ply, pcd, las, laz or bin, got {kind!r}")


def kitti_labels(cloud: PointCloud) -> bytes:
    """Return the label file beside a KITTI file: uint32, the class in the lower half.

    Raises:
        ValueError: If the cloud has no classes.
    """
    if cloud.classes is None:
        raise ValueError("classes: expected labelled points, got none")
    return cloud.classes.astype("<u4").tobytes()


def _from_npz(data: bytes) -> PointCloud:
    """Return our own cloud, or the first structured array with x, y, z, or the first (n, 3)."""
    arrays, header = unpack(data, _MAX_BYTES)
    if header.get("format") == _FORMAT:
        return _own(arrays, str(header.get("frame", "base_footprint")))
    for array in arrays.values():
        if array.dtype.names:
            return _from_columns(record_columns(array))
    for array in arrays.values():
        if array.ndim == 2 and array.shape[1] in (3, 4) and array.dtype.kind == "f":
            return PointCloud(array[:, :3].astype(np.float32), "sensor")
    known = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
    raise FormatError(f"expected an array with fields x, y, z or of shape (n, 3), got {known}")


def _own(arrays: dict[str, NDArray[Any]], frame: str) -> PointCloud:
    """Return a cloud that ``cloud_to_bytes`` wrote."""
    points = arrays.get("points")
    if points is None or points.dtype != np.float32:
        raise FormatError("expected points of float32, got none")
    columns = {name: arrays[name] for name in COLUMNS if name in arrays}
    for name, column in columns.items():
        if column.dtype != COLUMNS[name]:
            raise FormatError(f"{name}: expected {COLUMNS[name].__name__}, got {column.dtype}")
    return PointCloud(points, frame, **columns)


def _from_columns(table: Columns) -> PointCloud:
    """Return a cloud with the stamps and labels that go by a known name."""
    columns: dict[str, NDArray[Any]] = {}
    for name, dtype in COLUMNS.items():
        for alias in _NAMES[name]:
            if alias in table:
                values = table[alias]
                with np.errstate(over="ignore", invalid="ignore"):
                    columns[name] = values.astype(dtype)
                if name == "stamps" and values.dtype.kind in "iu":
                    columns[name] *= 1e-9
                break
    return PointCloud(coordinates(table), "sensor", **columns)


def _from_kitti(data: bytes, path: Path) -> PointCloud:
    """Return the points of a KITTI file, float32 x, y, z, intensity, with its labels if any."""
    if len(data) % 16:
        raise FormatError(f"expected a multiple of 16 bytes (x, y, z, intensity), got {len(data)}")
    points = np.frombuffer(data, dtype="<f4").reshape(-1, 4)[:, :3].astype(np.float32)
    beside = path.parent.parent / "labels" / f"{path.stem}.label"
    if path.parent.name != "velodyne" or not beside.is_file():
        return PointCloud(points, "sensor")
    labels = np.frombuffer(beside.read_bytes(), dtype="<u4") & 0xFFFF
    if len(labels) != len(points):
        raise FormatError(f"{beside.name}: expected {len(points)} labels, got {len(labels)}")
    traversable = _traversable(path.parent.parent)
    known = ~np.isin(labels, _KITTI_UNKNOWN if traversable is None else ())
    bad = ~np.isin(labels, KITTI_TRAVERSABLE if traversable is None else traversable)
    classes = labels.astype(np.uint8) if labels.max(initial=0) < 256 else None
    return PointCloud(points, "sensor", classes=classes, nontraversable=bad).select(known)


def _traversable(folder: Path) -> list[int] | None:
    """Return the classes that ``traversable.txt`` of a sequence names, or None without it."""
    file = folder / "traversable.txt"
    if not file.is_file():
        return None
    try:
        return [int(word) for word in file.read_text().split()]
    except ValueError as error:
        raise FormatError(f"{file.name}: expected class numbers, got {error}") from error
