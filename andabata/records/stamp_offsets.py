"""Constant offsets between the stamps of gyro, compass and wheels, by the turns that all three see.

A driver that stamps readings when they arrive, or a sensor with a filter of its own, shifts all of
them by the same time. The changes of yaw over a second are compared at many lags: the best
correlation is where the turns lie on each other. Which of three sensors is shifted, the other two
say. A robot turns up to a tenth of a second later than its wheels, which means nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.records import topics
from andabata.records.decoding.yaw_increments import (
    common_runs,
    heading_of,
    turned_angle,
    up_direction,
)
from andabata.records.topics import Topic

Rows = NDArray[np.float64]

_STEP = 0.05
"""Time between two instants at which changes of yaw are compared [s]."""

_HALF_WINDOW = 0.5
"""Half of the time over which yaw changes [s]."""

_MAX_LAG = 0.4
"""Largest lag that is sought [s]; beyond, the clocks differ (``clocks``)."""

_LAG_STEP = 0.01
"""Step of the lags [s]; the best one is interpolated between them."""

_SLOPE_STEP = 0.2
"""Time before and after an instant from which a rate of change is taken [s]: above the noise."""

_COMPASS = (-0.05, 0.05)
"""Bounds of the gyro's lag behind a compass that is filtered, with sound stamps [s]."""

_WHEELS = (-0.05, 0.12)
"""Bounds of the gyro's lag behind the wheels with sound stamps [s]: the robot follows them."""

_SIGMAS = 4.0
"""Margin around these bounds, as a multiple of the lag's standard deviation."""

_MIN_CORRELATION = 0.8
"""Least correlation of turns at the best lag."""

_FEWEST = 100
"""Number of instants by which a lag is judged: five seconds."""


@dataclass(frozen=True)
class Lag:
    """Lag of one sensor's turns behind those of another.

    Attributes:
        seconds: Lag [s]; positive where the first sensor's stamps are later.
        sigma: Standard deviation [s].
    """

    seconds: float
    sigma: float

    def is_within(self, bounds: tuple[float, float]) -> bool:
        """Return whether it is within bounds [s], or noise may explain that it is not."""
        margin = _SIGMAS * self.sigma
        return bounds[0] - margin <= self.seconds <= bounds[1] + margin


def yaw_lag(one: Rows, other: Rows) -> Lag | None:
    """Return the lag of a sensor's turns behind those of another, None where it is uncertain.

    Args:
        one: Stamp [s] and yaw angle in any unit, unwrapped, in order of time, shape (k, 2).
        other: Stamp and yaw angle of the other sensor, shape (j, 2).
    """
    begin, end = (pick(one[at, 0], other[at, 0]) for pick, at in ((max, 0), (min, -1)))
    margin = _HALF_WINDOW + _MAX_LAG
    runs = common_runs([one[:, 0], other[:, 0]], begin, end)
    parts = [np.arange(a + margin, b - margin, _STEP) for a, b in runs]
    instants = np.concatenate([np.zeros(0), *parts])
    if len(instants) < _FEWEST:
        return None
    lags = np.arange(-round(_MAX_LAG / _LAG_STEP), round(_MAX_LAG / _LAG_STEP) + 1) * _LAG_STEP
    still = _changes(other, instants)
    products = np.array([_correlation(_changes(one, instants + lag), still) for lag in lags])
    best = int(np.argmax(np.abs(products)))
    if abs(products[best]) < _MIN_CORRELATION or not 0 < best < len(lags) - 1:
        return None
    left, middle, right = np.abs(products[best - 1 : best + 2])
    bend = left - 2 * middle + right
    seconds = float(lags[best] + (_LAG_STEP * (left - right) / (2 * bend) if bend < 0 else 0.0))
    return Lag(seconds, _sigma(one, still, instants + seconds))


def _changes(angles: Rows, instants: Rows) -> Rows:
    """Return the changes of an angle over a second around some instants, shape (n,)."""
    after, before = (
        np.interp(instants + shift, angles[:, 0], angles[:, 1])
        for shift in (_HALF_WINDOW, -_HALF_WINDOW)
    )
    return np.asarray(after - before)


def _correlation(a: Rows, b: Rows) -> float:
    """Return the correlation of two changes of yaw about their means; 0 where one is constant."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0 else 0.0


def _sigma(one: Rows, still: Rows, instants: Rows) -> float:
    """Return the standard deviation of a lag by what remains of the changes at it [s]."""
    moved = _changes(one, instants)
    later, earlier = (_changes(one, instants + step) for step in (_SLOPE_STEP, -_SLOPE_STEP))
    slopes = (later - earlier) / (2 * _SLOPE_STEP)
    columns = np.column_stack([moved, np.ones(len(moved))])
    factors = np.linalg.lstsq(columns, still, rcond=None)[0]
    rest = still - columns @ factors
    products = np.correlate(rest, rest, "full")[len(rest) - 1 :]
    if not products[0] > 0:
        return 0.0
    positive = int(np.argmax(products <= 0)) or len(products)
    number = len(rest) / (1 + 2 * float((products[1:positive] / products[0]).sum()))
    slope = abs(float(factors[0])) * float(np.sqrt(np.mean(slopes**2)))
    spread = float(np.sqrt(np.mean(rest**2)))
    return spread / (slope * float(np.sqrt(number))) if slope > 0 else np.inf


def offset_remark(imu: Rows, compass: Rows | None, wheels: Rows | None) -> tuple[Topic, str] | None:
    """Return a remark on the sensor whose stamps are shifted, None without one.

    Args:
        imu: Stamp [s], angular velocity and specific force, in order of time, shape (k, 7).
        compass: Stamp [s] and field, shape (j, 4), or None.
        wheels: Stamp [s], left and right, shape (i, 3), or None.
    """
    up = up_direction(imu)
    gyro = np.column_stack([imu[:, 0], turned_angle(imu[:, 0], imu[:, 1:4] @ up)])
    by_compass = by_wheels = None
    if compass is not None and len(compass) > 1:
        by_compass = yaw_lag(
            gyro, np.column_stack([compass[:, 0], heading_of(compass[:, 1:4], up)])
        )
    if wheels is not None and len(wheels) > 1:
        turned = turned_angle(wheels[:, 0], wheels[:, 2] - wheels[:, 1])
        by_wheels = yaw_lag(gyro, np.column_stack([wheels[:, 0], turned]))
    return _remark(by_compass, by_wheels)


def _remark(by_compass: Lag | None, by_wheels: Lag | None) -> tuple[Topic, str] | None:
    """Return the remark on the lags of the gyro behind compass and wheels; see above."""
    compass_fits = by_compass is None or by_compass.is_within(_COMPASS)
    wheels_fit = by_wheels is None or by_wheels.is_within(_WHEELS)
    if compass_fits and wheels_fit:
        return None
    if by_compass is None or by_wheels is None:
        return _pair(topics.MAG, by_compass) if by_compass else _pair(topics.ENCODERS, by_wheels)
    if compass_fits:
        return topics.ENCODERS, _shifted(topics.ENCODERS, -by_wheels.seconds, "gyro and compass")
    between = Lag(
        by_wheels.seconds - by_compass.seconds, float(np.hypot(by_wheels.sigma, by_compass.sigma))
    )
    if between.is_within(_WHEELS):
        # Compass and wheels agree; where the gyro agrees with the wheels, too, two are possible.
        if wheels_fit:
            return _pair(topics.MAG, by_compass)
        return topics.IMU, _shifted(topics.IMU, by_compass.seconds, "compass and wheels")
    if wheels_fit:
        return topics.MAG, _shifted(topics.MAG, -by_compass.seconds, "gyro and wheels")
    return topics.IMU, (
        f"turns come {_words(by_compass.seconds, 'after', 'before')} those of {topics.MAG.ros1} "
        f"and {_words(by_wheels.seconds, 'after', 'before')} those of {topics.ENCODERS.ros1}: "
        "each of the three has stamps of its own"
    )


def _pair(other: Topic, lag: Lag | None) -> tuple[Topic, str] | None:
    """Return the remark on two sensors of which one is shifted, and nothing says which."""
    if lag is None:
        return None
    text = f"turns come {_words(lag.seconds, 'after', 'before')} those of {other.ros1}"
    choices = f"{_option(topics.IMU, lag.seconds)} or {_option(other, -lag.seconds)} shifts one"
    return topics.IMU, f"{text}: {choices}"


def _shifted(topic: Topic, late: float, others: str) -> str:
    """Return the text on a topic whose stamps are late [s] against two others."""
    text = f"stamps are {_words(late, 'late', 'early')} by the turns of {others}"
    return f"{text}: {_option(topic, late)} shifts them"


def _words(seconds: float, positive: str, negative: str) -> str:
    """Return a time with the word of its sign."""
    return f"{abs(seconds):.2f} s {positive if seconds > 0 else negative}"


def _option(topic: Topic, late: float) -> str:
    """Return the option that shifts the stamps of a topic that are late [s]."""
    return f"--time-offset {topic.ros1}={-late:.2f}"
