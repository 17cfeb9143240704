"""Cells that a recorded drive has labelled, by the navigator's own poses and clouds."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from andabata.assembly.navigator import NavigatorParts
from andabata.datasets.drive_labeller import DriveLabeller, DriveSamples
from andabata.datasets.drive_path import DriveLabelsConfig, DrivePeriod
from andabata.localization.localizer import Health, Localizer
from andabata.machine.kinematics import SkidSteer
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.records.bag_reader import Period
from andabata.records.bags import Bag, BagError
from andabata.replay.options import ReplayOptions
from andabata.replay.recorded_drive import RecordedDrive
from andabata.replay.replay import BagReplay
from traversability.grid import PolarGrid

_CONTROLLER = "reactive"
"""Controller of the replay, whose commands are not used: the one that costs least."""


def label_drive(
    path: Path,
    options: ReplayOptions,
    grid: PolarGrid,
    config: DriveLabelsConfig,
    on_second: Callable[[], None] | None = None,
) -> tuple[DriveSamples, dict[str, Any]]:
    """Send a recording through the navigator and label the cells of its clouds by its way.

    Args:
        path: The recording.
        options: User's choices; the controller is not used.
        grid: Polar grid of the cells.
        config: Settings of the labels.
        on_second: Function called after each recorded second.

    Returns:
        Labelled cells, and the result of the replay, ready for JSON.

    Raises:
        BagError: If the recording lacks a sensor that the robot needs, or is damaged.
        FrameError: If the mounting of a sensor is unknown or contradicted.
        DatumError: If the fixes lie far from the datum.
        ValueError: If the drive has labelled no cell.
    """
    observer = _DriveObserver(grid, config)
    options = replace(options, controller=_CONTROLLER)
    with Bag(path) as bag:
        result = BagReplay(bag, options, on_second, observer=observer).run()
    return observer.samples(), result


class _DriveObserver:
    """Hands the periods and clouds of a replay to a labeller."""

    _labeller: DriveLabeller
    _kinematics: SkidSteer
    _localizer: Localizer
    _assembler: CloudAssembler

    def __init__(self, grid: PolarGrid, config: DriveLabelsConfig) -> None:
        """Take the grid and the settings of the labels."""
        self._grid, self._config = grid, config

    def begin(self, parts: NavigatorParts, drive: RecordedDrive) -> None:
        """Take the parts of the navigator.

        Raises:
            BagError: If the recorded robot has a horizontal scanner, which makes no clouds.
        """
        assembler = assembler_of(parts.perception)
        if assembler is None:
            raise BagError(f"{drive.laser}: expected a laser that makes clouds, got one plane")
        self._localizer, self._assembler = parts.localizer, assembler
        self._kinematics = SkidSteer(drive.config.robot)
        self._labeller = DriveLabeller(drive.config.robot, self._grid, self._config)

    def observe(self, period: Period, result: StepResult) -> None:
        """Take a control period, with the cloud around its pose where one is due."""
        stamp, pose = result.readings.stamp, self._localizer.odometry
        seen = not self._assembler.is_stale(stamp)
        points = (
            self._assembler.around(pose) if seen and self._labeller.wants_cloud(stamp) else None
        )
        self._labeller.add(self._period(period, result.readings), points)

    def end_piece(self) -> None:
        """Label what waits."""
        self._labeller.end_piece()

    def samples(self) -> DriveSamples:
        """Return the labelled cells."""
        return self._labeller.samples()

    def _period(self, period: Period, readings: SensorReadings) -> DrivePeriod:
        """Return what is known of a control period."""
        localizer, commanded = self._localizer, period.speed
        if period.wheels is not None:
            commanded, _ = self._kinematics.twist(period.wheels)
        return DrivePeriod(
            readings.stamp,
            localizer.odometry,
            localizer.pose.position[:2].copy(),
            np.nan if commanded is None else commanded,
            self._wheel_speed(readings),
            localizer.health is Health.OK,
        )

    def _wheel_speed(self, readings: SensorReadings) -> float:
        """Return the forward speed of the wheels [m/s], NaN if it is unknown."""
        if readings.encoders is None or not len(readings.encoders):
            return float("nan")
        left, right = readings.encoders[:, 1:3].mean(axis=0).tolist()
        return self._kinematics.twist(WheelSpeeds(left, right))[0]
