"""Compares the tracks of an off-road robot with the walkers of its world, step by step.

A walker is in sight while two of three rays from the laser to its body meet nothing before it; see
``bench.mover_tally`` for what counts.
"""

import math
import time

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.bench.mover_tally import Case, MoverDrive, MoverTally, Tracks, TrueMovers
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.mover_perception import MoverPerception

_HEIGHTS = (0.5, 0.9, 1.3)
"""Heights over a walker's foot at which rays look for it [m]."""

_SLACK = 0.1
"""Distance before a walker's front that a ray may end at [m]."""

_DEPTH = 0.7
"""Optical depth of vegetation at which a ray ends: the median of standard exponential draws."""


class MoverProbe:
    """Compares tracks with the walkers of a world, step by step.

    Attributes:
        drive: Measures so far.
    """

    def __init__(self, case: Case, robot: SimulatedRobot, movers: MoverPerception) -> None:
        """Begin a drive.

        Args:
            case: Laser, preset and seed.
            robot: Robot that drives.
            movers: Tracks.
        """
        self._tally = MoverTally(case)
        self._rays, self._localizer, self._movers = robot.scene.rays, robot.localizer, movers
        self._eye = np.array([0.0, 0.0, robot.config.robot.lidar_height])
        self._head, self._stamp = 0.0, 0.0

    @property
    def drive(self) -> MoverDrive:
        """Measures so far."""
        return self._tally.drive

    def __call__(self, readings: SensorReadings) -> None:
        """Follow the movers, and compare."""
        begin = time.thread_time()
        self._movers.update(readings, self._localizer.track)
        cost = time.thread_time() - begin
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        self._compare(readings, readings.truth.pose, cost)
        self._stamp = readings.stamp
        if readings.sweeps is not None and len(readings.sweeps.head_angles):
            self._head = float(readings.sweeps.head_angles[-1])

    def _compare(self, readings: SensorReadings, pose: Pose, cost: float) -> None:
        """Compare the tracks with the walkers, at the true pose."""
        tracks, believed = self._movers.movers, self._localizer.odometry
        x, y = pose.position[:2].tolist()
        own = (*believed.position[:2].tolist(), believed.yaw)
        known = tracks.places, tracks.velocities, tracks.numbers
        rows = np.empty((0, 5)) if readings.walkers is None else readings.walkers
        movers = TrueMovers(
            rows[:, :2],
            rows[:, 3] > 0,
            lambda m: self._sees(pose, rows[m]),
            lambda m: self._is_looked_at(readings, pose, rows[m]),
        )
        self._tally.compare(
            Tracks.seen_from((x, y, pose.yaw), own, *known),
            movers,
            pose.position[:2],
            readings.stamp - self._stamp,
            cost,
        )

    def _is_looked_at(
        self, readings: SensorReadings, pose: Pose, walker: NDArray[np.float64]
    ) -> bool:
        """Return True if a cloud came, or a turning laser's plane has passed a walker."""
        if readings.sweeps is None or not len(readings.sweeps.head_angles):
            return bool(readings.frames)
        offset = walker[:2] - pose.position[:2]
        bearing = float(np.arctan2(offset[1], offset[0])) - pose.yaw
        head = float(readings.sweeps.head_angles[-1])
        return math.floor((head - bearing) / math.pi) != math.floor(
            (self._head - bearing) / math.pi
        )

    def _sees(self, pose: Pose, walker: NDArray[np.float64]) -> bool:
        """Return True if two of three rays to a walker meet nothing before it."""
        eye = pose.position + self._eye
        targets = walker[:3] + np.array([[0.0, 0.0, height] for height in _HEIGHTS]) - eye
        lengths = np.linalg.norm(targets, axis=1)
        rays = np.column_stack([np.tile(eye, (3, 1)), targets / lengths[:, None]])
        depths = np.full(3, _DEPTH, dtype=np.float32)
        ranges, _ = self._rays.cast(rays.astype(np.float32), depths)
        return int((ranges > lengths - walker[3] - _SLACK).sum()) >= 2

    def finish(self, duration: float) -> MoverDrive:
        """Return the measures of the whole drive of a duration [s]."""
        return self._tally.finish(duration, self._movers.jumps)
