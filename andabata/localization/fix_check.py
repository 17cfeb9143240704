"""Validation of satellite fixes before they are used: what is rejected, and what is assumed."""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.machine.geo_reference import MAX_ALTITUDE, MAX_LATITUDE_DEG, MIN_ALTITUDE

MAX_SIGMA = 1000.0
"""Largest standard deviation of an accepted fix [m]."""

_FAR = 1e6
"""Altitude that no receiver on Earth has [m]."""

NO_COVARIANCE = "no covariance: the default is taken"
"""Assumption about a fix without a covariance."""

NO_ALTITUDE = "no altitude: the horizontal place is used"
"""Assumption about a fix without an altitude."""


@dataclass(frozen=True)
class FixCheck:
    """Result of a validation.

    Attributes:
        good: True for rows that can be used, bool, shape (k,).
        rejected: Number of rejected rows, by reason. A row in which the receiver reports no fix is
            neither good nor rejected.
        assumed: Number of good rows with something missing, by what was assumed.
    """

    good: NDArray[np.bool_]
    rejected: Counter[str]
    assumed: Counter[str]


def reports_no_fix(fixes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows say that the receiver has no fix.

    Args:
        fixes: Rows as in ``check_fixes``.

    Returns:
        True for such a report, bool, shape (k,). Noise of a damaged link is none: its place would
        have to be no number twice, or a place.
    """
    whole = np.isfinite(fixes[:, 1]) == np.isfinite(fixes[:, 2])
    return np.isposinf(fixes[:, 4]) & whole & np.isfinite(fixes[:, 0])


def is_impossible(fixes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows have numbers that no receiver sends, with a fix or without one.

    Args:
        fixes: Rows as in ``check_fixes``.

    Returns:
        True for a place that is no place on Earth, half a place, or a negative variance, bool,
        shape (k,). A place that is no number, or zero, is that of a receiver without a fix.
    """
    latitude, longitude, altitude, variance = fixes[:, 1:].T
    half = np.isnan(latitude) != np.isnan(longitude)
    far = (np.abs(latitude) > 90) | (np.abs(longitude) > 360) | (np.abs(altitude) > _FAR)
    return half | far | (variance < 0)


def check_fixes(fixes: NDArray[np.float64]) -> FixCheck:
    """Validate fixes and return which can be used.

    Args:
        fixes: Rows of stamp [s], latitude, longitude [deg], altitude [m], NaN if unknown, and
            horizontal variance [m2], infinite without a fix and NaN or zero if unknown; shape
            (k, 5).
    """
    good = np.zeros(len(fixes), dtype=np.bool_)
    rejected, assumed = Counter[str](), Counter[str]()
    for k, (stamp, latitude, longitude, altitude, variance) in enumerate(fixes.tolist()):
        # An infinite variance is the receiver's own report of no fix: nothing to reject.
        if variance == math.inf:
            continue
        reason = _reason_against(stamp, latitude, longitude, altitude, variance)
        if reason is not None:
            rejected[reason] += 1
            continue
        good[k] = True
        if math.isnan(variance) or variance == 0:
            assumed[NO_COVARIANCE] += 1
        if math.isnan(altitude):
            assumed[NO_ALTITUDE] += 1
    return FixCheck(good, rejected, assumed)


def _reason_against(
    stamp: float, latitude: float, longitude: float, altitude: float, variance: float
) -> str | None:
    """Return the first reason for which a fix is rejected, None without any."""
    if not math.isfinite(stamp):
        return "a stamp that is no number"
    if not (math.isfinite(latitude) and math.isfinite(longitude)):
        return "a place that is no number"
    if latitude == 0 and longitude == 0:
        return "at latitude 0, longitude 0, which receivers send without a position"
    if abs(latitude) > 90:
        return "latitude beyond 90 degrees, which swapped latitude and longitude explain"
    if abs(latitude) > MAX_LATITUDE_DEG:
        return f"latitude beyond {MAX_LATITUDE_DEG:.0f} degrees, too near to a pole"
    if abs(longitude) > 360:
        return "longitude beyond 360 degrees"
    if altitude < MIN_ALTITUDE or altitude > MAX_ALTITUDE:  # One that is unknown is neither.
        return f"altitude outside of {MIN_ALTITUDE:.0f} to {MAX_ALTITUDE:.0f} m"
    if variance < 0:
        return "a negative variance"
    if variance > MAX_SIGMA**2:
        return f"a standard deviation beyond {MAX_SIGMA:.0f} m"
    return None
