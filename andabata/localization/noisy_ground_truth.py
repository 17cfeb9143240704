"""Localizer from ground truth with known errors, for labelled clouds and ablations."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.localization.localizer import Health
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import SensorReadings


class NoisyGroundTruthConfig(BaseModel):
    """Errors of the ground-truth localizer.

    Each error is a first-order Gauss-Markov process: the error of a filtered receiver is correlated
    in time. Assumption: half the paper's 1 m of horizontal resolution remains after filtering.

    Attributes:
        position_sigma: Standard deviation of each horizontal coordinate [m].
        position_time: Correlation time of the position error [s].
        yaw_sigma: Standard deviation of the heading [rad].
        yaw_time: Correlation time of the errors of heading, roll and pitch [s].
        tilt_sigma: Standard deviation of roll and of pitch [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    position_sigma: float = Field(default=0.35, ge=0, le=10)
    position_time: float = Field(default=60.0, gt=0)
    yaw_sigma: float = Field(default=0.03, ge=0, le=1)
    yaw_time: float = Field(default=30.0, gt=0)
    tilt_sigma: float = Field(default=0.004, ge=0, le=0.2)


class NoisyGroundTruthLocalizer:
    """True pose plus time-correlated errors of GNSS, compass and inclinometer."""

    def __init__(self, config: NoisyGroundTruthConfig, rng: np.random.Generator) -> None:
        """Begin without errors; ``reset`` draws them.

        Args:
            config: Standard deviations and correlation times.
            rng: Source of the errors.
        """
        self._rng = rng
        self._sigma = np.array(
            [config.position_sigma] * 2 + [config.yaw_sigma] + [config.tilt_sigma] * 2
        )
        self._time = np.array([config.position_time] * 2 + [config.yaw_time] * 3)
        self._error = np.zeros(5)
        self._track = PoseTrack()

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Draw new errors and start at the true pose.

        Args:
            pose: True pose in the map.
            stamp: Time [s].
            rough: Ignored.
        """
        self._error = self._sigma * self._rng.standard_normal(5)
        self._track.clear()
        position, quaternion = self._disturb(pose.position[None], pose.quaternion[None])
        self._pose = Pose(position[0], quaternion[0])
        self._track.append(stamp, self._pose.position, self._pose.quaternion)

    def update(self, readings: SensorReadings) -> None:
        """Advance the errors by one period and add them to the true poses in it.

        Args:
            readings: Readings of the period, with the true track.

        Raises:
            ValueError: If the readings hold no true track (they come from a record, not from a
                simulation).
        """
        if readings.true_track is None:
            raise ValueError(
                "true_track: expected the true poses of the period, got none; use localizer=ukf "
                "outside of a simulation"
            )
        rows = readings.true_track
        if not len(rows):  # Before the first period.
            return
        draw = self._rng.standard_normal(
            5
        )  # Always drawn, so that the stream does not depend on sigma.
        if not self._sigma.any():
            self._track.extend(rows[:, 0], rows[:, 1:4], rows[:, 4:8])
            self._pose = Pose(rows[-1, 1:4], rows[-1, 4:8])
            return
        keep = np.exp(-(readings.stamp - self._track.latest) / self._time)
        driving = self._sigma * np.sqrt(1 - keep * keep) * draw
        before, self._error = self._error, keep * self._error + driving
        # Linear within the period: the pose never jumps.
        share = np.linspace(0, 1, len(rows) + 1)[1:, None]
        errors = (1 - share) * before + share * self._error
        positions, quaternions = self._disturb(rows[:, 1:4], rows[:, 4:8], errors)
        self._track.extend(rows[:, 0], positions, quaternions)
        self._pose = Pose(positions[-1], quaternions[-1])

    def _disturb(
        self,
        positions: NDArray[np.float64],
        quaternions: NDArray[np.float64],
        errors: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return poses with errors added.

        Args:
            positions: True positions [m], shape (k, 3).
            quaternions: True rotations x, y, z, w, shape (k, 4).
            errors: Errors of x, y [m], yaw, roll and pitch [rad], shape (k, 5); None for the
                present ones.
        """
        errors = np.broadcast_to(self._error, (len(positions), 5)) if errors is None else errors
        positions = positions.copy()
        positions[:, :2] += errors[:, :2]
        tilt = Rotation.from_euler("ZYX", errors[:, [2, 4, 3]])
        return positions, (tilt * Rotation.from_quat(quaternions)).as_quat()

    @property
    def pose(self) -> Pose:
        """Latest pose, errors included."""
        return self._pose

    @property
    def odometry(self) -> Pose:
        """Latest pose: its errors change so slowly that it serves as odometry."""
        return self._pose

    @property
    def health(self) -> Health:
        """Health, which is always OK."""
        return Health.OK

    @property
    def track(self) -> PoseTrack:
        """Poses over time, errors included."""
        return self._track
