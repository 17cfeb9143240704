"""An unscented Kalman filter (Merwe and Wan 2000), compiled; it knows no sensor.

The functions work on arrays that live as long as the filter. A caller draws sigma points, sends
them through its own model and hands them back. Before each correction the points are drawn afresh:
several sensors between two predictions would otherwise meet stale ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel


@dataclass(frozen=True)
class Spread:
    """Where the sigma points lie and what they weigh.

    Attributes:
        gain: Points lie ``gain`` columns of the covariance's Cholesky factor from the mean.
        mean: Weights of the mean, float64, shape (2 n + 1,).
        covariance: Weights of the covariance, float64, shape (2 n + 1,).
    """

    gain: float
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @classmethod
    def merwe(cls, n: int, alpha: float = 1.0, beta: float = 2.0, kappa: float = 0.0) -> "Spread":
        """Return the scaled points of Merwe for a state of ``n`` numbers.

        With the defaults no weight is negative, so that a covariance can't lose its definiteness.
        """
        from filterpy.kalman import MerweScaledSigmaPoints

        points = MerweScaledSigmaPoints(n, alpha, beta, kappa)
        gain = float(np.sqrt(alpha**2 * (n + kappa)))
        return cls(gain, np.array(points.Wm, dtype=float), np.array(points.Wc, dtype=float))


@kernel
def turn_of(angle):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return an angle [rad] wrapped to (-pi, pi]."""
    if -np.pi < angle <= np.pi:
        return angle
    return np.pi - (np.pi - angle) % (2 * np.pi)


@kernel
def draw_points(x, P, gain, L, points):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Draw sigma points around a mean.

    Point 0 is the mean, 1 to n lie on one side and n + 1 to 2 n on the other. Column ``j`` of a
    Cholesky factor is zero above row ``j``: point ``1 + j`` shares the numbers before ``j`` with
    the mean, which spares a model most of its sines.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        gain: See ``Spread``.
        L: Room for the Cholesky factor, shape (n, n).
        points: Room for the points, shape (2 n + 1, n).

    Returns:
        Whether the covariance is positive definite; if not, the points are worth nothing.
    """
    n = len(x)
    for j in range(n):
        rest = P[j, j]
        for k in range(j):
            rest -= L[j, k] * L[j, k]
        if not rest > 0.0:
            return False
        pivot = np.sqrt(rest)
        L[j, j] = pivot
        for i in range(j + 1, n):
            total = P[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = total / pivot
    for i in range(n):
        points[0, i] = x[i]
        for j in range(n):
            shift = gain * L[i, j] if j <= i else 0.0
            points[1 + j, i] = x[i] + shift
            points[1 + n + j, i] = x[i] - shift
    return True


@kernel
def combine_points(points, weights, weights_c, angular, mean, deviations, P):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Turn sigma points into mean and covariance.

    Angles are averaged as turns from point 0, so that a mean near pi is no mean near zero.

    Args:
        points: Shape (p, m).
        weights: Of the mean, shape (p,).
        weights_c: Of the covariance, shape (p,).
        angular: Which numbers are angles, bool, shape (m,).
        mean: Room for the mean, shape (m,).
        deviations: Room for the points' deviations from the mean, shape (p, m).
        P: Room for the covariance, shape (m, m).
    """
    p, m = points.shape
    for i in range(m):
        mean[i] = 0.0
        for j in range(m):
            P[i, j] = 0.0
    for k in range(p):
        for i in range(m):
            deviations[k, i] = points[k, i] - points[0, i]
    for i in range(m):  # Apart from the rest: a branch in there would empty the vector unit.
        if angular[i]:
            for k in range(p):
                deviations[k, i] = turn_of(deviations[k, i])
    for k in range(p):
        for i in range(m):
            mean[i] += weights[k] * deviations[k, i]
    for k in range(p):
        for i in range(m):
            deviations[k, i] -= mean[i]
        for i in range(m):
            share = weights_c[k] * deviations[k, i]
            for j in range(m):
                P[i, j] += share * deviations[k, j]
    for i in range(m):
        mean[i] += points[0, i]
        if angular[i]:
            mean[i] = turn_of(mean[i])
        for j in range(i):
            P[j, i] = P[i, j]


@kernel
def cross_points(L, reach, weight, seen, cross):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Write the covariance of state and expected measurement.

    Points lie in pairs, ``reach`` columns of the factor to both sides of the mean: what a pair sees
    differently counts for that column, and the mean itself for nothing.

    Args:
        L: The Cholesky factor that the points were drawn with, shape (n, n).
        reach: See ``Spread.gain``.
        weight: Of the covariance, of any point but the mean.
        seen: Expected measurement of each point, shape (2 n + 1, m).
        cross: Room for the covariance, shape (n, m).
    """
    n, m = cross.shape
    for i in range(n):
        for j in range(m):
            cross[i, j] = 0.0
    for c in range(n):
        for j in range(m):
            share = weight * reach * (seen[1 + c, j] - seen[1 + n + c, j])
            for i in range(c, n):
                cross[i, j] += L[i, c] * share


@kernel
def correct(x, P, angular, cross, S, innovation, gate, gain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct mean and covariance in place, unless the measurement is too far off.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: Which numbers of the state are angles, bool, shape (n,).
        cross: Covariance of state and expected measurement, shape (n, m).
        S: Covariance of the innovation, the noise included, shape (m, m); overwritten by its
            Cholesky factor.
        innovation: Measurement less expectation, angles wrapped, shape (m,); overwritten.
        gate: Largest squared Mahalanobis distance that is believed.
        gain: Room for the Kalman gain, shape (n, m).

    Returns:
        The squared Mahalanobis distance; over ``gate``, or not a number, nothing was changed.
    """
    n, m = cross.shape
    for j in range(m):
        for k in range(j):
            S[j, j] -= S[j, k] * S[j, k]
        if not S[j, j] > 0.0:
            return np.nan
        S[j, j] = np.sqrt(S[j, j])
        for i in range(j + 1, m):
            for k in range(j):
                S[i, j] -= S[i, k] * S[j, k]
            S[i, j] /= S[j, j]
    distance = 0.0
    for i in range(m):  # Forward substitution: the innovation in units of its own spread.
        for k in range(i):
            innovation[i] -= S[i, k] * innovation[k]
        innovation[i] /= S[i, i]
        distance += innovation[i] * innovation[i]
    if not distance <= gate:
        return distance
    # With S = F F', gain = cross F'^-1: then P loses gain gain', and x moves by gain F^-1 y.
    for i in range(n):
        for j in range(m):
            total = cross[i, j]
            for k in range(j):
                total -= gain[i, k] * S[j, k]
            gain[i, j] = total / S[j, j]
        for j in range(m):
            x[i] += gain[i, j] * innovation[j]
        if angular[i]:
            x[i] = turn_of(x[i])
        for j in range(i + 1):
            for k in range(m):
                P[i, j] -= gain[i, k] * gain[j, k]
            P[j, i] = P[i, j]
    return distance


@kernel
def correct_one(x, P, angular, number, z, r, gate, gain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct in place with a measurement of one number of the state itself.

    A line through sigma points is itself: nothing has to be drawn, and the result is the same.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: Which numbers of the state are angles, bool, shape (n,).
        number: Which number is measured, no angle.
        z: Measurement.
        r: Its variance.
        gate: Largest squared Mahalanobis distance that is believed.
        gain: Room, shape (n, m).

    Returns:
        The squared Mahalanobis distance; over ``gate``, or not a number, nothing was changed.
    """
    n = len(x)
    spread, innovation = P[number, number] + r, z - x[number]
    if not spread > 0.0:
        return np.nan
    distance = innovation * innovation / spread
    if not distance <= gate:
        return distance
    root = np.sqrt(spread)
    for i in range(n):
        gain[i, 0] = P[i, number] / root
    for i in range(n):
        x[i] += gain[i, 0] * innovation / root
        if angular[i]:
            x[i] = turn_of(x[i])
        for j in range(i + 1):
            P[i, j] -= gain[i, 0] * gain[j, 0]
            P[j, i] = P[i, j]
    return distance
