"""Drivetrain of a real robot: commands arrive late, wheels lag, and are not what they should be.

It stands between the navigator's commands and the plant, and between the plant and the encoders, so
that every plant has it. Plants turn wheels of the believed size: a true wheel that is larger turns
as fast, and the plant's has to turn faster for the same way.
"""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from andabata.machine.sensor_readings import WheelSpeeds

_QUATERNION, _LEFT, _RIGHT = 4, 8, 9
"""Columns of a row of the true track: first of the quaternion x, y, z, w, wheel speeds [rad/s]."""


class Drivetrain:
    """Delay, lag, wheel radius, effective track and slip of one robot in one drive."""

    def __init__(self) -> None:
        """Begin as the navigator believes it."""
        self.reset(AS_BELIEVED)

    def reset(self, constants: TrueConstants) -> None:
        """Begin at rest.

        Args:
            constants: True constants of the drive.
        """
        self._constants = constants
        differs = (constants.wheel_radius, constants.effective_track, constants.slope_slip)
        self._is_ideal = not any((*differs, constants.latency, constants.lag))
        whole, self._share = divmod(constants.latency, CONTROL_PERIOD)
        self._share /= CONTROL_PERIOD
        self._commands = [np.zeros(2)] * (int(whole) + 2)
        self._follow = -math.expm1(-CONTROL_PERIOD / constants.lag) if constants.lag else 1.0
        self._speeds, self._slope = np.zeros(2), 0.0

    def targets(self, command: WheelSpeeds) -> WheelSpeeds:
        """Return the wheel speeds that the plant drives in a control period.

        Args:
            command: Commanded speeds of the true wheels.
        """
        if self._is_ideal:
            return command
        # A command that arrives within a period counts by its share: periods are not divided.
        self._commands = [*self._commands[1:], np.array([command.left, command.right])]
        arrived = (1 - self._share) * self._commands[1] + self._share * self._commands[0]
        self._speeds = self._speeds + self._follow * (arrived - self._speeds)
        left, right = self._speeds.tolist()
        mean, half = (left + right) / 2, (right - left) / 2
        mean /= self._slipping(np.array(mean), np.array(self._slope)).item()
        mean *= 1 + self._constants.wheel_radius
        half *= (1 + self._constants.wheel_radius) / (1 + self._constants.effective_track)
        return WheelSpeeds(mean - half, mean + half)

    def turned(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rows of a period with the speeds at which the true wheels turn.

        The slope at their end is that of the next period's targets.

        Args:
            rows: Rows of the true track with the plant's wheel speeds, shape (k, 10).
        """
        if self._is_ideal:
            return rows
        rows = rows.copy()
        x, y, z, w = rows[:, _QUATERNION : _QUATERNION + 4].T
        mean = (rows[:, _LEFT] + rows[:, _RIGHT]) / 2 / (1 + self._constants.wheel_radius)
        half = (rows[:, _RIGHT] - rows[:, _LEFT]) / 2 / (1 + self._constants.wheel_radius)
        slopes = 2 * (x * z - w * y)
        mean *= self._slipping(mean, slopes)
        self._slope = float(slopes[-1])
        half *= 1 + self._constants.effective_track
        rows[:, _LEFT], rows[:, _RIGHT] = mean - half, mean + half
        return rows

    def _slipping(
        self, speeds: NDArray[np.float64], slopes: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the ratio of the wheels' speed to that of the ground under them.

        Uphill the wheels turn faster than they drive, downhill slower.

        Args:
            speeds: Mean wheel speeds [rad/s].
            slopes: Sine of the angle by which the nose points up, of the same shape.
        """
        return 1 + self._constants.slope_slip * slopes * np.sign(speeds)
