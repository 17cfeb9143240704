"""Moving obstacles of many robots' worlds: upright cylinders, circles in the plane."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Movers(NamedTuple):
    """Moving upright cylinders, m for each of n robots; m may be 0.

    Attributes:
        places: Centres in the map [m], shape (n, m, 2).
        velocities: Velocities [m/s], shape (n, m, 2).
        radii: Radii [m], shape (n, m); 0 where there is none.
    """

    places: NDArray[np.float64]
    velocities: NDArray[np.float64]
    radii: NDArray[np.float64]

    @classmethod
    def none(cls, count: int, each: int = 0) -> "Movers":
        """Return no movers for some robots.

        Args:
            count: Number of robots.
            each: Number of movers of each that may come.
        """
        return cls(np.zeros((count, each, 2)), np.zeros((count, each, 2)), np.zeros((count, each)))
