"""Rows in place of an inertial unit that is silent: the yaw rate comes from the wheels."""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.measurements import (
    FORCE,
    GYRO,
    LEFT,
    MAX_WHEEL_SPEED,
    RIGHT,
    STAMP,
)
from andabata.machine.clock import TICK

_MAX_STEPS = 100
"""Largest number of prediction steps that bridge a gap."""

BRIDGE_GYRO_NOISE = 0.05
"""Gyro noise of a prediction whose yaw rate comes from the wheels [rad/sqrt(s)]."""


def bridging_rows(
    begin: float,
    end: float,
    gyro_bias: NDArray[np.float64],
    wheels: NDArray[np.float64],
    yaw_rate_per_wheel: float,
) -> NDArray[np.float64]:
    """Return inertial rows over a gap, without a specific force, which is NaN.

    Args:
        begin: Stamp of the state before the gap [s].
        end: End of the gap [s], which has no row of its own.
        gyro_bias: Estimated bias of the gyro [rad/s], shape (3,): with it the rotation is none.
        wheels: Encoder rows that arrived, shape (k, 3).
        yaw_rate_per_wheel: Yaw rate per difference of right and left wheel speed.

    Returns:
        Rows as in ``Measurements.imu``, shape (j, 7).
    """
    step = max(TICK, (end - begin - TICK) / _MAX_STEPS)
    stamps = np.arange(begin + step, end - TICK / 2, step)
    rows = np.full((len(stamps), 7), np.nan)
    rows[:, STAMP], rows[:, GYRO:FORCE] = stamps, gyro_bias
    # Damaged rows count as none: a recording may have left them out.
    wheels = wheels[(np.abs(wheels[:, LEFT : RIGHT + 1]) < MAX_WHEEL_SPEED).all(axis=1)]
    if len(wheels):
        difference = float((wheels[:, RIGHT] - wheels[:, LEFT]).mean())
        rows[:, FORCE - 1] += difference * yaw_rate_per_wheel
    return rows
