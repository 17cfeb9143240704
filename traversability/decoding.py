"""Decoding of columns of numbers, from any file or message, to a point cloud."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from traversability.cloud import COLUMNS, FLOAT32_REACH, PointCloud, are_returns, origin_of
from traversability.formats.coordinate_units import METRES, CoordinateUnits
from traversability.formats.error import FormatError
from traversability.formats.table import COORDINATES, Columns
from traversability.point_times import read_point_times
from traversability.viewpoint import Viewpoint

_LABELS: Mapping[str, tuple[str, ...]] = {
    "classes": ("classes", "class", "label", "labels", "classification", "semantic"),
    "instances": ("instances", "instance", "instance_id"),
    "nontraversable": ("nontraversable",),
    "severity": ("severity",),
    "forbidden": ("forbidden",),
}
_MAX_FLOAT32 = float(np.finfo(np.float32).max)
_WHOLE = (np.uint8, np.uint16, np.uint32, np.int8, np.int16, np.int32)


@dataclass(frozen=True)
class Labelling:
    """Interpretation of a cloud's class numbers as traversable or not.

    Attributes:
        traversable: Class numbers that a robot may drive on.
        assumed: True if they are assumed, as no file beside the cloud names them.
        found: Class numbers in the cloud.
        unlabelled: Number of points that were left out because they have no label.
    """

    traversable: tuple[int, ...]
    assumed: bool
    found: tuple[int, ...]
    unlabelled: int = 0


@dataclass(frozen=True)
class DecodedCloud:
    """Point cloud of a file or a message, with remarks on how it was read.

    Attributes:
        cloud: Points that a sensor measured.
        remarks: Sentences about what was assumed, inferred from the content, or not used.
        no_returns: Number of points that were left out because they are NaN, infinite or zero.
        data_lost: True if something that matters could not be read, which a remark names.
        others: Other columns by name, shape (n,) each: ``intensity`` and the like.
        spacing: Step and zero of the whole numbers that a LAS file holds coordinates in [m], shape
            (2, 3), or None.
        columns: Number of columns in a file without a header, or None.
        labelling: Interpretation of class numbers, or None.
        units: Units of the file's own coordinates; those of ``cloud`` are in metres.
        viewpoint: Pose of the sensor in the coordinates of ``cloud``, or None where the file names
            none or they are the sensor's own.
        rotation: Rotation from the axes of a message's frame to those of ``cloud``, or None if they
            are the same.
    """

    cloud: PointCloud
    remarks: tuple[str, ...] = ()
    no_returns: int = 0
    data_lost: bool = False
    others: Columns = field(default_factory=dict)
    spacing: NDArray[np.float64] | None = None
    columns: int | None = None
    labelling: Labelling | None = None
    units: CoordinateUnits = METRES
    viewpoint: Viewpoint | None = None
    rotation: Rotation | None = None

    def select(self, mask: NDArray[np.bool_]) -> "DecodedCloud":
        """Return the points where ``mask`` holds, with all of their numbers."""
        others = {name: column[mask] for name, column in self.others.items()}
        return replace(self, cloud=self.cloud.select(mask), others=others)

    def noting(self, *remarks: str, lost: bool = False) -> "DecodedCloud":
        """Return the same cloud with more remarks.

        Args:
            *remarks: Sentences to add.
            lost: True if they report lost data.
        """
        joined_remarks = (*self.remarks, *remarks)
        return replace(self, remarks=joined_remarks, data_lost=self.data_lost or lost)


@np.errstate(over="ignore", invalid="ignore")  # Damaged files hold any bit pattern.
def decode_columns(
    table: Columns,
    frame: str = "sensor",
    header: float | None = None,
    times: bool = True,
    units: CoordinateUnits | None = None,
) -> DecodedCloud:
    """Return the cloud of named columns: points without no-returns, with times and labels.

    Args:
        table: Columns by name, shape (n,) each.
        frame: Frame of the coordinates.
        header: Stamp of a message [s since the epoch]: times count from there. None for a file.
        times: True to search for a column of times.
        units: Units of the coordinates; None takes them as metres, with a remark if they are whole
            numbers.

    Raises:
        FormatError: If x, y or z is missing.
    """
    table = _with_small_coordinates(table)
    coordinates, remarks = _coordinates(table, units)
    real = are_returns(coordinates, frame)
    # All other columns of numbers come along, unless they turn out to be times or labels.
    numbers = {n: c for n, c in table.items() if n not in COORDINATES and c.dtype.kind in "biuf"}
    others = {name: column[real] for name, column in numbers.items()}
    remarks += _precision(coordinates[real])
    columns: dict[str, NDArray[Any]] = {}
    if times:
        point_times = read_point_times(others, header)
        remarks += point_times.remarks
        if point_times.seconds is not None and point_times.field is not None:
            columns["stamps"] = point_times.seconds
            others.pop(point_times.field)
    lost = False
    for name, aliases in _LABELS.items():
        alias = next((alias for alias in aliases if alias in others), None)
        if alias is None:
            continue
        values = _label(others[alias], COLUMNS[name])
        if values is None:
            lost = True
            remarks.append(
                f"field {alias}: expected whole numbers of at most 32 bits as labels, got "
                f"{_span(others[alias])}; not used as labels"
            )
            continue
        columns[name] = values
        others.pop(alias)
    cloud = PointCloud.from_coordinates(coordinates[real], frame, **columns)
    none = int(len(real) - real.sum())
    counted = units or METRES
    return DecodedCloud(cloud, tuple(remarks), none, lost, others, units=counted)


def _with_small_coordinates(table: Columns) -> Columns:
    """Return columns whose coordinates are called x, y, z, where the file has capitals."""
    if set(COORDINATES) <= set(table) or len({n.lower() for n in table}) < len(table):
        return table
    return {name.lower() if name.lower() in COORDINATES else name: c for name, c in table.items()}


def _coordinates(
    table: Columns, units: CoordinateUnits | None
) -> tuple[NDArray[np.float64], list[str]]:
    """Return x, y, z [m], shape (n, 3), and a remark where their type leaves the unit open."""
    if not set(COORDINATES) <= set(table):
        raise FormatError(f"expected fields x, y, z, got {', '.join(table) or 'none'}")
    coordinates = np.stack([table[name].astype(np.float64) for name in COORDINATES], axis=1)
    if units is not None:
        across, up = units.metres
        coordinates *= (across, across, up)
    coordinates[np.abs(coordinates) > _MAX_FLOAT32] = np.inf  # Beyond float32 there are no lengths.
    kinds = {table[name].dtype.name for name in COORDINATES if table[name].dtype.kind in "iu"}
    if not kinds or units is not None:
        return coordinates, []
    return coordinates, [
        f"fields x, y, z: whole numbers ({', '.join(sorted(kinds))}) taken as metres; if they are "
        "another unit, give its length in metres with --unit"
    ]


def _precision(coordinates: NDArray[np.float64]) -> list[str]:
    """Return a remark on a cloud that is wider than float32 holds to a millimetre, if it is."""
    if not len(coordinates):
        return []
    origin = origin_of(coordinates)
    reach = float(np.abs(coordinates - origin).max())
    if not origin.any() or reach <= 2 * FLOAT32_REACH or reach > 1e8:
        return []
    step = float(np.spacing(np.float32(reach))) / 2
    return [f"points lie up to {reach / 1000:.4g} km apart: the farthest are kept to {step:.2g} m"]


def _label(values: NDArray[Any], kind: type[Any]) -> NDArray[Any] | None:
    """Return labels in the type of a column, the smallest that holds them all, or None."""
    if kind is not np.integer:
        with np.errstate(over="ignore", invalid="ignore"):
            return values.astype(kind)
    if not len(values) or values.dtype.kind not in "iufb":
        return None if len(values) else values.astype(np.uint8)
    if values.dtype.kind == "f" and not (np.isfinite(values) & (values % 1 == 0)).all():
        return None
    low, high = values.min(), values.max()
    for whole in _WHOLE:
        if np.iinfo(whole).min <= low and high <= np.iinfo(whole).max:
            return values.astype(whole)
    return None


def _span(values: NDArray[Any]) -> str:
    """Return the type and the limits of numbers in words."""
    known = values[np.isfinite(values)]
    limits = f"from {known.min():.6g} to {known.max():.6g}" if len(known) else "that are not finite"
    return f"{values.dtype.name} {limits}"
