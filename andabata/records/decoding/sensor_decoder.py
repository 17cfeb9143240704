"""Decoding of messages into sensor readings per control period, recorded or live."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.sensor_readings import SensorReadings, Sweeps, WheelSpeeds
from andabata.records import topics
from andabata.records.decoding.accepted_types import accepted_types, message_type
from andabata.records.decoding.live_bursts import LiveBursts
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.point_cloud2 import as_point_cloud2, decode_point_cloud2
from andabata.records.decoding.reading_sources import ReadingSources
from andabata.records.decoding.source_choice import ReadingSource
from andabata.records.decoding.sweep_matcher import SweepMatcher, valid_ranges
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.decoding.wheel_speeds import TWO_NODES
from andabata.records.decoding.wheel_zeros import zeros_between
from andabata.records.frames.extrinsics import Extrinsics, PendingTransformError
from andabata.records.frames.names import Sensor
from andabata.records.messages import NS, header_ns, sweep_angles, wheel_speeds_of
from andabata.records.remarks import Remarks
from andabata.records.topics import RosMessage, Topic
from traversability.cloud import PointCloud

MOTION = (topics.ENCODERS, topics.IMU, topics.MAG)
"""Topics without which the robot's motion is unknown."""

SWEEPS = (topics.SCAN, topics.HEAD_ANGLE)
"""Topics of the rotating laser."""

_MOST_TRIES = 10
"""Number of periods for which a cloud waits for the transforms of its frame."""

_SENSORS: dict[Topic, Sensor] = {
    topics.IMU: "imu",
    topics.MAG: "compass",
    topics.FIX: "gnss",
}
"""Sensors whose rows depend on their pose on the robot."""

_ROWS = (topics.IMU, topics.ENCODERS, topics.MAG, topics.FIX)
"""Topics whose readings are rows of numbers."""


_FALSE_ZEROS = 3
"""Number of false zeros from which a zero at the end of a period is one, too."""

_ZEROS = "zeros between speeds of a robot that drives on, of a second node"


class SensorDecoder:
    """Collects the messages of a control period and returns them as sensor readings.

    Attributes:
        goal: Latest goal in the map [m], shape (2,), None before the first.
        ranges: Virtual scan of the period [m], shape (n_sectors,), None without one.
        wheels: Commanded wheel speeds of the period, None without.
        refused: Number of messages that were left out.
        decoder: Decoder of the readings that consist of rows.
        extrinsics: Poses of the sensors.
    """

    def __init__(
        self,
        epoch_ns: int,
        cloud: Topic | None = None,
        decoder: MessageDecoder | None = None,
        extrinsics: Extrinsics | None = None,
    ) -> None:
        """Create a decoder without messages.

        Args:
            epoch_ns: Stamp from which times are counted [ns].
            cloud: Topic of a 3D laser, None for the rotating laser's two.
            decoder: Decoder of the readings that consist of rows; None for one that infers units
                as they come.
            extrinsics: Poses of the sensors; None for those that the frames' names imply.
        """
        self.decoder = decoder or MessageDecoder()
        self.extrinsics = extrinsics or Extrinsics()
        self.epoch_ns = epoch_ns
        self._cloud = cloud
        self._is_levelled = cloud is not None and topics.RELATIVE_CLOUD.ros1 == cloud.ros1
        self._pending: list[tuple[RosMessage, int]] = []
        self.goal: NDArray[np.float64] | None = None
        self.refused = 0
        self._sweeps = SweepMatcher()
        self._clear()

    def _clear(self) -> None:
        """Begin the next period."""
        self._rows: dict[Topic, list[list[float]]] = {topic: [] for topic in _ROWS}
        self._frames: list[PointCloud] = []
        self.ranges: NDArray[np.float32] | None = None
        self.wheels: WheelSpeeds | None = None

    @property
    def epoch_ns(self) -> int:
        """Stamp from which times are counted [ns]; setting it forgets earlier readings."""
        return self._epoch_ns

    @epoch_ns.setter
    def epoch_ns(self, epoch_ns: int) -> None:
        self._epoch_ns = epoch_ns
        self._delivered: dict[Topic, float] = {}
        self._last_wheels: NDArray[np.float64] | None = None
        self._false_zeros = 0
        self._sources = ReadingSources(self.decoder.remarks)
        self._bursts = {topic: LiveBursts() for topic in MOTION} if self.decoder.is_live else {}
        self.extrinsics.checks.restart()
        self.decoder.restart()

    @property
    def wanted(self) -> tuple[Topic, ...]:
        """Topics of the sensors and the goal, to subscribe to."""
        laser = SWEEPS if self._cloud is None else (self._cloud,)
        return (*MOTION, *laser, topics.FIX, topics.GOAL)

    def is_laser(self, topic: Topic) -> bool:
        """Return True if a topic is the laser's."""
        return topic in SWEEPS or topic is self._cloud

    def sensor_of(self, topic: Topic) -> Sensor | None:
        """Return the sensor whose pose a topic's measurements depend on, None without one."""
        return "laser" if topic is self._cloud else _SENSORS.get(topic)

    @property
    def _laser(self) -> str:
        """Name of the topic that clouds come from."""
        return (self._cloud or topics.SCAN).ros1

    def seconds(self, stamp_ns: int) -> float:
        """Return a stamp [ns] as time since the epoch [s]."""
        return (stamp_ns - self.epoch_ns) / NS

    @property
    def remarks(self) -> Remarks:
        """Remarks on corrections and refusals."""
        return self.decoder.remarks

    @property
    def failures(self) -> list[str]:
        """Checks of the sensors against each other that failed, a line each."""
        return [*self.remarks.failures, *self.extrinsics.failures]

    def add(
        self, topic: Topic, content: RosMessage, stamp_ns: int | None = None, node: str = ""
    ) -> None:
        """Add a message; one that cannot be used is left out and counted.

        Args:
            topic: Topic of the message.
            content: Message to add.
            stamp_ns: Time of its arrival [ns], for types without a header.
            node: Name of the publishing node; empty if it is unknown.
        """
        try:
            self._add(topic, content, stamp_ns, node)
        except ValueError as error:
            self._refuse(topic.ros1, str(error), stamp_ns)

    def _refuse(self, topic: str, reason: str, stamp_ns: int | None = None) -> None:
        """Count a message that is left out."""
        self.refused += 1
        seconds = self.seconds(stamp_ns) if stamp_ns is not None and self.epoch_ns else None
        self.remarks.refuse(topic, reason, seconds)

    def _add(self, topic: Topic, content: RosMessage, stamp_ns: int | None, node: str) -> None:
        """Add a message to the readings of its kind.

        Raises:
            ValueError: If its type is not accepted, or it cannot be used.
        """
        kind = message_type(content)
        if kind not in accepted_types(topic):
            raise UnusableMessageError(f"expected {' or '.join(accepted_types(topic))}, got {kind}")
        if topic is self._cloud:
            self._add_cloud(as_point_cloud2(content), _MOST_TRIES)
        elif topic is topics.SCAN:
            self.extrinsics.head_pose(frame_of(content))  # Refuses a frame of the world.
            self._sweeps.add_scan(content)
        elif topic is topics.HEAD_ANGLE:
            self._sweeps.add_head(content)
        elif topic is topics.GOAL:
            point = content.pose.position
            self.goal = np.array([point.x, point.y])
        elif topic is topics.VIRTUAL_SCAN:
            self.ranges = np.asarray(content.ranges, dtype=np.float32)
        elif topic is topics.WHEEL_COMMAND:
            self.wheels = wheel_speeds_of(content)
        elif topic in self._rows:
            self._add_rows(topic, content, stamp_ns, node)

    def _add_rows(self, topic: Topic, content: RosMessage, stamp_ns: int | None, node: str) -> None:
        """Add the rows of a message, in the robot's axes.

        Raises:
            ValueError: If it cannot be used.
        """
        has_header = hasattr(content, "header")
        stamp = header_ns(content) if has_header else stamp_ns
        if stamp is None:
            raise UnusableMessageError(
                f"expected a header or a time of arrival, got {message_type(content)} with neither"
            )
        rows = self.decoder.rows(topic, content, self.seconds(stamp))
        sensor = _SENSORS.get(topic) if has_header else None
        if sensor is not None:
            frame, transform = frame_of(content), self.extrinsics.transform_row
            rows = [[row[0], *transform(sensor, frame, row[1:])] for row in rows]
        source = ReadingSource.of(content, node)
        for row in rows:
            self._sources.add(topic, source, row)
        self._rows[topic] += rows

    def _add_cloud(self, content: RosMessage, tries: int) -> None:
        """Add a cloud, which waits for the transforms of a frame that moves.

        Raises:
            ValueError: If it cannot be used.
        """
        stamp = self.seconds(header_ns(content))
        decoded = decode_point_cloud2(content, frame_of(content) or "sensor", stamp)
        cloud = decoded.cloud
        for text in decoded.remarks:
            self.remarks.count(self._laser, text, stamp)
        if self._is_levelled:  # Our own relative cloud, whose frame is levelled already.
            self._frames.append(cloud)
            return
        clock_offset = header_ns(content) / NS - stamp
        try:
            self._frames.append(self.extrinsics.transform_cloud(cloud, clock_offset))
        except PendingTransformError as error:
            if not tries:
                self.extrinsics.note_refusal("laser", error)
                raise
            self._pending.append((content, tries - 1))

    def _retry(self) -> None:
        """Try the clouds again that wait for transforms."""
        pending, self._pending = self._pending, []
        for content, tries in pending:
            try:
                self._add_cloud(content, tries)
            except ValueError as error:
                self._refuse(self._laser, str(error), header_ns(content))

    def readings(self, stamp: float) -> SensorReadings:
        """Return the readings of the period that ends at ``stamp`` [s], and begin the next."""
        self._retry()
        rows = {topic: self._in_order(topic) for topic in self._rows}
        period_readings = SensorReadings(
            stamp=stamp,
            sweeps=self._matched_sweeps(),
            frames=tuple(self._frames),
            encoders=rows[topics.ENCODERS],
            imu=rows[topics.IMU],
            mag=rows[topics.MAG],
            gnss=rows[topics.FIX],
            antenna=self.extrinsics.antenna,
        )
        self._compare(period_readings)
        self._clear()
        return period_readings

    def _compare(self, readings: SensorReadings) -> None:
        """Compare wheels, gyro and fixes of a period with each other."""
        checks, wheels, speeds = self.extrinsics.checks, readings.encoders, None
        checks.compare(readings.imu, wheels)
        if wheels is not None:
            speed = wheels[:, 1:3].mean(axis=1) * self.decoder.robot.wheel_radius
            speeds = np.column_stack([wheels[:, 0], speed])
        checks.driving.add(readings.imu, speeds, readings.mag, readings.gnss)

    def verify_sources(self) -> None:
        """Check that no two sources of one topic contradict each other.

        Raises:
            SourceError: If two do; the message names both and the option to give.
        """
        self._sources.verify()

    def _in_order(self, topic: Topic) -> NDArray[np.float64] | None:
        """Return the rows of a topic by increasing stamps, each stamp once, None without any.

        Rows older than those of earlier periods are left out; only a fix may come late.
        """
        if not self._rows[topic]:
            return None
        rows = np.array(self._rows[topic])
        if topic is topics.ENCODERS:
            rows = self._without_zeros(rows)
        if not len(rows):
            return None
        rows = self._spread(topic, rows)
        stamps, last = rows[:, 0], self._delivered.get(topic, -np.inf)
        if stamps[0] > last and (stamps[1:] > stamps[:-1]).all():
            self._delivered[topic] = float(stamps[-1])
            return rows
        _, first = np.unique(stamps, return_index=True)
        repeated, count = len(rows) - len(first), len(rows)
        rows = rows[first]
        if topic is not topics.FIX:
            repeated += int((rows[:, 0] == last).sum())
            rows = rows[rows[:, 0] > last]
            self._delivered[topic] = max(last, float(rows[-1, 0])) if len(rows) else last
        late = count - repeated - len(rows)
        if repeated:
            self.refused += repeated
            self.remarks.refuse(topic.ros1, "a stamp that came before", number=repeated)
        if late:
            self.refused += late
            text = "older than readings that were used already"
            self.remarks.refuse(topic.ros1, text, number=late)
        return rows if len(rows) else None

    def _spread(self, topic: Topic, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rows of a live session with bursts spread, if they are of one source."""
        bursts = self._bursts.get(topic)
        is_mixed = topic is topics.ENCODERS and self._false_zeros > 0
        if bursts is None or is_mixed or self._sources.is_shared(topic):
            return rows
        rows = bursts.spread(rows)
        if bursts.text is not None:
            self.remarks.note(topic.ros1, bursts.text)
        return rows

    def _without_zeros(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return wheel speeds without the zeros of another publisher, which are counted."""
        known = rows if self._last_wheels is None else np.vstack([self._last_wheels, rows])
        false = zeros_between(known)[len(known) - len(rows) :]
        self._false_zeros += int(false.sum())
        # The row after a zero at the end is still to come; later ones are judged by habit.
        if self._false_zeros >= _FALSE_ZEROS and len(rows) > 1 and not rows[-1, 1:3].any():
            false[-1] |= bool(rows[-2, 1:3].any())
        if false.any():
            self.refused += int(false.sum())
            self.remarks.refuse(topics.ENCODERS.ros1, _ZEROS, number=int(false.sum()))
            self.remarks.fail(topics.ENCODERS.ros1, TWO_NODES)
        rows = rows[~false]
        if len(rows):
            self._last_wheels = rows[-1]
        return rows

    def _matched_sweeps(self) -> Sweeps | None:
        """Return the sweeps with a known head angle, oldest first, None without one."""
        pairs = self._sweeps.take()
        alike = [pair for pair in pairs if len(pair[0].ranges) == len(pairs[0][0].ranges)]
        if len(alike) < len(pairs):
            number = len(pairs) - len(alike)
            self.refused += number
            text = "another number of beams than in the sweep before"
            self.remarks.refuse(topics.SCAN.ros1, text, number=number)
        if not alike:
            return None
        first, head = alike[0]
        mounting, frame = self.extrinsics.head_pose(frame_of(first))
        return Sweeps(
            stamps=np.array([self.seconds(header_ns(scan)) for scan, _ in alike]),
            head_angles=np.array([head.angle for _, head in alike]),
            head_rate=float(head.rate),
            beam_period=float(first.time_increment),
            elevations=sweep_angles(first),
            ranges=np.stack([valid_ranges(scan) for scan, _ in alike]),
            mounting=mounting,
            frame=frame,
        )


def frame_of(message: RosMessage) -> str:
    """Return the frame of a message's header."""
    return str(message.header.frame_id)
