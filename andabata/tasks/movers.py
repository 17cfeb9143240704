"""Moving obstacles of many robots' worlds: upright cylinders, circles in the plane."""

from enum import IntEnum
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


class Schedules(NamedTuple):
    """When movers come and go, m for each of n robots.

    Attributes:
        radii: Radius of each while it is there [m], shape (n, m).
        distances: Distance of the robot from the mover's edge below which it appears [m], infinite
            where time alone decides, shape (n, m).
        begins: Time before which it does not appear [s], infinite if it never will, shape (n, m).
        durations: Time from its appearance to its end [s], shape (n, m).
        ends: Time at which it vanishes [s], infinite before it appears, shape (n, m).
    """

    radii: NDArray[np.float64]
    distances: NDArray[np.float64]
    begins: NDArray[np.float64]
    durations: NDArray[np.float64]
    ends: NDArray[np.float64]

    @classmethod
    def none(cls, count: int, each: int = 0) -> "Schedules":
        """Return schedules of movers that never come; arguments as for ``Movers.none``."""
        never = np.full((count, each), np.inf)
        return cls(np.zeros((count, each)), never, never.copy(), never.copy(), never.copy())


class Contact(IntEnum):
    """What a robot in contact touches, and who drove into whom.

    What stands comes first if several are touched. With a mover, the share of the speed at which
    the two close in decides, along the line between their centres: that of the robot's own motion,
    and that of the mover's.
    """

    NONE = 0
    """No contact."""

    OBSTACLE = 1
    """A wall, box or circle that stands."""

    MOVER = 2
    """A mover, and at least half of the closing speed is the robot's."""

    HIT = 3
    """A mover, and more than half of the closing speed is the mover's."""

    HIT_AT_REST = 4
    """A mover, while the robot stands: it drives at ``AT_REST`` at most, or turns on the spot."""

    @property
    def label(self) -> str:
        """Name for infos and tables, empty without contact."""
        return "" if self is Contact.NONE else self.name.lower()


AT_REST = 0.05
"""Speed up to which a robot counts as standing when it is hit [m/s] (assumption)."""
