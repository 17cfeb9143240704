"""Supervision of the laser: the robot drives by what arrives, not by the age of a cloud.

A laser that sends nothing, nothing but invalid ranges, or the same ranges again while its head
turns or the robot moves, is silent. Noise never repeats itself to the bit. One that sends far fewer
sweeps than usual, or whose ranges change all at once, is not believed.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.localization.arrival_rate import (
    COLUMNS,
    DOUBT,
    RATE,
    USUAL_RATE,
    arrival_warning,
    follow_arrivals,
)
from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from andabata.navigation.range_plausibility import RangePlausibility, has_impossible
from traversability.cloud import PointCloud

_KNOWN_INTERVALS = 3
"""Number of times between arrivals after which the laser's own period is known."""

_UNKNOWN_LIMIT = 5.0
"""Silence that is accepted before [s]."""

_MAX_AGE = 1.0
"""Age from which a measurement that arrives is none any more [s]."""

_MOVED, _TURNED = 0.02, 0.01
"""Way [m] and turn [rad] in which a laser sees something else."""

_TOLERANCE = 1e-9
"""Difference of two times that counts as none [s]."""


class LaserMonitorConfig(BaseModel):
    """Silence of the laser from which the robot stands still.

    Attributes:
        timeout: Time since the last arrival of valid ranges [s].
        periods: Number of the laser's own periods, the usual time from arrival to arrival, that the
            timeout is at least.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    timeout: float = Field(default=0.3, gt=0)
    periods: float = Field(default=3.0, ge=1)


class LaserMonitor:
    """Record of when the laser last sent ranges that can be believed.

    Without any arrival since the start there is nothing to miss: an environment without a laser
    drives, and a robot that waits for its first cloud stands still anyway.

    Attributes:
        is_silent: True if the last arrival is longer ago than the timeout.
    """

    def __init__(self, config: LaserMonitorConfig) -> None:
        """Begin without an arrival.

        Args:
            config: Limits.
        """
        self._config = config
        self._ranges = RangePlausibility()
        self.reset()

    def reset(self) -> None:
        """Forget all arrivals."""
        self.is_silent = False
        self._arrival: float | None = None  # Last one that counts.
        self._changed = 0.0  # Last one that differed from the one before.
        self._now = 0.0
        self._reason = ""
        self._intervals: deque[float] = deque(maxlen=9)
        self._limit = max(_UNKNOWN_LIMIT, self._config.timeout)
        self._last: NDArray[np.float32] | None = None
        self._last_angle = np.nan
        self._newest = 0.0
        self._ranges.reset()
        self._rate = np.zeros(COLUMNS)

    @property
    def is_usable(self) -> bool:
        """True unless the laser is silent or what it sends is not believed."""
        return not (self.is_silent or self._ranges.is_doubted or self._rate[DOUBT])

    @property
    def causes(self) -> tuple[str, ...]:
        """What is wrong with the laser, for the health word; empty while it is usable."""
        if self.is_silent and self._arrival is not None:
            return (f"laser: silent for {self._now - self._arrival:.1f} s{self._reason}",)
        if self._ranges.is_doubted:
            return (self._ranges.warning(self._now),)
        if self._rate[DOUBT]:
            return (arrival_warning("laser", self._rate, self._now),)
        return ()

    def update(self, readings: SensorReadings, track: PoseTrack) -> SensorReadings:
        """Take in what arrived; return the readings without ranges that are not believed.

        Args:
            readings: Readings of a period.
            track: Estimated poses by stamp, until the end of the period.
        """
        dt, self._now = readings.stamp - self._now, readings.stamp
        sweeps, frames, horizontal = readings.sweeps, readings.frames, readings.horizontal
        count = 0
        if sweeps is not None and len(sweeps.stamps):
            count = len(sweeps.stamps)
            if not self._take_sweeps(sweeps, track):
                readings = replace(readings, sweeps=None)
        elif frames:
            count = len(frames)
            if not self._take_frames(frames, track):
                readings = replace(readings, frames=())
        elif horizontal is not None:
            count = 1
            if not self._take_horizontal(horizontal, track):
                readings = replace(readings, horizontal=None)
        count = count if self._arrival == self._now else 0
        if self.is_silent and count:  # The robot goes on with the first ranges after a silence.
            self._rate[RATE] = self._rate[USUAL_RATE]
        follow_arrivals(self._rate, self._now, dt, count, self._newest)
        silence = 0.0 if self._arrival is None else self._now - self._arrival
        self.is_silent = silence > self._limit + _TOLERANCE
        return readings

    def _take_sweeps(self, sweeps: Sweeps, track: PoseTrack) -> bool:
        """Take sweeps; return true if they are believed."""
        is_possible = self._ranges.is_possible(sweeps)
        newest, has_turned = float(sweeps.stamps[-1]), self._turned(sweeps)
        believed = self._take(sweeps.ranges, newest, is_possible, has_turned, track)
        return believed and not self._ranges.is_doubted

    def _turned(self, sweeps: Sweeps) -> bool:
        """Return true if the head has turned from sweep to sweep."""
        angles = sweeps.head_angles
        before, self._last_angle = self._last_angle, float(angles[-1])
        return bool(angles[0] != before or (len(angles) > 1 and angles[-1] != angles[0]))

    def _take_frames(self, frames: Sequence[PointCloud], track: PoseTrack) -> bool:
        """Take clouds of a 3D laser; return true if they are believed."""
        newest = frames[-1]
        stamp = self._now if newest.stamps is None or not len(newest) else newest.newest
        is_possible = not has_impossible(newest.points, -np.inf)
        return self._take(newest.points, stamp, is_possible, False, track)

    def _take_horizontal(self, ranges: NDArray[np.float32], track: PoseTrack) -> bool:
        """Take the ranges of a horizontal scanner; return true if they are believed."""
        # Nothing stands around it.
        if math.isinf(ranges[0]) and np.isinf(ranges).all():
            self._last, self._changed = None, self._now
            if self._arrival is None:
                self._arrival = self._now
            self._newest = self._now
            self._arrive()
            return True
        is_possible = not has_impossible(ranges[None], 0.0)
        return self._take(ranges[None], self._now, is_possible, False, track)

    def _take(
        self,
        ranges: NDArray[np.float32],
        newest: float,
        is_possible: bool,
        has_turned: bool,
        track: PoseTrack,
    ) -> bool:
        """Take ranges, or points; return false if they are impossible or repeat the last ones.

        Args:
            ranges: Ranges or points, row by row [m], float32, shape (s, b).
            newest: Stamp of the newest [s].
            is_possible: False if a laser cannot measure many of the numbers.
            has_turned: True if the head has turned from row to row.
            track: Estimated poses by stamp.
        """
        if self._arrival is None:  # Whatever it sends, there is a laser.
            self._arrival = self._changed = self._now
        self._newest = newest
        if newest < self._now - _MAX_AGE:
            self._reason = ", what arrives is old"
        elif is_possible and self._differs_at_a_glance(ranges):
            self._last, self._changed = ranges, self._now
            self._arrive()
        elif not (is_possible and _has_values(ranges)):
            self._reason = ", what arrives is invalid"
            return is_possible
        elif self._repeats(ranges, has_turned, track):
            self._reason = ", it repeats its last ranges"
            self._arrival = min(self._arrival, self._changed)
            return False
        else:
            self._arrive()
        return True

    def _differs_at_a_glance(self, ranges: NDArray[np.float32]) -> bool:
        """Return true if one beam alone shows that ranges are valid and new, as it mostly does."""
        last = self._last
        if last is None or not len(ranges) or last.shape[1:] != ranges.shape[1:]:
            return False
        beam = ranges.shape[1] // 8  # Of a vertical sweep, one that meets the ground.
        value = float(ranges[0, beam])
        return math.isfinite(value) and value not in (float(last[0, beam]), float(last[-1, beam]))

    def _repeats(self, ranges: NDArray[np.float32], has_turned: bool, track: PoseTrack) -> bool:
        """Return true if all rows repeat the last ones although they should differ."""
        last, self._last = self._last, ranges
        if last is not None and last.shape[1:] == ranges.shape[1:]:
            if has_turned and np.array_equal(ranges[0], last[-1]) and _is_one_row(ranges):
                return True
            if np.array_equal(ranges[0], last[0]) and np.array_equal(ranges, last):
                return self._has_moved(track)
        self._changed = self._now
        return False

    def _has_moved(self, track: PoseTrack) -> bool:
        """Return true if the robot has moved since the ranges last changed."""
        if not np.isfinite(track.latest):
            return False
        before, now = track.at(np.array([self._changed, self._now]))
        way = float(np.hypot(*(now - before)[:2]))
        turn = 2 * float(np.arccos(min(1.0, abs(before[3:] @ now[3:]))))
        return way > _MOVED or turn > _TURNED

    def _arrive(self) -> None:
        """Record an arrival, and learn the usual time from one to the next."""
        assert self._arrival is not None
        interval = self._now - self._arrival
        self._arrival, self._reason = self._now, ""
        if not 0.0 < interval <= self._limit:
            return
        self._intervals.append(interval)
        if len(self._intervals) >= _KNOWN_INTERVALS:
            median = sorted(self._intervals)[len(self._intervals) // 2]
            own = self._config.periods * median
            self._limit = max(self._config.timeout, own)


def _has_values(ranges: NDArray[np.float32]) -> bool:
    """Return true if some number is a distance: infinity is no return, NaN no measurement."""
    if not len(ranges):
        return False
    return bool(np.isfinite(ranges[0]).any()) or bool(np.isfinite(ranges).any())


def _is_one_row(ranges: NDArray[np.float32]) -> bool:
    """Return true if all rows are equal."""
    return bool((ranges[1:] == ranges[:-1]).all())
