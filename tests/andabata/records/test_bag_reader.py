"""Control periods of a recording end with its commands, or ten times a second."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.bag_reader import read_periods
from andabata.records.bags import Message
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.units import UnitFactors
from andabata.records.messages import NS, MessageBuilder

COMPOSE = MessageBuilder(1)
EPOCH = COMPOSE.epoch_ns


class ListBag:
    """A recording of some messages."""

    def __init__(self, messages):
        """Keep messages in the order of their stamps."""
        self._messages = sorted(messages, key=lambda message: message.stamp_ns)

    def messages(self, names):
        """Yield the messages of topics."""
        return (m for m in self._messages if m.topic in names)


def goal(seconds, x):
    """Return a goal on the x axis."""
    content = COMPOSE.goal(seconds, np.array([x, 0.0]))
    return Message("/goal", topics.GOAL.kind, COMPOSE.stamp_ns(seconds), content)


def command(seconds):
    """Return a command."""
    return Message("/cmd_vel", topics.TWIST.kind, COMPOSE.stamp_ns(seconds), None)


def ends(*messages):
    """Return the times [s] at which the periods of a recording end."""
    periods = read_periods(ListBag(messages), SensorDecoder(EPOCH), {})
    return [round(period.readings.stamp, 5) for period in periods]


def test_without_commands_the_clock_ends_periods():
    """Ten periods a second, the start itself first."""
    assert ends(goal(0.35, 1.0)) == [0.0, 0.1, 0.2, 0.3, 0.4]


def test_commands_end_periods():
    """Commands a little off the clock, and none of a joystick in a burst."""
    found = ends(*map(command, (0.0, 0.11, 0.1599, 0.16, 0.2)), goal(0.2, 1.0))
    assert found == [0.0, 0.11, 0.16, 0.26]


def test_the_clock_ends_periods_in_a_pause_of_commands():
    """A pause of over half a second is filled, up to the next command."""
    found = ends(command(0.0), command(0.83), goal(0.83, 1.0))
    assert found == [*(k / 10 for k in range(8)), 0.83]
    assert ends(command(0.0), command(0.5), goal(0.5, 1.0)) == [0.0, 0.5]
    assert ends(command(0.45), goal(0.45, 1.0)) == [0.0, 0.1, 0.2, 0.3, 0.45]


def test_a_message_at_the_end_of_a_period_belongs_to_it():
    """One just after belongs to the next, and one before the start to none."""
    messages = [goal(-0.01, 9.0), goal(0.1, 1.0), goal(0.1 + 1e-6, 2.0)]
    first = next(read_periods(ListBag([goal(0.0, 3.0)]), SensorDecoder(EPOCH), {}))
    assert first.goal[0] == 3.0
    periods = read_periods(ListBag(messages), SensorDecoder(EPOCH), {})
    goals = [None if period.goal is None else period.goal[0] for period in periods]
    assert goals == [None, 1.0, 2.0]


def test_other_names_are_read_by_their_remapping():
    """A remapped topic replaces ours."""
    messages = [goal(0.05, 1.0)]
    periods = list(read_periods(ListBag(messages), SensorDecoder(EPOCH), {"/goal": "/target"}))
    assert [period.goal for period in periods] == [None]
    assert periods[0].readings.stamp == pytest.approx(0.0)
    assert NS == 10**9


def imu(seconds):
    """Return an inertial message of a robot at rest."""
    content = COMPOSE.imu(np.array([seconds, 0.0, 0.0, 0.0, 0.0, 0.0, 9.81]))
    return Message("/imu", topics.IMU.kind, COMPOSE.stamp_ns(seconds), content)


def update(seconds):
    """Return an update within a control period."""
    return Message("/update", topics.UPDATE.kind, COMPOSE.stamp_ns(seconds), None)


def test_updates_divide_the_readings_of_a_period_where_they_are_asked_for():
    """A reading of an update's time is before it; without readings an update is empty."""
    messages = [command(0.0), *map(imu, (0.02, 0.05, 0.07)), update(0.05), command(0.1)]
    messages += [update(0.15), imu(0.19), command(0.2)]

    def divided(with_updates):
        decoder = SensorDecoder(EPOCH, decoder=MessageDecoder(units=UnitFactors()))
        periods = read_periods(ListBag(messages), decoder, {}, with_updates)
        parts = [[*period.earlier, period.readings] for period in periods]
        return [
            [(round(r.stamp, 3), 0 if r.imu is None else len(r.imu)) for r in period]
            for period in parts
        ]

    assert divided(True) == [[(0.0, 0)], [(0.05, 2), (0.1, 1)], [(0.15, 0), (0.2, 1)]]
    assert divided(False) == [[(0.0, 0)], [(0.1, 3)], [(0.2, 1)]]
