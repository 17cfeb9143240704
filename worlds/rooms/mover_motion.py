"""Moving obstacles as compiled code takes them: their state, their motion, coming and going.

Movers are upright cylinders, circles in the plane, in rooms and on natural ground alike. A mover
goes straight at a constant speed. Where its next sub-step would overlap a box, a circle, an edge
or another mover, it stays for this sub-step, and its velocity is mirrored there; of two movers that
meet each one that approaches the other is mirrored. So movers never overlap what
stands, or each other, and their speeds never change (assumption; equal masses would exchange
velocities along the line between them). Robots do not turn them back.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from worlds.rooms.movers import Mover

_INSTANT = 1e-9
"""Time by which an event may seem late [s]: times are sums of periods."""


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


class Solids(NamedTuple):
    """What stands and movers may meet.

    Attributes:
        boxes: x_min, y_min, x_max, y_max [m], shape (b, 4).
        circles: x, y, radius [m], shape (c, 3).
        edges: x, y at the begin and at the end [m], shape (e, 4).
    """

    boxes: NDArray[np.float64]
    circles: NDArray[np.float64]
    edges: NDArray[np.float64]


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


def put_down(
    k: int, movers: Sequence[Mover], state: Movers, schedules: Schedules, dt: float
) -> None:
    """Put the moving obstacles of robot ``k`` down. Those that wait for nothing are there at once.

    Args:
        k: Index of the robot.
        movers: Its moving obstacles.
        state: Moving obstacles of all robots, changed in place.
        schedules: Their schedules, changed in place.
        dt: Length of a sub-step [s].

    Raises:
        ValueError: If there are too many, one has a course, or one is too fast for its size.
    """
    most = state.radii.shape[1]
    if len(movers) > most:
        raise ValueError(f"movers: expected at most {most}, got {len(movers)}; make room for more")
    for array in state:
        array[k] = 0.0
    for array in schedules:
        array[k] = np.inf
    for m, mover in enumerate(movers):
        plan = mover.plan
        if plan.course:
            raise ValueError(
                "movers: expected none with a course, which fields of --task barn have, got one; "
                "leave it out of a room to train or to drive policies in"
            )
        if plan.speed * dt > plan.radius:
            raise ValueError(
                f"movers: expected at most {plan.radius / dt:.3g} m/s of a mover of "
                f"{plan.radius} m, got {plan.speed}; a robot with more sub-steps lets it go"
            )
        state.places[k, m], state.velocities[k, m] = mover.place, mover.velocity
        schedules.radii[k, m] = plan.radius
        schedules.begins[k, m] = plan.appears_at
        if plan.duration is not None:
            schedules.durations[k, m] = plan.duration
        if plan.when_within is not None:
            schedules.distances[k, m] = plan.when_within
        elif plan.appears_at == 0.0:
            state.radii[k, m] = plan.radius
            schedules.ends[k, m] = schedules.durations[k, m]


@inlined_kernel
def movers_of(movers: Movers, k: int) -> Movers:
    """Return the movers of robot ``k``, one row, which change with those of all."""
    return Movers(movers.places[k : k + 1], movers.velocities[k : k + 1], movers.radii[k : k + 1])


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
        motions: State of each robot, x and y first [m], shape (n, 2) or wider.
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
    edges: NDArray[np.float64],
    dt: float,
) -> None:
    """Move the movers of robot ``k`` for a sub-step, one after the other.

    A mover may not go farther than its radius in a sub-step: it would pass through what is thin.

    Args:
        k: Index of the robot.
        movers: Moving obstacles, changed in place.
        boxes: x_min, y_min, x_max, y_max of the room's boxes [m], shape (b, 4).
        circles: x, y, radius of its circles [m], shape (c, 3).
        edges: x, y at the begin and at the end of its slanted edges [m], shape (e, 4).
        dt: Length of the sub-step [s].
    """
    for m in range(movers.radii.shape[1]):
        advance_one(k, m, movers, boxes, circles, edges, dt)


@inlined_kernel
def advance_one(
    k: int,
    m: int,
    movers: Movers,
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    edges: NDArray[np.float64],
    dt: float,
) -> None:
    """Move mover ``m`` of robot ``k`` for a sub-step; arguments as for ``advance``."""
    velocity, radius = movers.velocities[k, m], movers.radii[k, m]
    if radius <= 0.0 or (velocity[0] == 0.0 and velocity[1] == 0.0):
        return
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
    for e in range(len(edges)):
        # From the edge's nearest point to the mover's centre.
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        share = ((x - edges[e, 0]) * dx + (y - edges[e, 1]) * dy) / (dx * dx + dy * dy)
        share = min(max(share, 0.0), 1.0)
        nx, ny = x - edges[e, 0] - share * dx, y - edges[e, 1] - share * dy
        if nx * nx + ny * ny < radius * radius:
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
