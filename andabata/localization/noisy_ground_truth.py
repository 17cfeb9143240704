"""Localizer from ground truth with known errors, for labelled clouds and ablations."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import SensorReadings
from terrain.kernel import inlined_kernel, kernel

Quaternion = tuple[float, float, float, float]
"""Components x, y, z and w."""


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
        self._causes: tuple[str, ...] = ()
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
        if len(readings.true_track):  # Before the first period there is none.
            # Always drawn, so that the stream does not depend on sigma.
            draws = self._rng.standard_normal((1, 5))
            self.follow(np.array([readings.stamp]), readings.true_track[None], draws)

    def follow(
        self,
        ends: NDArray[np.float64],
        tracks: NDArray[np.float64],
        draws: NDArray[np.float64],
    ) -> None:
        """Advance by several periods at once, as ``update`` does by one.

        Args:
            ends: End of each period [s], shape (p,).
            tracks: Stamp [s], true position [m] and quaternion x, y, z, w at each tick of each
                period, shape (p, k, 8).
            draws: Standard normal draws that drive the errors in each period, shape (p, 5).
        """
        stamps, positions, quaternions = np.split(tracks.reshape(-1, 8), [1, 4], axis=1)
        if self._sigma.any():
            begins = np.array([self._track.latest, *tracks[:-1, -1, 0]])
            errors = self._wander(ends - begins, draws, tracks.shape[1])
            positions, quaternions = self._disturb(positions, quaternions, errors)
        self._track.extend(np.hstack([stamps, positions, quaternions]))
        self._pose = Pose(positions[-1], quaternions[-1])

    def _wander(
        self, periods: NDArray[np.float64], draws: NDArray[np.float64], ticks: int
    ) -> NDArray[np.float64]:
        """Return the errors at each tick, shape (p * ticks, 5), and keep the last.

        Args:
            periods: Length of each period [s], shape (p,).
            draws: Standard normal draws, shape (p, 5).
            ticks: Number of ticks of a period.
        """
        keep = np.exp(-periods[:, None] / self._time)
        driving = self._sigma * np.sqrt(1 - keep * keep) * draws
        errors = np.empty((len(periods) + 1, 5))
        errors[0] = self._error
        for k in range(len(periods)):
            errors[k + 1] = keep[k] * errors[k] + driving[k]
        self._error = errors[-1].copy()
        # Linear within the period: the pose never jumps.
        share = np.linspace(0, 1, ticks + 1)[1:, None]
        between = (1 - share) * errors[:-1, None] + share * errors[1:, None]
        return np.asarray(between.reshape(-1, 5))

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
        return positions, _rotated(quaternions, errors[:, 2:])

    def report(self, causes: tuple[str, ...]) -> None:
        """Take causes from outside of the estimate, which hold until the next report."""
        self._causes = causes

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
        """Health, which is OK without causes from outside."""
        return Health.DEGRADED if self._causes else Health.OK

    @property
    def status(self) -> EstimatorStatus:
        """Status, whose covariance is that of the errors that are added."""
        position, yaw, tilt = self._sigma[0], self._sigma[2], self._sigma[3]
        sigma = np.array([position, position, 0.0, tilt, tilt, yaw])
        return EstimatorStatus(self.health, self._causes, np.diag(sigma**2))

    @property
    def track(self) -> PoseTrack:
        """Poses over time, errors included."""
        return self._track


@kernel
def _rotated(quaternions: NDArray[np.float64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations with errors of yaw, roll and pitch, about the map's axes, shape (k, 4).

    Args:
        quaternions: True rotations x, y, z, w, shape (k, 4).
        errors: Errors of yaw, roll and pitch [rad], shape (k, 3).
    """
    out = np.empty((len(quaternions), 4))
    for k in range(len(quaternions)):
        yaw, roll, pitch = errors[k, 0] / 2, errors[k, 1] / 2, errors[k, 2] / 2
        tilt = _product(
            (0.0, 0.0, np.sin(yaw), np.cos(yaw)), (0.0, np.sin(pitch), 0.0, np.cos(pitch))
        )
        tilt = _product(tilt, (np.sin(roll), 0.0, 0.0, np.cos(roll)))
        x, y, z, w = quaternions[k]
        out[k] = _unit(_product(tilt, _unit((x, y, z, w))))
    return out


@inlined_kernel
def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the product of two quaternions: the rotation q, then the rotation p."""
    return (
        p[3] * q[0] + q[3] * p[0] + (p[1] * q[2] - p[2] * q[1]),
        p[3] * q[1] + q[3] * p[1] + (p[2] * q[0] - p[0] * q[2]),
        p[3] * q[2] + q[3] * p[2] + (p[0] * q[1] - p[1] * q[0]),
        p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2],
    )


@inlined_kernel
def _unit(q: Quaternion) -> Quaternion:
    """Return a quaternion scaled to unit length."""
    size = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] / size, q[1] / size, q[2] / size, q[3] / size
