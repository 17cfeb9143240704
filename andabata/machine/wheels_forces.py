"""Forces on a body with ray-cast wheels: tyres, hull, ground, solid objects and walkers.

A rim of a wheel touches the ground along a fan of rays in its plane, which turn with the body and
not with the wheel. Each ray that ends below the ground presses a spring along the ground's normal;
their sum is one contact with one damper and one patch of tyre. A patch holds by a deflection along
and across the wheel until its force leaves the friction ellipse; then it slides, and keeps the
deflection of that force. The stiffnesses of the two directions are as the squares of the ellipse's
axes, so that the force of a sliding patch is the one of largest dissipation: this is what turns a
skid-steer robot less than its wheels say.

Contacts of the hull are rigid: a share of the overlap and of the closing speed is undone in each
sub-step, by the mass that the body has at the place and in the direction of the contact.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.solid_contact import Solids, meet_box, meet_disc, overlaps
from andabata.machine.vectors import Axes, Vector, added, cross, dot, to_map
from andabata.machine.wheels_body import SUB_STEP, Tyres, WheelsBody
from terrain.kernel import kernel
from worlds.walking import Ground, WalkerTrack

_DEEPEST = 0.05
"""Largest depth of a contact that presses [m]: a body put down inside of something is not shot
out."""

_RESOLVED, _STOPPED = 0.2, 0.4
"""Shares of overlap and closing speed that a contact of the hull undoes in a sub-step."""

_GROUND_SHARE = 0.25
"""Ratio of a hull point's contact with the ground to that: many may touch at once."""

_MOMENT = 6
"""Column of ``loads`` of the first wheel's moment, after force and torque."""


class Motion(NamedTuple):
    """Place and motion of a body.

    Attributes:
        place: Centre of mass in the map [m].
        axes: Axes of the body.
        velocity: Velocity of the centre of mass [m/s].
        spin: Angular velocity in the axes of the map [rad/s].
    """

    place: Vector
    axes: Axes
    velocity: Vector
    spin: Vector


class _Touch(NamedTuple):
    """One contact.

    Attributes:
        push: Force of the spring [N], of a tyre; depth [m], of the hull.
        normal: Unit vector out of what is touched.
        arm: Place from the centre of mass [m].
    """

    push: float
    normal: Vector
    arm: Vector


@kernel
def surface(ground: Ground, x: float, y: float) -> tuple[float, Vector]:
    """Return height [m] and unit normal of the triangle of the ground at a place in the map [m].

    Beyond the border there is no ground: its height is minus infinity.
    """
    heights, cell = ground
    nx, ny = heights.shape
    u, v = x / cell + (nx - 1) / 2, y / cell + (ny - 1) / 2
    if not (0.0 <= u <= nx - 1.0 and 0.0 <= v <= ny - 1.0):
        return -np.inf, (0.0, 0.0, 1.0)
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    u, v = u - i, v - j
    h10, h01 = np.float64(heights[i + 1, j]), np.float64(heights[i, j + 1])
    if u + v <= 1.0:
        corner = np.float64(heights[i, j])
        along_x, along_y = h10 - corner, h01 - corner
        z = corner + u * along_x + v * along_y
    else:
        corner = np.float64(heights[i + 1, j + 1])
        along_x, along_y = corner - h01, corner - h10
        z = corner - (1.0 - u) * along_x - (1.0 - v) * along_y
    size = np.sqrt(along_x * along_x + along_y * along_y + cell * cell)
    return z, (-along_x / size, -along_y / size, cell / size)


@kernel
def add_force(loads: NDArray[np.float64], force: Vector, arm: Vector) -> None:
    """Add a force [N] that acts at an arm from the centre of mass [m] to force and torque."""
    torque = cross(arm, force)
    for c in range(3):
        loads[c] += force[c]
        loads[3 + c] += torque[c]


@kernel
def press_tyres(
    motion: Motion,
    body: WheelsBody,
    speeds: NDArray[np.float64],
    grips: NDArray[np.float64],
    ground: Ground,
    loads: NDArray[np.float64],
) -> None:
    """Add the forces of the ground on the wheels.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        speeds: Speed of each wheel [rad/s], shape (4,).
        grips: Deflection of each rim's patch along and across the wheel [m], changed in place,
            shape (8, 2).
        ground: Heights and cell of the ground.
        loads: Force [N] and torque [N m] on the body and moment about the axle of each wheel [N m],
            added to in place, shape (10,).
    """
    tyres = body.tyres
    for rim in range(len(tyres.rims)):
        x, y, z = tyres.rims[rim]
        centre = to_map(motion.axes, x, y, z)
        touch = _touch_ground(motion, centre, tyres, ground)
        if touch.push > 0.0:
            _roll(motion, tyres, touch, centre, rim // 2, speeds, grips[rim], loads)
        else:
            grips[rim, 0] = grips[rim, 1] = 0.0


@kernel
def _touch_ground(motion: Motion, centre: Vector, tyres: Tyres, ground: Ground) -> _Touch:
    """Return the sum of the springs of a rim, at the mean place of those that are pressed.

    Args:
        motion: Place and motion of the body.
        centre: Centre of the rim from the centre of mass [m].
        tyres: The wheels.
        ground: Heights and cell of the ground.
    """
    total = 0.0
    push, place = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for f in range(len(tyres.fan)):
        ray = to_map(motion.axes, tyres.fan[f, 0], 0.0, tyres.fan[f, 1])
        arm = added(centre, ray, tyres.radius)
        z, normal = surface(ground, motion.place[0] + arm[0], motion.place[1] + arm[1])
        depth = min((z - motion.place[2] - arm[2]) * normal[2], _DEEPEST)
        if depth > 0.0:
            total += depth
            push, place = added(push, normal, depth), added(place, arm, depth)
    if total == 0.0:
        return _Touch(0.0, motion.axes.up, centre)
    size = np.sqrt(dot(push, push))
    normal = push[0] / size, push[1] / size, push[2] / size
    arm = place[0] / total, place[1] / total, place[2] / total
    return _Touch(tyres.stiffness * size, normal, arm)


@kernel
def _roll(
    motion: Motion,
    tyres: Tyres,
    touch: _Touch,
    centre: Vector,
    wheel: int,
    speeds: NDArray[np.float64],
    grip: NDArray[np.float64],
    loads: NDArray[np.float64],
) -> None:
    """Add the force of a rim that is pressed: damped spring, and the patch within its ellipse.

    Args:
        motion: Place and motion of the body.
        tyres: The wheels.
        touch: Contact of the rim.
        centre: Centre of the rim from the centre of mass [m].
        wheel: Index of the wheel.
        speeds: Speed of each wheel [rad/s], shape (4,).
        grip: Deflection of the patch [m], changed in place, shape (2,).
        loads: As for ``press_tyres``.
    """
    left, spoke = motion.axes.left, added(touch.arm, centre, -1.0)
    velocity = added(motion.velocity, cross(motion.spin, touch.arm), 1.0)
    press = touch.push - tyres.damping * dot(velocity, touch.normal)
    along = cross(left, touch.normal)
    size = np.sqrt(dot(along, along))
    if press <= 0.0 or size == 0.0:
        grip[0] = grip[1] = 0.0
        return
    along = along[0] / size, along[1] / size, along[2] / size
    across = cross(touch.normal, along)
    slip = added(velocity, cross(left, spoke), speeds[wheel])
    # The stiffness across follows from the ellipse: see the module's text.
    softer = tyres.lateral * tyres.lateral
    slip_x, slip_y = dot(slip, along), dot(slip, across)
    # Rolling brings fresh rubber into the patch: what was deflected leaves it.
    renewed = 1.0 + SUB_STEP * abs(speeds[wheel]) * tyres.radius / tyres.relaxation
    grip[0] = (grip[0] + SUB_STEP * slip_x) / renewed
    grip[1] = (grip[1] + SUB_STEP * slip_y) / renewed
    force_x = -tyres.stiffness * grip[0] - tyres.damping * slip_x
    force_y = softer * (-tyres.stiffness * grip[1] - tyres.damping * slip_y)
    limit = tyres.friction * press
    excess = np.hypot(force_x, force_y / tyres.lateral) / limit
    if excess > 1.0:
        force_x, force_y = force_x / excess, force_y / excess
        grip[0] = -force_x / tyres.stiffness
        grip[1] = -force_y / (softer * tyres.stiffness)
    force = press * touch.normal[0], press * touch.normal[1], press * touch.normal[2]
    force = added(added(force, along, force_x), across, force_y)
    add_force(loads, force, touch.arm)
    loads[_MOMENT + wheel] += dot(left, cross(spoke, force))


@kernel
def strike_tyres(
    motion: Motion,
    body: WheelsBody,
    speeds: NDArray[np.float64],
    grips: NDArray[np.float64],
    ground: Ground,
    solids: Solids,
    near: NDArray[np.int64],
    loads: NDArray[np.float64],
) -> bool:
    """Add the forces of solid objects on the wheels; return True if one is too high to climb.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        speeds: Speed of each wheel [rad/s], shape (4,).
        grips: Deflection of each rim's patch on objects [m], changed in place, shape (8, 2).
        ground: Heights and cell of the ground.
        solids: Solid objects.
        near: Indices of the objects that are near.
        loads: As for ``press_tyres``.
    """
    tyres, struck = body.tyres, False
    for rim in range(len(tyres.rims)):
        x, y, z = tyres.rims[rim]
        centre = to_map(motion.axes, x, y, z)
        place = added(motion.place, centre, 1.0)
        nearest, ray = np.inf, motion.axes.up
        for k in near:
            if overlaps(solids.objects.boxes[k], place, tyres.radius + body.touch_distance):
                found = meet_disc(place, motion.axes, tyres.solid_fan, solids, k)
                if found.range < nearest:
                    nearest, ray = found.range, found.ray
        depth = tyres.radius - nearest
        if depth > -body.touch_distance:
            touched = added(place, ray, nearest)
            low, _ = surface(ground, touched[0], touched[1])
            struck |= touched[2] - low > body.collision_height
        if depth > 0.0:
            push = tyres.stiffness * min(depth, _DEEPEST)
            touch = _Touch(push, (-ray[0], -ray[1], -ray[2]), added(centre, ray, nearest))
            _roll(motion, tyres, touch, centre, rim // 2, speeds, grips[rim], loads)
        else:
            grips[rim, 0] = grips[rim, 1] = 0.0
    return struck


@kernel
def _mobility(body: WheelsBody, axes: Axes, arm: Vector, way: Vector) -> float:
    """Return the acceleration of a place of the body in a direction per force there [1/kg]."""
    lever = cross(arm, way)
    x, y, z = dot(lever, axes.forward), dot(lever, axes.left), dot(lever, axes.up)
    ix, iy, iz = body.inertia
    return 1.0 / body.mass + x * x / ix + y * y / iy + z * z / iz


@kernel
def _resist(
    motion: Motion,
    body: WheelsBody,
    touch: _Touch,
    moving: Vector,
    share: float,
    loads: NDArray[np.float64],
) -> None:
    """Add the force of a rigid contact of the hull, with friction.

    Args:
        motion: Place and motion of the body.
        body: Numbers of the robot.
        touch: Contact; its ``push`` is a depth [m].
        moving: Velocity of what is touched [m/s].
        share: Share of ``_RESOLVED`` and ``_STOPPED``.
        loads: As for ``press_tyres``.
    """
    slip = added(added(motion.velocity, cross(motion.spin, touch.arm), 1.0), moving, -1.0)
    closing = -dot(slip, touch.normal)
    undone = _RESOLVED * min(touch.push, _DEEPEST) / SUB_STEP + _STOPPED * closing
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
def scrape_hull(
    motion: Motion, body: WheelsBody, ground: Ground, loads: NDArray[np.float64]
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
        height, normal = surface(ground, motion.place[0] + arm[0], motion.place[1] + arm[1])
        depth = (height - motion.place[2] - arm[2]) * normal[2]
        if depth > 0.0:
            touch = _Touch(depth, normal, arm)
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
            _resist(motion, body, _Touch(-gap, normal, arm), (0.0, 0.0, 0.0), 1.0, loads)
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
    forward, left, up = motion.axes
    bottom, top = -body.hull.reach, box[2] + box[5]
    for m in range(movers.radii.shape[1]):
        radius = movers.radii[tick, m]
        dx = movers.places[tick, m, 0] - motion.place[0]
        dy = movers.places[tick, m, 1] - motion.place[1]
        if radius <= 0.0 or dx * dx + dy * dy > (radius + 2.0 * body.hull.reach) ** 2:
            continue
        foot = walkers.feet[tick, m] - motion.place[2]
        if foot > top or foot + walkers.heights[m] < bottom:
            continue
        x = min(max(dx * forward[0] + dy * forward[1], -box[3]), box[3])
        y = min(max(dx * left[0] + dy * left[1], -box[4]), box[4])
        arm = to_map((forward, left, up), x, y, box[2])
        away = np.hypot(arm[0] - dx, arm[1] - dy)
        gap = away - radius
        struck |= gap < body.touch_distance
        if gap < 0.0 and away > 0.0:
            normal = (arm[0] - dx) / away, (arm[1] - dy) / away, 0.0
            velocity = movers.velocities[tick, m, 0], movers.velocities[tick, m, 1], 0.0
            _resist(motion, body, _Touch(-gap, normal, arm), velocity, 1.0, loads)
    return struck
