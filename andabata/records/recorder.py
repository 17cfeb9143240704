"""Readings, estimates and commands of a robot as messages, for a recording or a live graph."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health, Localizer, health_after
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.navigator import StepResult
from andabata.records import topics
from andabata.records.bag_writers import MessageWriter
from andabata.records.messages import MessageBuilder
from andabata.records.planner_recorder import PlannerRecorder
from andabata.records.topics import RosMessage, Topic
from andabata.runs.strict_json import dumps
from traversability.cloud import PointCloud

SETUP = "setup"
"""Key of the drive's settings, as JSON, in the first diagnostics of a recording."""

DATUM = "datum"
"""Key of a live navigator's datum, as JSON, in its diagnostics."""

UNUSED = "not used: "
"""Beginning of the keys of the numbers of readings that were not used, by sensor and reason."""

_HALF_PERIOD = 0.05
"""Half a control period [s]: the relative cloud comes twice in one (paper, Table 3)."""

_RADIUS = 3
"""Column of a walker's radius."""

_LEVELS = {Health.OK: 0, Health.DEGRADED: 1, Health.DISORIENTED: 1, Health.LOST: 2}
"""Level of a diagnostics message by health: ok, warning, error."""


class MessageQueue:
    """Queue of outgoing messages of a control period; they leave in the order of their times.

    Attributes:
        builder: Builder of the messages.
    """

    def __init__(self, writer: MessageWriter, builder: MessageBuilder) -> None:
        """Create an empty queue.

        Args:
            writer: Recording or graph that the messages go to.
            builder: Builder of the messages.
        """
        self._writer, self.builder = writer, builder
        self._waiting: list[tuple[int, int, Topic, RosMessage]] = []

    def add(self, seconds: float, topic: Topic, message: RosMessage) -> None:
        """Append a message.

        Args:
            seconds: Time at which the robot has the message [s].
            topic: Topic of the message.
            message: The message.
        """
        order = len(self._waiting)
        self._waiting.append((self.builder.stamp_ns(seconds), order, topic, message))

    def flush(self) -> None:
        """Write all messages, oldest first; those of one time in the order of their arrival."""
        for stamp, _, topic, message in sorted(self._waiting, key=lambda entry: entry[:2]):
            self._writer.write(topic, stamp, message)
        self._waiting.clear()


def queue_readings(queue: MessageQueue, readings: SensorReadings) -> None:
    """Queue the readings of a period: a sweep at its end, a fix when it arrives.

    Args:
        queue: Queue of outgoing messages, extended.
        readings: Readings of the period.
    """
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
    if readings.walkers is not None:
        there = readings.walkers[readings.walkers[:, _RADIUS] > 0.0]
        queue.add(readings.stamp, topics.WALKERS, builder.places(readings.stamp, there[:, :3]))


class Recorder:
    """Records readings, estimates and commands of a navigator.

    A message is recorded when the robot has it: a sweep at its end, a fix when it arrives, a
    command at the end of its control period. The stamp in its header is the time of measurement.

    Attributes:
        has_begun: True if the begin of the drive is recorded.
        diagnostic_values: Values added to every diagnostics message, by key.
        failures: Checks of the sensors against each other that failed, a line each; with one of
            them no diagnostics message is ok.
    """

    def __init__(
        self,
        queue: MessageQueue,
        localizer: Localizer,
        assembler: CloudAssembler | None,
        bearings: NDArray[np.float64],
        clouds: bool = True,
        planner: PlannerRecorder | None = None,
    ) -> None:
        """Prepare a recording.

        Args:
            queue: Queue of outgoing messages.
            localizer: Localizer of the navigator.
            assembler: Cloud assembler of the perception; None with the horizontal scanner.
            bearings: Bearings of the virtual scan's sectors [rad], shape (n_sectors,).
            clouds: True to record the clouds, which make up nearly all of the bytes.
            planner: Maker of the planner's messages; None to record no map and no plan.
        """
        self._planner = planner
        self._queue, self._localizer, self._assembler = queue, localizer, assembler
        self._bearings, self._records_clouds = bearings, clouds
        self._cloud: PointCloud | None = None
        self._goal: NDArray[np.float64] | None = None
        self._last_complaints, self._has_arrived = "", False
        self.has_begun = False
        self.diagnostic_values: dict[str, str] = {}
        self.failures: Sequence[str] = ()

    def begin(self, pose: Pose, stamp: float, setup: dict[str, Any]) -> None:
        """Record the start and the settings of a drive.

        Args:
            pose: Start in the map, as the navigator was reset to it.
            stamp: Time of the start [s].
            setup: Settings of the drive, ready for JSON.
        """
        queue, builder, self.has_begun = self._queue, self._queue.builder, True
        queue.add(stamp, topics.INITIAL_POSE, builder.stamped_pose(stamp, pose))
        queue.add(stamp, topics.FILTERED_ODOMETRY, builder.odometry(stamp, pose))
        values = {SETUP: dumps(setup, sort_keys=True)}
        queue.add(stamp, topics.DIAGNOSTICS, builder.diagnostics(stamp, 0, "begin", values))
        queue.flush()

    def record(self, step: StepResult) -> None:
        """Record one control step."""
        queue_readings(self._queue, step.readings)
        now, builder = step.readings.stamp, self._queue.builder
        if self._goal is None or not np.array_equal(self._goal, step.goal):
            self._goal = step.goal.copy()
            self._queue.add(now, topics.GOAL, builder.goal(now, step.goal))
        self.queue_transforms(step.readings)
        self.queue_state(now)
        for stamp in (now - _HALF_PERIOD, now):
            self.queue_clouds(stamp)
        self.queue_commands(step)
        self._queue.flush()

    def queue_commands(self, step: StepResult) -> None:
        """Queue the outcome of a step: virtual scan, twist, wheel speeds, arrival, map and plan."""
        now, builder = step.readings.stamp, self._queue.builder
        if step.scan is not None:
            scan = builder.virtual_scan(now, step.scan, self._bearings)
            self._queue.add(now, topics.VIRTUAL_SCAN, scan)
        self._queue.add(now, topics.TWIST, builder.twist(step.twist.linear, step.twist.angular))
        wheels = builder.wheels("Wheels_cmd", now, step.wheels.left, step.wheels.right)
        self._queue.add(now, topics.WHEEL_COMMAND, wheels)
        if step.has_arrived and not self._has_arrived:
            self._queue.add(now, topics.GOAL_REACHED, builder.goal(now, step.goal))
        self._has_arrived = step.has_arrived
        if self._planner is not None:
            for topic, message in self._planner.messages(builder, step):
                self._queue.add(now, topic, message)

    def queue_transforms(self, readings: SensorReadings) -> None:
        """Queue the pose in ``odom`` at the time of each inertial reading, and ``odom`` at last."""
        queue, localizer = self._queue, self._localizer
        ticks = (
            _rows(readings.imu)[:, 0] if readings.imu is not None else np.array([readings.stamp])
        )
        kind = topics.TF.type_name(queue.builder.ros)
        for stamp, row in zip(ticks, localizer.track.at(ticks), strict=True):
            message = queue.builder.transform(float(stamp), row, kind)
            if stamp == ticks[-1] and self._planner is not None:
                message.transforms.append(self._planner.map_transform(queue.builder, float(stamp)))
            queue.add(float(stamp), topics.TF, message)

    def queue_state(self, now: float) -> None:
        """Queue the pose in the map; and the health, once a second or when it changes."""
        queue, builder = self._queue, self._queue.builder
        pose, status = self._localizer.pose, self._localizer.status
        odometry = builder.odometry(now, pose, status.covariance)
        queue.add(now, topics.FILTERED_ODOMETRY, odometry)
        estimate = builder.stamped_pose(now, pose, status.covariance)
        queue.add(now, topics.ESTIMATED_POSE, estimate)
        level, complaints = self._health(now, status)
        if round(now * 10) % 10 == 0 or complaints != self._last_complaints:
            self._last_complaints = complaints
            queue.add(now, topics.DIAGNOSTICS, self._diagnosis(now, level, status))

    def queue_clouds(self, stamp: float) -> None:
        """Queue the cloud relative to the robot at ``stamp`` [s]; a new cloud unchanged, too."""
        queue, builder, assembler = self._queue, self._queue.builder, self._assembler
        if not self._records_clouds or assembler is None or assembler.cloud is None:
            return
        if assembler.cloud is not self._cloud:
            self._cloud = assembler.cloud
            queue.add(stamp, topics.CLOUD, builder.cloud(stamp, self._cloud))
        row = self._localizer.track.at(np.array([stamp]))[0]
        relative = assembler.relative(Pose(row[:3], row[3:]))
        queue.add(stamp, topics.RELATIVE_CLOUD, builder.cloud(stamp, relative))

    def _health(self, now: float, status: EstimatorStatus) -> tuple[int, str]:
        """Return the diagnostics' level, 0 to 2, and what is wrong, without numbers."""
        health = health_after(status.health, bool(self.failures))
        level, complaints = _LEVELS[health], [str(health)]
        complaints += [text.split(":")[0] for text in (*self.failures, *status.causes)]
        if self._assembler is not None and self._has_no_cloud(now):
            waiting = np.isinf(self._assembler.cloud_age(now))
            level, complaints = max(level, 1 if waiting else 2), [*complaints, "cloud"]
        return level, "; ".join(complaints)

    def _has_no_cloud(self, now: float) -> bool:
        """Return True if the robot has no cloud that is recent enough."""
        return self._assembler is not None and self._assembler.is_stale(now)

    def _diagnosis(self, now: float, level: int, status: EstimatorStatus) -> RosMessage:
        """Return health, causes, uncertainty and counts as a diagnostics message."""
        assembler = self._assembler
        health = health_after(status.health, bool(self.failures))
        causes = [*self.failures, *status.causes]
        complaints = [str(health), *causes]
        values = self.diagnostic_values | _values_of(status, str(health), causes)
        for name, (accepted, gated, refused) in getattr(self._localizer, "counts", {}).items():
            values[name] = f"{accepted} accepted, {gated} gated, {refused} refused"
        if assembler is not None:
            age = assembler.cloud_age(now)
            values["cloud"] = f"{age:.1f} s old, {assembler.refused} refused"
            if self._has_no_cloud(now):
                complaints.append("cloud: none" if np.isinf(age) else f"cloud: {age:.1f} s old")
        return self._queue.builder.diagnostics(now, level, "; ".join(complaints), values)


def _values_of(status: EstimatorStatus, health: str, causes: Sequence[str]) -> dict[str, str]:
    """Return values of a diagnostics message: a plot of ``UNUSED`` needs bare numbers."""
    return {
        "health": health,
        "cause": "; ".join(causes),
        "position sigma [m]": f"{status.position_sigma:.3f}",
        "heading sigma [deg]": f"{np.rad2deg(status.yaw_sigma):.2f}",
    } | {
        f"{UNUSED}{sensor}, {reason}": str(number)
        for sensor, reasons in status.unused.items()
        for reason, number in reasons.items()
    }


def _rows(rows: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return a sensor's rows; none if it sent nothing."""
    return np.empty((0, 1)) if rows is None else rows
