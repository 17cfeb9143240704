"""What the senses are judged by: limits, last rows, turns of the last periods."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.measurements import LEFT, MAX_WHEEL_SPEED, RIGHT
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import borrowing_kernel

IMU, WHEELS, COMPASS, FORCES = range(4)
"""Senses that are examined; the last one is the accelerometer of the inertial unit."""

REPEATED, SCALE, JUMP = 1, 2, 3
"""Reasons why a sense is not believed; 0 is none."""

ROWS_OF_A_RUN = 5
"""Least number of equal rows that can be a sensor that hangs."""

PERIODS = 128
"""Number of periods that are kept: 6.4 s of a live graph, which has twenty a second."""

_BEGIN = 69
"""Size of a watch's memory before the stamps of the periods."""

WAY, DOUBTS, SINCE = slice(57, 59), slice(61, 65), slice(65, 69)
"""Places of three parts of a watch in its memory."""

FORCE_PERIODS = 10
"""Number of periods over which the specific force is averaged."""

LAGS = (0.0, 0.1, 0.2)
"""Times with which the robot may follow its wheels, which slip until it has their speed [s]."""


class Wheel(NamedTuple):
    """Size of the wheels.

    Attributes:
        radius: Radius [m].
        yaw_rate: Yaw rate per difference of right and left wheel speed.
    """

    radius: float
    yaw_rate: float


class PlausibilityConfig(NamedTuple):
    """Limits beyond which a sense is not believed.

    Attributes:
        max_age: Largest time by which an encoder or compass row may be older than the state [s].
        repeat_time: Time of equal rows of inertial unit or compass, while the wheels turn, after
            which it hangs [s].
        wheel_repeat_time: Time of equal rows of the encoders after a change of the yaw rate, about
            which gyro and compass agree, after which they hang [s].
        scatter: Number of rows that differ from the one before after which a sense is known to
            scatter: until then, and if it repeated itself at rest or for ``repeat_time``, its rows
            are coarse, and a compass has to repeat itself in a turn of ``repeat_turn``.
        repeat_turn: Turn of the gyro in which a compass of whatever resolution changes [rad].
        repeat_rate: Change of the gyro's yaw rate in which the encoders change [rad/s].
        turn_time: Time over which the turns by gyro, wheels and compass are compared, as over half,
            twice and four times of it [s].
        force_share: Difference of the mean specific force from gravity, as a share of it.
    """

    max_age: float = 1.0
    repeat_time: float = 0.5
    wheel_repeat_time: float = 1.0
    scatter: int = 100
    repeat_turn: float = 0.15
    repeat_rate: float = 0.15
    turn_time: float = 1.5
    force_share: float = 0.25


WHEEL_REPEAT_TIME, TURN_TIME = 2, 6
"""Places of two limits in ``Watch.limits``."""


class Watch(NamedTuple):
    """What is known of the senses: last rows, runs of equal ones, turns of the last periods.

    All are views of one array, ``fresh_memory``: a call takes an array apart in a tenth of the time
    that a record takes.

    Attributes:
        limits: Values of ``PlausibilityConfig``, then of ``Wheel``, shape (10,).
        imu: Last valid inertial row, shape (7,), NaN before.
        wheels: Last valid encoder row, shape (3,).
        mag: Last valid compass row, shape (4,).
        begin: Stamp of the first row of each sense's run of equal rows [s], shape (3,).
        rows: Number of rows of the run, shape (3,).
        changes: Number of rows that differed from the one before, shape (3,).
        coarse: 1 for a sense that is known to repeat itself, shape (3,).
        run_turn: Turn of the gyro in the compass's run [rad], shape (1,).
        rates: Lowest and highest yaw rate of the gyro in the encoders' run [rad/s], and when they
            were last no more than ``repeat_rate`` apart [s], shape (3,).
        forces: Mean specific force of the last periods with any [m/s2], shape (10,).
        slot: Number of periods so far, and of those with a specific force, shape (2,).
        heading: Last heading by the compass [rad] and its time [s], shape (2,).
        wheel_rate: Last yaw rate by the wheels [rad/s] and its time [s], shape (2,).
        now: End of the last period [s], shape (1,).
        way: Sum of the steps by the wheels, in the map's axes [m], shape (2,).
        ratio: Turn by the wheels per turn by the gyro, and the number of periods that it comes
            from, shape (2,).
        doubts: ``Doubt`` about each sense, shape (4,).
        since: Time since when, shape (4,) [s].
        stamps: End of each of the last periods [s], shape (128,).
        gyro_turns: Turn by the gyro in each [rad], NaN if unknown, shape (128,).
        wheel_turns: Turn by the wheels in each [rad], NaN if unknown, shape (128,).
        compass_turns: Turn by the compass in each [rad], NaN if unknown, shape (128,).
        inertial: Integral of the forward acceleration [m/s], stamp of its last row [s], and the
            time since when it goes on without a gap [s], shape (3,).
        lagged: Speed by the wheels with each of ``LAGS`` [m/s], shape (3,).
        jump: Step of the wheels' speed that they are doubted for [m/s], shape (1,).
        speeds: Speed by the wheels in each period [m/s], NaN if unknown, shape (128,).
        gaps: Difference of that speed, with each of ``LAGS``, from the integral [m/s], shape
            (384,): the periods of the first one, then those of the next.
        step: Stamp [s] and speed [m/s] of the last encoder row, end of the period of the last step
            [s] and its size [m/s], shape (4,).
    """

    limits: NDArray[np.float64]
    imu: NDArray[np.float64]
    wheels: NDArray[np.float64]
    mag: NDArray[np.float64]
    begin: NDArray[np.float64]
    rows: NDArray[np.float64]
    changes: NDArray[np.float64]
    coarse: NDArray[np.float64]
    run_turn: NDArray[np.float64]
    rates: NDArray[np.float64]
    forces: NDArray[np.float64]
    slot: NDArray[np.float64]
    heading: NDArray[np.float64]
    wheel_rate: NDArray[np.float64]
    now: NDArray[np.float64]
    way: NDArray[np.float64]
    ratio: NDArray[np.float64]
    doubts: NDArray[np.float64]
    since: NDArray[np.float64]
    stamps: NDArray[np.float64]
    gyro_turns: NDArray[np.float64]
    wheel_turns: NDArray[np.float64]
    compass_turns: NDArray[np.float64]
    inertial: NDArray[np.float64]
    lagged: NDArray[np.float64]
    jump: NDArray[np.float64]
    speeds: NDArray[np.float64]
    gaps: NDArray[np.float64]
    step: NDArray[np.float64]


def fresh_memory(limits: PlausibilityConfig, wheel: Wheel, now: float) -> NDArray[np.float64]:
    """Return the memory of a watch that has seen nothing, float64, shape (m,).

    Args:
        limits: Limits.
        wheel: Size of the wheels.
        now: Time [s].
    """
    parts = Watch(
        limits=np.array([*limits, *wheel], dtype=np.float64),
        imu=np.full(7, np.nan),
        wheels=np.full(3, np.nan),
        mag=np.full(4, np.nan),
        begin=np.zeros(3),
        rows=np.zeros(3),
        changes=np.zeros(3),
        coarse=np.zeros(3),
        run_turn=np.zeros(1),
        rates=np.array([np.inf, -np.inf, now]),
        forces=np.full(FORCE_PERIODS, GRAVITY),
        slot=np.zeros(2),
        heading=np.array([np.nan, -np.inf]),
        wheel_rate=np.array([np.nan, -np.inf]),
        now=np.array([now]),
        way=np.zeros(2),
        ratio=np.array([1.0, 0.0]),
        doubts=np.zeros(4),
        since=np.zeros(4),
        stamps=np.full(PERIODS, -np.inf),
        gyro_turns=np.zeros(PERIODS),
        wheel_turns=np.zeros(PERIODS),
        compass_turns=np.zeros(PERIODS),
        inertial=np.array([0.0, now, now]),
        lagged=np.full(len(LAGS), np.nan),
        jump=np.zeros(1),
        speeds=np.full(PERIODS, np.nan),
        gaps=np.full(len(LAGS) * PERIODS, np.nan),
        step=np.array([-np.inf, 0.0, -np.inf, 0.0]),
    )
    return np.concatenate(parts)


@borrowing_kernel
def watch_of(memory: NDArray[np.float64]) -> Watch:
    """Return the views of a watch's memory; compiled code alone can call it.

    Args:
        memory: Memory as ``fresh_memory`` returns it.
    """
    m, p = memory, _BEGIN + PERIODS
    q = p + 3 * PERIODS
    return Watch(
        m[0:10],
        m[10:17],
        m[17:20],
        m[20:24],
        m[24:27],
        m[27:30],
        m[30:33],
        m[33:36],
        m[36:37],
        m[37:40],
        m[40:50],
        m[50:52],
        m[52:54],
        m[54:56],
        m[56:57],
        m[57:59],
        m[59:61],
        m[61:65],
        m[65:69],
        m[_BEGIN:p],
        m[p : p + PERIODS],
        m[p + PERIODS : p + 2 * PERIODS],
        m[p + 2 * PERIODS : q],
        m[q : q + 3],
        m[q + 3 : q + 6],
        m[q + 6 : q + 7],
        m[q + 7 : q + 7 + PERIODS],
        m[q + 7 + PERIODS : q + 7 + (1 + len(LAGS)) * PERIODS],
        m[q + 7 + (1 + len(LAGS)) * PERIODS :],
    )


@borrowing_kernel
def slot_of(watch: Watch) -> int:
    """Return the place of the last period."""
    return int(watch.slot[0] - 1) % PERIODS


@borrowing_kernel
def doubt(watch: Watch, sense: int, reason: int, since: float) -> None:
    """Doubt a sense from a time on [s]; the first doubt stays."""
    if watch.doubts[sense] == 0:
        watch.doubts[sense], watch.since[sense] = reason, since


@borrowing_kernel
def acquit(watch: Watch, sense: int, reason: int) -> None:
    """End a doubt of some reason."""
    if watch.doubts[sense] == reason:
        watch.doubts[sense] = 0


@borrowing_kernel
def is_wheel_speed(row: NDArray[np.float64]) -> bool:
    """Return true if an encoder row has speeds that wheels can have."""
    return abs(row[LEFT]) < MAX_WHEEL_SPEED and abs(row[RIGHT]) < MAX_WHEEL_SPEED
