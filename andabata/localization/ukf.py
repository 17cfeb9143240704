"""Unscented Kalman filter (Julier and Uhlmann 1997; Merwe and Wan 2000), compiled, for any model.

Symbols follow the literature: state ``x`` with covariance ``P``, measurement ``z`` with covariance
of the innovation ``S``, Kalman gain ``K``. The functions work on arrays that the caller keeps.
Before each correction the sigma points are drawn again: several sensors correct between two
predictions, and points from before an earlier correction would no longer represent the state.

A model, of the process or of a measurement, is written as ``z = A x + e(x)``: a linear part, whose
matrix the caller applies, and a remainder, which alone is evaluated at the sigma points. With the
covariance's Cholesky factor ``P = U' U``, points at ``x +- reach U[k]`` and a remainder that
changes along row ``k`` by the slope ``c[k]`` and bends by ``s[k]``, the moments of the unscented
transform of the whole model are, exactly:

* covariance of model and state: ``A P + sum(c[k] U[k])``,
* covariance of the model: ``A (A P + sum(c[k] U[k]))' + sum((A U[k] + c[k]) c[k]')``, and what the
  ``s[k]`` add.

Rows along which the remainder does not change add nothing, and their points need not be drawn
(Morelande and Moran 2007, "An unscented transformation for conditionally linear models"). The
states come first that it depends on, or that change ``A``: row ``k`` is zero before column ``k``.
What belongs to a number of the model is a row: loops along rows take vector instructions.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import borrowing_kernel, kernel


class SigmaWeights(NamedTuple):
    """Positions and weights of the sigma points.

    Attributes:
        reach: Distance of the points from the mean, in rows of the covariance's Cholesky factor:
            ``sqrt(n + lambda)``.
        weight: Weight of each point but the mean's, in mean and covariance.
        about: Sum of all weights of the covariance, less 2: the covariance is
            ``sum(w e e') + about d d'`` for deviations ``e`` from the mean's point, whose mean is
            ``d``.
    """

    reach: float
    weight: float
    about: float

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
        return cls(reach, float(points.Wc[1]), float(points.Wc.sum()) - 2.0)


class Transform(NamedTuple):
    """Buffers of the unscented transform of a model of m numbers, with points along c rows.

    Attributes:
        U: First rows of the covariance's Cholesky factor, shape (c, n).
        points: Sigma points, as far as the remainder depends on them, shape (2 c + 1, k).
        remainder: Remainder ``e`` at each point, shape (2 c + 1, m).
        linear: Change of the linear part along each row, ``A U'``, shape (m, c).
        slopes: Change of the remainder along each row, shape (m, c).
        bends: Second difference of the remainder along each row, shape (m, c).
        mean: Mean of the remainder less its value at the mean's point, shape (m,).
        cross: Covariance of model and state, shape (m, n).
        covariance: Covariance of the model, shape (m, m).
    """

    U: NDArray[np.float64]
    points: NDArray[np.float64]
    remainder: NDArray[np.float64]
    linear: NDArray[np.float64]
    slopes: NDArray[np.float64]
    bends: NDArray[np.float64]
    mean: NDArray[np.float64]
    cross: NDArray[np.float64]
    covariance: NDArray[np.float64]


@kernel
def allocate_transform(n: int, m: int, c: int, k: int) -> Transform:
    """Return new buffers.

    Args:
        n: Number of states.
        m: Number of numbers of the model.
        c: Number of rows of the Cholesky factor that points are drawn along.
        k: Number of states that the remainder depends on, the first ones.
    """
    return Transform(
        np.zeros((c, n)),
        np.zeros((2 * c + 1, k)),
        np.zeros((2 * c + 1, m)),
        np.zeros((m, c)),
        np.zeros((m, c)),
        np.zeros((m, c)),
        np.zeros(m),
        np.zeros((m, n)),
        np.zeros((m, m)),
    )


@borrowing_kernel
def wrap_angle(angle: float) -> float:
    """Return an angle [rad] wrapped to (-pi, pi]."""
    if -np.pi < angle <= np.pi:
        return angle
    return np.pi - (np.pi - angle) % (2 * np.pi)


@borrowing_kernel
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
        points: Buffer of the points' first k states, shape (2 c + 1, k).

    Returns:
        True if the covariance is positive definite as far as it is factorised; if not, the points
        are invalid.
    """
    rows, n = U.shape
    for j in range(rows):
        # Whole rows: loops of one length take vector instructions, shorter ones hardly.
        for i in range(n):
            U[j, i] = P[j, i]
        for k in range(j):
            share = U[k, j]
            for i in range(n):
                U[j, i] -= share * U[k, i]
        if not U[j, j] > 0.0:
            return False
        scale = 1.0 / np.sqrt(U[j, j])
        for i in range(n):
            U[j, i] *= scale
        for i in range(j):
            U[j, i] = 0.0
    # Pairs of points: x +- reach * U[j].
    states = points.shape[1]
    for i in range(states):
        points[0, i] = x[i]
    for j in range(rows):
        for i in range(states):
            shift = reach * U[j, i]
            points[1 + j, i] = x[i] + shift
            points[1 + rows + j, i] = x[i] - shift
    return True


@borrowing_kernel
def is_rest_positive(P: NDArray[np.float64], U: NDArray[np.float64]) -> bool:
    """Return true if what the first rows of the Cholesky factor leave of all variances is positive.

    Args:
        P: Covariance, shape (n, n).
        U: First rows of the factor, shape (c, n).
    """
    rows, n = U.shape
    for i in range(rows, n):
        rest = P[i, i]
        for k in range(rows):
            rest -= U[k, i] * U[k, i]
        if not rest > 0.0:
            return False
    return True


@borrowing_kernel
def add_remainder_to_cross(weights: SigmaWeights, transform: Transform) -> None:
    """Fill slopes, bends and mean of the remainder, and add what it shows to ``cross``.

    Args:
        weights: Weights of the points.
        transform: Buffers; ``U`` and ``remainder`` are filled, and ``cross`` with ``A P``.
    """
    U, remainder, slopes, bends, mean, cross = (
        transform.U,
        transform.remainder,
        transform.slopes,
        transform.bends,
        transform.mean,
        transform.cross,
    )
    m, n = cross.shape
    rows = len(U)
    half = 0.5 / weights.reach
    for a in range(m):
        centre, total = remainder[0, a], 0.0
        for k in range(rows):
            up, down = remainder[1 + k, a] - centre, remainder[1 + rows + k, a] - centre
            slopes[a, k] = half * (up - down)
            bends[a, k] = up + down
            total += bends[a, k]
        mean[a] = weights.weight * total
        # Three rows at once, so that cross is read and written less often.
        for k in range(0, rows, 3):
            u, v, w = slopes[a, k], slopes[a, k + 1], slopes[a, k + 2]
            for i in range(n):
                cross[a, i] += u * U[k, i] + v * U[k + 1, i] + w * U[k + 2, i]


@borrowing_kernel
def add_remainder_to_covariance(weights: SigmaWeights, transform: Transform) -> None:
    """Add what the remainder shows to ``covariance``, which becomes exactly symmetric.

    Args:
        weights: Weights of the points.
        transform: Buffers after ``add_remainder_to_cross``; ``linear`` is filled, and
            ``covariance`` with ``A cross'``.
    """
    linear, slopes, bends, mean = (
        transform.linear,
        transform.slopes,
        transform.bends,
        transform.mean,
    )
    covariance = transform.covariance
    m, rows = slopes.shape
    # A pair adds w (e e' + e e') = c c' + w / 2 s s', as its weights are 2 w reach^2 = 1.
    half = weights.weight / 2
    for a in range(m):
        for b in range(a + 1):
            total = weights.about * mean[a] * mean[b]
            for k in range(rows):
                total += slopes[a, k] * (linear[b, k] + slopes[b, k])
                total += half * bends[a, k] * bends[b, k]
            covariance[a, b] += total
            covariance[b, a] = covariance[a, b]


@borrowing_kernel
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


@borrowing_kernel
def _whiten(F: NDArray[np.float64], innovation: NDArray[np.float64]) -> float:
    """Replace an innovation y by ``F^-1 y`` and return its square, the NIS ``y' S^-1 y``."""
    nis = 0.0
    for i in range(len(innovation)):  # Forward substitution.
        for k in range(i):
            innovation[i] -= F[i, k] * innovation[k]
        innovation[i] /= F[i, i]
        nis += innovation[i] * innovation[i]
    return nis


@borrowing_kernel
def correct(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    angular: NDArray[np.uint8],
    cross: NDArray[np.float64],
    S: NDArray[np.float64],
    innovation: NDArray[np.float64],
    gate: float,
) -> float:
    """Correct mean and covariance in place, unless the measurement lies beyond the gate.

    The gate compares the normalised innovation squared (NIS, Bar-Shalom et al. 2001, section 5.4),
    which is chi-square distributed for a consistent filter.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: 1 for states that are angles, else 0, uint8, shape (n,).
        cross: Covariance of expected measurement and state, shape (3, n); overwritten.
        S: Covariance of the innovation, measurement noise included, shape (3, 3); overwritten by
            its Cholesky factor.
        innovation: Measurement less expectation, angles wrapped, shape (3,); overwritten.
        gate: Largest NIS that is accepted.

    Returns:
        The NIS; if it is larger than the gate, or NaN, nothing was changed.
    """
    m, n = cross.shape
    if not _factorise(S):
        return np.nan
    nis = _whiten(S, innovation)
    if not nis <= gate:
        return nis
    # With S = F F' the gain K = cross' S^-1 is G' F^-1 with G = F^-1 cross: then x moves by
    # G' F^-1 y, and K S K' = G' G is subtracted from P, which keeps P symmetric.
    for j in range(m):
        for k in range(j):
            for i in range(n):
                cross[j, i] -= cross[k, i] * S[j, k]
        scale = 1.0 / S[j, j]
        for i in range(n):
            cross[j, i] *= scale
            x[i] += cross[j, i] * innovation[j]
    for i in range(n):
        if angular[i]:
            x[i] = wrap_angle(x[i])
        # All three numbers at once, so that P is read and written only once.
        a, b, c = cross[0, i], cross[1, i], cross[2, i]
        for j in range(n):
            P[i, j] -= a * cross[0, j] + b * cross[1, j] + c * cross[2, j]
    return nis


@borrowing_kernel
def correct_number(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    angular: NDArray[np.uint8],
    cross: NDArray[np.float64],
    s: float,
    innovation: float,
    gate: float,
) -> float:
    """Correct in place with a measurement of one number.

    Args:
        x: Mean, shape (n,).
        P: Covariance, shape (n, n).
        angular: 1 for states that are angles, else 0, uint8, shape (n,).
        cross: Covariance of expected measurement and state, shape (n,); overwritten.
        s: Variance of the innovation, measurement noise included.
        innovation: Measurement less expectation; an angle is wrapped.
        gate: Largest NIS that is accepted.

    Returns:
        The NIS; if it is larger than the gate, or NaN, nothing was changed.
    """
    n = len(x)
    if not s > 0.0:
        return np.nan
    nis = innovation * innovation / s
    if not nis <= gate:
        return nis
    scale = 1.0 / np.sqrt(s)
    for i in range(n):
        cross[i] *= scale
        x[i] += cross[i] * innovation * scale
    for i in range(n):
        if angular[i]:
            x[i] = wrap_angle(x[i])
        share = cross[i]
        for j in range(n):
            P[i, j] -= share * cross[j]
    return nis
