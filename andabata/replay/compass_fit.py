"""Fit of a compass to the turns of a gyro: sense, bearing, hard iron and soft iron.

A robot that turns by ``theta`` sees the horizontal field, as a complex number forward + i left, as
``p exp(-i theta) + q exp(i theta) + c``: ``p`` is the Earth's field, ``q`` what soft iron adds, and
``c`` hard iron (Gebre-Egziabher et al. 2006). A mirrored compass has a ``q`` larger than its ``p``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_DRIFTS = np.linspace(-0.012, 0.012, 25)
"""Biases of the gyro that are tried [rad/s]."""

_DRIFT_SIGMA = 0.006
"""Standard deviation of such a bias [rad/s]."""

_IRON_SIGMA = 30.0
"""Prior standard deviation of hard and soft iron [uT]."""

_NOISE, _CORRELATED = 1.5, 20.0
"""Standard deviation of the field's error [uT], and number of samples over which it is one."""

_MOST = 600
"""Number of samples that are fitted."""


class CompassSamples(NamedTuple):
    """Compass and gyro over time, one sample a control period.

    Attributes:
        stamps: Times [s], shape (k,).
        turns: Yaw by the gyro alone [rad], shape (k,).
        tilts: Pitch and roll [rad], shape (k, 2).
        fields: Flux density in the base frame [uT], shape (k, 3).
    """

    stamps: NDArray[np.float64]
    turns: NDArray[np.float64]
    tilts: NDArray[np.float64]
    fields: NDArray[np.float64]

    def levelled(self, rotation: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return the fields forward, left and up, rotated in the base before [uT], (k, 3).

        Args:
            rotation: Matrix that the fields are multiplied with, shape (3, 3); None for none.
        """
        fields = self.fields if rotation is None else self.fields @ rotation.T
        return np.asarray(Rotation.from_euler("YX", self.tilts).apply(fields))

    def thinned(self) -> "CompassSamples":
        """Return at most ``_MOST`` samples, evenly spread."""
        every = -(-len(self.stamps) // _MOST)
        return CompassSamples(*(column[::every] for column in self))


class CompassFit(NamedTuple):
    """Horizontal field over the turns of a gyro.

    Attributes:
        earth: Field that turns as the robot's heading wants, ``p`` [uT]; turns are those of a gyro
            that is right in the middle of the time.
        soft: Field that turns the other way, ``q`` [uT].
        hard: Field that turns with the robot, ``c`` [uT].
        sigma: Standard deviations of these three [uT].
        up: Mean of the vertical part [uT].
        drift: Bias of the gyro [rad/s].
    """

    earth: complex
    soft: complex
    hard: complex
    sigma: tuple[float, float, float]
    up: float
    drift: float


def fit_compass(samples: CompassSamples, rotation: NDArray[np.float64] | None = None) -> CompassFit:
    """Return the fit of a compass to the gyro.

    Args:
        samples: At least three samples.
        rotation: Matrix that the fields are multiplied with before, shape (3, 3); None for none.
    """
    thin = samples.thinned()
    forward, left, up = thin.levelled(rotation).T
    field, elapsed = forward + 1j * left, thin.stamps - thin.stamps.mean()
    solutions = [_solve(thin.turns - drift * elapsed, field) for drift in _DRIFTS]
    costs = [
        misfit + (drift / _DRIFT_SIGMA) ** 2
        for (_, _, misfit), drift in zip(solutions, _DRIFTS, strict=True)
    ]
    best = int(np.argmin(costs))
    (earth, soft, hard), sigma, _ = solutions[best]
    spread = (float(sigma[0]), float(sigma[1]), float(sigma[2]))
    drift = float(_DRIFTS[best])
    return CompassFit(complex(earth), complex(soft), complex(hard), spread, float(up.mean()), drift)


def _solve(
    turns: NDArray[np.float64], field: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.float64], float]:
    """Return the three fields [uT], their standard deviations, and the normalised misfit."""
    wave = np.exp(-1j * turns)
    basis = np.stack([wave, wave.conj(), np.ones_like(wave)], axis=1)
    weight = 1.0 / (_NOISE**2 * _CORRELATED)
    prior = np.diag([1e-9, _IRON_SIGMA**-2, _IRON_SIGMA**-2])
    covariance = np.linalg.inv(weight * (basis.conj().T @ basis) + prior)
    solution = covariance @ (weight * (basis.conj().T @ field))
    misfit = float(weight * (np.abs(field - basis @ solution) ** 2).sum())
    return solution, np.sqrt(np.diag(covariance).real), misfit
