"""A point cloud whose arrays travel together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import NDArray

COLUMNS: Mapping[str, type[np.generic]] = MappingProxyType(
    {
        "stamps": np.float64,
        "classes": np.uint8,
        "nontraversable": np.bool_,
        "severity": np.float32,
        "forbidden": np.bool_,
    }
)
"""What may be known about each point, by name, with its type."""


@dataclass(frozen=True)
class PointCloud:
    """3D points with what is known about each of them.

    Attributes:
        points: Coordinates in ``frame`` [m], float32, shape (n, 3).
        frame: Frame's name after REP-105; ``base_footprint`` is levelled, its origin under the
            robot on the ground.
        stamps: Time of each point [s], float64, shape (n,), or None.
        classes: Semantic class of each point, uint8, shape (n,), or None.
        nontraversable: Whether the point belongs to something that the robot must not drive on,
            bool, shape (n,), or None.
        severity: How far the true surface under the point is beyond what the robot may drive on,
            in units of the margin of doubt: more than 0 is non-traversable, -1 to 1 is borderline,
            things are infinite. float32, shape (n,), or None.
        forbidden: Whether the true map forbids the place that the point was measured at, however
            high it is and whatever it belongs to, bool, shape (n,), or None.
    """

    points: NDArray[np.float32]
    frame: str = "base_footprint"
    stamps: NDArray[np.float64] | None = None
    classes: NDArray[np.uint8] | None = None
    nontraversable: NDArray[np.bool_] | None = None
    severity: NDArray[np.float32] | None = None
    forbidden: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        """Check shapes once, at the border."""
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise ValueError(f"points: expected shape (n, 3), got {self.points.shape}")
        for name in COLUMNS:
            column = getattr(self, name)
            if column is not None and column.shape != (len(self.points),):
                expected = (len(self.points),)
                raise ValueError(f"{name}: expected shape {expected}, got {column.shape}")

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Return the points where ``mask`` holds, bool, shape (n,), with all columns."""
        columns = {
            name: column[mask]
            for name in ("points", *COLUMNS)
            if (column := getattr(self, name)) is not None
        }
        return replace(self, **columns)


def joined(parts: Sequence[PointCloud]) -> PointCloud:
    """Return the points of clouds in one frame, with the columns that all of them have.

    Args:
        parts: At least one.
    """
    columns = {}
    for name in COLUMNS:
        known = [column for part in parts if (column := getattr(part, name)) is not None]
        columns[name] = np.concatenate(known) if len(known) == len(parts) else None
    points = np.concatenate([part.points for part in parts])
    return PointCloud(points, parts[0].frame, **columns)
