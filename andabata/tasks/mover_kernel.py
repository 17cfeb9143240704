"""Compiled pass of moving obstacles in rooms: motion, coming and going, and who hit whom.

A mover goes straight at a constant speed. Where its next sub-step would overlap a wall, a box, a
circle or another mover, it stays for this sub-step, and its velocity is mirrored there; of two
movers that meet each one that approaches the other is mirrored. So movers never overlap what
stands, or each other, and their speeds never change (assumption; equal masses would exchange
velocities along the line between them). Robots do not turn them back.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.movers import AT_REST, Contact, Movers, Schedules
from terrain.kernel import inlined_kernel, kernel

_MOVER, _HIT, _HIT_AT_REST = int(Contact.MOVER), int(Contact.HIT), int(Contact.HIT_AT_REST)

_INSTANT = 1e-9
"""Time by which an event may seem late [s]: times are sums of periods."""


@kernel
def come_and_go(
    motions: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    stamps: NDArray[np.float64],
    movers: Movers,
    schedules: Schedules,
    radius: float,
) -> None:
    """Let movers appear and vanish, at the begin of a control period.

    One that is due waits as long as the robot or another mover is in its place.

    Args:
        motions: State of each robot, x and y first [m], shape (n, 5).
        chosen: True for robots that move, shape (n,).
        stamps: Time since each robot was put down [s], shape (n,).
        movers: Moving obstacles, changed in place.
        schedules: Schedules of the moving obstacles, changed in place.
        radius: Radius of the robots [m].
    """
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        now = stamps[k] + _INSTANT
        for m in range(movers.radii.shape[1]):
            if movers.radii[k, m] > 0.0:
                if now >= schedules.ends[k, m]:
                    movers.radii[k, m] = 0.0
                    schedules.begins[k, m] = np.inf
                continue
            if now < schedules.begins[k, m]:
                continue
            place, own = movers.places[k, m], schedules.radii[k, m]
            gap = np.hypot(motions[k, 0] - place[0], motions[k, 1] - place[1]) - own
            if gap < schedules.distances[k, m] and gap >= radius and _is_free(k, m, own, movers):
                movers.radii[k, m] = own
                schedules.ends[k, m] = stamps[k] + schedules.durations[k, m]


@kernel
def _is_free(k: int, m: int, radius: float, movers: Movers) -> bool:
    """Return True if no other mover overlaps the place of mover ``m`` of robot ``k``."""
    x, y = movers.places[k, m]
    for o in range(movers.radii.shape[1]):
        reach = radius + movers.radii[k, o]
        dx, dy = x - movers.places[k, o, 0], y - movers.places[k, o, 1]
        if o != m and movers.radii[k, o] > 0.0 and dx * dx + dy * dy < reach * reach:
            return False
    return True


@kernel
def advance(
    k: int,
    movers: Movers,
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    dt: float,
) -> None:
    """Move the movers of robot ``k`` for a sub-step, one after the other.

    A mover may not go farther than its radius in a sub-step: it would pass through what is thin.

    Args:
        k: Index of the robot.
        movers: Moving obstacles, changed in place.
        boxes: x_min, y_min, x_max, y_max of the room's boxes [m], shape (b, 4).
        circles: x, y, radius of its circles [m], shape (c, 3).
        dt: Length of the sub-step [s].
    """
    for m in range(movers.radii.shape[1]):
        velocity, radius = movers.velocities[k, m], movers.radii[k, m]
        if radius <= 0.0 or (velocity[0] == 0.0 and velocity[1] == 0.0):
            continue
        x = movers.places[k, m, 0] + velocity[0] * dt
        y = movers.places[k, m, 1] + velocity[1] * dt
        blocked = False
        for b in range(len(boxes)):
            # From the box's nearest point to the mover's centre.
            nx = x - min(max(x, boxes[b, 0]), boxes[b, 2])
            ny = y - min(max(y, boxes[b, 1]), boxes[b, 3])
            if nx * nx + ny * ny < radius * radius:
                blocked = True
                _mirror(velocity, nx, ny)
        for c in range(len(circles)):
            nx, ny, reach = x - circles[c, 0], y - circles[c, 1], radius + circles[c, 2]
            if nx * nx + ny * ny < reach * reach:
                blocked = True
                _mirror(velocity, nx, ny)
        for o in range(movers.radii.shape[1]):
            nx, ny = x - movers.places[k, o, 0], y - movers.places[k, o, 1]
            reach = radius + movers.radii[k, o]
            if o != m and movers.radii[k, o] > 0.0 and nx * nx + ny * ny < reach * reach:
                blocked = True
                _mirror(velocity, nx, ny)
                _mirror(movers.velocities[k, o], -nx, -ny)
        if not blocked:
            movers.places[k, m, 0], movers.places[k, m, 1] = x, y


@inlined_kernel
def _mirror(velocity: NDArray[np.float64], nx: float, ny: float) -> None:
    """Mirror a velocity that points against a normal of any length, in place."""
    against = velocity[0] * nx + velocity[1] * ny
    if against < 0.0:
        share = 2.0 * against / (nx * nx + ny * ny)
        velocity[0] -= share * nx
        velocity[1] -= share * ny


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
