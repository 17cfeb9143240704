"""Where am I: the seam between senses and everything that needs a pose."""

from enum import StrEnum
from typing import Protocol

from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import SensorReadings


class Health(StrEnum):
    """How far a localizer can be trusted."""

    OK = "ok"
    DEGRADED = "degraded"
    LOST = "lost"


class Localizer(Protocol):
    """Whatever turns senses into poses.

    Poses come in two frames (REP-105): ``map``, in which goals stand and where a satellite fix may
    shift the robot, and ``odom``, which drifts but never jumps, and in which clouds are put
    together.
    """

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Start afresh at a pose in the map at ``stamp`` [s]; ``rough`` is one that senses told."""

    def update(self, readings: SensorReadings) -> None:
        """Take in one control period of senses."""

    @property
    def pose(self) -> Pose:
        """The latest estimated pose of ``base_footprint`` in the map."""

    @property
    def odometry(self) -> Pose:
        """The latest pose of ``base_footprint`` in ``odom``."""

    @property
    def track(self) -> PoseTrack:
        """Poses in ``odom`` by time, for placing each beam with the pose of its own instant."""

    @property
    def health(self) -> Health:
        """Whether to drive by it."""
