"""Records a drive: every topic at its rate, from the navigator's own steps."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health, Localizer
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import Pose
from andabata.machine.senses import Senses
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.navigator import Step
from andabata.records import topics
from andabata.records.bags import BagWriter
from andabata.records.messages import Composer
from andabata.records.topics import RosMessage, Topic
from traversability.cloud import PointCloud

SETUP = "setup"
"""Key of the diagnostics' first message under which the drive's settings stand, as JSON."""

_LEVELS = {Health.OK: 0, Health.DEGRADED: 1, Health.LOST: 2}


class Recorder:
    """Writes what a navigator senses and does.

    A message is recorded when the robot has it: a sweep at its end, a fix when it arrives, a
    command at the end of its control period. Its own stamp is that of its instant.
    """

    def __init__(
        self,
        writer: BagWriter,
        localizer: Localizer,
        assembler: CloudAssembler | None,
        bearings: NDArray[np.float64],
        clouds: bool = True,
    ) -> None:
        """Begin a record.

        Args:
            writer: Where to.
            localizer: The navigator's.
            assembler: The perception's, None with the horizontal scanner.
            bearings: Of the virtual scan's sectors [rad].
            clouds: Whether to record the clouds, which are nearly all of the bytes.
        """
        self._writer, self._localizer, self._assembler = writer, localizer, assembler
        self._bearings, self._clouds = bearings, clouds
        self._compose = Composer(writer.ros)
        self._waiting: list[tuple[int, int, Topic, RosMessage]] = []
        self._cloud: PointCloud | None = None
        self.begun = False
        self._goal: NDArray[np.float64] | None = None

    def begin(self, pose: Pose, stamp: float, setup: dict[str, Any]) -> None:
        """Record where the robot believes to start, and the settings of the drive.

        Args:
            pose: As the navigator was told.
            stamp: Its time [s].
            setup: Ready for JSON.
        """
        compose, self.begun = self._compose, True
        self._add(stamp, topics.FILTERED, compose.odometry(stamp, pose))
        values = {SETUP: json.dumps(setup, sort_keys=True)}
        self._add(stamp, topics.DIAGNOSTICS, compose.diagnostics(stamp, 0, "begin", values))
        self._flush()

    def take(self, step: Step) -> None:
        """Record one control step."""
        now, compose = step.senses.stamp, self._compose
        self._sensed(step.senses)
        if self._goal is None or not np.array_equal(self._goal, step.goal):
            self._goal = step.goal.copy()
            self._add(now, topics.GOAL, compose.goal(now, step.goal))
        self._believed(step.senses)
        if step.view is not None:
            scan = compose.virtual_scan(now, step.view.scan, self._bearings)
            self._add(now, topics.VIRTUAL, scan)
        self._add(now, topics.TWIST, compose.twist(step.speed, step.steering))
        wheels = compose.wheels("Wheels_cmd", now, step.wheels.left, step.wheels.right)
        self._add(now, topics.WHEELS, wheels)
        if step.senses.truth is not None:
            truth = step.senses.truth
            self._add(now, topics.TRUTH, compose.odometry(now, truth.pose, None, truth))
        self._flush()

    def _sensed(self, senses: Senses) -> None:
        """Record the senses of a period."""
        compose, sweeps = self._compose, senses.sweeps
        if sweeps is not None:
            lasts = sweeps.beam_period * (sweeps.ranges.shape[1] - 1)
            for k, stamp in enumerate(sweeps.stamps):
                self._add(float(stamp) + lasts, topics.SCAN, compose.sweep(sweeps, k))
                self._add(float(stamp) + lasts, topics.HEAD, compose.head(sweeps, k))
        for row in _rows(senses.encoders):
            message = compose.wheels("Wheels_speed", float(row[0]), row[1], row[2])
            self._add(float(row[0]), topics.ENCODERS, message)
        for row in _rows(senses.imu):
            self._add(float(row[0]), topics.IMU, compose.imu(row))
        for row in _rows(senses.field):
            self._add(float(row[0]), topics.COMPASS, compose.field(row))
        for row in _rows(senses.fixes):
            self._add(senses.stamp, topics.FIX, compose.fix(row))

    def _believed(self, senses: Senses) -> None:
        """Record poses, clouds and health."""
        compose, localizer, now = self._compose, self._localizer, senses.stamp
        ticks = _rows(senses.imu)[:, 0] if senses.imu is not None else np.array([now])
        kind = topics.TF.type_name(self._writer.ros)
        for stamp, row in zip(ticks, localizer.track.at(ticks), strict=True):
            self._add(float(stamp), topics.TF, compose.transform(float(stamp), row, kind))
        covariance = localizer.covariance if isinstance(localizer, UkfLocalizer) else None
        filtered = compose.odometry(now, localizer.pose, covariance)
        self._add(now, topics.FILTERED, filtered)
        if round(now * 10) % 10 == 0:
            self._add(now, topics.DIAGNOSTICS, self._diagnosis(now))
        assembler = self._assembler
        if not self._clouds or assembler is None or assembler.cloud is None:
            return
        if assembler.cloud is not self._cloud:
            self._cloud = assembler.cloud
            self._add(now, topics.CLOUD, compose.cloud(now, self._cloud))
        for stamp in (now - 0.05, now):
            row = localizer.track.at(np.array([stamp]))[0]
            cloud = assembler.relative(Pose(row[:3], row[3:]))
            self._add(stamp, topics.RELATIVE, compose.cloud(stamp, cloud))

    def _diagnosis(self, now: float) -> RosMessage:
        """Return health, complaints and counts in words."""
        localizer = self._localizer
        values: dict[str, str] = {}
        said: tuple[str, ...] = ()
        if isinstance(localizer, UkfLocalizer):
            said = localizer.complaints
            for name, (believed, gated, refused) in localizer.counts.items():
                values[name] = f"{believed} believed, {gated} gated, {refused} refused"
        health = localizer.health
        message = "; ".join((str(health), *said))
        return self._compose.diagnostics(now, _LEVELS[health], message, values)

    def _add(self, seconds: float, topic: Topic, message: RosMessage) -> None:
        """Put a message in line."""
        order = len(self._waiting)
        self._waiting.append((self._compose.stamp_ns(seconds), order, topic, message))

    def _flush(self) -> None:
        """Write the messages of a period, oldest first."""
        for stamp, _, topic, message in sorted(self._waiting, key=lambda entry: entry[:2]):
            self._writer.write(topic, stamp, message)
        self._waiting.clear()


def _rows(given: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return a sense's rows, none when it was silent."""
    return np.empty((0, 1)) if given is None else given
