"""Unscented Kalman filter (Julier and Uhlmann 1997; Merwe and Wan 2000), compiled, for any model.

Symbols follow the literature: state ``x`` with covariance ``P``, measurement ``z`` with covariance
of the innovation ``S``, Kalman gain ``K``. The functions work on arrays that the caller keeps. A
caller draws sigma points, propagates them through its own model and hands them back. Before each
correction the points are drawn again: several sensors correct between two predictions, and points
from before an earlier correction would no longer represent the state.

The covariance's Cholesky factor is kept as its transpose ``U``, ``P = U' U``, and what belongs to a
number of the measurement as a row: loops along rows take vector instructions.

Points along a row of ``U`` need not be drawn where the model is
affine in what they change: such a pair has the mean of its centre, and adds to the covariance what
a Kalman filter would add. The states come first that the model is not affine in; the points along
their rows are drawn, and the covariance that the others would show is what is left of ``P``, in
closed form and exactly (Morelande and Moran 2007, "An unscented transformation for conditionally
linear models").
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel


class SigmaWeights(NamedTuple):
    """Positions and weights of the sigma points.

    Attributes:
        reach: Distance of the points from the mean, in columns of the covariance's Cholesky factor:
            ``sqrt(n + lambda)``.
        mean: Weights of the mean, float64, shape (2 n + 1,).
        covariance: Weights of the covariance, float64, shape (2 n + 1,).
    """

    reach: float
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @classmethod
    def merwe(
        cls, n: int, alpha: float = 1.0, beta: float = 2.0, kappa: float = 0.0
    ) -> "SigmaWeights":
        """Return the scaled points of Merwe (2004) for a state of ``n`` numbers.

        With the defaults no weight is negative, so that a covariance remains positive definite.

        Args:
            n: Number of states.
            alpha: Scaling of the points' distance.
            beta: Weight of the mean's point in the covariance; 2 is best for a normal distribution.
            kappa: Second scaling of the points' distance.
        """
        from filterpy.kalman import MerweScaledSigmaPoints

        points = MerweScaledSigmaPoints(n, alpha, beta, kappa)
        reach = float(np.sqrt(alpha**2 * (n + kappa)))
        return cls(reach, np.array(points.Wm, dtype=float), np.array(points.Wc, dtype=float))


@kernel
def wrap_angle(angle: float) -> float:
    """Return an angle [rad] wrapped to (-pi, pi]."""
    if -np.pi < angle <= np.pi:
        return angle
    return np.pi - (np.pi - angle) % (2 * np.pi)


@kernel
def draw_sigma_points(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    reach: float,
    U: NDArray[np.float64],
    points: NDArray[np.float64],
) -> bool:
    """Draw sigma points around a mean, along the first rows of the Cholesky factor ``U``.

    Point 0 is the mean, 1 to c lie on one side and c + 1 to 2 c on the other. Row ``j`` of ``U`` is
    zero before column ``j``: point ``1 + j`` shares the states before ``j`` with the mean, which
    saves a model most of its sines.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        reach: ``SigmaWeights.reach``.
        U: Buffer of the first rows of the Cholesky factor, shape (c, n).
        points: Buffer of the points, shape (2 c + 1, n).

    Returns:
        True if the covariance is positive definite as far as it is factorised; if not, the points
        are invalid.
    """
    rows, n = U.shape
    for j in range(rows):
        for i in range(j, n):
            U[j, i] = P[j, i]
        for k in range(j):
            share = U[k, j]
            for i in range(j, n):
                U[j, i] -= share * U[k, i]
        if not U[j, j] > 0.0:
            return False
        pivot = np.sqrt(U[j, j])
        for i in range(j, n):
            U[j, i] /= pivot
    # Pairs of points: x +- reach * U[j].
    for i in range(n):
        points[0, i] = x[i]
    for j in range(rows):
        for i in range(j):
            points[1 + j, i] = points[1 + rows + j, i] = x[i]
        for i in range(j, n):
            shift = reach * U[j, i]
            points[1 + j, i] = x[i] + shift
            points[1 + rows + j, i] = x[i] - shift
    return True


@kernel
def unscented_transform(
    points: NDArray[np.float64],
    weights: SigmaWeights,
    angular: NDArray[np.bool_],
    mean: NDArray[np.float64],
    deviations: NDArray[np.float64],
    P: NDArray[np.float64],
) -> None:
    """Compute mean and covariance of sigma points.

    Angles are averaged as differences from point 0, so that the mean of angles near pi is near pi.
    Pairs that are not among the points are taken to lie at point 0: the caller adds the covariance
    that they show, and their mean is none.

    Args:
        points: The first p sigma points, in pairs that all have the same weight, shape (p, m).
        weights: Weights of all points.
        angular: True for states that are angles, bool, shape (m,).
        mean: Buffer of the mean, shape (m,).
        deviations: Buffer of the points' deviations from point 0, shape (p, m).
        P: Buffer of the covariance, shape (m, m).
    """
    p, m = points.shape
    weight = weights.covariance[1]
    # Differences from point 0.
    for k in range(p):
        for i in range(m):
            deviations[k, i] = points[k, i] - points[0, i]
    # Angles in a loop of their own: a branch in the loop above would prevent vector instructions.
    for i in range(m):
        if angular[i]:
            for k in range(p):
                deviations[k, i] = wrap_angle(deviations[k, i])
    # Weighted mean of the differences, of which that of point 0 is none.
    for i in range(m):
        mean[i] = 0.0
    for k in range(1, p):
        for i in range(m):
            mean[i] += weight * deviations[k, i]
    # Covariance about the mean d: sum(w e e') - d d' - d d' + sum(w) d d' over all points, of which
    # those at point 0 have no deviation e.
    about = weights.covariance.sum() - 2.0
    for i in range(m):
        for j in range(i + 1):
            P[i, j] = about * mean[i] * mean[j]
    for k in range(1, p):
        for i in range(m):
            weighted = weight * deviations[k, i]
            for j in range(i + 1):
                P[i, j] += weighted * deviations[k, j]
    # Back from differences to states; the covariance is made exactly symmetric.
    for i in range(m):
        mean[i] += points[0, i]
        if angular[i]:
            mean[i] = wrap_angle(mean[i])
        for j in range(i):
            P[j, i] = P[i, j]


@kernel
def cross_covariance(
    U: NDArray[np.float64],
    weights: SigmaWeights,
    expected: NDArray[np.float64],
    cross: NDArray[np.float64],
) -> None:
    """Compute the covariance of state and expected measurement.

    Points lie in pairs on both sides of the mean and have the same weight: the sum over all points
    reduces to the differences within the pairs, and point 0 does not count.

    Args:
        U: Rows of the Cholesky factor that the points were drawn along, shape (c, n).
        weights: Weights of the points.
        expected: Expected measurement of each point, shape (2 c + 1, m).
        cross: Buffer of the covariance, shape (m, n).
    """
    m, n = cross.shape
    rows = len(U)
    weight = weights.covariance[1]
    for j in range(m):
        for i in range(n):
            cross[j, i] = 0.0
        for c in range(rows):
            share = weight * weights.reach * (expected[1 + c, j] - expected[1 + rows + c, j])
            for i in range(c, n):  # The factor is zero before its diagonal.
                cross[j, i] += U[c, i] * share


@kernel
def _factorise(S: NDArray[np.float64]) -> bool:
    """Replace a covariance by its lower Cholesky factor; return false if it has none."""
    m = len(S)
    for j in range(m):
        for k in range(j):
            S[j, j] -= S[j, k] * S[j, k]
        if not S[j, j] > 0.0:
            return False
        S[j, j] = np.sqrt(S[j, j])
        for i in range(j + 1, m):
            for k in range(j):
                S[i, j] -= S[i, k] * S[j, k]
            S[i, j] /= S[j, j]
    return True


@kernel
def _whiten(F: NDArray[np.float64], innovation: NDArray[np.float64]) -> float:
    """Replace an innovation y by ``F^-1 y`` and return its square, the NIS ``y' S^-1 y``."""
    nis = 0.0
    for i in range(len(innovation)):  # Forward substitution.
        for k in range(i):
            innovation[i] -= F[i, k] * innovation[k]
        innovation[i] /= F[i, i]
        nis += innovation[i] * innovation[i]
    return nis


@kernel
def correct(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    angular: NDArray[np.bool_],
    cross: NDArray[np.float64],
    S: NDArray[np.float64],
    innovation: NDArray[np.float64],
    gate: float,
    gain: NDArray[np.float64],
) -> float:
    """Correct mean and covariance in place, unless the measurement lies beyond the gate.

    The gate compares the normalised innovation squared (NIS, Bar-Shalom et al. 2001, section 5.4),
    which is chi-square distributed for a consistent filter.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: True for states that are angles, bool, shape (n,).
        cross: Covariance of state and expected measurement, shape (m, n).
        S: Covariance of the innovation, measurement noise included, shape (m, m); overwritten by
            its Cholesky factor.
        innovation: Measurement less expectation, angles wrapped, shape (m,); overwritten.
        gate: Largest NIS that is accepted.
        gain: Buffer of the gain, shape (m, n).

    Returns:
        The NIS; if it is larger than the gate, or NaN, nothing was changed.
    """
    m, n = cross.shape
    if not _factorise(S):
        return np.nan
    nis = _whiten(S, innovation)
    if not nis <= gate:
        return nis
    # With S = F F' the gain K = cross S^-1 is G F^-1 with G = cross F'^-1: then x moves by
    # G F^-1 y, and K S K' = G G' is subtracted from P, which keeps P symmetric.
    for j in range(m):
        for i in range(n):
            gain[j, i] = cross[j, i]
        for k in range(j):
            for i in range(n):
                gain[j, i] -= gain[k, i] * S[j, k]
        for i in range(n):
            gain[j, i] /= S[j, j]
        for i in range(n):
            x[i] += gain[j, i] * innovation[j]
    for i in range(n):
        if angular[i]:
            x[i] = wrap_angle(x[i])
        for k in range(m):
            share = gain[k, i]
            for j in range(n):
                P[i, j] -= share * gain[k, j]
    return nis


@kernel
def correct_state(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    angular: NDArray[np.bool_],
    index: int,
    z: float,
    variance: float,
    gate: float,
    gain: NDArray[np.float64],
) -> float:
    """Correct in place with a measurement of one state itself.

    The measurement is linear, where the unscented transform is exact: no points have to be drawn.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: True for states that are angles, bool, shape (n,).
        index: Index of the measured state, which is no angle.
        z: Measurement.
        variance: Variance of the measurement.
        gate: Largest NIS that is accepted.
        gain: Buffer of the gain, shape (m, n).

    Returns:
        The NIS; if it is larger than the gate, or NaN, nothing was changed.
    """
    n = len(x)
    s, innovation = P[index, index] + variance, z - x[index]
    if not s > 0.0:
        return np.nan
    nis = innovation * innovation / s
    if not nis <= gate:
        return nis
    root = np.sqrt(s)
    for i in range(n):
        gain[0, i] = P[index, i] / root
    for i in range(n):
        x[i] += gain[0, i] * innovation / root
        if angular[i]:
            x[i] = wrap_angle(x[i])
        share = gain[0, i]
        for j in range(n):
            P[i, j] -= share * gain[0, j]
    return nis
