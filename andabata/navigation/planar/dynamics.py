"""Model of how a robot on flat ground follows its commands: delay, acceleration limits, lag.

It is the model that plans and the model that is identified: what it leaves out, such as the steps
of the robot's own controller, is identified into its numbers.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel


class PlanarDynamics(NamedTuple):
    """Numbers of the model, of speed and yaw rate alike but for the accelerations.

    Attributes:
        delay: Time from a command to its effect [s].
        lag: Time constant with which the body follows its controller [s].
        acceleration: Largest acceleration and deceleration [m/s2].
        yaw_acceleration: Largest yaw acceleration [rad/s2].
    """

    delay: float
    lag: float
    acceleration: float
    yaw_acceleration: float


class MotionState(NamedTuple):
    """Motion at the begin of a control period.

    Attributes:
        x: Position [m].
        y: Position [m].
        yaw: Heading [rad].
        v: Speed [m/s].
        w: Yaw rate [rad/s].
        controller_v: Speed that the robot's own controller asks for [m/s].
        controller_w: Yaw rate that it asks for [rad/s].
    """

    x: float
    y: float
    yaw: float
    v: float
    w: float
    controller_v: float
    controller_w: float


class WheelLimits(NamedTuple):
    """Limits of commands.

    Attributes:
        min_speed: Least speed, negative backwards [m/s].
        max_speed: Largest speed [m/s].
        max_wheel_speed: Largest |v| + ``half_track`` |w| [m/s].
        half_track: Half of the effective track [m].
        max_yaw_rate: Largest yaw rate [rad/s].
    """

    min_speed: float
    max_speed: float
    max_wheel_speed: float
    half_track: float
    max_yaw_rate: float


class AxisStep(NamedTuple):
    """One period of one axis of the model.

    Attributes:
        most: Largest change of the controller's speed in a period.
        keep: Share of the difference that is left after a period of lag.
        trail: Lag in periods: how far the body trails a steady ramp.
    """

    most: float
    keep: float
    trail: float


@kernel
def axis_step(acceleration: float, lag: float, period: float) -> AxisStep:
    """Return the numbers of a period of one axis."""
    lag = max(lag, 1e-3)
    return AxisStep(acceleration * period, np.exp(-period / lag), lag / period)


@kernel
def advance_axis(
    controller: float, body: float, command: float, step: AxisStep
) -> tuple[float, float]:
    """Return the controller's and the body's speed after a period with a command in effect.

    The controller's speed moves to the command with a limited acceleration; the body follows that
    ramp as a first-order lag, in closed form (the ramp is taken as even over the period).
    """
    change = min(max(command - controller, -step.most), step.most)
    after = controller + change
    behind = change * step.trail
    return after, after - behind + (body - controller + behind) * step.keep


@kernel
def delayed(commands: NDArray[np.float64], k: int, axis: int, delay: float) -> float:
    """Return the mean command in effect during a period.

    Args:
        commands: Commands of all periods, the oldest first, shape (n, 2).
        k: Period.
        axis: 0 for speed, 1 for yaw rate.
        delay: Delay in periods; before the first command the first counts.
    """
    whole = int(delay)
    share = delay - whole
    newer, older = commands[max(k - whole, 0), axis], commands[max(k - whole - 1, 0), axis]
    return float(newer + share * (older - newer))


@kernel
def limited(v: float, w: float, limits: WheelLimits) -> tuple[float, float]:
    """Return a command within the limits; the wheels' limit keeps its curvature."""
    v = min(max(v, limits.min_speed), limits.max_speed)
    w = min(max(w, -limits.max_yaw_rate), limits.max_yaw_rate)
    wheels = abs(v) + limits.half_track * abs(w)
    scale = min(1.0, limits.max_wheel_speed / max(wheels, 1e-12))
    return v * scale, w * scale


@kernel
def observed(
    x: float,
    y: float,
    yaw: float,
    past: NDArray[np.float64],
    speeds: NDArray[np.float64],
    dynamics: PlanarDynamics,
    period: float,
) -> MotionState:
    """Return the motion now, with the speeds that the robot's own controller asks for.

    Those are not measured: they are the model's, driven from the oldest measured speeds on.

    Args:
        x: Position [m].
        y: Position [m].
        yaw: Heading [rad].
        past: Commands of the periods before, the oldest first, shape (p, 2).
        speeds: Measured speed and yaw rate at the begin of each of these periods and now, shape
            (p + 1, 2).
        dynamics: Delay, lag and accelerations.
        period: Control period [s].
    """
    delay = dynamics.delay / period
    step_v = axis_step(dynamics.acceleration, dynamics.lag, period)
    step_w = axis_step(dynamics.yaw_acceleration, dynamics.lag, period)
    set_v, set_w = v, w = speeds[0, 0], speeds[0, 1]
    for k in range(len(past)):
        set_v, v = advance_axis(set_v, v, delayed(past, k, 0, delay), step_v)
        set_w, w = advance_axis(set_w, w, delayed(past, k, 1, delay), step_w)
    # The measured speeds correct the gains that the model does not know.
    now_v, now_w = speeds[-1, 0], speeds[-1, 1]
    return MotionState(x, y, yaw, now_v, now_w, set_v + now_v - v, set_w + now_w - w)
