"""A robot that sees nothing, or does not know where it is, stands still and goes on later."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.machine.senses import WheelSpeeds
from andabata.models import shipped_forest
from andabata.navigation.navigator import STANDSTILL
from andabata.navigation.reactive import StraightController
from andabata.tasks.rig import Rig, RigConfig
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
