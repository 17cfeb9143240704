"""A point cloud whose arrays travel together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
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
"""What may be known about each point, by name, with its type."""

BASE_FRAMES = ("base_footprint", "base_link")
"""Frames whose origin is no sensor: a point there may be at (0, 0, 0)."""

FLOAT32_REACH = 8192.0
"""float32 holds coordinates up to here to a quarter of a millimetre [m]."""

_FARTHEST = 1e8  # No place on Earth has such coordinates [m].

_HERE = np.zeros(3)
_HERE.setflags(write=False)


@dataclass(frozen=True)
class PointCloud:
    """3D points with what is known about each of them.

    Attributes:
        points: Coordinates in ``frame`` after ``origin`` [m], float32, or float64 as ``absolute``
            gives them, shape (n, 3).
        frame: Frame's name after REP-105; ``base_footprint`` is levelled, its origin under the
            robot on the ground.
        stamps: Time of each point [s], float64, shape (n,), or None.
        classes: Semantic class of each point, any integer, shape (n,), or None.
        instances: Number of the object that each point belongs to, any integer, shape (n,), or
            None.
        nontraversable: Whether the point belongs to something that the robot must not drive on,
            bool, shape (n,), or None.
        severity: How far the true surface under the point is beyond what the robot may drive on,
            in units of the margin of doubt: more than 0 is non-traversable, -1 to 1 is borderline,
            things are infinite. float32, shape (n,), or None.
        forbidden: Whether the true map forbids the place that the point was measured at, however
            high it is and whatever it belongs to, bool, shape (n,), or None.
        origin: Place in ``frame`` that ``points`` count from [m], float64, shape (3,). It is zero
            unless coordinates are too far from the frame's origin for float32, as in UTM.
    """

    points: NDArray[np.float32]
    frame: str = "base_footprint"
    stamps: NDArray[np.float64] | None = None
    classes: NDArray[np.integer] | None = None
    nontraversable: NDArray[np.bool_] | None = None
    severity: NDArray[np.float32] | None = None
    forbidden: NDArray[np.bool_] | None = None
    instances: NDArray[np.integer] | None = None
    origin: NDArray[np.float64] = field(default_factory=lambda: _HERE)

    def __post_init__(self) -> None:
        """Check shapes once, at the border."""
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
            coordinates: In ``frame`` [m], shape (n, 3).
            frame: Name of the frame.
            **columns: Those of ``COLUMNS`` that are known.
        """
        origin = origin_of(coordinates)
        with np.errstate(over="ignore", invalid="ignore"):
            points = (coordinates - origin).astype(np.float32)
        return cls(points, frame, origin=origin, **columns)

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    def coordinates(self) -> NDArray[np.float64]:
        """Return the points in ``frame`` [m], float64, shape (n, 3)."""
        return self.points.astype(np.float64) + self.origin

    def absolute(self) -> Self:
        """Return the cloud with its coordinates themselves: float64 where ``origin`` counts."""
        if not self.origin.any():
            return self
        points: NDArray[Any] = self.coordinates()
        return replace(self, points=points, origin=_HERE)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Return the points where ``mask`` holds, bool, shape (n,), with all columns."""
        columns = {
            name: column[mask]
            for name in ("points", *COLUMNS)
            if (column := getattr(self, name)) is not None
        }
        return replace(self, **columns)


def origin_of(coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the whole metres to count coordinates from: zero unless float32 cannot hold them."""
    known = coordinates[(np.abs(coordinates) < _FARTHEST).all(axis=1)]
    if not len(known) or np.abs(known).max() <= FLOAT32_REACH:
        return _HERE
    middle = np.asarray(np.round(np.median(known, axis=0)), dtype=np.float64)
    return middle if np.abs(middle).max() > 0 else _HERE


def are_returns(coordinates: NDArray[Any], frame: str) -> NDArray[np.bool_]:
    """Return which points a sensor measured, shape (n,).

    Drivers fill beams without a return with NaN, infinity or zeros. At (0, 0, 0) of a sensor's
    frame there is the sensor itself, in a frame of the base there may be a point.

    Args:
        coordinates: In ``frame`` [m], shape (n, 3).
        frame: Name of the frame.
    """
    found = np.asarray(np.isfinite(coordinates).all(axis=1))
    if frame not in BASE_FRAMES:
        found &= (coordinates != 0).any(axis=1)
    return found


def joined(parts: Sequence[PointCloud]) -> PointCloud:
    """Return the points of clouds in one frame, with the columns that all of them have.

    Args:
        parts: At least one, with the same ``origin``.

    Raises:
        ValueError: If their origins differ.
    """
    if any((part.origin != parts[0].origin).any() for part in parts):
        raise ValueError("origin: expected parts with the same origin, got different ones")
    columns: dict[str, NDArray[Any] | None] = {}
    for name in COLUMNS:
        known = [column for part in parts if (column := getattr(part, name)) is not None]
        columns[name] = np.concatenate(known) if len(known) == len(parts) else None
    points = np.concatenate([part.points for part in parts])
    return PointCloud(points, parts[0].frame, origin=parts[0].origin, **columns)
