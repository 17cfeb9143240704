"""Clouds in and out of files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.arrays import ArrayFileError, pack, unpack
from traversability.cloud import COLUMNS, PointCloud
from traversability.formats import pcd, ply, vtk
from traversability.formats.error import FormatError
from traversability.formats.table import coordinates

_FORMAT = "andabata-cloud"
_MAX_BYTES = 1 << 30


class CloudFileError(ValueError):
    """A file that is not a point cloud that can be used."""


def read_cloud(path: Path) -> PointCloud:
    """Return the cloud of a file, chosen by its suffix: npz, ply, pcd, bin (KITTI) or vtk.

    Points that are not finite are no-returns of organised clouds and are left out. Clouds of other
    programs keep their coordinates; their frame is called ``sensor``.

    Args:
        path: The file.

    Raises:
        CloudFileError: If the file is empty, damaged, of an unknown kind, or has no finite point.
        OSError: If it cannot be read.
    """
    readers: dict[str, Callable[[bytes], PointCloud]] = {
        ".npz": _from_npz,
        ".ply": lambda data: PointCloud(ply.parse(data), "sensor"),
        ".pcd": lambda data: PointCloud(pcd.parse(data), "sensor"),
        ".bin": lambda data: PointCloud(_from_bin(data), "sensor"),
        ".vtk": lambda data: PointCloud(vtk.parse(data), "sensor"),
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(suffix[1:] for suffix in readers)
        raise CloudFileError(f"{path}: expected a file of kind {known}, got {path.suffix!r}")
    data = path.read_bytes()
    if not data:
        raise CloudFileError(f"{path}: expected a point cloud, got an empty file")
    try:
        cloud = reader(data)
    except (FormatError, ArrayFileError, ValueError) as error:
        raise CloudFileError(f"{path}: {str(error).splitlines()[0]}; is the file whole?") from error
    finite = np.asarray(np.isfinite(cloud.points).all(axis=1))
    if not finite.any():
        raise CloudFileError(
            f"{path}: expected finite points, got none among {len(finite)}; check the recording"
        )
    return cloud if finite.all() else cloud.select(finite)


def cloud_to_bytes(cloud: PointCloud) -> bytes:
    """Return the npz file of a cloud; equal clouds give equal bytes."""
    arrays: dict[str, NDArray[Any]] = {"points": cloud.points}
    for name in COLUMNS:
        column = getattr(cloud, name)
        if column is not None:
            arrays[name] = column
    return pack(arrays, {"format": _FORMAT, "version": 1, "frame": cloud.frame})


def _from_npz(data: bytes) -> PointCloud:
    """Return our own cloud, or the first structured array with x, y, z, or the first (n, 3)."""
    arrays, header = unpack(data, _MAX_BYTES)
    if header.get("format") == _FORMAT:
        return _own(arrays, str(header.get("frame", "base_footprint")))
    for array in arrays.values():
        if array.dtype.names:
            return PointCloud(coordinates(array), "sensor")
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


def _from_bin(data: bytes) -> NDArray[np.float32]:
    """Return the points of a KITTI file: float32 x, y, z, intensity."""
    if len(data) % 16:
        raise FormatError(f"expected a multiple of 16 bytes (x, y, z, intensity), got {len(data)}")
    return np.frombuffer(data, dtype="<f4").reshape(-1, 4)[:, :3].astype(np.float32)
