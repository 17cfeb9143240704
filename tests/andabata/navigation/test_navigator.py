"""A robot that sees nothing, or does not know where it is, stands still and goes on later."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.localization.initial_pose import initial_pose
from andabata.localization.localizer import Health
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.models import shipped_forest
from andabata.navigation.navigator import STANDSTILL
from andabata.navigation.perception import assembler_of
from andabata.navigation.reactive import StraightController
from andabata.records.messages import NS, MessageBuilder
from andabata.records.recorder import MessageQueue, Recorder
from andabata.records.topics import DIAGNOSTICS
from worlds.world import Start


@pytest.fixture
def simulated_robot(make_scene):
    config = SimulatedRobotConfig(plant="kinematic")
    scene = make_scene(size=60.0, cell=0.2)
    simulated_robot = SimulatedRobot(scene, config, shipped_forest(), StraightController())
    yield simulated_robot
    simulated_robot.close()


def drive(simulated_robot, seconds, change=lambda readings: readings):
    """Return the commands of some seconds, with senses spoilt on their way to the navigator."""
    commands = []
    for _ in range(round(seconds * 10)):
        wheels = simulated_robot.navigator.step(change(simulated_robot.readings))
        commands.append(wheels)
        simulated_robot.readings = simulated_robot.simulator.step(wheels)
    return commands


def test_it_holds_when_the_laser_falls_silent_and_goes_on_when_it_speaks(simulated_robot):
    simulated_robot.readings = simulated_robot.place(
        Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    assert drive(simulated_robot, 6.0)[-1] != STANDSTILL
    silent = drive(simulated_robot, 9.0, lambda readings: replace(readings, sweeps=None))
    moving = [wheels != STANDSTILL for wheels in silent]
    until = moving.index(False)
    # The cloud was at most a half turn old, and may be five seconds old.
    assert 1.0 <= until / 10 <= 5.2
    assert not any(moving[until:])
    again = drive(simulated_robot, 8.0)
    assert again[-1] != STANDSTILL


def test_it_holds_when_it_is_lost(simulated_robot):
    simulated_robot.readings = simulated_robot.place(
        Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    assert drive(simulated_robot, 6.0)[-1] != STANDSTILL
    deaf = drive(simulated_robot, 1.0, lambda readings: replace(readings, imu=None, encoders=None))
    assert simulated_robot.localizer.health is Health.LOST
    assert deaf[3] == STANDSTILL  # 0.2 s after the time-outs of 0.1 and 0.2 s.
    assert drive(simulated_robot, 1.0)[-1] != STANDSTILL
    assert simulated_robot.localizer.health is not Health.LOST


def test_a_command_is_never_a_lie(simulated_robot):
    simulated_robot.readings = simulated_robot.place(
        Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    spoilt = drive(
        simulated_robot, 6.0, lambda s: s if s.imu is None else replace(s, imu=s.imu * np.nan)
    )
    assert all(np.isfinite([w.left, w.right]).all() for w in spoilt)
    assert all(isinstance(w, WheelSpeeds) for w in spoilt)


class Heard:
    """A writer that keeps what it is told."""

    ros = 1

    def __init__(self):
        self.messages = []

    def write(self, topic, stamp_ns, message):
        self.messages.append((topic, stamp_ns, message))


def test_a_silent_laser_is_said_when_the_robot_holds(simulated_robot):
    heard = Heard()
    builder = MessageBuilder(1)
    queue = MessageQueue(heard, builder)
    assembler = assembler_of(simulated_robot.perception)
    recorder = Recorder(
        queue,
        simulated_robot.localizer,
        assembler,
        simulated_robot.config.grid.bearings,
        clouds=False,
    )
    simulated_robot.navigator.watch(recorder.record)
    simulated_robot.readings = simulated_robot.place(
        Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    drive(simulated_robot, 6.0)
    silent = drive(simulated_robot, 9.0, lambda readings: replace(readings, sweeps=None))
    held = 6.0 + [wheels != STANDSTILL for wheels in silent].index(False) / 10
    said = [
        (stamp - builder.epoch_ns) / NS
        for topic, stamp, message in heard.messages
        if topic is DIAGNOSTICS and "cloud: 5" in message.status[0].message
    ]
    assert said[0] == pytest.approx(held, abs=0.2)
    levels = [m.status[0].level for topic, _, m in heard.messages if topic is DIAGNOSTICS]
    assert levels[0] == 1  # No cloud yet.
    assert 0 in levels
    assert levels[-1] == 2


def test_a_robot_at_rest_tells_where_it_stands(simulated_robot):
    simulated_robot.readings = simulated_robot.place(
        Start(3.0, -2.0, 0.7), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    first, kept = simulated_robot.readings, []
    assert initial_pose(first, simulated_robot.config.sensing.geo_reference) is None
    for _ in range(25):
        readings = simulated_robot.simulator.step(STANDSTILL)
        kept.append(readings)
    rows = {
        name: np.concatenate([getattr(s, name) for s in kept if len(getattr(s, name))])
        for name in ("imu", "field", "fixes")
    }
    pose = initial_pose(SensorReadings(2.5, **rows), simulated_robot.config.sensing.geo_reference)
    truth = kept[-1].truth.pose
    assert np.hypot(*(pose.position - truth.position)[:2]) < 3.0
    assert abs(wrap(pose.yaw - truth.yaw)) < np.deg2rad(10)
    assert np.abs(pose.quaternion[:2] - truth.quaternion[:2]).max() < 0.02
