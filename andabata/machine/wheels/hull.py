"""Forces of ground, solid objects and walkers on the hull of a body with ray-cast wheels.

Contacts of the hull are rigid: a share of the overlap and of the closing speed is undone in each
sub-step, by the mass that the body has at the place and in the direction of the contact.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.solid_contact import Solids, meet_box
from andabata.machine.vectors import Axes, Vector, added, cross, dot, to_map
from andabata.machine.wheels.body import SUB_STEP, WheelsBody
from andabata.machine.wheels.contact import DEEPEST, Motion, Touch, add_force, touch_ground
from terrain.kernel import kernel
from worlds.walking import HeightGrid, WalkerTrack

_RESOLVED, _STOPPED = 0.2, 0.4
"""Shares of overlap and closing speed that a contact undoes in a sub-step."""

_GROUND_SHARE = 0.25
"""Share of that for a point on the ground, of which many may touch at once."""


@kernel
def scrape_hull(
    motion: Motion, body: WheelsBody, ground: HeightGrid, loads: NDArray[np.float64]
) -> None:
    """Add the forces of the ground on the hull: on its floor, and on its corners once it fell.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        ground: Heights and cell of the ground.
        loads: As for ``press_tyres``.
    """
    for p in range(len(body.hull.points)):
        x, y, z = body.hull.points[p]
        arm = to_map(motion.axes, x, y, z)
        touch = touch_ground(motion, arm, ground)
        if touch.depth > 0.0:
            _resist(motion, body, touch, (0.0, 0.0, 0.0), _GROUND_SHARE, loads)


@kernel
def strike_hull(
    motion: Motion,
    body: WheelsBody,
    solids: Solids,
    near: NDArray[np.int64],
    loads: NDArray[np.float64],
) -> bool:
    """Add the forces of solid objects on the hull; return True if one touches it.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        solids: Solid objects.
        near: Indices of the objects that are near.
        loads: As for ``press_tyres``.
    """
    struck, boxes = False, body.hull.boxes
    for k in near:
        # The deeper of both boxes presses: their contacts are on one object.
        gap, normal, arm = np.inf, motion.axes.up, motion.place
        for b in range(len(boxes)):
            centre = to_map(motion.axes, boxes[b, 0], boxes[b, 1], boxes[b, 2])
            half = boxes[b, 3], boxes[b, 4], boxes[b, 5]
            met = meet_box(added(motion.place, centre, 1.0), motion.axes, half, solids, k)
            if met.gap < gap:
                gap, normal, arm = met.gap, met.normal, added(met.place, motion.place, -1.0)
        struck |= gap < body.touch_distance
        if gap < 0.0:
            _resist(motion, body, Touch(-gap, normal, arm), (0.0, 0.0, 0.0), 1.0, loads)
    return struck


@kernel
def meet_walkers(
    motion: Motion,
    body: WheelsBody,
    walkers: WalkerTrack,
    tick: int,
    loads: NDArray[np.float64],
) -> bool:
    """Add the forces of walkers, whom nothing pushes; return True if one touches the body.

    Seen from above the body is the rectangle of its hull, as for the kinematic plant.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        walkers: Walkers at the ticks of a drive.
        tick: Index of the tick.
        loads: As for ``press_tyres``.
    """
    movers, box, struck = walkers.movers, body.hull.boxes[1], False
    floor = body.hull.boxes[0, 2] - body.hull.boxes[0, 5]
    forward, left, _ = motion.axes
    for m in range(movers.radii.shape[1]):
        radius = movers.radii[tick, m]
        dx = movers.places[tick, m, 0] - motion.place[0]
        dy = movers.places[tick, m, 1] - motion.place[1]
        if radius <= 0.0 or dx * dx + dy * dy > (radius + 2.0 * body.hull.reach) ** 2:
            continue
        foot = walkers.feet[tick, m] - motion.place[2]
        if foot > box[2] + box[5] or foot + walkers.heights[m] < floor:
            continue
        x = min(max(dx * forward[0] + dy * forward[1], -box[3]), box[3])
        y = min(max(dx * left[0] + dy * left[1], -box[4]), box[4])
        arm = to_map(motion.axes, x, y, floor)
        away = np.hypot(arm[0] - dx, arm[1] - dy)
        gap = away - radius
        struck |= gap < body.touch_distance
        if gap < 0.0 and away > 0.0:
            normal = (arm[0] - dx) / away, (arm[1] - dy) / away, 0.0
            velocity = movers.velocities[tick, m, 0], movers.velocities[tick, m, 1], 0.0
            _resist(motion, body, Touch(-gap, normal, arm), velocity, 1.0, loads)
    return struck


@kernel
def _resist(
    motion: Motion,
    body: WheelsBody,
    touch: Touch,
    moving: Vector,
    share: float,
    loads: NDArray[np.float64],
) -> None:
    """Add the force of a rigid contact of the hull, with friction.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        touch: Contact.
        moving: Velocity of what is touched [m/s].
        share: Share of ``_RESOLVED`` and ``_STOPPED``.
        loads: As for ``press_tyres``.
    """
    slip = added(added(motion.velocity, cross(motion.spin, touch.arm), 1.0), moving, -1.0)
    closing = -dot(slip, touch.normal)
    undone = _RESOLVED * min(touch.depth, DEEPEST) / SUB_STEP + _STOPPED * closing
    if undone <= 0.0:
        return
    press = share * undone / SUB_STEP / _mobility(body, motion.axes, touch.arm, touch.normal)
    force = press * touch.normal[0], press * touch.normal[1], press * touch.normal[2]
    slip = added(slip, touch.normal, closing)
    size = np.sqrt(dot(slip, slip))
    if size > 0.0:
        way = slip[0] / size, slip[1] / size, slip[2] / size
        # Friction never turns the motion round within the sub-step.
        most = share * _STOPPED * size / SUB_STEP / _mobility(body, motion.axes, touch.arm, way)
        force = added(force, way, -min(body.hull.friction * press, most))
    add_force(loads, force, touch.arm)


@kernel
def _mobility(body: WheelsBody, axes: Axes, arm: Vector, way: Vector) -> float:
    """Return the acceleration of a place of the body in a direction per force there [1/kg]."""
    lever = cross(arm, way)
    x, y, z = dot(lever, axes.forward), dot(lever, axes.left), dot(lever, axes.up)
    ix, iy, iz = body.inertia
    return 1.0 / body.mass + x * x / ix + y * y / iy + z * z / iz
