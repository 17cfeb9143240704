"""State of the robot's filter: what each number is, by index.

The constants below name each element:

====== ============================================================================
0-2    roll, pitch, yaw of ``base_footprint`` in the map [rad], intrinsic z-y-x
3-5    bias of the gyro [rad/s]
6-8    position of ``base_footprint`` in the map [m]
9-10   forward speed, and lateral speed beyond what turning on a slope explains [m/s]
11-12  hard iron: magnetic field of the robot itself, forward and left [uT]
13     slowly changing error of the compass heading, beyond hard iron [rad]
14-15  time-correlated error of the satellite fixes, east and north [m]
16-17  bias of the accelerometer, forward and lateral [m/s2]
18     scale of the wheels: share by which they read too fast on level ground
19     slip on slopes: that share per sine of a climb
====== ============================================================================

Attitude and gyro bias come first: a sigma point differs from the mean in them only if it lies along
one of the first six rows of the covariance's Cholesky factor. Process and measurements are
affine in all other states, so that the points along the other rows need not be drawn; see
``ukf``. Of the 13 that are left, seven have sines of their own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ROLL, PITCH, YAW = 0, 1, 2
GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z = 3, 4, 5
X, Y, Z = 6, 7, 8
SPEED, LATERAL_SPEED = 9, 10
HARD_IRON_X, HARD_IRON_Y, COMPASS_ERROR = 11, 12, 13
GNSS_EAST, GNSS_NORTH = 14, 15
ACCEL_BIAS_X, ACCEL_BIAS_Y = 16, 17
WHEEL_SCALE, SLOPE_SLIP = 18, 19

STATES = 20
"""Number of states."""

ATTITUDE = slice(ROLL, YAW + 1)
GYRO_BIAS = slice(GYRO_BIAS_X, GYRO_BIAS_Z + 1)
POSITION = slice(X, Z + 1)
HORIZONTAL = slice(X, Y + 1)
HARD_IRON = slice(HARD_IRON_X, HARD_IRON_Y + 1)
GNSS_ERROR = slice(GNSS_EAST, GNSS_NORTH + 1)
ACCEL_BIAS = slice(ACCEL_BIAS_X, ACCEL_BIAS_Y + 1)

ANGULAR = np.arange(STATES) <= YAW
"""True for states that are angles, shape (20,)."""


class Belief(NamedTuple):
    """What the filter believes, and how many measurements led to it.

    Attributes:
        x: State, shape (20,).
        P: Covariance, shape (20, 20).
        counts: Table of counts by kind of measurement, int64, shape (6, 4); see ``filter_period``.
    """

    x: NDArray[np.float64]
    P: NDArray[np.float64]
    counts: NDArray[np.int64]
