"""Sigma points of the robot's filter with the sines of their attitude, and the filter's buffers.

Process and measurements call these functions; which points are drawn, and why, is told in ``ukf``
and ``filter_state``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import BodyParameters, FilterModel
from andabata.localization.filter_state import ANGULAR, LATERAL_SPEED, ROLL, STATES
from andabata.localization.ukf import Transform, allocate_transform, draw_sigma_points
from terrain.kernel import borrowing_kernel, inlined_kernel

ROWS = 6
"""Number of rows of the Cholesky factor that points are drawn along: the first ones, which change
attitude and gyro bias."""

ATTITUDE_ROWS = 3
"""Number of those rows that change the attitude, on which the compass heading depends."""

SIN_ROLL, COS_ROLL, SIN_PITCH, COS_PITCH, SIN_YAW, COS_YAW, CREEP, _TRIG_COLUMNS = range(8)
"""Columns of the table of a point's attitude, and their number."""


class Workspace(NamedTuple):
    """Buffers of the filter, allocated once.

    Attributes:
        process: Transform of what the process moves: attitude and position.
        gravity: Transform of the specific force.
        compass: Transform of the compass heading.
        trig: Sine and cosine of roll, pitch and yaw of each point, and its share of the creep,
            shape (13, 7).
        cross: Covariance of a linear measurement and the state, shape (3, 20).
        S: Covariance of a linear measurement, shape (3, 3).
        innovation: Measurement less expectation, shape (3,).
        number: Covariance of a measurement of one number and the state, shape (20,).
        kept_state: State before a correction, shape (20,).
        kept_covariance: Covariance before a correction, shape (20, 20).
        angular: 1 for states that are angles, as ``ANGULAR``, uint8, shape (20,).
    """

    process: Transform
    gravity: Transform
    compass: Transform
    trig: NDArray[np.float64]
    cross: NDArray[np.float64]
    S: NDArray[np.float64]
    innovation: NDArray[np.float64]
    number: NDArray[np.float64]
    kept_state: NDArray[np.float64]
    kept_covariance: NDArray[np.float64]
    angular: NDArray[np.uint8]

    @classmethod
    def allocate(cls) -> "Workspace":
        """Return new buffers."""
        n, seen = STATES, LATERAL_SPEED + 1
        return cls(
            process=allocate_transform(n, 6, ROWS, seen),
            gravity=allocate_transform(n, 3, ROWS, seen),
            compass=allocate_transform(n, 1, ATTITUDE_ROWS, ATTITUDE_ROWS),
            trig=np.zeros((2 * ROWS + 1, _TRIG_COLUMNS)),
            cross=np.zeros((3, n)),
            S=np.zeros((3, 3)),
            innovation=np.zeros(3),
            number=np.zeros(n),
            kept_state=np.zeros(n),
            kept_covariance=np.zeros((n, n)),
            angular=ANGULAR.astype(np.uint8),
        )


@borrowing_kernel
def draw_points(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    angles: int,
    model: FilterModel,
    transform: Transform,
    trig: NDArray[np.float64],
) -> bool:
    """Draw the sigma points of a transform, and fill the sines of their attitude.

    Args:
        x: State, shape (20,).
        P: Covariance, shape (20, 20).
        angles: Number of angles whose sines are filled: 2 without that of the yaw.
        model: Parameters of the filter.
        transform: Buffers of the transform.
        trig: Table of the points' attitude, filled, shape (13, 7).

    Returns:
        True if the covariance is positive definite, as far as it is factorised.
    """
    points = transform.points
    if not draw_sigma_points(x, P, model.weights.reach, transform.U, points):
        return False
    rows = len(transform.U)
    for k in range(2 * rows + 1):
        # Points along a row of the Cholesky factor have the angles before it of the mean.
        same = (k - 1) % rows if k > 0 else 0
        for a in range(angles):
            if a < same:
                trig[k, 2 * a], trig[k, 2 * a + 1] = trig[0, 2 * a], trig[0, 2 * a + 1]
            else:
                trig[k, 2 * a] = np.sin(points[k, a])
                trig[k, 2 * a + 1] = np.cos(points[k, a])
        if same > ROLL:
            trig[k, CREEP] = trig[0, CREEP]
        else:
            trig[k, CREEP] = np.tanh(trig[k, SIN_ROLL] / model.body.creep_slope)
    return True


@inlined_kernel
def sliding_speed(
    k: int, yaw_rate: float, body: BodyParameters, trig: NDArray[np.float64]
) -> float:
    """Return the speed to the right of a point [m/s] that turns at a yaw rate [rad/s].

    A turning body creeps down a cross slope and turns about a point uphill of its middle, as the
    kinematic plant does.
    """
    return abs(yaw_rate) * body.creep * trig[k, CREEP] + yaw_rate * body.pivot * trig[k, SIN_PITCH]
