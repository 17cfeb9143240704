"""Status of an estimator: health with its causes, uncertainty, and what became of the readings."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health

X, Y, YAW = 0, 1, 5
"""Rows of a status's covariance: those of place and heading."""

SIGMAS = 2.0
"""Size of what is drawn of an uncertainty, in standard deviations."""

_SECTOR = 2.5
"""Length of the sector that shows the heading [m]."""

_PLANAR = [X, Y, YAW]

_NUMBERS = re.compile(r",? (for|by) [\d.]+.*")


@dataclass(frozen=True)
class EstimatorStatus:
    """What an estimator believes of itself at one moment.

    Attributes:
        health: Health of the estimate.
        causes: Causes why it is not ok, one text each; empty while it is.
        covariance: Covariance of x, y, z [m], roll, pitch, yaw [rad] in the map, shape (6, 6).
        accepted: Number of accepted readings, by sensor.
        unused: Number of readings that were not used, by sensor and reason; zeros are left out.
    """

    health: Health
    causes: tuple[str, ...]
    covariance: NDArray[np.float64]
    accepted: Mapping[str, int] = field(default_factory=dict)
    unused: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    @property
    def cause(self) -> str:
        """Causes as one line; empty while the estimate is ok."""
        return "; ".join(self.causes)

    @property
    def planar_covariance(self) -> NDArray[np.float64]:
        """Covariance of x, y [m] and yaw [rad], shape (3, 3)."""
        return self.covariance[np.ix_(_PLANAR, _PLANAR)]

    @property
    def position_sigma(self) -> float:
        """Longest half axis of the standard error ellipse of x and y [m]."""
        return longest_sigma(self.covariance[:2, :2])

    @property
    def yaw_sigma(self) -> float:
        """Standard deviation of the heading [rad]."""
        return float(np.sqrt(max(self.covariance[YAW, YAW], 0.0)))

    @property
    def unused_in_words(self) -> list[str]:
        """Readings that were not used, as text, a line for each sensor."""
        return [
            f"{sensor}: {', '.join(f'{number} {reason}' for reason, number in reasons.items())}"
            for sensor, reasons in self.unused.items()
        ]


def without_numbers(cause: str) -> str:
    """Return a cause without its numbers, such as ``gnss: not accepted``: it names the kind."""
    return _NUMBERS.sub("", cause)


def longest_sigma(covariance: NDArray[np.float64]) -> float:
    """Return the longest half axis of the standard error ellipse [m].

    Args:
        covariance: Covariance of x and y [m], shape (2, 2).
    """
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def error_ellipse(covariance: NDArray[np.float64], points: int = 32) -> NDArray[np.float64]:
    """Return the rim of the error ellipse of ``SIGMAS`` standard deviations around the origin.

    Args:
        covariance: Covariance of x and y [m], shape (2, 2).
        points: Number of points of the rim, counter-clockwise.

    Returns:
        Points [m], shape (points, 2).
    """
    angles = np.linspace(0, 2 * np.pi, points, endpoint=False)
    values, axes = np.linalg.eigh(covariance)
    axes = axes * np.array([1.0, np.sign(np.linalg.det(axes))])  # No mirror image: a rotation.
    circle = np.stack([np.cos(angles), np.sin(angles)]) * np.sqrt(values.clip(0.0))[:, None]
    return np.asarray(SIGMAS * (axes @ circle).T)


def heading_sector(yaw: float, sigma: float, points: int = 13) -> NDArray[np.float64]:
    """Return tip and arc of the sector around the origin that holds the heading to ``SIGMAS``.

    Args:
        yaw: Heading [rad].
        sigma: Its standard deviation [rad].
        points: Number of points of the arc.

    Returns:
        Points [m], the tip first, shape (points + 1, 2).
    """
    spread = min(SIGMAS * sigma, np.pi)
    angles = yaw + spread * np.linspace(-1, 1, points)
    arc = _SECTOR * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([np.zeros((1, 2)), arc])
