"""Conversion of satellite fixes from geodetic coordinates to measurements in the map."""

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from andabata.localization.fix_check import check_fixes
from andabata.localization.ukf_config import UkfConfig
from andabata.machine.geo_reference import GeoReference

_UNKNOWN_HEIGHT_SIGMA = 1e6
"""Vertical standard deviation of a fix without an altitude [m]: it has no weight."""

_MIN_VARIANCE = 1e-4
"""Least variance of a fix [m2]: a centimetre, whatever the receiver reports."""


class FixConverter:
    """Checks fixes, converts them to the map and counts what it rejects or assumes.

    Attributes:
        rejected: Number of rejected fixes, by reason.
        assumed: Number of fixes with something missing, by what was assumed.
    """

    def __init__(self, config: UkfConfig, geo_reference: GeoReference) -> None:
        """Begin without any fix.

        Args:
            config: Parameters of the filter.
            geo_reference: Datum of the map.
        """
        self._config = config
        self.rejected, self.assumed = Counter[str](), Counter[str]()
        self.set_geo_reference(geo_reference)

    def set_geo_reference(self, geo_reference: GeoReference) -> None:
        """Replace the datum of the map.

        Args:
            geo_reference: Datum of the map.
        """
        self._geo_reference = geo_reference
        # Added to heights by fixes [m]; None until the first fix with an altitude.
        self._height_offset: float | None = None if geo_reference.altitude is None else 0.0

    def clear_counts(self) -> None:
        """Begin to count anew."""
        self.rejected.clear()
        self.assumed.clear()

    def to_map(self, fixes: NDArray[np.float64], height: float) -> tuple[NDArray[np.float64], int]:
        """Return the valid fixes in the map, and the number of rejected ones.

        Args:
            fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5).
            height: Estimated height in the map [m], for fixes without an altitude.

        Returns:
            Rows of stamp [s], x, y, z, horizontal sigma as it is stated and vertical sigma [m],
            shape (j, 6), and the number of fixes that were rejected.
        """
        if not len(fixes):
            return np.empty((0, 6)), 0
        check = check_fixes(fixes)
        rejected = check.rejected.total()
        self.rejected += check.rejected
        self.assumed += check.assumed
        fixes = fixes[check.good]
        if not len(fixes):
            return np.empty((0, 6)), rejected
        rows = np.empty((len(fixes), 6))
        rows[:, 0], rows[:, 1:4] = fixes[:, 0], self._positions(fixes[:, 1:4], height)
        rows[:, 4:] = [self._sigmas(*fix) for fix in fixes[:, 3:].tolist()]
        return rows, rejected

    def _sigmas(self, altitude: float, variance: float) -> tuple[float, float]:
        """Return the horizontal and the vertical sigma of a fix [m], by what the receiver says."""
        config = self._config
        known = math.isfinite(variance) and variance > 0
        variance = max(variance, _MIN_VARIANCE) if known else config.fix_sigma**2
        sigma = math.sqrt(variance)
        if math.isnan(altitude):
            return sigma, _UNKNOWN_HEIGHT_SIGMA
        vertical = config.vertical_ratio * max(sigma, config.receiver.total)
        return sigma, vertical

    def _positions(self, geodetic: NDArray[np.float64], height: float) -> NDArray[np.float64]:
        """Return positions in the map [m]; those without an altitude at the given height."""
        geo_reference, flat = self._geo_reference, np.isnan(geodetic[:, 2])
        if not flat.any() and self._height_offset == 0.0:
            return geo_reference.to_map(geodetic)
        filled = geodetic.copy()
        filled[flat, 2] = geo_reference.altitude or 0.0
        positions = geo_reference.to_map(filled)
        # A datum without an altitude: heights count from the first fix that has one.
        if self._height_offset is None and not flat.all():
            self._height_offset = float(height - positions[~flat, 2][0])
        positions[:, 2] += self._height_offset or 0.0
        positions[flat, 2] = height
        return positions
