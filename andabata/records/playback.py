"""Senses from a recording: what the robot's navigator is given, period by period."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.lidar import LidarConfig
from andabata.machine.pose import Pose
from andabata.machine.senses import Senses, Sweeps, WheelSpeeds
from andabata.records import topics
from andabata.records.bags import Bag, BagError, Message
from andabata.records.messages import NS, header_ns, pose_of, wheel_speeds_of
from andabata.records.recorder import SETUP
from andabata.records.topics import TOPICS, Topic

_NEEDED = (topics.SCAN, topics.HEAD, topics.ENCODERS, topics.IMU, topics.COMPASS)
_READ = (*_NEEDED, topics.FIX, topics.GOAL, topics.VIRTUAL, topics.WHEELS)


@dataclass(frozen=True)
class Setup:
    """How a recorded drive began.

    Attributes:
        start: Where the robot believed to be.
        epoch_ns: Stamp of that [ns]; times are counted from there.
        settings: The drive's settings, empty in a recording that is not ours.
    """

    start: Pose
    epoch_ns: int
    settings: dict[str, Any]


@dataclass(frozen=True)
class Period:
    """A recorded control period.

    Attributes:
        senses: What was sensed in it.
        goal: The goal at its end, None before the first [m], shape (2,).
        ranges: The virtual scan that was made then, None without one.
        wheels: The wheel speeds that were commanded then, None without.
    """

    senses: Senses
    goal: NDArray[np.float64] | None
    ranges: NDArray[np.float32] | None
    wheels: WheelSpeeds | None


def check_topics(bag: Bag) -> None:
    """Refuse a recording without the robot's senses.

    Raises:
        BagError: If some are missing; the message names them and what was found.
    """
    there = bag.topics
    missing = [t.ros1 for t in _NEEDED if not {t.ros1, t.ros2} & set(there)]
    if missing:
        found = ", ".join(f"{name} ({kind})" for name, (kind, _) in sorted(there.items())) or "none"
        raise BagError(
            f"{bag.path}: expected the topics {', '.join(missing)}, got {found}; a single cloud "
            "can be judged with `andabata scan --topic`"
        )


def read_setup(bag: Bag) -> Setup:
    """Return how a recorded drive began.

    Raises:
        BagError: If the recording tells no start.
    """
    names = _names((topics.FILTERED, topics.DIAGNOSTICS))
    start: Pose | None = None
    epoch, settings = 0, None
    for message in bag.messages(tuple(names)):
        topic = names[message.topic]
        if topic is topics.FILTERED and start is None:
            start, epoch = pose_of(message.content.pose.pose), header_ns(message.content)
        if topic is topics.DIAGNOSTICS and settings is None:
            values = {v.key: v.value for s in message.content.status for v in s.values}
            settings = json.loads(values.get(SETUP, "{}"))
        if start is not None and settings is not None:
            break
    if start is None:
        raise BagError(
            f"{bag.path}: expected {topics.FILTERED.ros1} to tell where the drive began, got no "
            "message of it"
        )
    return Setup(start, epoch, settings or {})


def read_periods(bag: Bag, setup: Setup, lidar: LidarConfig) -> Iterator[Period]:
    """Yield the control periods of a recording, by the time at which its messages came in.

    Periods end with the recorded commands. The period of the start itself comes first, without
    anything sensed.

    Args:
        bag: The recording.
        setup: How it began.
        lidar: Angles and timing of its beams.
    """
    names = _names(_READ)
    ends = [m.stamp_ns for m in bag.messages(tuple(_names((topics.TWIST,))))]
    if not ends:
        raise BagError(f"{bag.path}: expected {topics.TWIST.ros1} to tell the steps, got none")
    gathered = _Gathered(setup, lidar)
    periods = iter(ends)
    end = next(periods)
    for message in bag.messages(tuple(names)):
        while message.stamp_ns > end:
            yield gathered.period(end)
            following = next(periods, None)
            if following is None:
                return
            end = following
        gathered.add(names[message.topic], message)
    yield gathered.period(end)


class _Gathered:
    """The messages of a period on their way to senses."""

    def __init__(self, setup: Setup, lidar: LidarConfig) -> None:
        self._epoch, self._lidar = setup.epoch_ns, lidar
        self._goal: NDArray[np.float64] | None = None
        self._number = 0
        self._clear()

    def _clear(self) -> None:
        self._scans: list[Any] = []
        self._heads: dict[int, Any] = {}
        self._rows: dict[str, list[list[float]]] = {"imu": [], "wheels": [], "field": [], "fix": []}
        self._ranges: NDArray[np.float32] | None = None
        self._wheels: WheelSpeeds | None = None

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - self._epoch) / NS

    def add(self, topic: Topic, message: Message) -> None:
        """Take in a message."""
        content = message.content
        if topic is topics.SCAN:
            self._scans.append(content)
        elif topic is topics.HEAD:
            self._heads[header_ns(content)] = content
        elif topic is topics.GOAL:
            point = content.pose.position
            self._goal = np.array([point.x, point.y])
        elif topic is topics.VIRTUAL:
            self._ranges = np.asarray(content.ranges, dtype=np.float32)
        elif topic is topics.WHEELS:
            self._wheels = wheel_speeds_of(content)
        elif topic in _ROWS:
            name, row = _ROWS[topic]
            self._rows[name].append([self._seconds(header_ns(content)), *row(content)])

    def period(self, end_ns: int) -> Period:
        """Return the period that ends now, and begin the next."""
        rows = {name: np.array(found) if found else None for name, found in self._rows.items()}
        senses = Senses(
            stamp=self._seconds(end_ns),
            sweeps=self._sweeps(),
            imu=rows["imu"],
            encoders=rows["wheels"],
            field=rows["field"],
            fixes=rows["fix"],
        )
        found = Period(senses, self._goal, self._ranges, self._wheels)
        self._clear()
        return found

    def _sweeps(self) -> Sweeps | None:
        """Return the sweeps whose head angle is known, oldest first."""
        known = [scan for scan in self._scans if header_ns(scan) in self._heads]
        known.sort(key=header_ns)
        if not known:
            return None
        heads = [self._heads[header_ns(scan)] for scan in known]
        first, self._number = self._number, self._number + len(known)
        return Sweeps(
            stamps=np.array([self._seconds(header_ns(scan)) for scan in known]),
            head_angles=np.array([head.angle for head in heads]),
            head_rate=float(heads[0].rate),
            beam_period=self._lidar.beam_period,
            elevations=self._lidar.elevations(first, self._number),
            ranges=np.stack([np.asarray(scan.ranges, dtype=np.float32) for scan in known]),
        )


def _vector(v: Any) -> list[float]:  # noqa: ANN401
    return [float(v.x), float(v.y), float(v.z)]


_ROWS: dict[Topic, tuple[str, Any]] = {
    topics.IMU: (
        "imu",
        lambda m: _vector(m.angular_velocity) + _vector(m.linear_acceleration),
    ),
    topics.ENCODERS: ("wheels", lambda m: [float(m.left), float(m.right)]),
    topics.COMPASS: ("field", lambda m: _vector(m.magnetic_field)),
    topics.FIX: (
        "fix",
        lambda m: [m.latitude, m.longitude, m.altitude, float(m.position_covariance[0])],
    ),
}


def _names(chosen: tuple[Topic, ...]) -> dict[str, Topic]:
    """Return topics by both of their names."""
    wanted = [topic for topic in TOPICS if topic in chosen]
    return {topic.name(ros): topic for topic in wanted for ros in (1, 2)}
