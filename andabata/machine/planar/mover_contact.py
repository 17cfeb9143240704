"""Contacts of a robot with what stands and what moves, and who drove into whom."""

import math
from enum import IntEnum

import numpy as np

from andabata.machine.robot import RobotModel
from terrain.kernel import kernel
from worlds.rooms.mover_motion import Movers

AT_REST = 0.05
"""Speed up to which a robot counts as standing when it is hit [m/s] (assumption)."""

_SLACK = 0.02
"""Distance at which bodies touch in the physics, and a little [m]."""


class Contact(IntEnum):
    """What a robot in contact touches, and who drove into whom.

    What stands comes first if several are touched. With a mover, the share of the speed at which
    the two close in decides, along the line between their centres: that of the robot's own motion,
    and that of the mover's.
    """

    NONE = 0
    """No contact."""

    OBSTACLE = 1
    """A wall, a trunk or another thing that stands."""

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


_MOVER, _HIT, _HIT_AT_REST = int(Contact.MOVER), int(Contact.HIT), int(Contact.HIT_AT_REST)


@kernel
def contact_with_mover(
    x: float, y: float, yaw: float, speed: float, radius: float, k: int, movers: Movers
) -> int:
    """Return the ``Contact`` of a robot with the mover that it overlaps most, 0 without any.

    Args:
        x: Place of the robot [m].
        y: Place of the robot [m].
        yaw: Heading of the robot [rad].
        speed: Speed of the robot [m/s].
        radius: Radius of the robot [m].
        k: Index of the robot.
        movers: Moving obstacles.
    """
    nearest, which = 0.0, -1
    for m in range(movers.radii.shape[1]):
        if movers.radii[k, m] > 0.0:
            away = np.hypot(movers.places[k, m, 0] - x, movers.places[k, m, 1] - y)
            gap = away - movers.radii[k, m] - radius
            if gap < nearest:
                nearest, which = gap, m
    if which < 0:
        return 0
    if abs(speed) <= AT_REST:
        return _HIT_AT_REST
    # Both closing speeds times the distance of the centres: only their order counts.
    nx, ny = movers.places[k, which, 0] - x, movers.places[k, which, 1] - y
    own = speed * (np.cos(yaw) * nx + np.sin(yaw) * ny)
    others = -(movers.velocities[k, which, 0] * nx + movers.velocities[k, which, 1] * ny)
    return _MOVER if own >= others else _HIT


@kernel
def touches_mover(
    x: float, y: float, yaw: float, half_length: float, half_width: float, k: int, movers: Movers
) -> bool:
    """Return True if a rectangular robot overlaps a mover, as seen from above.

    Args:
        x: Place of its middle [m].
        y: Place of its middle [m].
        yaw: Heading of the robot [rad].
        half_length: Half of its length [m].
        half_width: Half of its width [m].
        k: Index of the robot.
        movers: Moving obstacles.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    for m in range(movers.radii.shape[1]):
        radius = movers.radii[k, m]
        if radius > 0.0:
            dx, dy = movers.places[k, m, 0] - x, movers.places[k, m, 1] - y
            ahead = max(abs(c * dx + s * dy) - half_length, 0.0)
            aside = max(abs(c * dy - s * dx) - half_width, 0.0)
            if ahead * ahead + aside * aside < radius * radius:
                return True
    return False


def walker_contact(
    pose: tuple[float, float, float], speed: float, robot: RobotModel, tick: int, movers: Movers
) -> Contact:
    """Return the ``Contact`` of a robot that touches a walker.

    Args:
        pose: x, y [m] and yaw [rad] of the robot.
        speed: Speed of the robot before it touched [m/s].
        robot: Parameters of the body.
        tick: Index of the tick, the first axis of ``movers``.
        movers: Walkers at some ticks.
    """
    # Who is nearest to the middle, of all that may touch the body, is who touches it.
    reach = math.hypot(robot.length, robot.width) / 2 + _SLACK
    return Contact(contact_with_mover(*pose, speed, reach, tick, movers) or Contact.MOVER)
