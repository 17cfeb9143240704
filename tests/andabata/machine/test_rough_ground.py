"""Rough ground is free ground: each plant drives over the roughest that worlds have."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig, Simulator
from terrain.heightfield import Heightfield
from worlds.fields import plain_world
from worlds.rays.scene import RayScene
from worlds.rough_ground import RoughnessConfig, rough_ground
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start

ROBOT = RobotModel()


def rough_world(seed):
    """Return 20 m of level ground with the highest clods, gravel and ruts."""
    smooth = Heightfield(np.zeros((81, 81), dtype=np.float32), 0.25)
    surface = np.zeros((80, 80), dtype=np.uint8)
    config = RoughnessConfig(clods=0.025, gravel=0.01, ruts=6)
    ground, surface = rough_ground(smooth, surface, config, 0.5, np.random.default_rng(seed))
    truth = build_truth(ground, (), TruthConfig(), surface, smooth)
    return replace(plain_world("rough", ground), truth=truth, base=smooth)


@pytest.mark.parametrize("plant", ["bullet", "wheels", "kinematic"])
@pytest.mark.parametrize("seed", [0, 1])
def test_what_wheels_roll_over_stops_no_plant(plant, seed):
    """In 24 s at 0.3 m/s the robot gets 5 m far, upright, and the true map calls its way free."""
    world = rough_world(seed)
    rng = np.random.default_rng(seed)
    simulator = Simulator(world, RayScene(world), ROBOT, plant, SensingConfig(), rng)
    simulator.reset(Start(-6.0, 0.0, 0.0))
    wheels = SkidSteer(ROBOT).wheel_speeds(0.3, 0.0)
    for _ in range(240):
        state = simulator.step(wheels, skip_scan=True).truth
        assert not state.tipped
        assert not world.truth.forbidden_at(*state.pose.position[:2])
    assert np.hypot(*(state.pose.position[:2] - [-6.0, 0.0])) > 5.0
    simulator.close()
