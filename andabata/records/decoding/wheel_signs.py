"""Signs of the sides' wheel speeds, and of the accelerations, by the gyro.

| the gyro's turn about the measured vertical | what is wrong | action |
|---|---|---|
| follows the sum of the sides, not their difference | one side is counted backwards | reversed |
| is opposite to the wheels', gravity measured downwards | accelerations are negated | reversed |
| is opposite to the wheels', which drive backwards | both sides are counted backwards | reversed |
| is opposite to the wheels', which drive ahead | left and right are swapped | reported |
"""

import numpy as np
from numpy.typing import NDArray

from andabata.records.decoding.yaw_increments import YawIncrements, correlation_of, fitted_slope

Rows = NDArray[np.float64]

MIN_TURN = 0.3
"""Least root of the summed squares of yaw increments by which readings are judged [rad]."""

MIN_CORRELATION = 0.8
"""Least correlation of the yaw increments of two sensors that saw the same turns."""

_MAX_CORRELATION = 0.5
"""Largest correlation of turns that wheels report and the gyro does not see."""


def mirrored_side(turns: YawIncrements, mirrored: YawIncrements, rows: Rows) -> int | None:
    """Return the side that is counted backwards, 0 for left, 1 for right, None without one.

    Args:
        turns: Yaw increments with the wheels as they come.
        mirrored: Yaw increments with the right side reversed.
        rows: Stamp, left and right wheel speed, shape (k, 3).
    """
    spin, drive = (float(np.linalg.norm(each.wheels)) for each in (turns, mirrored))
    # Wheels that drive more than they turn are right; only a mirrored side makes it look otherwise.
    if spin < MIN_TURN or spin < drive:
        return None
    if abs(correlation_of(turns.wheels, turns.gyro)) > _MAX_CORRELATION:
        return None
    slope = fitted_slope(mirrored.wheels, mirrored.gyro, MIN_TURN, MIN_CORRELATION)
    if slope is not None:
        return int(slope > 0)
    if float(np.linalg.norm(turns.gyro)) > MIN_TURN:
        return None
    return int(float(np.nanmean(rows[:, 1] - rows[:, 2])) > 0)  # Most driving is ahead.


def is_force_negated(slope: float | None, forces: Rows) -> bool:
    """Return whether accelerations are gravity instead of specific force.

    The vertical is then measured upside down, so that the gyro seems to turn against the wheels;
    an IMU that is mounted upside down turns with them.

    Args:
        slope: Slope of the gyro's turns over the wheels', None where it is uncertain.
        forces: Accelerations as they come, shape (k, 3).
    """
    if slope is None or slope >= 0:
        return False
    up = np.nanmedian(forces, axis=0)
    return bool(up[int(np.argmax(np.abs(up)))] < 0)
