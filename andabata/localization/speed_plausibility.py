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

_STEP = 0.17
"""Change of the speed from an encoder row to the next that is a step [m/s]: wheels that obey a
command or spin make some, too."""

_UNFELT = 0.55
"""Share of a step that the accelerometer did not feel, beyond which the robot has not followed. Of
608 steps from 0.14 m/s on in 78 development drives the largest was 0.097 of 0.3 m/s, else 0.06
m/s."""

_BEFORE, _SOON, _SETTLED, _JUDGED = 0.2, 0.1, 0.2, 0.5
"""Times before a step from which the speed is compared, with and without its drift; times after it
at which the robot has followed, and at which its drift is known [s]. A pitch that is wrong by 0.02
rad is 0.08 m/s in 0.4 s, and drifts on."""

_STEP_LAGS = 2
"""Number of the first ones of ``LAGS`` with which a step is compared: in longer ones it fades."""

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
            row = wheel.radius * (wheels[k, LEFT] + wheels[k, RIGHT]) / 2
            _follow_step(watch, stamp, wheels[k, STAMP], row)
            speed += row
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
def _follow_step(watch: Watch, stamp: float, time: float, speed: float) -> None:
    """Record a step of the speed from an encoder row to the next, by the period's end [s].

    Args:
        watch: Watch, changed in place.
        stamp: End of the period [s].
        time: Stamp of the row [s].
        speed: Its speed [m/s].
    """
    last, step = watch.step, speed - watch.step[1]
    is_next = 0.0 < time - last[0] <= _LONGEST_GAP
    last[0], last[1] = time, speed
    if is_next and abs(step) > _STEP:
        last[2], last[3] = stamp, step


@borrowing_kernel
def judge_speed(watch: Watch, stamp: float) -> None:
    """Doubt encoders whose speed changes as the robot's does not; believe them if that comes back.

    Args:
        watch: Watch, changed in place.
        stamp: Time [s].
    """
    jump = _slow_jump(watch, stamp)
    if jump == 0.0:
        jump = _unfelt_step(watch, stamp)
    if jump == 0.0:
        return
    if watch.doubts[WHEELS] != JUMP:
        watch.jump[0] = jump
        doubt(watch, WHEELS, JUMP, stamp)
    elif jump * watch.jump[0] < 0.0 and abs(jump) > _RETURN * abs(watch.jump[0]):
        acquit(watch, WHEELS, JUMP)
        watch.inertial[2] = stamp  # The same change does not count twice.


@borrowing_kernel
def _period_before(watch: Watch, stamp: float) -> int:
    """Return the place of the last period that ends at a stamp [s] or before it."""
    last = slot_of(watch)
    first = last
    for back in range(1, PERIODS):
        first = (last - back) % PERIODS
        if watch.stamps[first] <= stamp + _ROUNDING:
            break
    return first


@borrowing_kernel
def _slow_jump(watch: Watch, stamp: float) -> float:
    """Return the change of the speed over some time that no slip explains [m/s], 0 for none."""
    last, first = slot_of(watch), _period_before(watch, stamp - _TIME)
    if not watch.inertial[2] < watch.stamps[first]:
        return 0.0
    change, jump = watch.speeds[last] - watch.speeds[first], 0.0
    for k in range(len(LAGS)):
        gap = watch.gaps[k * PERIODS + last] - watch.gaps[k * PERIODS + first]
        if k == 0:
            # A robot that is stopped by something changes its speed, and its wheels do not.
            if not abs(change) > abs(change - gap):
                return 0.0
            jump = gap
        elif gap * jump <= 0.0:
            return 0.0
        elif abs(gap) < abs(jump):
            jump = gap
    return jump if abs(jump) > _JUMP[0] + _JUMP[1] * abs(change) else 0.0


@borrowing_kernel
def _unfelt_step(watch: Watch, stamp: float) -> float:
    """Return the part of a step from row to row that was not felt since [m/s], 0 for none."""
    begin, step, stamps = watch.step[2], watch.step[3], watch.stamps
    if not 0.0 <= stamp - begin - _JUDGED + _ROUNDING < _LONGEST_GAP:
        return 0.0
    last, first = slot_of(watch), _period_before(watch, begin - _BEFORE)
    if not watch.inertial[2] < stamps[first]:
        return 0.0
    near, after = _period_before(watch, begin - _SOON), _period_before(watch, begin + _SETTLED)
    ratio = (stamps[after] - stamps[near]) / (stamps[last] - stamps[after])
    sign, unfelt = np.sign(step), np.inf
    for k in range(_STEP_LAGS):
        gaps = watch.gaps[k * PERIODS : (k + 1) * PERIODS]
        change = sign * (gaps[after] - gaps[first])
        drift = sign * (gaps[last] - gaps[after]) * ratio
        without_drift = sign * (gaps[after] - gaps[near]) - drift
        both = min(change, without_drift)
        # A number that is none compares as false.
        unfelt = both if both < unfelt else unfelt
        unfelt = unfelt if np.isfinite(change + drift) else -np.inf
    return sign * unfelt if unfelt > _UNFELT * abs(step) else 0.0
