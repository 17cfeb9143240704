"""Check of the wheels' speed and direction against the fixes, as turns are checked with the gyro.

The wheels' mean speed and the gyro's yaw rate are integrated to a path. A similarity transform fits
it to the fixes: its scale is the true speed by the wheels', its rotation the heading at the start,
which the compass measures too. Where the fixes spread over too little ground, nothing is said.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.localization.fix_check import check_fixes

Rows = NDArray[np.float64]

_EARTH_RADIUS = 6_371_000.0
"""Mean radius of the Earth [m]."""

_FEWEST_FIXES = 5
"""Number of fixes by which driving is judged."""

_MOST_FIXES = 600
"""Number of fixes that are kept: the path drifts away from them later."""

_MOST_PERIODS = 12_000
"""Number of control periods that are kept: twenty minutes."""

_MIN_SPREAD = 3.0
"""Least root mean square distance of the fixes from their mean [m]: their noise is smaller."""

_SPREAD_BY_SIGMA = 2.0
"""The same as a multiple of the fixes' own standard deviation."""

_MIN_CORRELATION = 0.9
"""Least correlation of the path with the fixes by which scale and heading are judged."""

_STANDING = 0.2
"""Spread of the path, as a share of that of the fixes, below which the wheels stand."""

_SCALE = (0.5, 2.0)
"""Bounds of the true speed as a share of the wheels', on any ground."""


@dataclass(frozen=True)
class DrivingFit:
    """Similarity transform from the path of wheels and gyro to the fixes.

    Attributes:
        spread: Root mean square distance of the fixes from their mean [m].
        path_spread: Root mean square distance of the path from its mean [m].
        correlation: Correlation of the two, 0 to 1.
        scale: Distance by the fixes as a share of that by the wheels.
        heading: Heading at the start that fits, from east [rad].
    """

    spread: float
    path_spread: float
    correlation: float
    scale: float
    heading: float


class DrivingCheck:
    """Compares the wheels with the fixes of a drive."""

    def __init__(self) -> None:
        """Create a check before the first reading."""
        self._yaw, self._position = 0.0, 0.0 + 0.0j
        self._stamp: float | None = None
        self._path: list[tuple[float, complex]] = []
        self._fixes: list[list[float]] = []
        self._headings: list[complex] = []

    def add(
        self,
        imu: Rows | None,
        speeds: Rows | None,
        mag: Rows | None = None,
        fixes: Rows | None = None,
    ) -> None:
        """Add the readings of a control period, in the robot's axes.

        Args:
            imu: Rows as in ``SensorReadings``, None without.
            speeds: Stamp [s] and forward speed by the wheels [m/s], shape (k, 2), None without.
            mag: Rows as in ``SensorReadings``, None without.
            fixes: Rows as in ``SensorReadings``, None without.
        """
        if len(self._fixes) >= _MOST_FIXES or len(self._path) >= _MOST_PERIODS:
            return
        if fixes is not None:
            self._fixes += fixes[np.isfinite(fixes[:, 1:3]).all(axis=1)].tolist()
        if mag is not None:
            # The field points north: seen from the body it turns the other way.
            east = np.pi / 2 - np.arctan2(mag[-1, 2], mag[-1, 1]) - self._yaw
            self._headings.append(complex(np.exp(1j * east)))
        if imu is None or speeds is None:
            return
        self._drive(float(speeds[-1, 0]), float(speeds[:, 1].mean()), float(imu[:, 3].mean()))

    def _drive(self, stamp: float, speed: float, yaw_rate: float) -> None:
        """Drive on to a time [s], with a mean speed [m/s] and yaw rate [rad/s]."""
        if self._stamp is not None and stamp > self._stamp:
            seconds = stamp - self._stamp
            middle = self._yaw + yaw_rate * seconds / 2
            self._position += speed * seconds * np.exp(1j * middle)
            self._yaw += yaw_rate * seconds
        self._stamp = stamp
        self._path.append((stamp, self._position))

    @property
    def fit(self) -> DrivingFit | None:
        """Fit of the path to the fixes; None where these are too few or too close together."""
        fixes = np.array(self._fixes).reshape(-1, 5)
        fixes = fixes[check_fixes(fixes).good]
        if len(fixes) < _FEWEST_FIXES or len(self._path) < _FEWEST_FIXES:
            return None
        stamps = np.array([stamp for stamp, _ in self._path])
        fixes = fixes[(fixes[:, 0] >= stamps[0]) & (fixes[:, 0] <= stamps[-1])]
        if len(fixes) < _FEWEST_FIXES:
            return None
        points = _local(fixes)
        path = np.interp(fixes[:, 0], stamps, np.array([at for _, at in self._path]))
        points, path = points - points.mean(), path - path.mean()
        spread, path_spread = (float(np.sqrt(np.mean(np.abs(z) ** 2))) for z in (points, path))
        variances = fixes[:, 4][np.isfinite(fixes[:, 4])]
        sigma = float(np.sqrt(np.median(variances))) if len(variances) else 0.0
        if spread < max(_MIN_SPREAD, _SPREAD_BY_SIGMA * sigma):
            return None
        product = complex(np.vdot(path, points)) / len(points)
        return DrivingFit(
            spread,
            path_spread,
            abs(product) / max(spread * path_spread, 1e-9),
            abs(product) / max(path_spread**2, 1e-9),
            float(np.angle(product)),
        )

    @property
    def remarks(self) -> list[str]:
        """Remarks on wheels that contradict the fixes, at most one line."""
        fit = self.fit
        if fit is None:
            return []
        is_alike = fit.correlation > _MIN_CORRELATION
        if not is_alike and fit.path_spread < _STANDING * fit.spread:
            return [
                f"wheels: the fixes move by {fit.spread:.1f} m around their mean, and the wheels' "
                f"mean speed by {fit.path_spread:.1f} m: a side is counted backwards, or the "
                "topic is not that of the driven wheels (--map /encoder_data=...)"
            ]
        if not is_alike:
            return []
        if not _SCALE[0] < fit.scale < _SCALE[1]:
            return [
                f"wheels: the fixes move by {fit.scale:.2g} of the way that the wheels report; "
                "give the unit (--unit wheels=m/s or a factor) or the wheel's radius "
                "(--set robot.wheel_radius=...)"
            ]
        if self._is_backwards(fit.heading):
            return [
                "wheels: the fixes move backwards where the wheels drive ahead by the compass: "
                "the wheels are counted backwards (--unit wheels=-1), or IMU and compass are "
                "mounted the other way round (--mounting imu=..., --mounting compass=...)"
            ]
        return []

    def _is_backwards(self, heading: float) -> bool:
        """Return whether a heading [rad] is opposite to that of the compass."""
        mean = complex(np.mean(self._headings)) if self._headings else 0j
        steady = abs(mean) > _MIN_CORRELATION
        return steady and float((mean * np.exp(-1j * heading)).real) < -0.5 * abs(mean)


def _local(fixes: Rows) -> NDArray[np.complex128]:
    """Return fixes as east and north [m] in the complex plane, shape (k,)."""
    latitudes, longitudes = np.deg2rad(fixes[:, 1]), np.deg2rad(fixes[:, 2])
    # Across the antimeridian a longitude jumps by a whole turn.
    turned = (longitudes - longitudes[0] + np.pi) % (2 * np.pi) - np.pi
    east = turned * np.cos(latitudes[0])
    return _EARTH_RADIUS * (east + 1j * (latitudes - latitudes[0]))
