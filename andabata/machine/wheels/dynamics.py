"""Rigid-body motion of a robot on ray-cast wheels, compiled: forces, motors, integration.

Semi-implicit Euler at 200 Hz: forces of the state move velocities, and these move the places. The
state of the rotation is the angular momentum in the map, which free fall leaves as it is.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.solid_contact import Solids, find_near
from andabata.machine.vectors import Axes, axes_of, dot, to_map
from andabata.machine.wheels.body import GRAVITY, SUB_STEP, SUB_STEPS, WheelsBody
from andabata.machine.wheels.contact import MOMENT, TORQUE, Motion
from andabata.machine.wheels.hull import meet_walkers, scrape_hull, strike_hull
from andabata.machine.wheels.tyres import press_tyres, strike_tyres
from terrain.kernel import kernel
from worlds.drag import PERIOD, DragMap, braking, drag_at
from worlds.walking import HeightGrid, WalkerTrack

_MOST_NEAR = 64
"""Largest number of objects that the body can touch at once."""


class WheelsState(NamedTuple):
    """State of a robot, changed in place.

    Attributes:
        place: Centre of mass in the map [m], shape (3,).
        quaternion: Orientation x, y, z, w, shape (4,).
        velocity: Velocity of the centre of mass [m/s], shape (3,).
        momentum: Angular momentum in the axes of the map [kg m2/s], shape (3,).
        speeds: Speed of each wheel, front left, rear left, front right, rear right [rad/s],
            shape (4,).
        grips: Deflection of each rim's patch along and across the wheel, on the ground and on
            objects [m], shape (2, 8, 2).
        work: Work of the motors, which do not recuperate [J], shape (1,).
        tipped: True once the body has rolled over, shape (1,).
    """

    place: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    velocity: NDArray[np.float64]
    momentum: NDArray[np.float64]
    speeds: NDArray[np.float64]
    grips: NDArray[np.float64]
    work: NDArray[np.float64]
    tipped: NDArray[np.bool_]

    @classmethod
    def at_rest(cls, place: NDArray[np.float64], quaternion: NDArray[np.float64]) -> "WheelsState":
        """Return a robot at rest.

        Args:
            place: Centre of mass in the map [m], shape (3,).
            quaternion: Orientation x, y, z, w, shape (4,).
        """
        return cls(
            place,
            quaternion,
            velocity=np.zeros(3),
            momentum=np.zeros(3),
            speeds=np.zeros(4),
            grips=np.zeros((2, 8, 2)),
            work=np.zeros(1),
            tipped=np.zeros(1, dtype=np.bool_),
        )


class Surroundings(NamedTuple):
    """What a robot can touch.

    Attributes:
        ground: Heights and cell of the ground.
        solids: Solid objects.
        walkers: Walkers at the end of each tick of a drive; none has a radius of 0.
    """

    ground: HeightGrid
    solids: Solids
    walkers: WalkerTrack


@kernel
def motion_of(state: WheelsState, body: WheelsBody) -> Motion:
    """Return place and motion of the body.

    Args:
        state: State of the robot.
        body: Numbers of the robot.
    """
    axes = axes_of(state.quaternion)
    place = state.place[0], state.place[1], state.place[2]
    velocity = state.velocity[0], state.velocity[1], state.velocity[2]
    momentum = state.momentum[0], state.momentum[1], state.momentum[2]
    ix, iy, iz = body.inertia
    x, y, z = dot(momentum, axes.forward), dot(momentum, axes.left), dot(momentum, axes.up)
    return Motion(place, axes, velocity, to_map(axes, x / ix, y / iy, z / iz))


@kernel
def drive_ticks(
    state: WheelsState,
    targets: NDArray[np.float64],
    body: WheelsBody,
    around: Surroundings,
    drag: DragMap,
    rows: NDArray[np.float64],
    contacts: NDArray[np.float64],
) -> None:
    """Move a robot for as many ticks as ``rows`` has.

    Args:
        state: State of the robot, changed in place.
        targets: Commanded speed of the left and of the right wheels [rad/s], shape (2,).
        body: Numbers of the robot.
        around: Ground, solids and walkers that it can touch.
        drag: Drag of plants. Apart from ``around``, which is passed on in each sub-step.
        rows: Track that is filled: x, y, z [m], quaternion x, y, z, w of ``base_footprint``, left
            and right wheel speed [rad/s] at the end of each tick, shape (ticks, 9).
        contacts: For each tick, written in place: 1 if the body touched a solid object, 1 if it
            touched a walker, and its speed along the body's x axis before [m/s]; shape (ticks, 3).
    """
    near, loads = np.empty(_MOST_NEAR, dtype=np.int64), np.empty(10)
    reach = body.hull.reach + 2 * body.tyres.radius
    # Few drives meet walkers, and a call that finds none takes half as long as the hull's ground.
    alone = not (around.walkers.movers.radii > 0.0).any()
    drags, force = drag.force.size > 0, 0.0
    for tick in range(len(rows)):
        motion = motion_of(state, body)
        count = find_near(motion.place, reach, around.solids, near)
        solid = walker = False
        contacts[tick, 2] = dot(motion.velocity, motion.axes.forward)
        if drags and tick % PERIOD == 0:
            force = _plants(motion, body, drag)
        for _ in range(SUB_STEPS):
            motion = motion_of(state, body)
            loads[:] = 0.0
            loads[2] = -GRAVITY * body.mass
            if force > 0.0:
                u, v = motion.velocity[0], motion.velocity[1]
                rate = braking(force, np.hypot(u, v))
                loads[0] -= rate * u
                loads[1] -= rate * v
            press_tyres(motion, body, state.speeds, state.grips[0], around.ground, loads)
            scrape_hull(motion, body, around.ground, loads)
            if count > 0:
                solid |= strike_tyres(
                    motion,
                    body,
                    state.speeds,
                    state.grips[1],
                    around.ground,
                    around.solids,
                    near[:count],
                    loads,
                )
                solid |= strike_hull(motion, body, around.solids, near[:count], loads)
            if not alone:
                walker |= meet_walkers(motion, body, around.walkers, tick, loads)
            _turn_wheels(state, motion.axes, targets, body, loads)
            _integrate(state, body, loads)
        contacts[tick, 0], contacts[tick, 1] = solid, walker
        _write_row(state, body, rows[tick])
        state.tipped[0] |= axes_of(state.quaternion).up[2] < body.upright


@kernel
def _plants(motion: Motion, body: WheelsBody, drag: DragMap) -> float:
    """Return the force of the plants that the body is in [N]."""
    c, s = motion.axes.forward[0], motion.axes.forward[1]
    half_length, half_width = body.hull.boxes[1, 3], body.hull.boxes[1, 4]
    return 2.0 * half_width * drag_at(drag, motion.place[0], motion.place[1], c, s, half_length)


@kernel
def _turn_wheels(
    state: WheelsState,
    axes: Axes,
    targets: NDArray[np.float64],
    body: WheelsBody,
    loads: NDArray[np.float64],
) -> None:
    """Turn the wheels by their motors, which reach their speed at once within their torque.

    Args:
        state: State of the robot.
        axes: Axes of the body.
        targets: Commanded speed of the left and of the right wheels [rad/s], shape (2,).
        body: Numbers of the robot.
        loads: Loads; what speeds a wheel up turns the body back.
    """
    tyres = body.tyres
    # A wheel that its motor cannot hold is light and its patches are stiff: their forces at the
    # end of the sub-step count, or the wheel would oscillate.
    patches = 2 * tyres.radius**2 * (tyres.stiffness * SUB_STEP + tyres.damping) * SUB_STEP
    for wheel in range(4):
        speed, moment = state.speeds[wheel], loads[MOMENT + wheel]
        target = min(max(targets[wheel // 2], -tyres.max_speed), tyres.max_speed)
        wanted = tyres.inertia * (target - speed) / SUB_STEP - moment
        torque = min(max(wanted, -tyres.torque), tyres.torque)
        change = target - speed
        if torque != wanted:
            change = SUB_STEP * (torque + moment) / (tyres.inertia + patches)
        state.speeds[wheel] += change
        state.work[0] += max(torque * state.speeds[wheel], 0.0) * SUB_STEP
        for c in range(3):
            loads[TORQUE + c] -= axes.left[c] * tyres.inertia * change / SUB_STEP


@kernel
def _integrate(state: WheelsState, body: WheelsBody, loads: NDArray[np.float64]) -> None:
    """Move velocities by the loads, then place and orientation by the velocities."""
    for c in range(3):
        state.velocity[c] += SUB_STEP * loads[c] / body.mass
        state.momentum[c] += SUB_STEP * loads[TORQUE + c]
        state.place[c] += SUB_STEP * state.velocity[c]
    wx, wy, wz = motion_of(state, body).spin
    x, y, z, w = state.quaternion
    half = SUB_STEP / 2
    x, y, z, w = (
        x + half * (wx * w + wy * z - wz * y),
        y + half * (wy * w + wz * x - wx * z),
        z + half * (wz * w + wx * y - wy * x),
        w - half * (wx * x + wy * y + wz * z),
    )
    size = np.sqrt(x * x + y * y + z * z + w * w)
    state.quaternion[0], state.quaternion[1] = x / size, y / size
    state.quaternion[2], state.quaternion[3] = z / size, w / size


@kernel
def _write_row(state: WheelsState, body: WheelsBody, row: NDArray[np.float64]) -> None:
    """Write pose and wheel speeds; ``base_footprint`` is under the centre of mass on the z axis."""
    up = axes_of(state.quaternion).up
    for c in range(3):
        row[c] = state.place[c] - body.height * up[c]
    for c in range(4):
        row[3 + c] = state.quaternion[c]
    row[7] = (state.speeds[0] + state.speeds[1]) / 2
    row[8] = (state.speeds[2] + state.speeds[3]) / 2
