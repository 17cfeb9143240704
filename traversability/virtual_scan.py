"""The virtual 2D traversability scanner: how far is it free, in every sector?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class VirtualScan:
    """Free distance in every sector around the vehicle.

    Attributes:
        ranges: Inner edge of each sector's nearest non-traversable cell [m]; ``inf`` is free to the
            last ring, NaN is unknown (no cell of the sector could be judged). float32, shape
            (n_sectors,), sector 0 centred on bearing ``-pi + pi / n_sectors``, then
            counter-clockwise (REP-117).
        max_range: Last ring edge [m].
    """

    ranges: NDArray[np.float32]
    max_range: float

    def finite(self) -> NDArray[np.float32]:
        """Return the ranges as the policy sees them: free and unknown are ``max_range`` [m]."""
        return np.where(np.isfinite(self.ranges), self.ranges, np.float32(self.max_range))
