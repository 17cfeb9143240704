"""Sigma points of the robot's filter, and the covariance of those that are not drawn.

Process and measurements call these functions; which points are drawn, and why, is told in ``ukf``
and ``filter_state``. Points share buffers that are allocated once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import BodyParameters, FilterModel
from andabata.localization.filter_state import ANGULAR, LATERAL_SPEED, ROLL, STATES
from andabata.localization.ukf import draw_sigma_points
from terrain.kernel import inlined_kernel, kernel

ROWS = 6
"""Number of rows of the Cholesky factor that points are drawn along: the first ones, which change
attitude and gyro bias."""

ATTITUDE_ROWS = 3
"""Number of those rows that change the attitude, on which the magnetic field depends."""

SIN_ROLL, COS_ROLL, SIN_PITCH, COS_PITCH, SIN_YAW, COS_YAW, _CREEP, _TRIG_COLUMNS = range(8)
"""Columns of the table of a point's attitude, and their number."""


class Workspace(NamedTuple):
    """Buffers of the filter, allocated once.

    Attributes:
        points: Sigma points, shape (13, 18).
        deviations: Deviations of the points from the first, shape (13, 18).
        factor: First rows of the covariance's Cholesky factor, shape (6, 18).
        rest: Covariance of the points that are not drawn, shape (18, 18).
        rest_cross: Covariance of these points and their expected measurement, shape (3, 18).
        predicted: Expected measurement of each point, shape (13, 3).
        expected: Expected measurement, shape (3,).
        innovation: Measurement less expectation, shape (3,).
        S: Covariance of the innovation, shape (3, 3).
        cross: Covariance of state and expected measurement, shape (3, 18).
        gain: Kalman gain, shape (3, 18).
        trig: Sine and cosine of roll, pitch and yaw of each point, and its share of the creep,
            shape (13, 7).
        angular: ``ANGULAR``, as compiled code takes it.
    """

    points: NDArray[np.float64]
    deviations: NDArray[np.float64]
    factor: NDArray[np.float64]
    rest: NDArray[np.float64]
    rest_cross: NDArray[np.float64]
    predicted: NDArray[np.float64]
    expected: NDArray[np.float64]
    innovation: NDArray[np.float64]
    S: NDArray[np.float64]
    cross: NDArray[np.float64]
    gain: NDArray[np.float64]
    trig: NDArray[np.float64]
    angular: NDArray[np.bool_]

    @classmethod
    def allocate(cls) -> "Workspace":
        """Return new buffers."""
        n, p = STATES, 2 * ROWS + 1
        return cls(
            points=np.zeros((p, n)),
            deviations=np.zeros((p, n)),
            factor=np.zeros((ROWS, n)),
            rest=np.zeros((n, n)),
            rest_cross=np.zeros((3, n)),
            predicted=np.zeros((p, 3)),
            expected=np.zeros(3),
            innovation=np.zeros(3),
            S=np.zeros((3, 3)),
            cross=np.zeros((3, n)),
            gain=np.zeros((3, n)),
            trig=np.zeros((p, _TRIG_COLUMNS)),
            angular=ANGULAR.copy(),
        )


@kernel
def _fill_trigonometry(rows: int, body: BodyParameters, workspace: Workspace) -> None:
    """Fill the sines and cosines of each point's attitude, and its share of the creep.

    Args:
        rows: Number of rows of the Cholesky factor that points were drawn along.
        body: Parameters of the robot.
        workspace: Buffers of the filter.
    """
    points, trig = workspace.points, workspace.trig
    for k in range(2 * rows + 1):
        # Points along a row of the Cholesky factor have the angles before it of the mean.
        same = (k - 1) % rows if k > 0 else 0
        for a in range(3):
            if a < same:
                trig[k, 2 * a], trig[k, 2 * a + 1] = trig[0, 2 * a], trig[0, 2 * a + 1]
            else:
                trig[k, 2 * a] = np.sin(points[k, a])
                trig[k, 2 * a + 1] = np.cos(points[k, a])
        if same > ROLL:
            trig[k, _CREEP] = trig[0, _CREEP]
        else:
            trig[k, _CREEP] = np.tanh(trig[k, SIN_ROLL] / body.creep_slope)


@inlined_kernel
def lateral_speed(k: int, yaw_rate: float, body: BodyParameters, workspace: Workspace) -> float:
    """Return the lateral speed of a point [m/s] that turns at a yaw rate [rad/s].

    A turning body creeps down a cross slope and turns about a point uphill of its middle, as the
    kinematic plant does.
    """
    trig = workspace.trig
    sliding = (
        abs(yaw_rate) * body.creep * trig[k, _CREEP] + yaw_rate * body.pivot * trig[k, SIN_PITCH]
    )
    return workspace.points[k, LATERAL_SPEED] - sliding


@kernel
def draw_points(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    rows: int,
    model: FilterModel,
    workspace: Workspace,
) -> bool:
    """Draw the sigma points along the first rows of the Cholesky factor, with their sines.

    Returns:
        True if the covariance is positive definite, as far as it is factorised.
    """
    factor, points = workspace.factor[:rows], workspace.points[: 2 * rows + 1]
    if not draw_sigma_points(x, P, model.weights.reach, factor, points):
        return False
    _fill_trigonometry(rows, model.body, workspace)
    return True


@inlined_kernel
def find_rest(P: NDArray[np.float64], i: int, rows: int, workspace: Workspace) -> float:
    """Fill a row of the covariance of the points that are not drawn, ``P - U' U``.

    Args:
        P: Covariance, shape (18, 18).
        i: State whose row of ``rest`` is filled, ``rows`` or more.
        rows: Number of rows of the Cholesky factor ``U`` that points were drawn along.
        workspace: Buffers of the filter.

    Returns:
        Variance of the state in these points.
    """
    factor, rest = workspace.factor, workspace.rest
    for j in range(STATES):
        rest[i, j] = P[i, j]
    for k in range(rows):
        share = factor[k, i]
        for j in range(STATES):
            rest[i, j] -= share * factor[k, j]
    return float(rest[i, i])
