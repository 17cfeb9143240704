"""Compiled motion of a differential robot on flat ground, by steps of integration."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.footprint import Obstacles, outline_distance, touches
from andabata.machine.planar.mover_contact import Contact, contact_with_mover
from andabata.machine.planar.odometry import move_along_arc, turn_off
from andabata.machine.planar.skid_steer import Swing, swung
from terrain.kernel import kernel
from worlds.rooms.mover_motion import Movers

X, Y, YAW, V, W, SET_V, SET_W, ODOM_X, ODOM_Y, ODOM_YAW, RATE_V, RATE_W = range(12)
"""Parts of a state: pose, body's speed and yaw rate, those asked for, pose by odometry, and changes
of the body's speed [m/s2] and yaw rate [rad/s2], which a skid-steered base alone has."""


_NONE, _OBSTACLE = int(Contact.NONE), int(Contact.OBSTACLE)


class PlanarMotion(NamedTuple):
    """Numbers of a drive that the compiled motion depends on.

    Attributes:
        dt: Step of integration [s].
        substeps: Number of steps in a period.
        follow: Share of the difference that the lag takes in a step.
        acceleration: Largest change of speed in a step [m/s].
        yaw_acceleration: Largest change of yaw rate in a step [rad/s].
        gain: Ratio of speed to the commanded one.
        yaw_gain: Ratio of yaw rate to the commanded one.
        odometry_scale: Ratio of distances by odometry to those of the wheels.
        odometry_turn: Standard deviation of the heading by odometry after a metre [rad].
        reach: Distance of the farthest corner of the footprint from the centre [m].
        braking: Largest changes towards zero as a share of those away from it.
        understeer: How the yaw rate falls with speed [s2/m2].
        swing: Step of the body's response of second order; of no use to a lag of first order.
        is_swinging: True for the former, False for the latter.
    """

    dt: float
    substeps: int
    follow: float
    acceleration: float
    yaw_acceleration: float
    gain: float
    yaw_gain: float
    odometry_scale: float
    odometry_turn: float
    reach: float
    braking: float
    understeer: float
    swing: Swing
    is_swinging: bool


@kernel
def drive_period(
    state: NDArray[np.float64],
    commands: NDArray[np.float64],
    delays: NDArray[np.int64],
    draws: NDArray[np.float64],
    motion: PlanarMotion,
    corners: NDArray[np.float64],
    around: Obstacles,
    movers: Movers,
) -> int:
    """Drive for one period, to the first contact at most.

    Args:
        state: State, changed in place, shape (10,).
        commands: Speed and yaw rate of this period and those before, the newest first, (c, 2).
        delays: Delay of each command in steps, shape (c,).
        draws: Slip of speed and of yaw rate, and the draw of the odometry's heading, shape (3,).
        motion: Numbers of the drive.
        corners: Corners of the footprint [m], shape (c, 2).
        around: Obstacles that stand.
        movers: Movers at the end of each step of integration, the first axis.

    Returns:
        The ``Contact`` with what it touches.
    """
    way = 0.0
    contact = _NONE
    for step in range(motion.substeps):
        # The newest command that is old enough: row k is k periods and this step old.
        row = 0
        while delays[row] > row * motion.substeps + step:
            row += 1
        _ask(state, motion.gain * commands[row, 0], motion.yaw_gain * commands[row, 1], motion)
        if motion.is_swinging:
            wanted_w = state[SET_W] / (1.0 + motion.understeer * state[V] ** 2)
            state[V], state[RATE_V] = swung(state[V], state[RATE_V], state[SET_V], motion.swing)
            state[W], state[RATE_W] = swung(state[W], state[RATE_W], wanted_w, motion.swing)
        else:
            state[V] += motion.follow * (state[SET_V] - state[V])
            state[W] += motion.follow * (state[SET_W] - state[W])
        slipped = state[V] * draws[0], state[W] * draws[1]
        move_along_arc(state, X, slipped[0] * motion.dt, slipped[1] * motion.dt)
        seen = state[V] * motion.dt * motion.odometry_scale
        move_along_arc(state, ODOM_X, seen, state[W] * motion.dt)
        way += abs(seen)
        if touches(state[X], state[Y], state[YAW], corners, motion.reach, around):
            contact = _OBSTACLE
        elif _meets_mover(state, corners, motion.reach, step, movers):
            place, speed = (state[X], state[Y], state[YAW]), state[V]
            # The mover that is nearest to the middle, of all that may touch the outline.
            contact = contact_with_mover(*place, speed, motion.reach, step, movers)
        if contact != _NONE:
            break
    turn_off(state, ODOM_X, motion.odometry_turn, way, draws[2])
    return contact


@kernel
def _meets_mover(
    state: NDArray[np.float64],
    corners: NDArray[np.float64],
    reach: float,
    step: int,
    movers: Movers,
) -> bool:
    """Return True if the footprint touches a mover at the end of a step of integration."""
    cosine, sine = np.cos(state[YAW]), np.sin(state[YAW])
    for m in range(movers.radii.shape[1]):
        radius = movers.radii[step, m]
        dx, dy = movers.places[step, m, 0] - state[X], movers.places[step, m, 1] - state[Y]
        if radius <= 0.0 or dx * dx + dy * dy >= (reach + radius) ** 2:
            continue
        if outline_distance(cosine * dx + sine * dy, cosine * dy - sine * dx, corners) < radius:
            return True
    return False


@kernel
def _ask(state: NDArray[np.float64], speed: float, yaw_rate: float, motion: PlanarMotion) -> None:
    """Move what the robot's own controller asks for towards a command."""
    state[SET_V] = _towards(state[SET_V], speed, motion.acceleration, motion.braking)
    state[SET_W] = _towards(state[SET_W], yaw_rate, motion.yaw_acceleration, motion.braking)


@kernel
def _towards(value: float, target: float, most: float, braking: float) -> float:
    """Return a value moved towards its target by a step of limited size.

    A step towards zero is smaller by the share of the brakes.
    """
    if (target - value) * value < 0.0:
        most *= braking
    return value + min(max(target - value, -most), most)
