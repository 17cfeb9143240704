"""What a robot senses, believes and does, as messages: for a recording and for a live graph."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health, Localizer
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.navigator import Step
from andabata.records import topics
from andabata.records.bags import MessageWriter
from andabata.records.messages import MessageBuilder
from andabata.records.topics import RosMessage, Topic
from traversability.cloud import PointCloud

SETUP = "setup"
"""Key of the diagnostics' first message under which the drive's settings stand, as JSON."""

DATUM = "datum"
"""Key of the diagnostics under which the datum stands that a live navigator took, as JSON."""

_LEVELS = {Health.OK: 0, Health.DEGRADED: 1, Health.LOST: 2}


class MessageQueue:
    """Messages of a control period on their way out.

    Attributes:
        builder: Makes them.
    """

    def __init__(self, writer: MessageWriter, builder: MessageBuilder) -> None:
        """Begin empty."""
        self._writer, self.builder = writer, builder
        self._waiting: list[tuple[int, int, Topic, RosMessage]] = []

    def add(self, seconds: float, topic: Topic, message: RosMessage) -> None:
        """Put a message in line; ``seconds`` is when the robot has it."""
        order = len(self._waiting)
        self._waiting.append((self.builder.stamp_ns(seconds), order, topic, message))

    def flush(self) -> None:
        """Write what waits, oldest first."""
        for stamp, _, topic, message in sorted(self._waiting, key=lambda entry: entry[:2]):
            self._writer.write(topic, stamp, message)
        self._waiting.clear()


def queue_readings(queue: MessageQueue, readings: SensorReadings) -> None:
    """Put a period's senses in line: a sweep at its end, a fix when it arrives."""
    builder, sweeps = queue.builder, readings.sweeps
    if sweeps is not None:
        lasts = sweeps.beam_period * (sweeps.ranges.shape[1] - 1)
        for k, stamp in enumerate(sweeps.stamps):
            queue.add(float(stamp) + lasts, topics.SCAN, builder.sweep(sweeps, k))
            queue.add(float(stamp) + lasts, topics.HEAD_ANGLE, builder.head(sweeps, k))
    for frame in readings.frames:
        queue.add(readings.stamp, topics.LASER_CLOUD, builder.frame(frame))
    for row in _rows(readings.encoders):
        message = builder.wheels("Wheels_speed", float(row[0]), row[1], row[2])
        queue.add(float(row[0]), topics.ENCODERS, message)
    for row in _rows(readings.imu):
        queue.add(float(row[0]), topics.IMU, builder.imu(row))
    for row in _rows(readings.mag):
        queue.add(float(row[0]), topics.MAG, builder.field(row))
    for row in _rows(readings.gnss):
        queue.add(readings.stamp, topics.FIX, builder.fix(row))
    if readings.truth is not None:
        truth = builder.odometry(readings.stamp, readings.truth.pose, None, readings.truth)
        queue.add(readings.stamp, topics.GROUND_TRUTH, truth)


class Recorder:
    """Writes what a navigator senses and does.

    A message is recorded when the robot has it: a sweep at its end, a fix when it arrives, a
    command at the end of its control period. Its own stamp is that of its instant.

    Attributes:
        has_begun: Whether the begin is recorded.
        diagnostic_values: Values that are added to the diagnostics, by key.
    """

    def __init__(
        self,
        queue: MessageQueue,
        localizer: Localizer,
        assembler: CloudAssembler | None,
        bearings: NDArray[np.float64],
        clouds: bool = True,
    ) -> None:
        """Begin a record.

        Args:
            queue: Where to.
            localizer: The navigator's.
            assembler: The perception's, None with the horizontal scanner.
            bearings: Of the virtual scan's sectors [rad].
            clouds: Whether to record the clouds, which are nearly all of the bytes.
        """
        self._queue, self._localizer, self._assembler = queue, localizer, assembler
        self._bearings, self._clouds = bearings, clouds
        self._cloud: PointCloud | None = None
        self._goal: NDArray[np.float64] | None = None
        self._said = ""
        self.has_begun = False
        self.diagnostic_values: dict[str, str] = {}

    def begin(self, pose: Pose, stamp: float, setup: dict[str, Any]) -> None:
        """Record where the robot believes to start, and the settings of the drive.

        Args:
            pose: As the navigator was told.
            stamp: Its time [s].
            setup: Ready for JSON.
        """
        queue, builder, self.has_begun = self._queue, self._queue.builder, True
        queue.add(stamp, topics.INITIAL_POSE, builder.initial(stamp, pose))
        queue.add(stamp, topics.FILTERED_ODOMETRY, builder.odometry(stamp, pose))
        values = {SETUP: json.dumps(setup, sort_keys=True)}
        queue.add(stamp, topics.DIAGNOSTICS, builder.diagnostics(stamp, 0, "begin", values))
        queue.flush()

    def record(self, step: Step) -> None:
        """Record one control step."""
        queue_readings(self._queue, step.readings)
        now, builder = step.readings.stamp, self._queue.builder
        if self._goal is None or not np.array_equal(self._goal, step.goal):
            self._goal = step.goal.copy()
            self._queue.add(now, topics.GOAL, builder.goal(now, step.goal))
        self.queue_transforms(step.readings)
        self.queue_state(now)
        for stamp in (now - 0.05, now):
            self.queue_clouds(stamp)
        self.queue_commands(step)
        self._queue.flush()

    def queue_commands(self, step: Step) -> None:
        """Put in line what a step made of it: virtual scan, command and wheel speeds."""
        now, builder = step.readings.stamp, self._queue.builder
        if step.view is not None:
            scan = builder.virtual_scan(now, step.view.scan, self._bearings)
            self._queue.add(now, topics.VIRTUAL_SCAN, scan)
        self._queue.add(now, topics.TWIST, builder.twist(step.speed, step.steering))
        wheels = builder.wheels("Wheels_cmd", now, step.wheels.left, step.wheels.right)
        self._queue.add(now, topics.WHEEL_COMMAND, wheels)

    def queue_transforms(self, readings: SensorReadings) -> None:
        """Put in line the poses of some senses."""
        queue, localizer = self._queue, self._localizer
        ticks = (
            _rows(readings.imu)[:, 0] if readings.imu is not None else np.array([readings.stamp])
        )
        kind = topics.TF.type_name(queue.builder.ros)
        for stamp, row in zip(ticks, localizer.track.at(ticks), strict=True):
            message = queue.builder.transform(float(stamp), row, kind)
            queue.add(float(stamp), topics.TF, message)

    def queue_state(self, now: float) -> None:
        """Put in line the pose in the map, and health, once a second or when it changes."""
        queue, builder, localizer = self._queue, self._queue.builder, self._localizer
        covariance = localizer.covariance if isinstance(localizer, UkfLocalizer) else None
        queue.add(now, topics.FILTERED_ODOMETRY, builder.odometry(now, localizer.pose, covariance))
        level, said = self._health(now)
        if round(now * 10) % 10 == 0 or said != self._said:
            self._said = said
            queue.add(now, topics.DIAGNOSTICS, self._diagnosis(now, level))

    def queue_clouds(self, stamp: float) -> None:
        """Put in line the cloud as seen from the pose at ``stamp`` [s]; a new one as it is too."""
        queue, builder, assembler = self._queue, self._queue.builder, self._assembler
        if not self._clouds or assembler is None or assembler.cloud is None:
            return
        if assembler.cloud is not self._cloud:
            self._cloud = assembler.cloud
            queue.add(stamp, topics.CLOUD, builder.cloud(stamp, self._cloud))
        row = self._localizer.track.at(np.array([stamp]))[0]
        relative = assembler.relative(Pose(row[:3], row[3:]))
        queue.add(stamp, topics.RELATIVE_CLOUD, builder.cloud(stamp, relative))

    def _health(self, now: float) -> tuple[int, str]:
        """Return the level of the diagnostics and what is wrong, without its numbers."""
        level, said = _LEVELS[self._localizer.health], [str(self._localizer.health)]
        if isinstance(self._localizer, UkfLocalizer):
            said += [text.split(":")[0] for text in self._localizer.complaints]
        if self._assembler is not None and self._blind(now):
            waiting = np.isinf(self._assembler.cloud_age(now))
            level, said = max(level, 1 if waiting else 2), [*said, "cloud"]
        return level, "; ".join(said)

    def _blind(self, now: float) -> bool:
        """Return whether there is no cloud to drive by."""
        return self._assembler is not None and self._assembler.is_stale(now)

    def _diagnosis(self, now: float, level: int) -> RosMessage:
        """Return health, complaints and counts in words."""
        localizer, assembler = self._localizer, self._assembler
        values = dict(self.diagnostic_values)
        said = [str(localizer.health)]
        if isinstance(localizer, UkfLocalizer):
            said += localizer.complaints
            for name, (believed, gated, refused) in localizer.counts.items():
                values[name] = f"{believed} believed, {gated} gated, {refused} refused"
        if assembler is not None:
            age = assembler.cloud_age(now)
            values["cloud"] = f"{age:.1f} s old, {assembler.refused} refused"
            if self._blind(now):
                said.append("cloud: none" if np.isinf(age) else f"cloud: {age:.1f} s old")
        return self._queue.builder.diagnostics(now, level, "; ".join(said), values)


def _rows(given: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return a sense's rows, none when it was silent."""
    return np.empty((0, 1)) if given is None else given
