"""Point cloud: coordinates with labels and stamps of each point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

COLUMNS: Mapping[str, type[Any]] = MappingProxyType(
    {
        "stamps": np.float64,
        "classes": np.integer,
        "instances": np.integer,
        "nontraversable": np.bool_,
        "severity": np.float32,
        "forbidden": np.bool_,
    }
)
"""Names and types of the optional columns of a cloud."""

BASE_FRAMES = ("base_footprint", "base_link")
"""Frames whose origin is no sensor, so that a point may lie at (0, 0, 0)."""

FLOAT32_REACH = 8192.0
"""Largest magnitude of a coordinate that float32 holds to a quarter of a millimetre [m]."""

_MAX_COORDINATE = 1e8
"""Magnitude that no coordinate on Earth reaches [m]."""

_NO_OFFSET = np.zeros(3)
_NO_OFFSET.setflags(write=False)


@dataclass(frozen=True)
class PointCloud:
    """3D points with optional columns of each of them.

    Attributes:
        points: Coordinates in ``frame`` after ``origin`` [m], float32, or float64 as ``absolute``
            gives them, shape (n, 3).
        frame: Name of the frame after REP-105; ``base_footprint`` is levelled, its origin under the
            robot on the ground.
        stamps: Time of each point [s], float64, shape (n,), or None.
        classes: Semantic class of each point, any integer, shape (n,), or None.
        instances: Number of the object that each point belongs to, any integer, shape (n,), or
            None.
        nontraversable: True for points of something that the robot must not drive on, bool, shape
            (n,), or None.
        severity: Excess of the true surface under the point over what the robot may drive on, in
            units of the margin of doubt: more than 0 is non-traversable, -1 to 1 is borderline,
            objects are infinite. float32, shape (n,), or None.
        forbidden: True for points at places that the true map forbids, at any height and whatever
            they belong to, bool, shape (n,), or None.
        origin: Position in ``frame`` from which ``points`` are counted [m], float64, shape (3,). It
            is zero unless coordinates are too far from the frame's origin for float32, as in UTM.
    """

    points: NDArray[np.float32]
    frame: str = "base_footprint"
    stamps: NDArray[np.float64] | None = None
    classes: NDArray[np.integer] | None = None
    nontraversable: NDArray[np.bool_] | None = None
    severity: NDArray[np.float32] | None = None
    forbidden: NDArray[np.bool_] | None = None
    instances: NDArray[np.integer] | None = None
    origin: NDArray[np.float64] = field(default_factory=lambda: _NO_OFFSET)

    def __post_init__(self) -> None:
        """Check all shapes once, when the cloud is made.

        Raises:
            ValueError: If an array has another shape.
        """
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise ValueError(f"points: expected shape (n, 3), got {self.points.shape}")
        if self.origin.shape != (3,):
            raise ValueError(f"origin: expected shape (3,), got {self.origin.shape}")
        for name in COLUMNS:
            column = getattr(self, name)
            if column is not None and column.shape != (len(self.points),):
                expected = (len(self.points),)
                raise ValueError(f"{name}: expected shape {expected}, got {column.shape}")

    @classmethod
    def from_coordinates(
        cls, coordinates: NDArray[np.float64], frame: str, **columns: NDArray[Any]
    ) -> Self:
        """Return a cloud that holds coordinates of any size, exact to a millimetre near its middle.

        Args:
            coordinates: Coordinates in ``frame`` [m], shape (n, 3).
            frame: Name of the frame.
            **columns: Columns of ``COLUMNS`` by name.
        """
        origin = origin_of(coordinates)
        with np.errstate(over="ignore", invalid="ignore"):
            points = (coordinates - origin).astype(np.float32)
        return cls(points, frame, origin=origin, **columns)

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    @cached_property
    def xyz(self) -> NDArray[np.float32]:
        """All x, all y and all z of the points [m], shape (3, n): many are read at once."""
        return np.ascontiguousarray(self.points.T)

    @cached_property
    def newest(self) -> float:
        """Stamp of the newest point [s].

        Raises:
            ValueError: If the cloud has no points, or they have no stamps.
        """
        if self.stamps is None or not len(self):
            raise ValueError("stamps: expected points with stamps, got none")
        return float(self.stamps.max())

    def coordinates(self) -> NDArray[np.float64]:
        """Return the points in ``frame`` [m], float64, shape (n, 3)."""
        return self.points.astype(np.float64) + self.origin

    def absolute(self) -> Self:
        """Return the cloud without an origin: its coordinates are float64 if they are far."""
        if not self.origin.any():
            return self
        points: NDArray[Any] = self.coordinates()
        return replace(self, points=points, origin=_NO_OFFSET)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Return some of the points, with all columns.

        Args:
            mask: True for the points to return, bool, shape (n,).
        """
        columns = {
            name: column[mask]
            for name in ("points", *COLUMNS)
            if (column := getattr(self, name)) is not None
        }
        return replace(self, **columns)


def origin_of(coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an origin of whole metres for coordinates: zero unless float32 cannot hold them.

    Args:
        coordinates: Coordinates [m], shape (n, 3).
    """
    known = coordinates[(np.abs(coordinates) < _MAX_COORDINATE).all(axis=1)]
    if not len(known) or np.abs(known).max() <= FLOAT32_REACH:
        return _NO_OFFSET
    middle = np.asarray(np.round(np.median(known, axis=0)), dtype=np.float64)
    return middle if np.abs(middle).max() > 0 else _NO_OFFSET


def are_returns(coordinates: NDArray[Any], frame: str) -> NDArray[np.bool_]:
    """Return which points a sensor measured, bool, shape (n,).

    Drivers fill beams without a return with NaN, infinity or zeros. At (0, 0, 0) of a sensor's
    frame there is the sensor itself; in a frame of the base there may be a point.

    Args:
        coordinates: Coordinates in ``frame`` [m], shape (n, 3).
        frame: Name of the frame.
    """
    is_return = np.asarray(np.isfinite(coordinates).all(axis=1))
    if frame not in BASE_FRAMES:
        is_return &= (coordinates != 0).any(axis=1)
    return is_return


def joined(parts: Sequence[PointCloud]) -> PointCloud:
    """Return the points of several clouds in one, with the columns that all of them have.

    Args:
        parts: Clouds in one frame, at least one, with the same ``origin``.

    Raises:
        ValueError: If their origins differ.
    """
    origin = parts[0].origin
    if any(part.origin is not origin and (part.origin != origin).any() for part in parts):
        raise ValueError("origin: expected parts with the same origin, got different ones")
    columns: dict[str, NDArray[Any] | None] = {}
    for name in COLUMNS:
        known = [column for part in parts if (column := getattr(part, name)) is not None]
        columns[name] = np.concatenate(known) if len(known) == len(parts) else None
    points = np.concatenate([part.points for part in parts])
    return PointCloud(points, parts[0].frame, origin=origin, **columns)
