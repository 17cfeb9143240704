"""Measurements of one period of the filter, and the columns of their rows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

STAMP, GYRO, FORCE = 0, 1, 4
"""First columns of an inertial row: stamp [s], angular velocity [rad/s], specific force [m/s2]."""

MAX_GYRO_RATE = 50.0
"""Largest gyro reading that is accepted [rad/s]: no robot turns faster."""

MAX_WHEEL_SPEED = 500.0
"""Wheel speed that no encoder of a robot measures [rad/s]."""

MAX_FORCE = 500.0
"""Largest specific force that counts [m/s2]: no inertial unit of a robot measures more."""

MAX_FLUX = 1e6
"""Largest component of a flux density that counts, in whatever unit: the Earth's is 65,000 nT."""

LEFT, RIGHT = 1, 2
"""Columns of an encoder row [rad/s]."""

HORIZONTAL_SIGMA, VERTICAL_SIGMA = 4, 5
"""Columns of a fix after stamp, x, y, z [m]."""

STAMP_TOLERANCE = 1e-9
"""Largest difference of two stamps that count as the same instant [s]."""


class Measurements(NamedTuple):
    """Measurements of a period, oldest first.

    Attributes:
        imu: Rows of stamp [s], angular velocity [rad/s], specific force [m/s2]; shape (k, 7).
        wheels: Rows of stamp [s], left, right wheel speed [rad/s]; shape (k, 3).
        mag: Rows of stamp [s], magnetic flux density in the base frame [uT]; shape (k, 4).
        gnss: Rows of stamp [s], x, y, z, horizontal and vertical sigma [m]; shape (k, 6).
    """

    imu: NDArray[np.float64]
    wheels: NDArray[np.float64]
    mag: NDArray[np.float64]
    gnss: NDArray[np.float64]
