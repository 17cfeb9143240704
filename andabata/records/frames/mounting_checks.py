"""Checks of the mountings of IMU and compass against gravity, the Earth's field and the wheels."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.records.frames.driving_check import DrivingCheck
from andabata.records.frames.names import FrameError, Sensor

_ROWS = 100
"""Number of rows that are averaged: those of a second."""

_MAX_LEAN = np.deg2rad(60.0)
"""Largest lean of the ground that a robot drives on [rad]; beyond, the mounting is wrong."""

_NO_GRAVITY = 0.5
"""Mean specific force below which gravity was subtracted: it is 9.8 m/s2, or 1 g."""

_STEEP = np.deg2rad(30.0)
"""Lean of gravity from which there is a remark [rad]."""

_DIP_ERROR = np.deg2rad(45.0)
"""Largest difference of the field's dip from that of an axial dipole [rad]; the true field stays
within half of it.
"""

_TURNS = 20
"""Number of control periods with a turn that are needed."""

_MOST_TURNS = 10 * _TURNS
"""Number of control periods with a turn that are kept."""

_TURN = 0.5
"""Difference of the wheel speeds that is a turn [rad/s]."""

_OPPOSITE = 0.8
"""Share of turns in which gyro and wheels disagree from which there is a remark."""


_NEGATED = (
    "; where the IMU is upright and sends gravity instead of specific force: --unit acceleration=-1"
)
"""Second cause of a specific force that points down, with its option."""


class MountingChecks:
    """Compares measurements in the robot's axes with those that correct mountings imply.

    Attributes:
        driving: Check of the wheels against the fixes.
    """

    def __init__(self) -> None:
        """Create checks without a measurement."""
        self._sums = {"force": np.zeros(3), "field": np.zeros(3)}
        self._counts = dict.fromkeys(self._sums, 0)
        self._latitude: float | None = None
        self._turns: list[tuple[float, float]] = []
        self.driving = DrivingCheck()
        self._earlier: dict[str, None] = {}

    def restart(self) -> None:
        """Begin a drive whose times count from another instant; what failed before is kept."""
        self._earlier |= dict.fromkeys(self.driving.remarks)
        self.driving = DrivingCheck()

    def add(self, sensor: Sensor, numbers: Sequence[float]) -> None:
        """Add a measurement of ``imu``, ``compass`` or ``gnss``.

        Args:
            sensor: Name of the sensor.
            numbers: Values as ``Extrinsics.transform_row`` returns them.
        """
        if sensor == "imu":
            self._add_vector("force", numbers[3:6])
        elif sensor == "compass":
            self._add_vector("field", numbers[:3])
        elif self._latitude is None and np.isfinite(numbers[:2]).all() and any(numbers[:2]):
            self._latitude = float(np.deg2rad(numbers[0]))

    def _add_vector(self, name: str, vector: Sequence[float]) -> None:
        """Add a vector to the first hundred."""
        if self._counts[name] < _ROWS and np.isfinite(vector).all():
            self._sums[name] += vector
            self._counts[name] += 1

    def compare(
        self, imu: NDArray[np.float64] | None, encoders: NDArray[np.float64] | None
    ) -> None:
        """Compare the gyro with the wheels in a control period.

        Args:
            imu: Rows as in ``SensorReadings``, None without.
            encoders: Rows as in ``SensorReadings``, None without.
        """
        if imu is None or encoders is None or len(self._turns) >= _MOST_TURNS:
            return
        difference = float(np.mean(encoders[:, 2] - encoders[:, 1]))
        if abs(difference) > _TURN:
            self._turns.append((float(np.mean(imu[:, 3])), difference))

    def _direction(self, name: str) -> NDArray[np.float64] | None:
        """Return the mean direction of a vector, None before there are enough rows."""
        if self._counts[name] < _ROWS:
            return None
        mean = self._sums[name] / self._counts[name]
        length = float(np.linalg.norm(mean))
        least = _NO_GRAVITY if name == "force" else 0.0
        return mean / length if length > least else None

    def verify_gravity(self, frame: str, source: str, rotation: Rotation) -> None:
        """Check that the mean specific force points along the robot's z axis.

        Args:
            frame: Frame of the IMU.
            source: Source of its mounting; see ``SensorPose.source``.
            rotation: Mounting: rotation from the frame to the robot's axes.

        Raises:
            FrameError: If it leans too far from the axis; the message names the option to give.
        """
        up = self._direction("force")
        if up is None or np.arccos(np.clip(up[2], -1, 1)) < _MAX_LEAN:
            return
        roll, pitch = _levelling_angles(rotation.inv().apply(up))
        given = {"tf_static": "/tf_static", "tf": "/tf", "option": "--mounting"}.get(source)
        raise FrameError(
            f"imu: gravity points {_axis_in_words(up)} in the IMU's frame"
            f"{f', mounted as {given} says' if given else f' ({frame})'}: expected a specific force"
            f" along z (0, 0, 1), got one along ({up[0]:.2f}, {up[1]:.2f}, {up[2]:.2f}); give its "
            f"mounting: --mounting imu=0,0,0,{roll},{pitch},YAW turns z up, with the YAW of your "
            f"robot{_NEGATED if up[2] < -np.cos(_STEEP) else ''}"
        )

    @property
    def remarks(self) -> list[str]:
        """Remarks on the mountings, a line each."""
        return [*self._gravity_remarks(), *self._field_remarks()]

    @property
    def failures(self) -> list[str]:
        """Contradictions between wheels, gyro and fixes, a line each."""
        lines = [*self._turn_failures(), *self._earlier, *self.driving.remarks]
        return list(dict.fromkeys(lines))

    def _gravity_remarks(self) -> list[str]:
        """Return remarks on the direction of gravity."""
        up = self._direction("force")
        if up is None and self._counts["force"] >= _ROWS:
            return [
                "imu: expected a specific force with gravity, got one of less than "
                f"{_NO_GRAVITY} m/s2 in the mean; the IMU's mounting is not checked"
            ]
        lean = 0.0 if up is None else float(np.arccos(np.clip(up[2], -1, 1)))
        if lean < _STEEP:
            return []
        return [
            f"imu: gravity leans {np.rad2deg(lean):.0f} degrees at the start: the robot stands on "
            "a steep slope, or --mounting imu=X,Y,Z,ROLL,PITCH,YAW is missing"
        ]

    def _field_remarks(self) -> list[str]:
        """Return remarks on the magnetic field's dip, against that of a dipole at the latitude."""
        up, field = self._direction("force"), self._direction("field")
        if up is None or field is None or self._latitude is None:
            return []
        dip = float(np.arcsin(np.clip(-(up @ field), -1, 1)))
        expected = float(np.arctan(2 * np.tan(self._latitude)))
        if abs(dip - expected) < _DIP_ERROR:
            return []
        return [
            f"compass: the field points {_dip_in_words(dip)}, expected {_dip_in_words(expected)} "
            "at this latitude: it is rotated against the IMU (--mounting "
            "compass=X,Y,Z,ROLL,PITCH,YAW), or its axes or signs differ"
        ]

    def _turn_failures(self) -> list[str]:
        """Return what contradicts the gyro's sign: the difference of the wheel speeds."""
        if len(self._turns) < _TURNS:
            return []
        opposite = np.mean([gyro * difference < 0 for gyro, difference in self._turns])
        if opposite < _OPPOSITE:
            return []
        return [
            "imu: the gyro turns left where the wheels turn right: its sign is wrong "
            "(--unit angular_velocity=-1), or left and right wheels are exchanged, which changes "
            "nothing: only their mean is used"
        ]


def _levelling_angles(up: NDArray[np.float64]) -> tuple[int, int]:
    """Return roll and pitch [deg] that turn the axis nearest to a direction up, else itself.

    Sensors are mounted square more often than robots stand level.
    """
    k = int(np.argmax(np.abs(up)))
    if abs(up[k]) > np.cos(_STEEP):
        up = np.where(np.arange(3) == k, np.sign(up[k]), 0.0)
    x, y, z = up
    roll = np.rad2deg(np.arctan2(y, z)) if np.hypot(y, z) > 0 else 0.0
    return round(roll), round(np.rad2deg(np.arctan2(-x, np.hypot(y, z))))


def _axis_in_words(up: NDArray[np.float64]) -> str:
    """Return the axis nearest to the specific force, as text."""
    k = int(np.argmax(np.abs(up)))
    sign = "-" if up[k] < 0 else ""
    return "down" if k == 2 and sign else f"along {sign}{'xyz'[k]}"


def _dip_in_words(dip: float) -> str:
    """Return a dip below the horizon [rad] as text [deg]."""
    return f"{abs(np.rad2deg(dip)):.0f} degrees {'down' if dip >= 0 else 'up'}"
