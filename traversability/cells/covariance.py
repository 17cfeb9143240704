"""Closed forms about the covariance of points: eigenvalues, the normal, a plane's gradient."""

from typing import NamedTuple

import numpy as np

from terrain.kernel import kernel


class Covariance(NamedTuple):
    """Covariance of points [m2], or of their rows and columns.

    Attributes:
        xx: Variance of x [m2].
        yy: Variance of y [m2].
        zz: Variance of z [m2].
        xy: Covariance of x and y [m2].
        xz: Covariance of x and z [m2].
        yz: Covariance of y and z [m2].
    """

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


class Eigenvalues(NamedTuple):
    """Eigenvalues of a covariance, none of them negative.

    Attributes:
        l1: Largest one [m2].
        l2: Middle one [m2].
        l3: Smallest one, the variance along the normal [m2].
    """

    l1: float
    l2: float
    l3: float


@kernel
def eigenvalues(covariance: Covariance) -> Eigenvalues:
    """Return the eigenvalues of a covariance in closed form.

    The largest comes from the trigonometric solution of the cubic (Smith 1961, "Eigenvalues of a
    symmetric 3 x 3 matrix"); sum and product of the other two follow from trace and determinant,
    which keeps the smallest one exact on flat ground.
    """
    xx, yy, zz, xy, xz, yz = covariance
    trace = xx + yy + zz
    q = trace / 3
    off = xy * xy + xz * xz + yz * yz
    a, b, c = xx - q, yy - q, zz - q
    p = np.sqrt(max((a * a + b * b + c * c + 2 * off) / 6, 0.0))
    if p <= 1e-15 * max(q, 1e-300):  # A ball, or a single place: no direction stands out.
        ball = max(q, 0.0)
        return Eigenvalues(ball, ball, ball)
    half_det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2
    angle = np.arccos(min(max(half_det / (p * p * p), -1.0), 1.0)) / 3
    l1 = q + 2 * p * np.cos(angle)
    # l2 + l3 and l2 l3, so a quadratic; l3 from the product, which does not cancel.
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    rest = max(trace - l1, 0.0)
    product = max(det / l1, 0.0)
    root = np.sqrt(max(rest * rest - 4 * product, 0.0))
    l2 = (rest + root) / 2
    l3 = product / l2 if l2 > 0 else 0.0
    return Eigenvalues(l1, l2, min(l3, l2))


@kernel
def normal_z_squared(covariance: Covariance, axes: Eigenvalues) -> float:
    """Return the squared z of the unit normal, the eigenvector of ``l3``, from the eigenvalues.

    The identity of eigenvectors from eigenvalues (Denton et al. 2022): the characteristic
    polynomial of the minor without z, over the product of the eigenvalues' gaps. Zero where the
    normal is undefined (a line, a ball).
    """
    gaps = (axes.l1 - axes.l3) * (axes.l2 - axes.l3)
    if gaps <= 1e-12 * axes.l1 * axes.l1:
        return 0.0
    xy = covariance.xy
    minor = (covariance.xx - axes.l3) * (covariance.yy - axes.l3) - xy * xy
    return min(max(minor / gaps, 0.0), 1.0)


@kernel
def gradient(
    xx: float, yy: float, xy: float, xz: float, yz: float, noise: float
) -> tuple[float, float]:
    """Return rise over run along x and y of the least-squares plane, where points support one.

    Across an arc of points nothing is known: what spreads it outwards is range noise, which moves
    points along their beam, so that a plane through them would be as steep as the beam. A direction
    in which the points' variance is well under ``noise`` [m2] counts as level; well above it, this
    is the plain solution ``A^-1 b``. (Tikhonov: ``(A^2 + noise^2)^-1 A b``.)

    Args:
        xx: Variance of x [m2].
        yy: Variance of y [m2].
        xy: Covariance of x and y [m2].
        xz: Covariance of x and z [m2].
        yz: Covariance of y and z [m2].
        noise: Variance that range noise alone makes [m2].
    """
    axx, ayy = xx * xx + xy * xy + noise * noise, yy * yy + xy * xy + noise * noise
    axy = xy * (xx + yy)
    bx, by = xx * xz + xy * yz, xy * xz + yy * yz
    determinant = axx * ayy - axy * axy
    return (ayy * bx - axy * by) / determinant, (axx * by - axy * bx) / determinant
