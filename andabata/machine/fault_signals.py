"""Signals of the senses: the parts of readings that a fault selects, delays and changes.

A sense has one or several signals, each with its own form in ``SensorReadings``: rows, sweeps,
clouds or ranges. A batch is what one signal sent in a control period, never empty.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from andabata.machine.sensor_readings import SensorReadings, Sweeps
from traversability.cloud import PointCloud

Values = NDArray[Any]
Change = Callable[[Values], Values]
"""Function of the values of a batch that returns new ones of the same shape."""

Batch = TypeVar("Batch")

_METRES_PER_DEGREE = 111_195.0
"""Length of a degree of latitude on a sphere with the Earth's mean radius [m]."""


class Signal(Protocol[Batch]):
    """Part of the readings of a sense."""

    def take(self, readings: SensorReadings) -> Batch | None:
        """Return what it sent in a control period, None for nothing."""

    def put(self, readings: SensorReadings, batch: Batch | None) -> SensorReadings:
        """Return readings with another batch, or with none."""

    def count(self, batch: Batch) -> int:
        """Return the number of messages of a batch."""

    def select(self, batch: Batch, kept: NDArray[np.bool_]) -> Batch:
        """Return some messages of a batch, at least one; ``kept`` has shape (count,)."""

    def join(self, batches: Sequence[Batch]) -> Batch:
        """Return several batches as one, at least one."""

    def repeat(self, last: Batch, batch: Batch) -> Batch:
        """Return a batch whose messages have the values of an earlier one's last message."""

    def change(self, batch: Batch, change: Change) -> Batch:
        """Return a batch with changed values; stamps stay."""

    def scale(self, batch: Batch, factor: float) -> Batch:
        """Return a batch whose values are multiplied."""

    def shift(self, batch: Batch, offset: float) -> Batch:
        """Return a batch whose values are off by ``offset``; see ``faults.JUMPS``."""


@dataclass(frozen=True)
class RowSignal:
    """Rows of stamp and values.

    Attributes:
        field: Name of the field of ``SensorReadings``.
        shifted: Function of values, shape (k, n), and an offset that returns shifted values.
        scaled: Number of values of a row that are multiplied, the first ones; None for all.
    """

    field: str
    shifted: Callable[[Values, float], Values]
    scaled: int | None = None

    def take(self, readings: SensorReadings) -> Values | None:
        """Return the rows, shape (k, 1 + n), or None."""
        rows: Values | None = getattr(readings, self.field)
        return None if rows is None or not len(rows) else rows

    def put(self, readings: SensorReadings, batch: Values | None) -> SensorReadings:
        """Return readings with other rows; a sensor that is there and silent has none."""
        rows = getattr(readings, self.field)[:0] if batch is None else batch
        changed: dict[str, Any] = {self.field: rows}
        return replace(readings, **changed)

    def count(self, batch: Values) -> int:
        """Return the number of rows."""
        return len(batch)

    def select(self, batch: Values, kept: NDArray[np.bool_]) -> Values:
        """Return some rows."""
        return batch[kept]

    def join(self, batches: Sequence[Values]) -> Values:
        """Return the rows of all batches."""
        return np.concatenate(batches)

    def repeat(self, last: Values, batch: Values) -> Values:
        """Return rows with their own stamps and the values of the last one."""
        return self.change(batch, lambda values: np.broadcast_to(last[-1, 1:], values.shape))

    def change(self, batch: Values, change: Change) -> Values:
        """Return rows with changed values."""
        rows = batch.copy()
        rows[:, 1:] = change(rows[:, 1:])
        return rows

    def scale(self, batch: Values, factor: float) -> Values:
        """Return rows whose first values, or all, are multiplied."""
        rows = batch.copy()
        rows[:, 1:][:, : self.scaled] *= factor
        return rows

    def shift(self, batch: Values, offset: float) -> Values:
        """Return rows whose values are shifted."""
        return self.change(batch, lambda values: self.shifted(values.copy(), offset))


class _RangeSignal(ABC):
    """Scaling and shifting of ranges."""

    def scale(self, batch: Any, factor: float) -> Any:  # noqa: ANN401 - a batch of the signal.
        """Return a batch whose ranges are multiplied."""
        return self.change(batch, lambda values: values * factor)

    def shift(self, batch: Any, offset: float) -> Any:  # noqa: ANN401 - a batch of the signal.
        """Return a batch whose ranges are longer by an offset [m], at least 0."""
        return self.change(batch, lambda values: np.maximum(values + offset, 0.0))

    @abstractmethod
    def change(self, batch: Any, change: Change) -> Any:  # noqa: ANN401 - a batch of the signal.
        """Return a batch with changed ranges."""


class SweepSignal(_RangeSignal):
    """Sweeps of the rotating laser; their head angles are never wrong."""

    def take(self, readings: SensorReadings) -> Sweeps | None:
        """Return the sweeps, or None."""
        sweeps = readings.sweeps
        return None if sweeps is None or not len(sweeps.stamps) else sweeps

    def put(self, readings: SensorReadings, batch: Sweeps | None) -> SensorReadings:
        """Return readings with other sweeps."""
        return replace(readings, sweeps=batch)

    def count(self, batch: Sweeps) -> int:
        """Return the number of sweeps."""
        return len(batch.stamps)

    def select(self, batch: Sweeps, kept: NDArray[np.bool_]) -> Sweeps:
        """Return some sweeps."""
        of_sweeps: dict[str, Any] = {name: getattr(batch, name)[kept] for name in _columns(batch)}
        return replace(batch, **of_sweeps)

    def join(self, batches: Sequence[Sweeps]) -> Sweeps:
        """Return the sweeps of all batches, which have as many beams each."""
        if len(batches) == 1:
            return batches[0]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(each, name) for each in batches])
            for name in _columns(batches[-1])
        }
        return replace(batches[-1], **columns)

    def repeat(self, last: Sweeps, batch: Sweeps) -> Sweeps:
        """Return sweeps with their own stamps and angles and the ranges of the last one."""
        ranges = np.resize(last.ranges[-1], batch.ranges.shape[1])
        return self.change(batch, lambda values: np.broadcast_to(ranges, values.shape))

    def change(self, batch: Sweeps, change: Change) -> Sweeps:
        """Return sweeps with changed ranges."""
        return replace(batch, ranges=change(batch.ranges).astype(batch.ranges.dtype))


class CloudSignal:
    """Clouds of a 3D laser."""

    def take(self, readings: SensorReadings) -> tuple[PointCloud, ...] | None:
        """Return the clouds, or None."""
        return readings.frames or None

    def put(self, readings: SensorReadings, batch: tuple[PointCloud, ...] | None) -> SensorReadings:
        """Return readings with other clouds."""
        return replace(readings, frames=batch or ())

    def count(self, batch: tuple[PointCloud, ...]) -> int:
        """Return the number of clouds."""
        return len(batch)

    def select(
        self, batch: tuple[PointCloud, ...], kept: NDArray[np.bool_]
    ) -> tuple[PointCloud, ...]:
        """Return some clouds."""
        return tuple(cloud for cloud, is_kept in zip(batch, kept, strict=True) if is_kept)

    def join(self, batches: Sequence[tuple[PointCloud, ...]]) -> tuple[PointCloud, ...]:
        """Return the clouds of all batches."""
        return tuple(cloud for batch in batches for cloud in batch)

    def repeat(
        self, last: tuple[PointCloud, ...], batch: tuple[PointCloud, ...]
    ) -> tuple[PointCloud, ...]:
        """Return the last cloud again and again, as new as those of the batch."""
        return tuple(_renewed(last[-1], cloud) for cloud in batch)

    def change(self, batch: tuple[PointCloud, ...], change: Change) -> tuple[PointCloud, ...]:
        """Return clouds with changed coordinates."""
        return tuple(
            replace(cloud, points=change(cloud.points).astype(cloud.points.dtype))
            for cloud in batch
        )

    def scale(self, batch: tuple[PointCloud, ...], factor: float) -> tuple[PointCloud, ...]:
        """Return clouds whose coordinates are multiplied."""
        return self.change(batch, lambda values: values * factor)

    def shift(self, batch: tuple[PointCloud, ...], offset: float) -> tuple[PointCloud, ...]:
        """Return clouds whose points lie farther from their frame's origin by an offset [m]."""

        def farther(points: Values) -> Values:
            ranges = np.linalg.norm(points, axis=1, keepdims=True)
            ratio = np.divide(offset, ranges, out=np.zeros_like(ranges), where=ranges > 0)
            return points * np.maximum(1.0 + ratio, 0.0)

        return self.change(batch, farther)


class HorizontalSignal(_RangeSignal):
    """Ranges of the horizontal scanner, one message a period."""

    def take(self, readings: SensorReadings) -> Values | None:
        """Return the ranges [m], shape (n_sectors,), or None."""
        return readings.horizontal

    def put(self, readings: SensorReadings, batch: Values | None) -> SensorReadings:
        """Return readings with other ranges."""
        return replace(readings, horizontal=batch)

    def count(self, batch: Values) -> int:
        """Return 1."""
        return 1

    def select(self, batch: Values, kept: NDArray[np.bool_]) -> Values:
        """Return the ranges."""
        return batch

    def join(self, batches: Sequence[Values]) -> Values:
        """Return the newest ranges: those of a period replace those before."""
        return batches[-1]

    def repeat(self, last: Values, batch: Values) -> Values:
        """Return the last ranges."""
        return last

    def change(self, batch: Values, change: Change) -> Values:
        """Return changed ranges."""
        return change(batch).astype(batch.dtype)


def _columns(sweeps: Sweeps) -> list[str]:
    """Return the names of the fields that have a value for each sweep."""
    names = ["stamps", "head_angles", "ranges"]
    names += ["elevations"] if sweeps.elevations.ndim == 2 else []
    return names + (["classes"] if sweeps.classes is not None else [])


def _renewed(last: PointCloud, now: PointCloud) -> PointCloud:
    """Return a cloud whose newest point is as new as that of another one."""
    if last.stamps is None or now.stamps is None or not len(last) or not len(now):
        return last
    return replace(last, stamps=last.stamps + (now.newest - last.newest))


def _north(fixes: Values, metres: float) -> Values:
    """Return latitude, longitude and all else of fixes, moved to the north, in place."""
    fixes[:, 0] += metres / _METRES_PER_DEGREE
    return fixes


def _turned(fields: Values, angle: float) -> Values:
    """Return magnetic fields of a heading that is larger by an angle [rad], shape (k, 3)."""
    # A body that turns to the left sees the field turn to the right.
    c, s = np.cos(angle), np.sin(angle)
    return fields @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _yawing(inertial: Values, rate: float) -> Values:
    """Return angular velocities and forces with a yaw rate added [rad/s], in place."""
    inertial[:, 2] += rate
    return inertial


def _faster(wheels: Values, speed: float) -> Values:
    """Return wheel speeds with a speed added [rad/s]."""
    return wheels + speed


SIGNALS: Mapping[str, tuple[Signal[Any], ...]] = MappingProxyType(
    {
        "laser": (SweepSignal(), CloudSignal(), HorizontalSignal()),
        # A wrong unit of places leaves the stated variance alone.
        "gnss": (RowSignal("gnss", _north, scaled=3),),
        "compass": (RowSignal("mag", _turned),),
        "imu": (RowSignal("imu", _yawing),),
        "wheels": (RowSignal("encoders", _faster),),
    }
)
"""Signals of each sense."""
