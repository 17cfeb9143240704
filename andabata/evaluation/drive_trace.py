"""Trace of a drive: place, motion, and what the robot believes of itself, twice a second."""

from typing import Any

import numpy as np

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health, Localizer
from andabata.machine.pose import Pose, wrap
from andabata.machine.sensor_readings import SensorReadings

TRACE_COLUMNS = (
    "time_s",
    "x_m",
    "y_m",
    "yaw_rad",
    "yaw_rate_rad_s",
    "speed_m_s",
    "pose_error_m",
    "position_sigma_m",
    "yaw_error_rad",
    "yaw_sigma_rad",
    "health",
)
"""Columns of a trace: true values, distance of the estimated position from the true one, and its
standard deviation along the longest half axis; error of the estimated heading, and its standard
deviation; number of the health, in the order of ``Health``. A column ``unused SENSOR: REASON``
for each reason follows, with the number of readings so far."""

UNUSED = "unused "
"""Beginning of the names of these columns."""

_EVERY = 5
"""Number of control steps from one row to the next: half a second."""

_HEALTH = list(Health)


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
        self._unused: list[dict[str, int]] = []

    def add(self, readings: SensorReadings) -> None:
        """Add the readings of a control step, one in five."""
        truth = readings.truth
        self._steps += 1
        if truth is None or (self._steps - 1) % _EVERY:
            return
        status = self._localizer.status
        row = (
            readings.stamp,
            *truth.pose.position[:2],
            truth.pose.yaw,
            truth.angular[2],
            truth.linear[0],
            *_belief(self._localizer.pose, truth.pose, status),
        )
        # Millimetres are enough for curves, and keep the file small.
        self.rows.append([round(float(value), 3) for value in row])
        self._unused.append(
            {
                f"{UNUSED}{sensor}: {reason}": number
                for sensor, reasons in status.unused.items()
                for reason, number in reasons.items()
            }
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the trace, ready for JSON."""
        reasons = sorted({reason for row in self._unused for reason in row})
        rows = [
            [*row, *(counts.get(reason, 0) for reason in reasons)]
            for row, counts in zip(self.rows, self._unused, strict=True)
        ]
        return {"columns": [*TRACE_COLUMNS, *reasons], "rows": rows}


def _belief(estimate: Pose, truth: Pose, status: EstimatorStatus) -> tuple[float, ...]:
    """Return the columns from ``pose_error_m`` to ``health``."""
    return (
        float(np.hypot(*(estimate.position[:2] - truth.position[:2]))),
        status.position_sigma,
        wrap(estimate.yaw - truth.yaw),
        status.yaw_sigma,
        _HEALTH.index(status.health),
    )
