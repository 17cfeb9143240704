"""One period of the plausibility of inertial unit, encoders and compass: runs, turns, forces."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_state import GYRO_BIAS_Y, GYRO_BIAS_Z, PITCH, ROLL, YAW
from andabata.localization.measurements import (
    FORCE,
    GYRO,
    LEFT,
    MAX_FORCE,
    MAX_GYRO_RATE,
    RIGHT,
    STAMP,
)
from andabata.localization.sense_watch import (
    COMPASS,
    FORCE_PERIODS,
    FORCES,
    IMU,
    PERIODS,
    REPEATED,
    ROWS_OF_A_RUN,
    SCALE,
    TURN_TIME,
    WHEEL_REPEAT_TIME,
    WHEELS,
    PlausibilityConfig,
    Watch,
    Wheel,
    acquit,
    doubt,
    is_wheel_speed,
    slot_of,
    watch_of,
)
from andabata.localization.speed_plausibility import follow_speed, judge_speed
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import borrowing_kernel

_MAX_PERIOD = 0.5
"""Longest period whose turns are compared [s]."""

_AGREEMENT = (0.1, 0.2)
"""Difference of two turns, and its share of the larger one, at which two senses agree [rad]."""

_DIFFERENCE = (0.25, 0.25)
"""The same at which gyro and compass contradict each other while the wheels' ratio is not known."""

_GYRO_DIFFERENCE = (0.15, 0.2)
"""Difference of the gyro from wheels and compass, both to the same side, and its share of all that
was turned to and fro, at which it is wrong [rad]: largest 0.06 and 0.2 in 117 healthy drives."""

_WHEEL_DIFFERENCE = (0.2, 0.2)
"""The same of the wheels, which slip, from gyro and compass: largest 0.12 and 0.2 there."""

_STILL_TURN = 0.3
"""Turn in which wheels cannot stand still [rad]."""

_CLEAR_TURN = 0.5
"""Turn in which an agreement counts [rad]."""

_SHORTEST, _LONGEST = 0.5, 4
"""Ratios of the shortest and the longest time in which turns are compared to ``turn_time``."""

_ONE_SIDED = 0.7
"""Share of a turn in all that was turned to and fro from which the wheels' ratio follows from it:
they may turn farther to one side than to the other."""

_PERIODS_OF_RATIO = 20
"""Number of periods with a clear turn after which the wheels' own turn per turn is known."""

_RATIO_WEIGHT = 0.01
"""Weight of a further period in that ratio."""


@borrowing_kernel
def examine_period(
    memory: NDArray[np.float64],
    stamp: float,
    now: float,
    imu: NDArray[np.float64],
    wheels: NDArray[np.float64],
    mag: NDArray[np.float64],
    x: NDArray[np.float64],
) -> int:
    """Examine the rows of a period; see ``Plausibility.examine``.

    Args:
        memory: Memory of the ``Watch``, changed in place.
        stamp: End of the period [s].
        now: Stamp of the state [s].
        imu: Inertial rows, shape (k, 7).
        wheels: Encoder rows, shape (k, 3).
        mag: Compass rows, shape (k, 4).
        x: State, shape (20,).

    Returns:
        Number of senses that are not believed, and of those with rows that are stale or, of the
        accelerometer, invalid.
    """
    watch = watch_of(memory)
    v = watch.limits
    limits = PlausibilityConfig(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7])
    wheel = Wheel(v[8], v[9])
    moves = False
    for k in range(len(wheels)):
        turns = wheels[k, LEFT] != 0.0 or wheels[k, RIGHT] != 0.0
        moves = moves or (turns and is_wheel_speed(wheels[k]))
    rate = _yaw_rate(imu, x)
    _record_period(watch, stamp, rate, wheels, mag, x, wheel)
    if not np.isnan(rate) and watch.doubts[IMU] == 0:
        watch.rates[0], watch.rates[1] = min(watch.rates[0], rate), max(watch.rates[1], rate)
        if watch.rates[1] - watch.rates[0] <= limits.repeat_rate:
            watch.rates[2] = stamp
    _follow_run(watch, IMU, watch.imu, imu, moves, limits.repeat_time)
    is_same = _follow_run(watch, COMPASS, watch.mag, mag, moves, limits.repeat_time)
    watch.run_turn[0] = watch.run_turn[0] + watch.gyro_turns[slot_of(watch)] if is_same else 0.0
    is_same = _follow_run(watch, WHEELS, watch.wheels, wheels, moves, limits.wheel_repeat_time)
    if not is_same or watch.doubts[IMU] != 0:
        watch.rates[0], watch.rates[1], watch.rates[2] = np.inf, -np.inf, stamp
    _judge_runs(watch, limits, moves)
    _judge_turns(watch, stamp, limits.turn_time)
    _judge_force(watch, limits, stamp, imu)
    follow_speed(watch, limits, stamp, imu, wheels, x, wheel)
    judge_speed(watch, stamp)
    found = 0
    for sense in range(4):
        found += watch.doubts[sense] != 0
    oldest = now - limits.max_age
    found += _has_stale(wheels, oldest) + _has_stale(mag, oldest)
    return found + (count_broken_forces(imu) > 0)


@borrowing_kernel
def count_broken_forces(imu: NDArray[np.float64]) -> int:
    """Return the number of inertial rows whose force alone is invalid.

    Without any number there is no accelerometer, and nothing to count.

    Args:
        imu: Inertial rows, shape (k, 7).
    """
    broken = 0
    for k in range(len(imu)):
        valid, numbers, finite = bool(np.isfinite(imu[k, STAMP])), 0, 0
        for c in range(GYRO, FORCE):
            valid = valid and abs(imu[k, c]) < MAX_GYRO_RATE
        for c in range(FORCE, FORCE + 3):
            numbers += not np.isnan(imu[k, c])
            finite += np.isfinite(imu[k, c])
        broken += valid and numbers > 0 and finite < 3
    return broken


@borrowing_kernel
def _has_stale(rows: NDArray[np.float64], oldest: float) -> bool:
    """Return true if a row is older than an instant [s], or not newer than the row before it."""
    before = oldest
    for k in range(len(rows)):
        is_again = k > 0 and rows[k, STAMP] == rows[k - 1, STAMP]
        if is_again or rows[k, STAMP] < before:
            return True
        before = max(rows[k, STAMP], oldest)
    return False


@borrowing_kernel
def _yaw_rate(imu: NDArray[np.float64], x: NDArray[np.float64]) -> float:
    """Return the mean yaw rate by the gyro [rad/s], NaN without a valid row."""
    y, z, n = 0.0, 0.0, 0
    for k in range(len(imu)):
        # Numbers that are none compare as false.
        if abs(imu[k, GYRO + 1]) < MAX_GYRO_RATE and abs(imu[k, GYRO + 2]) < MAX_GYRO_RATE:
            y += imu[k, GYRO + 1] - x[GYRO_BIAS_Y]
            z += imu[k, GYRO + 2] - x[GYRO_BIAS_Z]
            n += 1
    if n == 0:
        return np.nan
    return (np.sin(x[ROLL]) * y + np.cos(x[ROLL]) * z) / (n * np.cos(x[PITCH]))


@borrowing_kernel
def _heading(row: NDArray[np.float64], x: NDArray[np.float64]) -> float:
    """Return the heading of a levelled field against magnetic north, counter-clockwise [rad]."""
    sr, cr, sp, cp = np.sin(x[ROLL]), np.cos(x[ROLL]), np.sin(x[PITCH]), np.cos(x[PITCH])
    forward = cp * row[1] + sp * (sr * row[2] + cr * row[3])
    left = cr * row[2] - sr * row[3]
    return np.arctan2(-left, forward)


@borrowing_kernel
def _record_period(
    watch: Watch,
    stamp: float,
    rate: float,
    wheels: NDArray[np.float64],
    mag: NDArray[np.float64],
    x: NDArray[np.float64],
    wheel: Wheel,
) -> None:
    """Record the turns of a period by gyro, wheels and compass, and the way by the wheels."""
    dt = stamp - watch.now[0]
    watch.now[0] = stamp
    left, right, n = 0.0, 0.0, 0
    for k in range(len(wheels)):
        if is_wheel_speed(wheels[k]):
            left, right, n = left + wheels[k, LEFT], right + wheels[k, RIGHT], n + 1
    if n > 0:
        watch.wheel_rate[0], watch.wheel_rate[1] = (right - left) / n * wheel.yaw_rate, stamp
        if 0.0 < dt <= _MAX_PERIOD:
            step = (left + right) / (2 * n) * wheel.radius * dt
            watch.way[0] += step * np.cos(x[YAW])
            watch.way[1] += step * np.sin(x[YAW])
    turn = np.nan
    for k in range(len(mag) - 1, -1, -1):
        heading = _heading(mag[k], x)
        if np.isfinite(heading):
            if stamp - watch.heading[1] <= _MAX_PERIOD:
                turn = heading - watch.heading[0]
                turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
            watch.heading[0], watch.heading[1] = heading, stamp
            break
    if np.isnan(turn) and stamp - watch.heading[1] <= _MAX_PERIOD and len(mag) == 0:
        turn = 0.0  # It comes less often than periods: the next one has it.
    slot = int(watch.slot[0]) % PERIODS
    watch.slot[0] += 1
    watch.stamps[slot] = stamp
    known = 0.0 < dt <= _MAX_PERIOD
    held = stamp - watch.wheel_rate[1] <= _MAX_PERIOD
    watch.gyro_turns[slot] = rate * dt if known else np.nan
    watch.wheel_turns[slot] = watch.wheel_rate[0] * dt if known and held else np.nan
    watch.compass_turns[slot] = turn if known else np.nan


@borrowing_kernel
def _follow_run(
    watch: Watch,
    sense: int,
    last: NDArray[np.float64],
    rows: NDArray[np.float64],
    moves: bool,
    limit: float,
) -> bool:
    """Follow a sense's run of equal rows; return true if all rows of a period equal the last one.

    Args:
        watch: Watch, changed in place.
        sense: Sense.
        last: Its last valid row, changed in place.
        rows: Its rows.
        moves: True if the wheels turn.
        limit: Time of a run that shows how coarse a sense is [s].
    """
    same = True
    for k in range(len(rows)):
        finite, equal = True, True
        for c in range(len(last)):
            finite = finite and bool(np.isfinite(rows[k, c]))
            equal = equal and (c == STAMP or rows[k, c] == last[c])
        if not finite:
            continue
        if equal:
            watch.rows[sense] += 1
        else:
            # A long run that ended by itself and was not doubted, or one at rest, is a habit.
            if last[STAMP] - watch.begin[sense] >= limit and watch.doubts[sense] == 0:
                watch.coarse[sense] = 1.0
            watch.begin[sense], watch.rows[sense] = rows[k, STAMP], 1.0
            watch.changes[sense] += 1
            same = False
        for c in range(len(last)):
            last[c] = rows[k, c]
    rests = not moves and watch.rows[sense] >= ROWS_OF_A_RUN and watch.doubts[sense] == 0
    if rests and last[STAMP] - watch.begin[sense] >= limit:
        watch.coarse[sense] = 1.0
    return same


@borrowing_kernel
def _judge_runs(watch: Watch, limits: PlausibilityConfig, moves: bool) -> None:
    """Doubt the senses that repeat themselves while others move; believe those that change."""
    for sense in range(3):
        if watch.rows[sense] < ROWS_OF_A_RUN:
            acquit(watch, sense, REPEATED)
            continue
        scatters = watch.changes[sense] >= limits.scatter and watch.coarse[sense] == 0
        begin = watch.begin[sense]
        if sense == COMPASS:
            is_long = watch.mag[STAMP] - begin >= limits.repeat_time
            if is_long and ((moves and scatters) or abs(watch.run_turn[0]) > limits.repeat_turn):
                doubt(watch, sense, REPEATED, begin)
        elif sense == IMU and moves and scatters and watch.imu[STAMP] - begin >= limits.repeat_time:
            doubt(watch, sense, REPEATED, begin)


@borrowing_kernel
def _differ(a: float, b: float, size: float, limits: tuple[float, float]) -> bool:
    """Return true if two turns differ by more than a number and a share of a size [rad]."""
    return abs(a - b) > limits[0] + limits[1] * size


class _Turn(NamedTuple):
    """Turns of some time by three senses, and what two of them turned to and fro in it [rad].

    Attributes:
        gyro: Turn by the gyro.
        wheels: Turn by the wheels, with their own ratio.
        compass: Turn by the compass.
        gyro_path: Sum of the turns of its periods by the gyro, whatever their side.
        wheel_path: Sum of the turns of its periods by the wheels, likewise.
    """

    gyro: float
    wheels: float
    compass: float
    gyro_path: float
    wheel_path: float


@borrowing_kernel
def _judge_turns(watch: Watch, stamp: float, time: float) -> None:
    """Compare the turns by gyro, wheels and compass in times from half to four times a time [s]."""
    gyro, wheels, compass, gyro_path, wheel_path = 0.0, 0.0, 0.0, 0.0, 0.0
    stamps, last, ratio = watch.stamps, slot_of(watch), watch.ratio[0]
    time, longest = _SHORTEST * time, _LONGEST * time
    for back in range(PERIODS):
        k = (last - back) % PERIODS
        if stamps[k] <= stamp - time:
            turn = _Turn(gyro, wheels / ratio, compass, gyro_path, wheel_path / ratio)
            _judge_turn(watch, stamp, time, turn)
            time *= 2
            if time > longest:
                return
        gyro += watch.gyro_turns[k]
        wheels += watch.wheel_turns[k]
        compass += watch.compass_turns[k]
        gyro_path += abs(watch.gyro_turns[k])
        wheel_path += abs(watch.wheel_turns[k])
    turn = _Turn(gyro, wheels / ratio, compass, gyro_path, wheel_path / ratio)
    _judge_turn(watch, stamp, time, turn)


@borrowing_kernel
def _contradicts(a: float, b: float, c: float, path: float, limits: tuple[float, float]) -> bool:
    """Return true if a turn differs from two others, to the same side [rad].

    Args:
        a: Turn that is judged.
        b: Second turn.
        c: Third turn.
        path: Turns to and fro.
        limits: Difference, and its share of the path.
    """
    limit = limits[0] + limits[1] * path
    return min(a - b, a - c) > limit or max(a - b, a - c) < -limit


@borrowing_kernel
def _judge_turn(watch: Watch, stamp: float, time: float, turn: _Turn) -> None:
    """Compare the turns by gyro, wheels and compass in some time: two convict the third.

    Args:
        watch: Watch, changed in place.
        stamp: Time [s].
        time: Length of the time up to then [s].
        turn: Turns in it.
    """
    gyro, wheels, compass = turn.gyro, turn.wheels, turn.compass
    larger, path = max(abs(gyro), abs(compass)), max(turn.gyro_path, turn.wheel_path)
    is_learned = watch.ratio[1] >= _PERIODS_OF_RATIO
    if is_learned and _contradicts(gyro, wheels, compass, path, _GYRO_DIFFERENCE):
        doubt(watch, IMU, SCALE, stamp)
    elif is_learned and _contradicts(wheels, gyro, compass, path, _WHEEL_DIFFERENCE):
        doubt(watch, WHEELS, SCALE, stamp)
    elif _differ(gyro, compass, larger, _DIFFERENCE):
        if not is_learned and abs(compass - wheels) < 0.5 * abs(gyro - wheels):
            doubt(watch, IMU, SCALE, stamp)
    elif not _differ(gyro, compass, larger, _AGREEMENT) and np.isfinite(compass):
        _judge_agreement(watch, stamp, time, turn, larger)


@borrowing_kernel
def _judge_agreement(watch: Watch, stamp: float, time: float, turn: _Turn, larger: float) -> None:
    """Acquit senses by a turn about which gyro and compass agree, and learn the wheels' ratio.

    Args:
        watch: Watch, changed in place.
        stamp: Time [s].
        time: Length of the time up to then [s].
        turn: Turns in it.
        larger: Larger one of the turns by gyro and compass [rad].
    """
    gyro, wheels, usual = turn.gyro, turn.wheels, watch.limits[TURN_TIME]
    # What a doubt came from ends none.
    if larger > _CLEAR_TURN and watch.since[IMU] <= stamp - time:
        acquit(watch, IMU, SCALE)
    if time == usual:
        _judge_equal_wheels(watch, stamp)
    if wheels == 0.0 and abs(gyro) > _STILL_TURN:
        doubt(watch, WHEELS, SCALE, stamp)
    elif abs(gyro) > _CLEAR_TURN and np.isfinite(wheels):
        if 0.7 < wheels / gyro < 1.4 and watch.since[WHEELS] <= stamp - time:
            acquit(watch, WHEELS, SCALE)
        if time == _LONGEST * usual and abs(gyro) > _ONE_SIDED * turn.gyro_path:
            _learn_ratio(watch, wheels / gyro)


@borrowing_kernel
def _judge_equal_wheels(watch: Watch, stamp: float) -> None:
    """Doubt encoders that repeat themselves through a change of the yaw rate.

    Gyro and compass agree about the turn: the change is true.
    """
    is_long = stamp - watch.rates[2] >= watch.limits[WHEEL_REPEAT_TIME]
    moves = abs(watch.wheels[LEFT]) > 0.0 or abs(watch.wheels[RIGHT]) > 0.0
    if is_long and moves and watch.rows[WHEELS] > ROWS_OF_A_RUN:
        doubt(watch, WHEELS, REPEATED, watch.begin[WHEELS])


@borrowing_kernel
def _learn_ratio(watch: Watch, factor: float) -> None:
    """Learn the turn by the wheels per turn by the gyro, of which a track may be stated wrong.

    Once the ratio is known it follows what differs by slip alone.

    Args:
        watch: Watch, changed in place.
        factor: Factor of the ratio so far that a comparison asks for.
    """
    if watch.ratio[1] < _PERIODS_OF_RATIO:
        watch.ratio[1] += 1
        wanted = min(max(factor * watch.ratio[0], 0.2), 5.0)
        watch.ratio[0] += (wanted - watch.ratio[0]) / watch.ratio[1]
    elif 0.8 < factor < 1.25:
        watch.ratio[0] *= 1 + _RATIO_WEIGHT * (factor - 1)


@borrowing_kernel
def _judge_force(
    watch: Watch, limits: PlausibilityConfig, stamp: float, imu: NDArray[np.float64]
) -> None:
    """Compare the mean specific force with gravity."""
    total, n = 0.0, 0
    for k in range(len(imu)):
        x, y, z = imu[k, FORCE], imu[k, FORCE + 1], imu[k, FORCE + 2]
        size = np.sqrt(x * x + y * y + z * z)
        if size < MAX_FORCE:
            total, n = total + size, n + 1
    if n == 0:
        return
    forces = watch.forces
    forces[int(watch.slot[1]) % FORCE_PERIODS] = total / n
    watch.slot[1] += 1
    mean = 0.0
    for k in range(FORCE_PERIODS):
        mean += forces[k]
    mean /= FORCE_PERIODS
    if abs(mean - GRAVITY) > limits.force_share * GRAVITY:
        doubt(watch, FORCES, SCALE, stamp)
    else:
        acquit(watch, FORCES, SCALE)
