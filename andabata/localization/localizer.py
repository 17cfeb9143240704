"""Interface between the sensors and everything that needs a pose."""

from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import SensorReadings

if TYPE_CHECKING:
    from andabata.localization.estimator_status import EstimatorStatus


class Health(StrEnum):
    """Health of a localizer.

    Attributes:
        OK: All sensors send data that are accepted.
        DEGRADED: Some sensor is missing; the pose is still usable.
        DISORIENTED: The heading is unknown, all else is there; the robot creeps, so that two fixes
            tell it.
        LOST: No usable pose; the robot has to stand still.
    """

    OK = "ok"
    DEGRADED = "degraded"
    DISORIENTED = "disoriented"
    LOST = "lost"


def health_after(health: Health, has_failures: bool) -> Health:
    """Return the health of a localizer whose sensors were checked against each other.

    Args:
        health: Health by the sensors' data alone.
        has_failures: True if a check failed: then the pose is not ok, whatever the filter accepts.
    """
    return Health.DEGRADED if has_failures and health is Health.OK else health


class Localizer(Protocol):
    """Estimator of poses from sensor readings.

    Poses are in two frames (REP-105): ``map``, the frame of goals, in which a satellite fix may
    shift the pose, and ``odom``, which drifts but never jumps, the frame in which clouds are
    assembled.
    """

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Start again at a pose.

        Args:
            pose: Pose in the map.
            stamp: Time [s].
            rough: True if the pose comes from the sensors themselves.
        """

    def update(self, readings: SensorReadings) -> None:
        """Update the estimate with the readings of one control period."""

    def report(self, causes: tuple[str, ...]) -> None:
        """Take causes from outside of the estimate, such as a silent laser, into health and status.

        Args:
            causes: One text each, which hold until the next report.
        """

    @property
    def pose(self) -> Pose:
        """Latest estimated pose of ``base_footprint`` in the map."""

    @property
    def odometry(self) -> Pose:
        """Latest pose of ``base_footprint`` in ``odom``."""

    @property
    def track(self) -> PoseTrack:
        """Poses in ``odom`` over time, to place each beam with the pose of its own instant."""

    @property
    def health(self) -> Health:
        """Health of the estimate."""

    @property
    def status(self) -> "EstimatorStatus":
        """Health with its causes, uncertainty, and counts of readings; made at each call."""
