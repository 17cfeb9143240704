"""Plausibility of the encoders' speed: a change of it is one that the accelerometer feels, too.

A scale that jumps, or wheels that are said to stand from one moment to the next, need no turn to be
found. A robot follows its wheels after some tenths of a second, in which they slip: the difference
has to be there whatever that time is.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_state import PITCH
from andabata.localization.measurements import FORCE, LEFT, RIGHT, STAMP
from andabata.localization.sense_watch import (
    FORCES,
    IMU,
    JUMP,
    LAGS,
    PERIODS,
    ROWS_OF_A_RUN,
    WHEELS,
    PlausibilityConfig,
    Watch,
    Wheel,
    acquit,
    doubt,
    is_wheel_speed,
    slot_of,
)
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import borrowing_kernel

_TIME = 0.3
"""Time over which changes of the speed are compared [s]: an error of the pitch of 0.02 rad is
0.06 m/s then."""

_JUMP = (0.18, 0.1)
"""Difference of the two changes that no slip explains [m/s], and its share of the change: largest
0.13 in 117 healthy drives."""

_RETURN = 0.6
"""Share of a jump that has to come back, to the other side, to end the doubt."""

_LONGEST_GAP = 0.05
"""Longest time between two inertial rows, and age of the last one, that is integrated [s]."""

_ROUNDING = 1e-6
"""Difference of two stamps that counts as none [s]."""


@borrowing_kernel
def follow_speed(
    watch: Watch,
    limits: PlausibilityConfig,
    stamp: float,
    imu: NDArray[np.float64],
    wheels: NDArray[np.float64],
    x: NDArray[np.float64],
    wheel: Wheel,
) -> None:
    """Record a period's speed by the wheels, and its difference from the integrated acceleration.

    Args:
        watch: Watch, changed in place; the slot of the period is taken already.
        limits: Limits.
        stamp: End of the period [s].
        imu: Inertial rows, shape (k, 7).
        wheels: Encoder rows, shape (k, 3).
        x: State, shape (20,).
        wheel: Size of the wheels.
    """
    integral, last, begin = watch.inertial[0], watch.inertial[1], watch.inertial[2]
    # Rows that repeat themselves, are doubted, or feel another force than gravity prove nothing.
    broken = watch.rows[IMU] >= ROWS_OF_A_RUN or watch.doubts[IMU] != 0
    broken = broken or watch.doubts[FORCES] != 0 or len(imu) == 0
    weight, j = GRAVITY * np.sin(x[PITCH]), 0
    speed, total, size, n = 0.0, 0.0, 0.0, 0
    for k in range(len(wheels) + 1):
        # The rest of the inertial rows comes after the last encoder row.
        until = wheels[k, STAMP] + _ROUNDING if k < len(wheels) else np.inf
        while j < len(imu) and imu[j, STAMP] <= until:
            dt, force = imu[j, STAMP] - last, imu[j, FORCE]
            # A number that is none compares as false.
            broken = broken or not -_ROUNDING < dt <= _LONGEST_GAP
            size += np.sqrt(force**2 + imu[j, FORCE + 1] ** 2 + imu[j, FORCE + 2] ** 2)
            # What is felt along the robot is its acceleration, and its weight on a slope.
            integral += (force + weight) * dt
            last = imu[j, STAMP]
            j += 1
        if k < len(wheels) and is_wheel_speed(wheels[k]):
            speed += wheel.radius * (wheels[k, LEFT] + wheels[k, RIGHT]) / 2
            total += integral
            n += 1
    is_weight = abs(size - len(imu) * GRAVITY) <= limits.force_share * GRAVITY * len(imu)
    is_recent = abs(stamp - last) <= _LONGEST_GAP
    if broken or not is_weight or not is_recent:
        integral, begin = 0.0, stamp
        last = last if is_recent else stamp
    watch.inertial[0], watch.inertial[1], watch.inertial[2] = integral, last, begin
    _record(watch, stamp, speed / n if n > 0 else np.nan, total / n if n > 0 else np.nan)


@borrowing_kernel
def _record(watch: Watch, stamp: float, speed: float, integral: float) -> None:
    """Record the speed of a period by the wheels, also with lags, and the mean integral [m/s]."""
    slot = slot_of(watch)
    dt = stamp - watch.stamps[(slot - 1) % PERIODS]
    watch.speeds[slot] = speed
    for k in range(len(LAGS)):
        before, weight = watch.lagged[k], 1.0
        if np.isfinite(before) and LAGS[k] > 0.0 and np.isfinite(dt):
            weight = 1.0 - np.exp(-dt / LAGS[k])
        else:
            before = 0.0
        lagged = before + weight * (speed - before)
        watch.lagged[k] = lagged
        watch.gaps[k * PERIODS + slot] = lagged - integral


@borrowing_kernel
def judge_speed(watch: Watch, stamp: float) -> None:
    """Doubt encoders whose speed changes as the robot's does not; believe them if that comes back.

    Args:
        watch: Watch, changed in place.
        stamp: Time [s].
    """
    last = slot_of(watch)
    first = last
    for back in range(1, PERIODS):
        first = (last - back) % PERIODS
        if watch.stamps[first] <= stamp - _TIME + _ROUNDING:
            break
    if not watch.inertial[2] < watch.stamps[first]:
        return
    change, jump = watch.speeds[last] - watch.speeds[first], 0.0
    for k in range(len(LAGS)):
        gap = watch.gaps[k * PERIODS + last] - watch.gaps[k * PERIODS + first]
        if k == 0:
            # A robot that is stopped by something changes its speed, and its wheels do not.
            if not abs(change) > abs(change - gap):
                return
            jump = gap
        elif gap * jump <= 0.0:
            return
        elif abs(gap) < abs(jump):
            jump = gap
    if not abs(jump) > _JUMP[0] + _JUMP[1] * abs(change):
        return
    if watch.doubts[WHEELS] != JUMP:
        watch.jump[0] = jump
        doubt(watch, WHEELS, JUMP, stamp)
    elif jump * watch.jump[0] < 0.0 and abs(jump) > _RETURN * abs(watch.jump[0]):
        acquit(watch, WHEELS, JUMP)
        watch.inertial[2] = stamp  # The same change does not count twice.
