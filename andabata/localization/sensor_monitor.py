"""Supervision of the filter's sensors: timeouts, long rejection, and warnings."""

from collections import deque
from collections.abc import Collection, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_state import YAW, X, Y
from andabata.localization.localizer import Health
from andabata.localization.ukf_config import UkfConfig
from terrain.kernel import borrowing_kernel

_NONE: Mapping[str, str] = MappingProxyType({})
"""No warnings."""

_MEDIAN_OF = 5
"""Number of fixes whose median offset is compared."""

_TIME_TOLERANCE = 1e-9
"""Difference of two times that counts as none [s]."""

_KNOWN_INTERVALS = 3
"""Number of times from fix to fix after which the receiver's own period is known."""

_LAST_INTERVALS = 9
"""Number of those whose median is the period: a fix that is lost doubles only one."""

_LEAST_SILENCE = 1.0
"""Time without fixes that is accepted of a receiver of whatever period [s]."""


class SensorMonitor:
    """Record of when each sensor last sent data, and when its data were last accepted.

    A sensor that sends data which are all rejected for long suggests that the filter is wrong: its
    covariance is then inflated, each time by twice the standard deviation of the time before.
    """

    def __init__(self, config: UkfConfig, stamp: float) -> None:
        """Begin as if every sensor had just sent accepted data.

        Args:
            config: Timeouts and limits.
            stamp: Time of the start [s].
        """
        self._config = config
        self._received = dict.fromkeys(("imu", "wheels", "compass", "gnss"), stamp)
        self._accepted = dict.fromkeys(("wheels", "compass", "gnss"), stamp)
        self._timeouts = (
            ("imu", self._received, config.imu_timeout),
            ("wheels", self._accepted, config.wheel_timeout),
            ("compass", self._accepted, config.compass_timeout),
        )
        self._fix_intervals: deque[float] = deque(maxlen=_LAST_INTERVALS)
        self._no_fix = stamp  # Last report of the receiver that it has none.
        self._impossible: float | None = None  # First impossible fix since the last good one.
        self._inflated = dict(self._accepted)
        self._inflations = dict.fromkeys(self._accepted, 0)
        # Offsets [m] from the estimate of fixes since the last accepted one, and the way since [m].
        self._offsets: list[NDArray[np.float64]] = []
        self._way = 0.0
        self._has_position = False
        self._has_jumped = False  # Since the last accepted fix one was out of reach.

    def receive(self, sensor: str, stamp: float) -> None:
        """Record that a sensor sent data at a time [s]."""
        interval = stamp - self._received[sensor]
        if sensor == "gnss" and 0.0 < interval <= self._config.gnss_timeout:
            self._fix_intervals.append(interval)
        if sensor == "gnss":
            self._impossible = None
        self._received[sensor] = stamp

    def accept(self, sensor: str, stamp: float) -> None:
        """Record that the filter accepted data of a sensor at a time [s], which it sent then."""
        self.receive(sensor, stamp)
        self._accepted[sensor] = self._inflated[sensor] = stamp
        self._inflations[sensor] = 0
        if sensor == "gnss":
            self._offsets.clear()
            self._way, self._has_jumped = 0.0, False
            self._has_position = True

    def contradicts_fixes(self, stamp: float) -> bool:
        """Return true if fixes arrive and have not been accepted for long [s]."""
        silence = stamp - self._accepted["gnss"]
        return self.has_fixes(stamp) and silence > self._config.gnss_timeout

    def has_fixes(self, stamp: float) -> bool:
        """Return true if fixes arrive, accepted or not."""
        return stamp - self._received["gnss"] <= self._config.gnss_timeout

    def report_no_fix(self, stamp: float) -> None:
        """Record that the receiver reported at a time [s] that it has no fix."""
        self._no_fix = stamp

    def report_impossible_fix(self, stamp: float) -> None:
        """Record that the receiver sent numbers at a time [s] that none can have."""
        if self._impossible is None:
            self._impossible = stamp

    def longest_gap(self, periods: float) -> float:
        """Return the time of some of the receiver's own periods [s].

        Args:
            periods: Number of periods, from fix to fix.
        """
        intervals = sorted(self._fix_intervals)
        if len(intervals) < _KNOWN_INTERVALS:
            return self._config.gnss_timeout
        return max(periods * intervals[len(intervals) // 2], _LEAST_SILENCE)

    def _fix_warning(self, now: float) -> str | None:
        """Return the warning about missing fixes at a time [s], None if none is due."""
        config, received = self._config, self._received["gnss"]
        since, last = now - self._accepted["gnss"], max(received, self._no_fix)
        silence, loss = map(self.longest_gap, (config.gnss_periods, config.no_fix_periods))
        if self._impossible is not None:
            return f"gnss: sends numbers that no fix can have, for {now - self._impossible:.1f} s"
        if now - last > silence + _TIME_TOLERANCE:
            why = "no valid reading arrives"
        elif now - received > loss + _TIME_TOLERANCE:
            why = "the receiver has no fix"
        elif since > max(config.gnss_timeout, loss) + _TIME_TOLERANCE:
            why = "what arrives contradicts the estimate"
        else:
            return None
        return f"gnss: not accepted for {since:.1f} s, {why}"

    def drive(self, way: float) -> None:
        """Record a way that was driven, forward or backward [m]."""
        self._way += abs(way)

    def add_offset(self, offset: NDArray[np.float64]) -> None:
        """Record the offset of a fix from the estimate [m], shape (2,)."""
        self._offsets.append(offset)
        farthest = self._config.jump_offset + 2 * self._way
        self._has_jumped |= self._has_position and float(np.hypot(*offset)) > farthest

    def inflation(self, sensor: str, stamp: float) -> float | None:
        """Return the factor of the standard deviation that is due to be added, None if none is.

        Args:
            sensor: Name of the sensor, ``compass`` or ``gnss``.
            stamp: Time at the end of the period [s].
        """
        if self._received[sensor] != stamp:
            return None
        config = self._config
        time_out = config.inflation_time
        if sensor == "gnss" and self._is_out_of_reach():
            time_out = config.jump_inflation_time
        elif sensor == "gnss" and self._looks_like_multipath():
            time_out = config.multipath_inflation_time
        if not stamp - self._inflated[sensor] > time_out:
            return None
        factor = 2 ** self._inflations[sensor]
        self._inflations[sensor] += 1
        self._inflated[sensor] = stamp
        return float(factor)

    def _looks_like_multipath(self) -> bool:
        """Return true if all fixes since the last accepted one are off by the same."""
        if len(self._offsets) < 2 * _MEDIAN_OF or self._inflations["gnss"]:
            return False
        first = np.median(self._offsets[:_MEDIAN_OF], axis=0)
        last = np.median(self._offsets[-_MEDIAN_OF:], axis=0)
        near = np.hypot(*last) < self._config.multipath_offset
        return bool(near and np.hypot(*(last - first)) < self._config.multipath_spread)

    def _is_out_of_reach(self) -> bool:
        """Return true if fixes lie farther off than the robot can have driven since the last one.

        Before any fix was accepted the position itself may be wrong.
        """
        if not (self._has_position and self._offsets):
            return False
        offset = np.median(self._offsets[-_MEDIAN_OF:], axis=0)
        return bool(np.hypot(*offset) > self._config.multipath_offset + 2 * self._way)

    def _jump(self) -> float | None:
        """Return how far off the last fix is [m] if the robot cannot have driven there."""
        if not (self._has_position and self._offsets):
            return None
        return float(np.hypot(*self._offsets[-1])) if self._has_jumped else None

    def warnings(
        self,
        now: float,
        P: NDArray[np.float64],
        doubted: Collection[str] = (),
        arrivals: Mapping[str, str] = _NONE,
    ) -> tuple[str, ...]:
        """Return what is wrong with sensors and estimate, one text each.

        Args:
            now: Stamp of the state [s].
            P: Covariance of the state, shape (20, 20).
            doubted: Sensors that are not believed, for a reason that is told elsewhere.
            arrivals: Warnings about what arrives too seldom or too late, by sensor; those of a
                sensor with another warning are left out.
        """
        found = []
        for name, stamps, limit in self._timeouts:
            silence = now - stamps[name]
            if silence > limit + _TIME_TOLERANCE and name not in doubted:
                found.append(self._overdue(name, silence, now - self._received[name] > limit))
        if "gnss" not in doubted and (text := self._fix_warning(now)) is not None:
            found.append(text)
        jump = self._jump()
        if jump is not None and not any(text.startswith("gnss") for text in found):
            found.append(f"gnss: off by {jump:.0f} m, farther than the robot can have driven")
        if arrivals:
            named = {text.split(":")[0] for text in found}.union(doubted)
            found += [text for name, text in arrivals.items() if name not in named]
        position, yaw = _uncertainty(P)
        most, widest = self._config.lost_position, self._config.lost_yaw
        if position > most:
            found.append(f"position: uncertain by {position:.1f} m, limit {most:.3g} m")
        if yaw > widest:
            degrees = f"{np.rad2deg(yaw):.0f} degrees, limit {np.rad2deg(widest):.0f}"
            found.append(f"heading: uncertain by {degrees}")
        return tuple(found)

    def _overdue(self, name: str, seconds: float, is_silent: bool) -> str:
        """Return the warning about a sensor that was not heard, or not believed, for a time [s]."""
        if name == "imu" or (name == "wheels" and is_silent):
            return f"{name}: silent for {seconds:.1f} s"
        why = "no valid reading arrives" if is_silent else "what arrives contradicts the estimate"
        return f"{name}: not accepted for {seconds:.1f} s, {why}"


@borrowing_kernel
def _uncertainty(P: NDArray[np.float64]) -> tuple[float, float]:
    """Return the longest half axis of the horizontal error ellipse [m], and the heading's sigma."""
    east, north, both = P[X, X], P[Y, Y], P[X, Y]
    position = np.sqrt((east + north) / 2 + np.hypot((east - north) / 2, both))
    return position, np.sqrt(P[YAW, YAW])


def health_of(warnings: tuple[str, ...], has_fixes: bool = True) -> Health:
    """Return the health for some warnings of ``SensorMonitor.warnings``.

    A robot is lost without a position, or without both IMU and wheels. Without a heading it has a
    way out as long as inertial unit and wheels work and fixes arrive: it is disoriented, else lost.

    Args:
        warnings: Warnings.
        has_fixes: True if fixes arrive, accepted or not.
    """
    if not warnings:
        return Health.OK
    sources = {text.split(":")[0] for text in warnings}
    if "position" in sources or {"imu", "wheels"} <= sources:
        return Health.LOST
    if "heading" in sources:
        stuck = {"imu", "wheels"} & sources or not has_fixes
        return Health.LOST if stuck else Health.DISORIENTED
    return Health.DEGRADED
