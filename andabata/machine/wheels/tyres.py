"""Forces of the ground and of solid objects on ray-cast wheels.

A rim of a wheel touches the ground along a fan of rays in its plane, which turn with the body and
not with the wheel. Each ray that ends below the ground presses a spring along the ground's normal;
their sum is one contact with one damper and one patch of tyre. A patch holds by a deflection along
and across the wheel until its force leaves the friction ellipse; then it slides, and keeps the
deflection of that force. The stiffnesses of the two directions are as the squares of the ellipse's
axes, so that the force of a sliding patch is the one of largest dissipation: this is what turns a
skid-steer robot less than its wheels say. Patch and relaxation length are those of
single-contact-point tyre models (Pacejka 2012, "Tire and vehicle dynamics", chapter 7).

What is done for each rim is compiled into the loop over rims: called, with tuples of vectors that
then go through memory, it takes a quarter more of the plant's time.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.solid_contact import Solids, meet_disc, overlaps
from andabata.machine.vectors import Vector, added, cross, dot, to_map
from andabata.machine.wheels.body import SUB_STEP, Tyres, WheelsBody
from andabata.machine.wheels.contact import (
    DEEPEST,
    MOMENT,
    Motion,
    Touch,
    add_force,
    surface,
    touch_ground,
)
from terrain.kernel import inlined_kernel, kernel
from worlds.walking import HeightGrid


@kernel
def press_tyres(
    motion: Motion,
    body: WheelsBody,
    speeds: NDArray[np.float64],
    grips: NDArray[np.float64],
    ground: HeightGrid,
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
        touch = _press(motion, centre, tyres, ground)
        if touch.depth > 0.0:
            _roll(motion, tyres, touch, centre, rim // 2, speeds, grips[rim], loads)
        else:
            grips[rim, 0] = grips[rim, 1] = 0.0


@inlined_kernel
def _press(motion: Motion, centre: Vector, tyres: Tyres, ground: HeightGrid) -> Touch:
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
        arm = added(centre, ray, tyres.radius + tyres.sag)
        touch = touch_ground(motion, arm, ground)
        if touch.depth > 0.0:
            depth = min(touch.depth, DEEPEST)
            total += depth
            # Whatever it carries a tyre rolls on one radius, or wheels of one speed would fight.
            met = added(centre, ray, tyres.radius)
            push, place = added(push, touch.normal, depth), added(place, met, depth)
    if total == 0.0:
        return Touch(0.0, motion.axes.up, centre)
    size = np.sqrt(dot(push, push))
    normal = push[0] / size, push[1] / size, push[2] / size
    arm = place[0] / total, place[1] / total, place[2] / total
    return Touch(size, normal, arm)


@inlined_kernel
def _roll(
    motion: Motion,
    tyres: Tyres,
    touch: Touch,
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
    press = tyres.stiffness * touch.depth - tyres.damping * dot(velocity, touch.normal)
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
    loads[MOMENT + wheel] += dot(left, cross(spoke, force))


@kernel
def strike_tyres(
    motion: Motion,
    body: WheelsBody,
    speeds: NDArray[np.float64],
    grips: NDArray[np.float64],
    ground: HeightGrid,
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
    radius = tyres.radius + tyres.sag
    reach = radius + body.touch_distance
    for rim in range(len(tyres.rims)):
        x, y, z = tyres.rims[rim]
        centre = to_map(motion.axes, x, y, z)
        place = added(motion.place, centre, 1.0)
        nearest, way = np.inf, motion.axes.up
        for k in near:
            if overlaps(solids.objects.boxes[k], place, reach):
                found = meet_disc(place, motion.axes, reach, solids, k)
                if found.distance < nearest:
                    nearest, way = found.distance, found.way
        depth = radius - nearest
        if depth > -body.touch_distance:
            touched = added(place, way, nearest)
            low, _, _ = surface(ground, touched[0], touched[1])
            struck |= touched[2] - low > body.collision_height
        if depth > 0.0:
            out = -way[0], -way[1], -way[2]
            touch = Touch(min(depth, DEEPEST), out, added(centre, way, nearest))
            _roll(motion, tyres, touch, centre, rim // 2, speeds, grips[rim], loads)
        else:
            grips[rim, 0] = grips[rim, 1] = 0.0
    return struck
