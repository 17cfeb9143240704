"""The true pose with stated errors: for labelled clouds and for ablation."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.localization.localizer import Health
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import SensorReadings


class NoisyGroundTruthConfig(BaseModel):
    """Errors of a localizer that knows the truth but for GNSS and compass.

    Each error is a first-order Gauss-Markov process, since a filtered receiver's error wanders
    instead of jumping.
    Assumption: half the paper's 1 m of horizontal resolution remains after filtering.

    Attributes:
        position_sigma: Standard deviation of each horizontal coordinate [m].
        position_time: Correlation time of the position error [s].
        yaw_sigma: Standard deviation of the heading [rad].
        yaw_time: Correlation time of the heading error [s].
        tilt_sigma: Standard deviation of roll and of pitch [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    position_sigma: float = Field(default=0.35, ge=0, le=10)
    position_time: float = Field(default=60.0, gt=0)
    yaw_sigma: float = Field(default=0.03, ge=0, le=1)
    yaw_time: float = Field(default=30.0, gt=0)
    tilt_sigma: float = Field(default=0.004, ge=0, le=0.2)


class NoisyGroundTruthLocalizer:
    """The true pose plus wandering GNSS, compass and inclinometer errors."""

    def __init__(self, config: NoisyGroundTruthConfig, rng: np.random.Generator) -> None:
        self._rng = rng
        self._sigma = np.array(
            [config.position_sigma] * 2 + [config.yaw_sigma] + [config.tilt_sigma] * 2
        )
        self._time = np.array([config.position_time] * 2 + [config.yaw_time] * 3)
        self._error = np.zeros(5)
        self._track = PoseTrack()

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Draw fresh errors and start at ``pose``, the true one."""
        self._error = self._sigma * self._rng.standard_normal(5)
        self._track.clear()
        position, quaternion = self._disturb(pose.position[None], pose.quaternion[None])
        self._pose = Pose(position[0], quaternion[0])
        self._track.append(stamp, self._pose.position, self._pose.quaternion)

    def update(self, readings: SensorReadings) -> None:
        """Let the errors wander for one period and add them to the true poses in it.

        Raises:
            ValueError: If the senses hold no truth (they come from a record, not from a
                simulation).
        """
        if readings.true_track is None:
            raise ValueError("true_track: expected the true poses of the period, got none")
        rows = readings.true_track
        if not len(rows):  # Before the first period.
            return
        draw = self._rng.standard_normal(5)  # Also without errors: the others' draws stay theirs.
        if not self._sigma.any():
            self._track.extend(rows[:, 0], rows[:, 1:4], rows[:, 4:8])
            self._pose = Pose(rows[-1, 1:4], rows[-1, 4:8])
            return
        keep = np.exp(-(readings.stamp - self._track.latest) / self._time)
        wander = self._sigma * np.sqrt(1 - keep * keep) * draw
        before, self._error = self._error, keep * self._error + wander
        share = np.linspace(0, 1, len(rows) + 1)[1:, None]
        errors = (1 - share) * before + share * self._error
        positions, quaternions = self._disturb(rows[:, 1:4], rows[:, 4:8], errors)
        self._track.extend(rows[:, 0], positions, quaternions)
        self._pose = Pose(positions[-1], quaternions[-1])

    def _disturb(
        self,
        positions: np.ndarray,
        quaternions: np.ndarray,
        errors: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return poses moved by errors x, y, yaw, roll, pitch, shape (k, 5)."""
        errors = np.broadcast_to(self._error, (len(positions), 5)) if errors is None else errors
        positions = positions.copy()
        positions[:, :2] += errors[:, :2]
        tilt = Rotation.from_euler("ZYX", errors[:, [2, 4, 3]])
        return positions, (tilt * Rotation.from_quat(quaternions)).as_quat()

    @property
    def pose(self) -> Pose:
        """The latest pose, with its error."""
        return self._pose

    @property
    def odometry(self) -> Pose:
        """The same: the errors wander slowly."""
        return self._pose

    @property
    def health(self) -> Health:
        """Always well."""
        return Health.OK

    @property
    def track(self) -> PoseTrack:
        """The poses by time, with their errors."""
        return self._track
