"""Sources of the readings of a topic: two receivers, IMUs or drivers of wheels that publish on one.

The rule is that of ``andabata.records.sources``. Readings are compared in the robot's axes, so that
two IMUs that are mounted differently agree where /tf says how. A recording is refused where two
contradict each other, as the user can choose one; a robot that drives goes on with the first.
"""

from collections.abc import Sequence

import numpy as np

from andabata.records import topics
from andabata.records.decoding.source_choice import ReadingSource
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.remarks import Remarks
from andabata.records.sources import SourceDifference, Sources
from andabata.records.topics import Topic

_NEAR = {topics.IMU: 0.15, topics.MAG: 0.15, topics.ENCODERS: 0.15, topics.FIX: 1.5}
"""Longest time between two readings that are compared [s]."""

_ENOUGH = {topics.IMU: 20, topics.MAG: 20, topics.ENCODERS: 20, topics.FIX: 3}
"""Number of comparisons by which two sources are judged."""

_MAX_RATE = 0.2
"""Largest difference of two angular velocities that agree [rad/s]."""

_MAX_ANGLE = np.deg2rad(15.0)
"""Largest angle between two directions that agree [rad]."""

_MAX_DISTANCE = 5.0
"""Largest distance of two fixes that agree [m]."""

_MAX_WHEEL_SPEED = 1.0
"""Largest difference of two wheel speeds that agree [rad/s]."""

_METRES_PER_DEGREE = 111_195.0
"""Length of a degree of latitude [m]."""


class SourceError(ValueError):
    """Two sources of one topic that contradict each other, of which the user has to choose one."""


class ReadingSources:
    """Judges the sources of every topic; those that contradict the first one are refused."""

    def __init__(self, remarks: Remarks) -> None:
        """Create a judge without readings.

        Args:
            remarks: Destination of remarks.
        """
        self._remarks = remarks
        self._last: dict[Topic, dict[ReadingSource, Sequence[float]]] = {}
        self._sources: dict[tuple[Topic, ReadingSource], Sources] = {}
        self._refused: dict[tuple[Topic, ReadingSource], str] = {}

    def add(self, topic: Topic, source: ReadingSource, row: Sequence[float]) -> None:
        """Add a reading of a source.

        Args:
            topic: Topic of the reading.
            source: Source of the message.
            row: Stamp [s] and numbers in SI units and in the robot's axes.

        Raises:
            UnusableMessageError: If the source contradicts the first one of the topic.
        """
        if topic not in _NEAR:
            return
        last = self._last.setdefault(topic, {})
        first = next(iter(last), source)
        before = last.get(first)
        last[source] = row
        if source == first or before is None:
            return
        key = topic, source
        if key not in self._sources:
            self._sources[key] = Sources(_ENOUGH[topic])
            text = f"readings come from two sources, {first} and {source}"
            self._remarks.note(topic.ros1, text)
        near = abs(row[0] - before[0]) < _NEAR[topic]
        self._sources[key].add(str(source), _difference(topic, before, row) if near else None)
        self._judge(topic, first, source)

    def _judge(self, topic: Topic, first: ReadingSource, source: ReadingSource) -> None:
        """Refuse a source that contradicts the first one.

        Raises:
            UnusableMessageError: If it does.
        """
        key = topic, source
        text = self._sources[key].contradiction
        if key not in self._refused and text is not None:
            self._refused[key] = (
                f"expected one source, got {first} and {source}, which differ by {text}: "
                f"--source {topic.ros1}={first.name_beside(source)} or "
                f"--source {topic.ros1}={source.name_beside(first)} chooses one"
            )
            self._remarks.fail(topic.ros1, f"{self._refused[key]}; until then {first} is used")
        if key in self._refused:
            raise UnusableMessageError(f"of a second source, {source}, that contradicts {first}")

    def is_shared(self, topic: Topic) -> bool:
        """Return whether a topic has readings of two sources."""
        return len(self._last.get(topic, ())) > 1

    def verify(self) -> None:
        """Check that no source contradicts the first one of its topic.

        Raises:
            SourceError: If one does; the message names both and the option to give.
        """
        for (topic, _), text in self._refused.items():
            raise SourceError(f"{topic.ros1}: {text}")


def _difference(
    topic: Topic, one: Sequence[float], other: Sequence[float]
) -> SourceDifference | None:
    """Return the difference of two readings of a topic; None for wheels of which one stands still.

    Zeros between the speeds of a robot that drives are left out by ``wheel_zeros``.
    """
    if topic is topics.ENCODERS:
        return (
            _speed_difference(one[1:3], other[1:3]) if any(one[1:3]) and any(other[1:3]) else None
        )
    if topic is topics.FIX:
        return _distance(one, other)
    if topic is topics.MAG:
        return _angle(one[1:4], other[1:4])
    rate = float(np.linalg.norm(np.subtract(one[1:4], other[1:4])))
    turn = SourceDifference(rate / _MAX_RATE, f"{rate:.2f} rad/s")
    return max(turn, _angle(one[4:7], other[4:7]), key=lambda each: each.share)


def _speed_difference(one: Sequence[float], other: Sequence[float]) -> SourceDifference:
    """Return the larger difference of two sides' wheel speeds."""
    size = float(np.abs(np.subtract(one, other)).max())
    return SourceDifference(size / _MAX_WHEEL_SPEED, f"{size:.2f} rad/s")


def _angle(one: Sequence[float], other: Sequence[float]) -> SourceDifference:
    """Return the angle between two vectors; one without a direction agrees with any."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    if not size > 0:
        return SourceDifference(0.0, "0 degrees")
    angle = float(np.arccos(np.clip(np.dot(one, other) / size, -1, 1)))
    return SourceDifference(angle / _MAX_ANGLE, f"{np.rad2deg(angle):.0f} degrees")


def _distance(one: Sequence[float], other: Sequence[float]) -> SourceDifference:
    """Return the distance of two fixes; one without a place agrees with any."""
    if not np.isfinite([*one[1:3], *other[1:3]]).all() or np.inf in (one[4], other[4]):
        return SourceDifference(0.0, "0 m")
    north = (other[1] - one[1]) * _METRES_PER_DEGREE
    east = (other[2] - one[2]) * _METRES_PER_DEGREE * np.cos(np.deg2rad(one[1]))
    metres = float(np.hypot(north, east))
    return SourceDifference(metres / _MAX_DISTANCE, f"{metres:.1f} m")
