"""Check of satellite fixes before anything believes them: what is refused, and what is assumed."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.machine.geo_reference import MAX_ALTITUDE, MAX_LATITUDE_DEG, MIN_ALTITUDE

MAX_SIGMA = 1000.0
"""Largest standard deviation of a fix that is believed [m]."""

NO_COVARIANCE = "no covariance: the default is taken"
NO_ALTITUDE = "no altitude: the horizontal place is used"


@dataclass(frozen=True)
class FixCheck:
    """Outcome of a check.

    Attributes:
        good: Which rows can be used, bool, shape (k,).
        refused: Number of refused rows by reason. A receiver that says that it has no fix is
            neither good nor refused.
        assumed: Number of good rows in which something was missing, by what was done.
    """

    good: NDArray[np.bool_]
    refused: Counter[str]
    assumed: Counter[str]


def check_fixes(fixes: NDArray[np.float64]) -> FixCheck:
    """Return which fixes can be used.

    Args:
        fixes: Rows of stamp [s], latitude, longitude [deg], altitude [m], which is NaN where it is
            unknown, horizontal variance [m2], which is infinite without a fix and NaN or zero where
            it is unknown; shape (k, 5).
    """
    stamp, latitude, longitude, altitude, variance = fixes.T
    open_rows = ~np.isposinf(variance)  # The others say themselves that they are no fix.
    good, refused = open_rows.copy(), Counter[str]()
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
                refused[reason] += count
                good &= ~bad
    assumed = Counter[str]()
    for text, missing in (
        (NO_COVARIANCE, np.isnan(variance) | (variance == 0)),
        (NO_ALTITUDE, np.isnan(altitude)),
    ):
        if count := int((good & missing).sum()):
            assumed[text] += count
    return FixCheck(good, refused, assumed)
