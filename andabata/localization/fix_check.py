"""Validation of satellite fixes before they are used: what is rejected, and what is assumed."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.machine.geo_reference import MAX_ALTITUDE, MAX_LATITUDE_DEG, MIN_ALTITUDE

MAX_SIGMA = 1000.0
"""Largest standard deviation of an accepted fix [m]."""

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


def check_fixes(fixes: NDArray[np.float64]) -> FixCheck:
    """Validate fixes and return which can be used.

    Args:
        fixes: Rows of stamp [s], latitude, longitude [deg], altitude [m], NaN if unknown, and
            horizontal variance [m2], infinite without a fix and NaN or zero if unknown; shape
            (k, 5).
    """
    stamp, latitude, longitude, altitude, variance = fixes.T
    # An infinite variance is the receiver's own report of no fix: nothing to reject.
    good, rejected = ~np.isposinf(variance), Counter[str]()
    with np.errstate(invalid="ignore"):
        for reason, bad in (
            ("a stamp that is no number", ~np.isfinite(stamp)),
            ("a place that is no number", ~(np.isfinite(latitude) & np.isfinite(longitude))),
            (
                "at latitude 0, longitude 0, which receivers send without a position",
                (latitude == 0) & (longitude == 0),
            ),
            (
                "latitude beyond 90 degrees, which swapped latitude and longitude explain",
                np.abs(latitude) > 90,
            ),
            (
                f"latitude beyond {MAX_LATITUDE_DEG:.0f} degrees, too near to a pole",
                np.abs(latitude) > MAX_LATITUDE_DEG,
            ),
            ("longitude beyond 360 degrees", np.abs(longitude) > 360),
            (
                f"altitude outside of {MIN_ALTITUDE:.0f} to {MAX_ALTITUDE:.0f} m",
                (altitude < MIN_ALTITUDE) | (altitude > MAX_ALTITUDE),
            ),
            ("a negative variance", variance < 0),
            (f"a standard deviation beyond {MAX_SIGMA:.0f} m", variance > MAX_SIGMA**2),
        ):
            if count := int((good & bad).sum()):
                # A row counts for its first reason alone.
                rejected[reason] += count
                good &= ~bad
    assumed = Counter[str]()
    for text, missing in (
        (NO_COVARIANCE, np.isnan(variance) | (variance == 0)),
        (NO_ALTITUDE, np.isnan(altitude)),
    ):
        if count := int((good & missing).sum()):
            assumed[text] += count
    return FixCheck(good, rejected, assumed)
