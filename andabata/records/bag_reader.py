"""Sensor readings of a recording, control period by control period."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.records import topics
from andabata.records.bags import Bag
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.messages import NS
from andabata.records.topic_selection import Remapping, topic_names
from andabata.records.topics import RosMessage

CONTROL_HZ = 10
"""Control periods per second where no recorded command ends them."""

_PERIOD = NS // CONTROL_HZ
"""Length of such a control period [ns]."""

_SHORTEST_PERIOD = NS // 20
"""Time after a command in which another one, as of a joystick, ends no period [ns]."""

_LONGEST_PERIOD = NS // 2
"""Time without a command after which the clock ends periods [ns]."""


@dataclass(frozen=True)
class Period:
    """A recorded control period.

    Attributes:
        readings: Sensor readings of the period.
        goal: Goal at its end [m], shape (2,), None before the first.
        ranges: Recorded virtual scan [m], shape (n_sectors,), None without one.
        wheels: Recorded commands of wheel speeds, None without.
        speed: Recorded command of the forward speed that ends the period [m/s], None without.
        earlier: Readings that were taken in before, within the period.
    """

    readings: SensorReadings
    goal: NDArray[np.float64] | None
    ranges: NDArray[np.float32] | None
    wheels: WheelSpeeds | None
    speed: float | None = None
    earlier: tuple[SensorReadings, ...] = ()


class _End(NamedTuple):
    """End of a control period [ns], and the forward speed [m/s] that is commanded then, or None."""

    stamp_ns: int
    speed: float | None = None


def read_periods(
    bag: Bag, sensor_decoder: SensorDecoder, remapping: Remapping, with_updates: bool = False
) -> Iterator[Period]:
    """Yield the control periods of a recording, by the recorder's stamps of its messages.

    Periods end with the recorded commands, and ten times a second where there are none. The period
    of the start itself comes first, without readings.

    Args:
        bag: Recording to read.
        sensor_decoder: Decoder without messages, counting from the drive's start.
        remapping: Names that the recording uses.
        with_updates: True to divide the readings of a period as a live navigator took them in, if
            the recording holds that.

    Raises:
        SourceError: If two sources of one topic contradict each other.
    """
    wanted = (*sensor_decoder.wanted, topics.VIRTUAL_SCAN, topics.WHEEL_COMMAND)
    names = topic_names((*wanted, topics.UPDATE) if with_updates else wanted, remapping)
    ends = _period_ends(bag, sensor_decoder.epoch_ns, remapping)
    end, parts = next(ends), _Parts(sensor_decoder)
    for message in bag.messages(tuple(names)):
        while message.stamp_ns > end.stamp_ns:
            parts.finish(end.stamp_ns)
            yield _period(sensor_decoder, end, parts.take())
            end = next(ends)
        parts.finish(message.stamp_ns)
        topic = names[message.topic]
        if topic is topics.UPDATE:
            parts.end_ns = message.stamp_ns
        elif message.stamp_ns >= sensor_decoder.epoch_ns:
            sensor_decoder.add(topic, message.content, message.stamp_ns, message.publisher)
    parts.finish(end.stamp_ns)
    yield _period(sensor_decoder, end, parts.take())


class _Parts:
    """Readings of parts of a control period, but for the last one.

    Attributes:
        end_ns: Stamp of the update that ends the present part [ns]; None without one.
    """

    def __init__(self, sensor_decoder: SensorDecoder) -> None:
        self._decoder, self._readings = sensor_decoder, list[SensorReadings]()
        self.end_ns: int | None = None

    def finish(self, stamp_ns: int) -> None:
        """Finish the present part if it ends before a stamp [ns]."""
        if self.end_ns is not None and self.end_ns < stamp_ns:
            seconds = self._decoder.seconds(self.end_ns)
            self._readings.append(self._decoder.readings(seconds))
            self.end_ns = None

    def take(self) -> tuple[SensorReadings, ...]:
        """Return the finished parts of the period, and begin the next."""
        readings, self._readings, self.end_ns = tuple(self._readings), [], None
        return readings


def _period_ends(bag: Bag, epoch_ns: int, remapping: Remapping) -> Iterator[_End]:
    """Yield the ends of the control periods, endlessly."""
    names, end = tuple(topic_names((topics.TWIST,), remapping)), None
    commands = [
        _End(m.stamp_ns, _forward_speed(m.content))
        for m in bag.messages(names)
        if m.stamp_ns >= epoch_ns
    ]
    for command in commands:
        if end is not None and command.stamp_ns - end < _SHORTEST_PERIOD:
            continue
        start = epoch_ns - _PERIOD if end is None else end
        if command.stamp_ns - start > _LONGEST_PERIOD:
            last = command.stamp_ns - _SHORTEST_PERIOD
            yield from map(_End, range(start + _PERIOD, last, _PERIOD))
        end = command.stamp_ns
        yield command
    yield from map(_End, itertools.count(epoch_ns if end is None else end + _PERIOD, _PERIOD))


def _forward_speed(command: RosMessage) -> float | None:
    """Return the forward speed of a ``Twist`` or ``TwistStamped`` [m/s], None of other types."""
    linear = getattr(getattr(command, "twist", command), "linear", None)
    return None if linear is None else float(linear.x)


def _period(
    sensor_decoder: SensorDecoder, end: _End, earlier: tuple[SensorReadings, ...]
) -> Period:
    """Return the period that ends now.

    Raises:
        SourceError: If two sources of one topic contradict each other.
    """
    sensor_decoder.verify_sources()
    goal, ranges, wheels = sensor_decoder.goal, sensor_decoder.ranges, sensor_decoder.wheels
    readings = sensor_decoder.readings(sensor_decoder.seconds(end.stamp_ns))
    return Period(readings, goal, ranges, wheels, end.speed, earlier)
