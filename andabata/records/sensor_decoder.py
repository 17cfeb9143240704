"""Messages on their way to senses: the same for a recording and for a live graph."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from andabata.machine.sensor_readings import SensorReadings, Sweeps, WheelSpeeds
from andabata.records import topics
from andabata.records.frames import Sense
from andabata.records.messages import (
    NS,
    header_ns,
    sweep_angles,
    wheel_speeds_of,
)
from andabata.records.mounts import Mounts, PendingTransformError
from andabata.records.point_cloud2 import decode_point_cloud2
from andabata.records.remarks import Remarks
from andabata.records.row_error import RowError
from andabata.records.sense_decoding import (
    MessageDecoder,
    accepted_types,
    as_point_cloud2,
    row_name,
    type_of,
)
from andabata.records.topics import RosMessage, Topic
from traversability.cloud import PointCloud

SENSES = (topics.ENCODERS, topics.IMU, topics.MAG)
"""Topics without which nothing is known of the robot's motion."""

SWEEPS = (topics.SCAN, topics.HEAD_ANGLE)
"""Topics of the turning laser."""

_PATIENCE = 0.5
"""A sweep waits so long for the head's angle, and an angle for its sweep [s]."""

_ROUNDS = 10
"""A cloud waits for the transforms of its frame for so many periods."""

_MOUNTED: dict[Topic, Sense] = {
    topics.IMU: "imu",
    topics.MAG: "compass",
    topics.FIX: "gnss",
}
"""Sensors whose rows depend on where they sit."""


class SensorDecoder:
    """Gathers the messages of a control period and gives them back as senses.

    Attributes:
        goal: The latest goal in the map [m], shape (2,), None before the first.
        ranges: The virtual scan that was made in the period, None without one.
        wheels: The wheel speeds that were commanded in the period, None without.
        refused: Messages that said of themselves what can't be.
        decoder: Reads the senses that come as rows.
        mounts: Where the senses sit.
    """

    def __init__(
        self,
        epoch_ns: int,
        cloud: Topic | None = None,
        decoder: MessageDecoder | None = None,
        mounts: Mounts | None = None,
    ) -> None:
        """Begin with nothing.

        Args:
            epoch_ns: Stamp from which times are counted [ns].
            cloud: A 3D laser's topic, None for the turning laser's two.
            decoder: Reads the senses that come as rows; None for one that judges units as they
                come.
            mounts: Where the senses sit; None for what the frames' names say.
        """
        self.decoder = decoder or MessageDecoder()
        self.epoch_ns = epoch_ns
        self.mounts = mounts or Mounts()
        self._cloud = cloud
        self._levelled = cloud is not None and topics.RELATIVE_CLOUD.ros1 == cloud.ros1
        self._pending: list[tuple[RosMessage, int]] = []
        self.goal: NDArray[np.float64] | None = None
        self.refused = 0
        self._scans: deque[tuple[int, RosMessage]] = deque()
        self._heads: dict[int, RosMessage] = {}
        self._clear()

    def _clear(self) -> None:
        self._rows: dict[str, list[list[float]]] = {"imu": [], "wheels": [], "field": [], "fix": []}
        self._frames: list[PointCloud] = []
        self.ranges: NDArray[np.float32] | None = None
        self.wheels: WheelSpeeds | None = None

    @property
    def epoch_ns(self) -> int:
        """Stamp from which times are counted [ns]; with another one the senses begin anew."""
        return self._epoch_ns

    @epoch_ns.setter
    def epoch_ns(self, epoch_ns: int) -> None:
        self._epoch_ns = epoch_ns
        self._delivered: dict[str, float] = {}
        self.decoder.restart()

    @property
    def wanted(self) -> tuple[Topic, ...]:
        """Topics to listen to for what is sensed, and the goal."""
        laser = SWEEPS if self._cloud is None else (self._cloud,)
        return (*SENSES, *laser, topics.FIX, topics.GOAL)

    def sense_of(self, topic: Topic) -> Sense | None:
        """Return whose place on the robot a topic's measurements depend on, None for nobody's."""
        return "laser" if topic is self._cloud else _MOUNTED.get(topic)

    @property
    def _laser(self) -> str:
        """Name of the topic that clouds come from."""
        return (self._cloud or topics.SCAN).ros1

    def seconds(self, stamp_ns: int) -> float:
        """Return a stamp as time since the epoch [s]."""
        return (stamp_ns - self.epoch_ns) / NS

    @property
    def remarks(self) -> Remarks:
        """What was taken otherwise than it says, and what was left out."""
        return self.decoder.remarks

    def add(self, topic: Topic, content: RosMessage, stamp_ns: int | None = None) -> None:
        """Take in a message; one that can't be is left out and counted.

        Args:
            topic: What it is of.
            content: The message.
            stamp_ns: When it came [ns], for types without a header.
        """
        try:
            self._add(topic, content, stamp_ns)
        except ValueError as error:
            self._refuse(topic.ros1, str(error), stamp_ns)

    def _refuse(self, sense: str, reason: str, stamp_ns: int | None = None) -> None:
        """Count a message that is left out."""
        self.refused += 1
        seconds = self.seconds(stamp_ns) if stamp_ns is not None and self.epoch_ns else None
        self.remarks.refuse(sense, reason, seconds)

    def _add(self, topic: Topic, content: RosMessage, stamp_ns: int | None) -> None:
        """Put a message where it belongs.

        Raises:
            ValueError: If it is of a type that tells nothing of that, or can't be.
        """
        kind = type_of(content)
        if kind not in accepted_types(topic):
            raise RowError(f"expected {' or '.join(accepted_types(topic))}, got {kind}")
        if topic is self._cloud:
            self._add_cloud(as_point_cloud2(content), _ROUNDS)
        elif topic is topics.SCAN:
            self.mounts.head(frame_of(content))  # Refuses a frame that is none of the robot's.
            self._scans.append((header_ns(content), content))
        elif topic is topics.HEAD_ANGLE:
            self._heads[header_ns(content)] = content
        elif topic is topics.GOAL:
            point = content.pose.position
            self.goal = np.array([point.x, point.y])
        elif topic is topics.VIRTUAL_SCAN:
            self.ranges = np.asarray(content.ranges, dtype=np.float32)
        elif topic is topics.WHEEL_COMMAND:
            self.wheels = wheel_speeds_of(content)
        elif (name := row_name(topic)) is not None:
            when = header_ns(content) if hasattr(content, "header") else stamp_ns
            if when is None:
                raise RowError(f"{kind} has no header, and nobody tells when it came")
            rows = self.decoder.rows(topic, content, self.seconds(when))
            self._rows[name] += [self._mounted(topic, content, row) for row in rows]

    def _mounted(self, topic: Topic, content: RosMessage, row: list[float]) -> list[float]:
        """Return a sense's row, a stamp and numbers, in the robot's axes."""
        sense = _MOUNTED.get(topic)
        if sense is None or not hasattr(content, "header"):
            return row
        return [row[0], *self.mounts.row(sense, frame_of(content), row[1:])]

    def _add_cloud(self, content: RosMessage, rounds: int) -> None:
        """Keep a cloud, which waits for the transforms of a frame that moves.

        Raises:
            ValueError: If it cannot be.
        """
        stamp = self.seconds(header_ns(content))
        decoded = decode_point_cloud2(content, frame_of(content) or "sensor", stamp)
        cloud = decoded.cloud
        for text in decoded.remarks:
            self.remarks.count(self._laser, text, stamp)
        if self._levelled:  # Our own, whose frame is no body's.
            self._frames.append(cloud)
            return
        try:
            self._frames.append(self.mounts.cloud(cloud, header_ns(content) / NS - stamp))
        except PendingTransformError as error:
            if not rounds:
                self.mounts.leave_out("laser", error)
                raise
            self._pending.append((content, rounds - 1))

    def _retry(self) -> None:
        """Try again the clouds that wait for transforms."""
        pending, self._pending = self._pending, []
        for content, rounds in pending:
            try:
                self._add_cloud(content, rounds)
            except ValueError as error:
                self._refuse(self._laser, str(error), header_ns(content))

    def readings(self, stamp: float) -> SensorReadings:
        """Return what was sensed in the period that ends at ``stamp`` [s], and begin the next."""
        self._retry()
        rows = {name: self._in_order(name) for name in self._rows}
        found = SensorReadings(
            stamp=stamp,
            sweeps=self._sweeps(),
            frames=tuple(self._frames),
            imu=rows["imu"],
            encoders=rows["wheels"],
            mag=rows["field"],
            gnss=rows["fix"],
            antenna=self.mounts.antenna,
        )
        self.mounts.checks.compare(found.imu, found.encoders)
        self._clear()
        return found

    def _in_order(self, name: str) -> NDArray[np.float64] | None:
        """Return the rows of a sense by their stamps, each stamp once, None without any.

        What is older than what the period before gave comes too late; a fix may.
        """
        if not self._rows[name]:
            return None
        rows = np.array(self._rows[name])
        stamps, last = rows[:, 0], self._delivered.get(name, -np.inf)
        if stamps[0] > last and (stamps[1:] > stamps[:-1]).all():
            self._delivered[name] = float(stamps[-1])
            return rows
        topic = next(t for t in (*SENSES, topics.FIX) if row_name(t) == name)
        _, first = np.unique(stamps, return_index=True)
        twice, count = len(rows) - len(first), len(rows)
        rows = rows[first]
        if topic is not topics.FIX:
            twice += int((rows[:, 0] == last).sum())
            rows = rows[rows[:, 0] > last]
            self._delivered[name] = max(last, float(rows[-1, 0])) if len(rows) else last
        late = count - twice - len(rows)
        if twice:
            self.remarks.count(topic.ros1, "a stamp that came before is dropped", number=twice)
        if late:
            self.refused += late
            self.remarks.refuse(topic.ros1, "older than what was used already", number=late)
        return rows if len(rows) else None

    def _sweeps(self) -> Sweeps | None:
        """Return the sweeps whose head angle is known, oldest first.

        A sweep whose angle is on its way waits, and those after it wait with it: a cloud is made
        of sweeps in order.
        """
        newest = max((stamp for stamp, _ in self._scans), default=0)
        found: list[tuple[RosMessage, RosMessage]] = []
        while self._scans:
            stamp, scan = self._scans[0]
            head = self._heads.pop(stamp, None)
            if head is not None:
                found.append((scan, head))
            elif newest - stamp < _PATIENCE * NS:
                break
            self._scans.popleft()
        for stamp in [s for s in self._heads if newest - s > _PATIENCE * NS]:
            del self._heads[stamp]
        alike = [pair for pair in found if len(pair[0].ranges) == len(found[0][0].ranges)]
        if len(alike) < len(found):
            self.refused += len(found) - len(alike)
            self.remarks.refuse(
                topics.SCAN.ros1,
                "another number of beams than in the sweep before",
                number=len(found) - len(alike),
            )
        if not alike:
            return None
        first, head = alike[0]
        mounting, frame = self.mounts.head(frame_of(first))
        return Sweeps(
            stamps=np.array([self.seconds(header_ns(scan)) for scan, _ in alike]),
            head_angles=np.array([head.angle for _, head in alike]),
            head_rate=float(head.rate),
            beam_period=float(first.time_increment),
            elevations=sweep_angles(first),
            ranges=np.stack([_measured(scan) for scan, _ in alike]),
            mounting=mounting,
            frame=frame,
        )


def _measured(scan: RosMessage) -> NDArray[np.float32]:
    """Return the ranges of a scan, ``inf`` outside the bounds that it names (REP-117)."""
    ranges = np.array(scan.ranges, dtype=np.float32)
    with np.errstate(invalid="ignore"):
        ranges[~((ranges >= scan.range_min) & (ranges <= scan.range_max))] = np.inf
    return ranges


def frame_of(message: RosMessage) -> str:
    """Return the frame of a message's header."""
    return str(message.header.frame_id)
