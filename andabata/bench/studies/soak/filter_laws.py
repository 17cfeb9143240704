"""Laws of the filter over many steps: gate, agreement with the Kalman filter, positive covariance.

Each function is a check of a promise.
"""

from pathlib import Path

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.stats import chi2

from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.bench.studies.soak.synthetic_drive import fresh_localizer, synthetic_readings
from andabata.localization.ukf import (
    SigmaWeights,
    add_remainder_to_covariance,
    add_remainder_to_cross,
    allocate_transform,
    correct,
    correct_number,
    draw_sigma_points,
)

_REJECTED_SHARE = 0.001
"""Share of good measurements that a gate of this level rejects."""

_STATES = 6
_FREE = np.zeros(_STATES, dtype=np.uint8)
"""States that are no angles."""

_NO_WEIGHT = 1e12
"""Variance of a component that carries no information."""

_TOLERANCE = 1e-8
"""Largest difference from the Kalman filter."""

_STEPS_A_PERIOD = 10
"""Inertial rows of a control period."""


def gate_rejects_its_share(count: int, folder: Path) -> Outcome:
    """Check that gates of 0.001 reject 0.001 of good measurements of one, two and three numbers."""
    rng, tally = np.random.default_rng(8001), Tally()
    figures = []
    mean, spread = _REJECTED_SHARE * count, np.sqrt(_REJECTED_SHARE * count)
    for numbers in (1, 2, 3):
        gate = float(chi2.isf(_REJECTED_SHARE, numbers))
        rejected = sum(_is_gated(rng, numbers, gate) for _ in range(count))
        tally.trials += count
        figures.append(f"{rejected:,}")
        tally.expect(
            abs(rejected - mean) <= 3 * spread,
            f"{numbers} numbers: expected {mean:.0f} +- {3 * spread:.0f}, got {rejected}",
        )
    return tally.outcome(f"{', '.join(figures)} of {count:,} rejected in 1, 2, 3 dimensions")


def _is_gated(rng: np.random.Generator, numbers: int, gate: float) -> bool:
    """Draw a measurement as the filter expects it, and return whether the gate rejects it."""
    root = rng.normal(size=(_STATES, _STATES))
    P = root @ root.T + 0.1 * np.eye(_STATES)
    x, R = rng.normal(size=_STATES), np.diag(rng.uniform(0.1, 2.0, 3))
    before = x.copy()
    H = np.zeros((3, _STATES))
    H[:numbers] = rng.normal(size=(numbers, _STATES))
    S = H @ P @ H.T + R
    innovation = np.zeros(3)
    innovation[:numbers] = np.linalg.cholesky(S[:numbers, :numbers]) @ rng.normal(size=numbers)
    if numbers == 1:
        correct_number(x, P, _FREE, P @ H[0], float(S[0, 0]), float(innovation[0]), gate)
    else:
        for k in range(numbers, 3):
            S[k, k] = _NO_WEIGHT
        correct(x, P, _FREE, H @ P, S, innovation, gate)
    return bool((x == before).all())


def filter_is_the_kalman_filter(count: int, folder: Path) -> Outcome:
    """Check that on a linear problem the filter equals filterpy's Kalman filter at every step.

    The problem is a body in space: position and velocity, predicted at each step, with its speed
    along one axis at every second step and its position at every tenth.
    """
    rng, tally, largest = np.random.default_rng(8002), Tally(), 0.0
    ours, reference = LinearFilter(), _reference()
    truth = np.zeros(_STATES)
    for step in range(count):
        truth = LinearFilter.F @ truth + rng.normal(0.0, 0.02, _STATES)
        ours.predict()
        reference.predict()
        if step % 2 == 0:
            speed = truth[3] + rng.normal(0.0, 0.1)
            ours.correct_speed(speed)
            reference.update(np.array([[speed]]), R=np.array([[0.01]]), H=np.eye(_STATES)[3:4])
        if step % 10 == 0:
            place = truth[:3] + rng.normal(0.0, 0.5, 3)
            ours.correct_position(place)
            reference.update(place[:, None], R=0.25 * np.eye(3), H=np.eye(3, _STATES))
        tally.trials += 1
        apart = max(np.abs(ours.x - reference.x.ravel()).max(), np.abs(ours.P - reference.P).max())
        largest = max(largest, float(apart))
        tally.expect(apart <= _TOLERANCE, f"step {step}: differs by {apart:.2g}")
    return tally.outcome(f"largest difference {largest:.1g}")


class LinearFilter:
    """Filter of a body in space by the code of the robot's filter.

    Attributes:
        F: Transition of a step, shape (6, 6).
        Q: Process noise of a step, shape (6, 6).
        x: Position [m] and velocity [m/s], shape (6,).
        P: Covariance, shape (6, 6).
    """

    F: NDArray[np.float64] = np.eye(_STATES) + 0.1 * np.eye(_STATES, k=3)
    Q: NDArray[np.float64] = 4e-4 * np.eye(_STATES)

    def __init__(self) -> None:
        """Begin at rest in the origin."""
        self.x, self.P = np.zeros(_STATES), np.eye(_STATES)
        self._weights = SigmaWeights.merwe(_STATES)
        self._transform = allocate_transform(_STATES, _STATES, _STATES, _STATES)

    def predict(self) -> None:
        """Predict by a step, the whole transition taken at the sigma points.

        Raises:
            ValueError: If the covariance is not positive definite.
        """
        t = self._transform
        if not draw_sigma_points(self.x, self.P, self._weights.reach, t.U, t.points):
            raise ValueError("covariance: expected a positive definite one, got another")
        t.remainder[:] = t.points @ self.F.T
        t.cross[:], t.linear[:], t.covariance[:] = 0.0, 0.0, 0.0
        add_remainder_to_cross(self._weights, t)
        add_remainder_to_covariance(self._weights, t)
        self.x = t.remainder[0] + t.mean
        self.P = t.covariance + self.Q

    def correct_speed(self, speed: float) -> None:
        """Correct with the speed along the first axis [m/s], of variance 0.01."""
        s, innovation = float(self.P[3, 3]) + 0.01, speed - float(self.x[3])
        correct_number(self.x, self.P, _FREE, self.P[3].copy(), s, innovation, np.inf)

    def correct_position(self, place: NDArray[np.float64]) -> None:
        """Correct with a position [m], of variance 0.25, shape (3,)."""
        S = self.P[:3, :3] + 0.25 * np.eye(3)
        correct(self.x, self.P, _FREE, self.P[:3].copy(), S, place - self.x[:3], np.inf)


def _reference() -> KalmanFilter:
    """Return filterpy's filter of the same problem."""
    reference = KalmanFilter(dim_x=_STATES, dim_z=3)
    reference.x = np.zeros((_STATES, 1))
    reference.F, reference.Q, reference.P = LinearFilter.F, LinearFilter.Q, np.eye(_STATES)
    return reference


def covariance_stays_positive(count: int, folder: Path) -> Outcome:
    """Check that the smallest eigenvalue of the robot's covariance is positive at every period.

    A drive of computed readings, with gaps of compass and fixes.
    """
    localizer, tally, smallest = fresh_localizer(), Tally(), np.inf
    for readings in synthetic_readings(count // _STEPS_A_PERIOD, gaps=True):
        localizer.update(readings)
        value = float(np.linalg.eigvalsh(localizer.belief.P)[0])
        smallest = min(smallest, value)
        tally.trials += _STEPS_A_PERIOD
        tally.expect(value > 0.0, f"at {readings.stamp:.1f} s: eigenvalue {value:.2g}")
    lost = count // _STEPS_A_PERIOD * _STEPS_A_PERIOD - localizer.counts["imu"][0]
    tally.expect(lost == 0, f"expected every inertial row to be accepted, {lost} were not")
    return tally.outcome(f"smallest eigenvalue {smallest:.1g}")
