"""Covariance of the filter's state at its start."""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_state import (
    ACCEL_BIAS,
    COMPASS_ERROR,
    GNSS_ERROR,
    GYRO_BIAS,
    HARD_IRON,
    LATERAL_SPEED,
    PITCH,
    ROLL,
    SLOPE_SLIP,
    SPEED,
    STATES,
    WHEEL_SCALE,
    YAW,
    X,
    Y,
    Z,
)
from andabata.localization.ukf_config import UkfConfig

MIN_SLOW_ERROR = 1e-3
"""Least standard deviation of slow errors of fixes [m] and compass [rad]: the covariance has to be
positive definite."""


def initial_covariance(config: UkfConfig, rough: bool) -> NDArray[np.float64]:
    """Return the covariance at a start, shape (20, 20).

    Args:
        config: Parameters of the filter.
        rough: True if the pose comes from the first fix, the compass and gravity.
    """
    noise = config.noise
    initial = config.rough_initial_sigma if rough else config.initial_sigma
    sigma = np.empty(STATES)
    sigma[ROLL] = sigma[PITCH] = initial.tilt
    sigma[YAW] = initial.yaw
    sigma[GYRO_BIAS] = initial.gyro_bias
    sigma[X] = sigma[Y] = initial.position
    sigma[Z] = initial.height
    sigma[SPEED] = initial.speed
    sigma[LATERAL_SPEED] = max(initial.speed, noise.lateral_speed)
    sigma[HARD_IRON] = initial.hard_iron
    sigma[COMPASS_ERROR] = max(noise.compass_error, MIN_SLOW_ERROR)
    sigma[GNSS_ERROR] = max(noise.gnss_error, MIN_SLOW_ERROR)
    sigma[ACCEL_BIAS] = initial.accel_bias
    sigma[WHEEL_SCALE] = initial.wheel_scale
    sigma[SLOPE_SLIP] = initial.slope_slip
    return np.diag(sigma**2)
