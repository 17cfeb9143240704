"""Error of a robot's own estimate over a drive, beside what it said of itself."""

import math
from collections import Counter
from typing import Any

import numpy as np

from andabata.localization.estimator_status import SIGMAS, EstimatorStatus, without_numbers
from andabata.localization.localizer import Localizer
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import SensorReadings


class EstimateError:
    """Errors of position and heading at each control step, and the health there."""

    def __init__(self, localizer: Localizer) -> None:
        """Begin before the first step.

        Args:
            localizer: Estimator of the robot's pose.
        """
        self._localizer = localizer
        self._errors: list[tuple[float, float]] = []
        self._inside = 0
        self._health, self._causes = Counter[str](), Counter[str]()
        self._status: EstimatorStatus | None = None

    def add(self, readings: SensorReadings) -> None:
        """Add the readings of a control step with its true state; others are passed over."""
        if readings.truth is None:
            return
        truth, pose, status = readings.truth.pose, self._localizer.pose, self._localizer.status
        off = pose.position[:2] - truth.position[:2]
        self._errors.append((float(np.hypot(*off)), abs(wrap(pose.yaw - truth.yaw))))
        # A covariance of zeros, of an estimate that is the truth, has no inverse.
        distance = off @ np.linalg.pinv(status.covariance[:2, :2]) @ off
        self._inside += bool(distance <= SIGMAS**2)
        self._health[str(status.health)] += 1
        self._causes.update({without_numbers(cause) for cause in status.causes})
        self._status = status

    def as_dict(self) -> dict[str, Any] | None:
        """Return the errors and shares, ready for JSON; None without a true state.

        The share inside of the ellipse of two sigma is 0.86 for an estimate that knows itself.
        """
        if self._status is None:
            return None
        places, turns = np.array(self._errors).T
        steps = len(self._errors)
        return {
            "position_error_m": round(float(places[-1]), 3),
            "position_rms_m": round(math.sqrt(np.mean(places**2)), 3),
            "position_max_m": round(float(places.max()), 3),
            "heading_error_rad": round(float(turns[-1]), 4),
            "heading_rms_rad": round(math.sqrt(np.mean(turns**2)), 4),
            "inside_2_sigma": round(self._inside / steps, 3),
            "health_s": _seconds(self._health),
            "causes_s": _seconds(self._causes),
            "unused": {name: dict(reasons) for name, reasons in self._status.unused.items()},
        }


def _seconds(steps: Counter[str]) -> dict[str, float]:
    """Return times [s] of numbers of control steps."""
    return {name: round(CONTROL_PERIOD * number, 1) for name, number in steps.items()}
