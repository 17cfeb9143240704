"""Plausibility of inertial unit, encoders and compass: their rows against each other, each period.

A sensor that hangs repeats its last row bit for bit while the others move; noise never does. One
whose scale is wrong turns by another angle than the other two, or feels another gravity; encoders
whose scale jumps change their speed as the robot does not. Rows that are not believed count as not
received.
"""

from collections import Counter, defaultdict
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.measurements import FORCE, STAMP
from andabata.localization.plausibility_period import count_broken_forces, examine_period
from andabata.localization.sense_watch import (
    DOUBTS,
    JUMP,
    REPEATED,
    SCALE,
    SINCE,
    WAY,
    WHEELS,
    PlausibilityConfig,
    Wheel,
    fresh_memory,
)

NAMES = ("imu", "wheels", "compass", "gravity")
"""Names of these senses in warnings and counts."""


class Doubt(IntEnum):
    """Reason why a sense is not believed."""

    NONE = 0
    REPEATED = REPEATED
    SCALE = SCALE
    JUMP = JUMP


class SenseRows(NamedTuple):
    """Rows of the senses that are examined.

    Attributes:
        imu: Rows of stamp [s], angular velocity [rad/s], specific force [m/s2], shape (k, 7).
        wheels: Rows of stamp [s], left, right wheel speed [rad/s], shape (k, 3).
        mag: Rows of stamp [s], flux density in the base frame in any unit, shape (k, 4).
    """

    imu: NDArray[np.float64]
    wheels: NDArray[np.float64]
    mag: NDArray[np.float64]


class Plausibility:
    """Examines the rows of each period and says which senses are not believed.

    Attributes:
        doubts: Reason why a sense is not believed, by name.
        unused: Number of rows that were not believed, by name and reason.
    """

    def __init__(self, config: PlausibilityConfig, wheel: Wheel) -> None:
        """Begin without any row.

        Args:
            config: Limits.
            wheel: Size of the wheels.
        """
        self._config, self._wheel = config, wheel
        self.unused = defaultdict[str, Counter[str]](Counter)
        self.reset(0.0)

    def reset(self, stamp: float) -> None:
        """Begin anew at a time [s], with all senses believed."""
        self._memory = fresh_memory(self._config, self._wheel, stamp)
        self._codes, self._since = self._memory[DOUBTS], self._memory[SINCE]
        self.doubts: dict[str, Doubt] = {}
        self.unused.clear()

    def believed(
        self, stamp: float, now: float, rows: SenseRows, x: NDArray[np.float64]
    ) -> SenseRows:
        """Take the rows of a period and return those that are believed.

        Args:
            stamp: End of the period [s].
            now: Stamp of the state [s].
            rows: Rows that arrived.
            x: State at the begin of the period, shape (20,).
        """
        found = examine_period(self._memory, stamp, now, *rows, x)
        if not (found or self.doubts):
            return rows
        codes = zip(NAMES, self._codes.tolist(), strict=True)
        self.doubts = {name: Doubt(int(code)) for name, code in codes if code}
        imu = self._without_doubt("imu", rows.imu)
        if "gravity" in self.doubts and len(imu):  # The gyro beside it may still be right.
            self.unused["gravity"][_REASONS[Doubt.SCALE]] += len(imu)
            imu = imu.copy()
            imu[:, FORCE:] = np.nan
        elif broken := count_broken_forces(imu):
            self.unused["gravity"][INVALID] += broken
        oldest = now - self._config.max_age
        wheels = self._without_stale("wheels", rows.wheels, oldest)
        mag = self._without_stale("compass", rows.mag, oldest)
        return SenseRows(
            imu, self._without_doubt("wheels", wheels), self._without_doubt("compass", mag)
        )

    def _without_doubt(self, name: str, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rows of a sense, none if it is not believed; those are counted."""
        if name not in self.doubts:
            return rows
        self.unused[name][_REASONS[self.doubts[name]]] += len(rows)
        return rows[:0]

    def _without_stale(
        self, name: str, rows: NDArray[np.float64], oldest: float
    ) -> NDArray[np.float64]:
        """Return the rows that are not too old, and newer than the row before."""
        stamps = rows[:, STAMP]
        before = np.maximum(stamps[:-1], oldest)
        is_stale = stamps < oldest
        is_stale[1:] |= (stamps[1:] < before) | (stamps[1:] == stamps[:-1])
        if not is_stale.any():
            return rows
        self.unused[name][STALE] += int(is_stale.sum())
        return rows[~is_stale]

    @property
    def way(self) -> NDArray[np.float64]:
        """Sum of the robot's steps by the wheels, believed or not, in the map's axes [m]."""
        return self._memory[WAY]

    def judge_wheels(self, is_wrong: bool, begin: float, stamp: float) -> None:
        """Take what the fixes say about the scale of the wheels.

        Args:
            is_wrong: True if they contradict the wheels, false if they agree.
            begin: Begin of the comparison [s]: an agreement from before a doubt does not end it.
            stamp: Time [s].
        """
        doubts, since = self._codes, self._since
        if is_wrong and not doubts[WHEELS]:
            doubts[WHEELS], since[WHEELS] = SCALE, stamp
        elif not is_wrong and doubts[WHEELS] in (SCALE, JUMP) and begin >= since[WHEELS]:
            doubts[WHEELS] = 0

    def warnings(self, now: float) -> tuple[str, ...]:
        """Return what is not believed and why, one text for each sense.

        Args:
            now: Time [s].
        """
        since = dict(zip(NAMES, self._since.tolist(), strict=True))
        return tuple(
            f"{name}: {_words(name, doubt)}, for {max(now - since[name], 0.0):.1f} s"
            for name, doubt in self.doubts.items()
        )


INVALID = "invalid"
"""Reason why the force of single rows is not used, which the filter passes over."""

STALE = "stale: too old or out of order"
"""Reason why single rows are not used."""

_REASONS = {
    Doubt.REPEATED: "repeated",
    Doubt.SCALE: "out of scale",
    Doubt.JUMP: "not as the accelerometer",
}
"""Reasons why the rows of a sense that is not believed are not used."""


def _words(name: str, doubt: Doubt) -> str:
    """Return what is wrong with a sense, by name and doubt."""
    match name, doubt:
        case "imu", Doubt.REPEATED:
            return "repeats its last row while the wheels turn"
        case "wheels", Doubt.REPEATED:
            return "repeat their last row while the gyro turns"
        case "compass", Doubt.REPEATED:
            return "repeats its last row while the robot moves"
        case "wheels", Doubt.JUMP:
            return "change their speed, and the accelerometer feels another change"
        case "imu", Doubt.SCALE:
            return "its gyro contradicts compass and wheels"
        case "wheels", Doubt.SCALE:
            return "contradict gyro and compass, or the fixes"
        case _:
            return "the accelerometer feels another force than gravity"
