"""A robot that sees nothing, or does not know where it is, stands still and goes on later."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import Rig, RigConfig
from andabata.localization.initial_pose import initial_pose
from andabata.localization.localizer import Health
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import Senses, WheelSpeeds
from andabata.models import shipped_forest
from andabata.navigation.navigator import STANDSTILL
from andabata.navigation.perception import assembler_of
from andabata.navigation.reactive import StraightController
from andabata.records.messages import NS, Composer
from andabata.records.recorder import Outbox, Recorder
from andabata.records.topics import DIAGNOSTICS
from worlds.world import Start


@pytest.fixture
def rig(make_scene):
    config = RigConfig(plant="kinematic")
    scene = make_scene(size=60.0, cell=0.2)
    rig = Rig(scene, config, shipped_forest(), StraightController())
    yield rig
    rig.close()


def drive(rig, seconds, change=lambda senses: senses):
    """Return the commands of some seconds, with senses spoilt on their way to the navigator."""
    commands = []
    for _ in range(round(seconds * 10)):
        wheels = rig.navigator.step(change(rig.senses))
        commands.append(wheels)
        rig.senses = rig.simulator.step(wheels)
    return commands


def test_it_holds_when_the_laser_falls_silent_and_goes_on_when_it_speaks(rig):
    rig.senses = rig.place(Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0))
    assert drive(rig, 6.0)[-1] != STANDSTILL
    silent = drive(rig, 9.0, lambda senses: replace(senses, sweeps=None))
    moving = [wheels != STANDSTILL for wheels in silent]
    until = moving.index(False)
    # The cloud was at most a half turn old, and may be five seconds old.
    assert 1.0 <= until / 10 <= 5.2
    assert not any(moving[until:])
    again = drive(rig, 8.0)
    assert again[-1] != STANDSTILL


def test_it_holds_when_it_is_lost(rig):
    rig.senses = rig.place(Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0))
    assert drive(rig, 6.0)[-1] != STANDSTILL
    deaf = drive(rig, 1.0, lambda senses: replace(senses, imu=None, encoders=None))
    assert rig.localizer.health is Health.LOST
    assert deaf[3] == STANDSTILL  # 0.2 s after the time-outs of 0.1 and 0.2 s.
    assert drive(rig, 1.0)[-1] != STANDSTILL
    assert rig.localizer.health is not Health.LOST


def test_a_command_is_never_a_lie(rig):
    rig.senses = rig.place(Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0))
    spoilt = drive(rig, 6.0, lambda s: s if s.imu is None else replace(s, imu=s.imu * np.nan))
    assert all(np.isfinite([w.left, w.right]).all() for w in spoilt)
    assert all(isinstance(w, WheelSpeeds) for w in spoilt)


class Heard:
    """A writer that keeps what it is told."""

    ros = 1

    def __init__(self):
        self.messages = []

    def write(self, topic, stamp_ns, message):
        self.messages.append((topic, stamp_ns, message))


def test_a_silent_laser_is_said_when_the_robot_holds(rig):
    heard = Heard()
    compose = Composer(1)
    outbox = Outbox(heard, compose)
    assembler = assembler_of(rig.perception)
    recorder = Recorder(outbox, rig.localizer, assembler, rig.config.grid.bearings, clouds=False)
    rig.navigator.watch(recorder.take)
    rig.senses = rig.place(Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0))
    drive(rig, 6.0)
    silent = drive(rig, 9.0, lambda senses: replace(senses, sweeps=None))
    held = 6.0 + [wheels != STANDSTILL for wheels in silent].index(False) / 10
    said = [
        (stamp - compose.epoch_ns) / NS
        for topic, stamp, message in heard.messages
        if topic is DIAGNOSTICS and "cloud: 5" in message.status[0].message
    ]
    assert said[0] == pytest.approx(held, abs=0.2)
    levels = [m.status[0].level for topic, _, m in heard.messages if topic is DIAGNOSTICS]
    assert levels[0] == 1  # No cloud yet.
    assert 0 in levels
    assert levels[-1] == 2


def test_a_robot_at_rest_tells_where_it_stands(rig):
    rig.senses = rig.place(Start(3.0, -2.0, 0.7), np.array([25.0, 0.0]), np.random.default_rng(0))
    first, kept = rig.senses, []
    assert initial_pose(first, rig.config.sensing.site) is None
    for _ in range(25):
        senses = rig.simulator.step(STANDSTILL)
        kept.append(senses)
    rows = {
        name: np.concatenate([getattr(s, name) for s in kept if len(getattr(s, name))])
        for name in ("imu", "field", "fixes")
    }
    pose = initial_pose(Senses(2.5, **rows), rig.config.sensing.site)
    truth = kept[-1].truth.pose
    assert np.hypot(*(pose.position - truth.position)[:2]) < 3.0
    assert abs(wrap(pose.yaw - truth.yaw)) < np.deg2rad(10)
    assert np.abs(pose.quaternion[:2] - truth.quaternion[:2]).max() < 0.02
