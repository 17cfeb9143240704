"""What gravity, the magnetic field, the wheels and the ground say of the senses' mountings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.frames import FrameError, Sense
from traversability.levelling import ground_plane, tilt_of

_ROWS = 100
"""Rows of a sense that are judged together: a second of them."""

_FALLEN = np.deg2rad(60.0)
"""No robot drives on ground that leans more: the IMU is mounted otherwise than was said."""

_NO_GRAVITY = 0.5
"""Mean specific force below which gravity was taken off: it is 9.8 m/s2, or 1 in its own units."""

_STEEP = np.deg2rad(30.0)
"""Ground that leans more is worth a remark."""

_DIP_ERROR = np.deg2rad(45.0)
"""The field of a dipole along the Earth's axis dips within half of this of the true one."""

_TURNS = 20
"""Control periods with a turn that are judged together."""

_TURN = 0.5
"""Difference of the wheel speeds that is a turn [rad/s]."""

_CLOUDS = 5
"""Clouds whose ground is judged together."""

_OFF_HEIGHT = 0.2
"""Ground further from where it should be is worth a remark [m]."""

_OFF_TILT = np.deg2rad(12.0)
"""Ground that leans more against the plane of the wheels is worth a remark."""


class MountingChecks:
    """Holds what the senses measure against what mountings imply, in the robot's axes."""

    def __init__(self) -> None:
        """Begin without a measurement."""
        self._sums = {"force": np.zeros(3), "field": np.zeros(3)}
        self._counts = dict.fromkeys(self._sums, 0)
        self._latitude: float | None = None
        self._turns: list[tuple[float, float]] = []

    def take(self, sense: Sense, numbers: Sequence[float]) -> None:
        """Take in a row of ``imu``, ``compass`` or ``gnss`` as ``Mounts.row`` returns it."""
        if sense == "imu":
            self._add("force", numbers[3:6])
        elif sense == "compass":
            self._add("field", numbers[:3])
        elif self._latitude is None and np.isfinite(numbers[:2]).all() and any(numbers[:2]):
            self._latitude = float(np.deg2rad(numbers[0]))

    def _add(self, what: str, vector: Sequence[float]) -> None:
        """Add a vector to the first hundred."""
        if self._counts[what] < _ROWS and np.isfinite(vector).all():
            self._sums[what] += vector
            self._counts[what] += 1

    def compare(
        self, imu: NDArray[np.float64] | None, encoders: NDArray[np.float64] | None
    ) -> None:
        """Hold the gyro against the wheels of a control period; rows as in ``SensorReadings``."""
        if imu is None or encoders is None or len(self._turns) >= 10 * _TURNS:
            return
        apart = float(np.mean(encoders[:, 2] - encoders[:, 1]))
        if abs(apart) > _TURN:
            self._turns.append((float(np.mean(imu[:, 3])), apart))

    def _direction(self, what: str) -> NDArray[np.float64] | None:
        """Return the mean direction of a vector, None before there are enough rows."""
        if self._counts[what] < _ROWS:
            return None
        mean = self._sums[what] / self._counts[what]
        length = float(np.linalg.norm(mean))
        least = _NO_GRAVITY if what == "force" else 0.0
        return mean / length if length > least else None

    def verify_gravity(self, frame: str, source: str, rotation: Rotation) -> None:
        """Refuse an IMU whose gravity does not point where it must.

        Args:
            frame: Of the IMU.
            source: What told how it is mounted.
            rotation: How it is mounted: from the frame to the robot's axes.

        Raises:
            FrameError: If the mean specific force leans too far from the robot's z axis.
        """
        up = self._direction("force")
        if up is None or np.arccos(np.clip(up[2], -1, 1)) < _FALLEN:
            return
        roll, pitch = _turn_up(rotation.inv().apply(up))
        told = {"tf_static": "/tf_static", "tf": "/tf", "option": "--mounting"}.get(source)
        raise FrameError(
            f"imu: gravity points {_axis_in_words(up)} in the IMU's frame"
            f"{f', mounted as {told} says' if told else f' ({frame})'}: expected a specific force "
            f"along z (0, 0, 1), got one along ({up[0]:.2f}, {up[1]:.2f}, {up[2]:.2f}); say how "
            f"it is mounted: --mounting imu=0,0,0,{roll},{pitch},YAW turns z up, "
            "YAW is for you to tell"
        )

    @property
    def remarks(self) -> list[str]:
        """What a person should know, a line each."""
        return [*self._of_gravity(), *self._of_field(), *self._of_turning()]

    def _of_gravity(self) -> list[str]:
        """Return what gravity says."""
        up = self._direction("force")
        if up is None and self._counts["force"] >= _ROWS:
            return [
                "imu: expected a specific force that holds gravity, got one of less than "
                f"{_NO_GRAVITY} m/s2 in the mean; nothing checks how the IMU is mounted"
            ]
        lean = 0.0 if up is None else float(np.arccos(np.clip(up[2], -1, 1)))
        if lean < _STEEP:
            return []
        return [
            f"imu: gravity leans {np.rad2deg(lean):.0f} degrees at the begin: the robot stands on "
            "a steep slope, or --mounting imu=X,Y,Z,ROLL,PITCH,YAW is missing"
        ]

    def _of_field(self) -> list[str]:
        """Return what the magnetic field's dip says, held against that of a dipole there."""
        up, field = self._direction("force"), self._direction("field")
        if up is None or field is None or self._latitude is None:
            return []
        dip = float(np.arcsin(np.clip(-(up @ field), -1, 1)))
        expected = float(np.arctan(2 * np.tan(self._latitude)))
        if abs(dip - expected) < _DIP_ERROR:
            return []
        return [
            f"compass: the field points {_dip_in_words(dip)}, expected {_dip_in_words(expected)} "
            "at this latitude: it is turned against the IMU (--mounting "
            "compass=X,Y,Z,ROLL,PITCH,YAW), or its axes or signs differ"
        ]

    def _of_turning(self) -> list[str]:
        """Return what the wheels say of the gyro's sense of turning."""
        if len(self._turns) < _TURNS:
            return []
        against = np.mean([gyro * apart < 0 for gyro, apart in self._turns])
        if against < 0.8:
            return []
        return [
            "imu: the gyro turns left where the wheels turn right: its z axis points down, or left "
            "and right wheels are exchanged (--mounting imu=..., --map /encoder_data=...)"
        ]


def _turn_up(up: NDArray[np.float64]) -> tuple[int, int]:
    """Return roll and pitch [deg] that turn a direction up, or the axis that it is nearest to.

    Sensors are mounted square more often than robots stand level.
    """
    k = int(np.argmax(np.abs(up)))
    if abs(up[k]) > np.cos(_STEEP):
        up = np.where(np.arange(3) == k, np.sign(up[k]), 0.0)
    x, y, z = up
    roll = np.rad2deg(np.arctan2(y, z)) if np.hypot(y, z) > 0 else 0.0
    return round(roll), round(np.rad2deg(np.arctan2(-x, np.hypot(y, z))))


def _axis_in_words(up: NDArray[np.float64]) -> str:
    """Return where the specific force points, by the nearest axis."""
    k = int(np.argmax(np.abs(up)))
    sign = "-" if up[k] < 0 else ""
    return "down" if k == 2 and sign else f"along {sign}{'xyz'[k]}"


def _dip_in_words(dip: float) -> str:
    """Return where a field points that dips below the horizon [rad]."""
    return f"{abs(np.rad2deg(dip)):.0f} degrees {'down' if dip >= 0 else 'up'}"


class GroundCheck:
    """Holds the ground that the first clouds show against where the laser's mounting puts it."""

    def __init__(
        self, laser_height: float, where: str = "robot.lidar_height", is_told: bool = True
    ) -> None:
        """Begin without a cloud.

        Args:
            laser_height: Of the laser above the ground [m].
            where: What says where the ground is.
            is_told: Whether the laser's height is told, not guessed.
        """
        self._height, self._where, self._is_told = laser_height, where, is_told
        self._seen: list[tuple[float, float]] = []

    @property
    def is_done(self) -> bool:
        """Whether enough clouds were looked at."""
        return len(self._seen) >= _CLOUDS

    def look(self, points: NDArray[np.float32], tilt: Rotation | None = None) -> None:
        """Look at the ground of a cloud.

        Args:
            points: In the levelled base frame, or that fixed to the body [m], shape (n, 3).
            tilt: Rotation from the body to the frame; None for none.
        """
        plane = ground_plane(points)
        if plane is None:
            return
        normal, height = plane
        own = normal if tilt is None else tilt.inv().apply(normal)
        self._seen.append((height, tilt_of(own)))

    def verify(self) -> None:
        """Refuse a laser that sees the ground above itself.

        Raises:
            FrameError: If it does in most clouds; the message names the option to give.
        """
        if self.is_done and self._median(0) > self._height + 0.1:
            raise FrameError(_above(self._median(0), self._height))

    def _median(self, column: int) -> float:
        """Return the median height [m] or tilt [rad]."""
        return float(np.median([row[column] for row in self._seen]))

    @property
    def remarks(self) -> list[str]:
        """What a person should know, a line each."""
        found = self.height_remarks
        if self._seen and self._median(1) > _OFF_TILT:
            found.append(
                f"laser: the ground leans {np.rad2deg(self._median(1)):.0f} degrees against the "
                "robot; is the laser mounted level? (--mounting laser=X,Y,Z,ROLL,PITCH,YAW)"
            )
        return found

    @property
    def height_remarks(self) -> list[str]:
        """What a person should know of the laser's height, a line each."""
        height = self._median(0) if self._seen else 0.0
        if height > self._height + 0.1:
            return [_above(height, self._height)]
        if abs(height) <= _OFF_HEIGHT:
            return []
        side = "below" if height < 0 else "above"
        said = f"laser: the ground lies {abs(height):.1f} m {side} where {self._where} puts it"
        if self._is_told:
            real = self._height - height
            said += f": the laser is {real:.2f} m above it, not {self._height:.2f} m"
        return [said]


def _above(height: float, laser: float) -> str:
    """Return the words for a laser under the ground."""
    return (
        f"laser: the ground is above the laser ({height - laser:.1f} m): it hangs upside down, or "
        "its frame is another; say how it is mounted, as --mounting laser=0,0,"
        f"{laser:.2f},180,0,0"
    )
