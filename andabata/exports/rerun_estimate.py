"""What a recorded robot believed, as rerun draws it: ellipse, heading, errors, health, readings."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.estimator_status import (
    SIGMAS,
    YAW,
    error_ellipse,
    heading_sector,
    longest_sigma,
)
from andabata.records.messages import header_ns, pose_of
from andabata.records.recorder import UNUSED
from andabata.records.topics import RosMessage

ESTIMATE = "map/estimate"
"""Entity of the ellipse and the wedge."""

PLOTS = (("position_error", "Error of the position [m]"), ("unused", "Readings not used"))
"""Entities below ``plots`` and titles of the plots."""

_COLOUR = [0, 120, 255]
_LEVELS = ("INFO", "WARN", "ERROR")


class EstimateLog:
    """Logger of what a robot believed of itself."""

    def __init__(self, rerun: Any, log: Callable[[str, Any], None]) -> None:  # noqa: ANN401
        """Begin before the first message.

        Args:
            rerun: The SDK.
            log: Function that logs an archetype under an entity.
        """
        self._rerun, self._log = rerun, log
        self._truth: tuple[int, NDArray[np.float64]] | None = None

    def add_truth(self, content: RosMessage) -> None:
        """Keep the true position for the estimate of the same time."""
        self._truth = header_ns(content), pose_of(content.pose.pose).position

    def add_odometry(self, content: RosMessage) -> None:
        """Log two sigma of place and heading, and the true error where it is known."""
        pose = pose_of(content.pose.pose)
        covariance = np.asarray(content.pose.covariance, dtype=np.float64).reshape(6, 6)
        if covariance[:2, :2].any():
            strips = estimate_strips(pose.position, pose.yaw, covariance)
            lines = self._rerun.LineStrips3D(strips, colors=[_COLOUR], radii=0.02)
            self._log(ESTIMATE, lines)
            self._scalar("position_error/two_sigma", SIGMAS * longest_sigma(covariance[:2, :2]))
        if self._truth is not None and self._truth[0] == header_ns(content):
            off = pose.position[:2] - self._truth[1][:2]
            self._scalar("position_error/true", float(np.hypot(*off)))

    def add_diagnostics(self, content: RosMessage) -> None:
        """Log the health in words, and the numbers of readings that were not used."""
        for status in content.status:
            level = int(status.level[0] if isinstance(status.level, bytes) else status.level)
            text = self._rerun.TextLog(str(status.message), level=_LEVELS[min(level, 2)])
            self._log("health", text)
            for pair in status.values:
                if pair.key.startswith(UNUSED):
                    name = pair.key.removeprefix(UNUSED).replace(", ", "/").replace(" ", "_")
                    self._scalar(f"unused/{name}", float(pair.value))

    def _scalar(self, name: str, value: float) -> None:
        """Log a number of a plot."""
        self._log(f"plots/{name}", self._rerun.Scalars(value))


def estimate_strips(
    position: NDArray[np.float64], yaw: float, covariance: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Return the rim of the error ellipse and the sector of the heading as closed lines [m].

    Args:
        position: Estimated position [m], shape (3,).
        yaw: Estimated heading [rad].
        covariance: Covariance of x, y, z [m], roll, pitch, yaw [rad], shape (6, 6).
    """
    rim = error_ellipse(covariance[:2, :2])
    sector = heading_sector(yaw, float(np.sqrt(max(covariance[YAW, YAW], 0.0))))
    return [
        np.column_stack([position[:2] + ring, np.full(len(ring), position[2] + 0.1)])
        for ring in (np.concatenate([part, part[:1]]) for part in (rim, sector))
    ]
