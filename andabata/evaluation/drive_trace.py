"""Trace of a drive: place, motion and error of the estimated position, twice a second."""

from typing import Any

import numpy as np

from andabata.localization.localizer import Localizer
from andabata.machine.sensor_readings import SensorReadings

TRACE_COLUMNS = (
    "time_s",
    "x_m",
    "y_m",
    "yaw_rad",
    "yaw_rate_rad_s",
    "speed_m_s",
    "pose_error_m",
)
"""Columns of a trace: true values, and the distance of the estimated position from the true one."""

_EVERY = 5
"""Number of control steps from one row to the next: half a second."""


class DriveTrace:
    """Rows of a drive, thinned.

    Attributes:
        rows: Rows in the order of ``TRACE_COLUMNS``.
    """

    def __init__(self, localizer: Localizer) -> None:
        """Begin without rows.

        Args:
            localizer: Estimator of the robot's pose.
        """
        self._localizer, self._steps = localizer, 0
        self.rows: list[list[float]] = []

    def add(self, readings: SensorReadings) -> None:
        """Add the readings of a control step, one in five."""
        truth = readings.truth
        self._steps += 1
        if truth is None or (self._steps - 1) % _EVERY:
            return
        off = self._localizer.pose.position[:2] - truth.pose.position[:2]
        row = (
            readings.stamp,
            *truth.pose.position[:2],
            truth.pose.yaw,
            truth.angular[2],
            truth.linear[0],
            np.hypot(*off),
        )
        # Millimetres are enough for curves, and keep the file small.
        self.rows.append([round(float(value), 3) for value in row])

    def as_dict(self) -> dict[str, Any]:
        """Return the trace, ready for JSON."""
        return {"columns": list(TRACE_COLUMNS), "rows": self.rows}
