"""Rough ground in each plant: what is free ground is crossed, what is not stops the robot."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig, Simulator
from andabata.machine.vehicle import make_vehicle
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box, rod
from terrain.plants import root
from tests.support.plants import ALL_PLANTS, BULLET, MUJOCO
from worlds.drag import BODY_HEIGHT, RESISTANCE
from worlds.fields import plain_world
from worlds.kerbs import Strip, kerbstones, raised
from worlds.rays.scene import RayScene
from worlds.rough_ground import RoughnessConfig, refined, rough_ground
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start

ROBOT = RobotModel()


def rough_world(seed):
    """Return 20 m of level ground with the highest clods, gravel and ruts."""
    smooth = Heightfield(np.zeros((81, 81), dtype=np.float32), 0.25)
    surface = np.zeros((80, 80), dtype=np.uint8)
    config = RoughnessConfig(clods=0.025, gravel=0.01, ruts=6)
    fine, surface = refined(smooth, surface, config.cells)
    ground = rough_ground(fine, surface, config, 0.5, np.random.default_rng(seed))
    truth = build_truth(ground, (), TruthConfig(), surface, smooth)
    return replace(plain_world("rough", ground), truth=truth, base=smooth)


@pytest.mark.parametrize("plant", ALL_PLANTS)
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


def kerb_world(height):
    """Return level ground with a strip along y whose near edge is at x = 1.5."""
    smooth = Heightfield(np.zeros((65, 65), dtype=np.float32), 0.25)
    fine = smooth.refined(3)
    line = np.array([[2.8, y] for y in np.arange(-6.0, 6.1, 1.5)])
    strips = [Strip(line, 1.3, height)]
    heights = fine.heights + raised(fine, strips, [])
    ground = Heightfield(heights.astype(np.float32), fine.cell)
    return plain_world("kerb", ground, tuple(kerbstones(smooth, strips, [], fine.cell)))


def flat_world(*objects):
    """Return level ground with objects."""
    ground = Heightfield(np.zeros((161, 161), dtype=np.float32), 0.1)
    return plain_world("flat", ground, objects)


def root_world(height):
    """Return level ground with a root across the way at x = 1.5."""
    course = np.array([[1.5, -1.5], [1.5, 0.0], [1.5, 1.5]])
    return flat_world(*root(flat_world().ground, course, height))


def stem_world(radius):
    """Return level ground with a stem that leans by 3 degrees at x = 1.5."""
    foot, tip = (1.5, 0.1, -0.1), (1.55, 0.1, 1.5)
    return flat_world(rod(SemanticClass.TRUNK, foot, tip, radius))


def driven(world, plant, start):
    """Return where a robot is after 10 s at 0.3 m/s, and where it first touched something."""
    vehicle = make_vehicle(plant, world, ROBOT, np.random.default_rng(0))
    vehicle.place(start)
    wheels, touched = SkidSteer(ROBOT).wheel_speeds(0.3, 0.0), None
    for _ in range(100):
        vehicle.drive(wheels, 10)
        if touched is None and vehicle.state.collided:
            touched = vehicle.state.pose.position[0]
    end = vehicle.state.pose.position[0]
    vehicle.close()
    return end, touched


PLANTS = pytest.mark.parametrize("plant", ALL_PLANTS)


@PLANTS
@pytest.mark.parametrize("make", [kerb_world, root_world])
def test_three_centimetres_are_climbed(plant, make):
    """A kerb and a root of 3 cm are free, and no plant stops there, up or down."""
    world = make(0.03)
    assert not world.truth.forbidden_at(np.linspace(0.5, 2.9, 49), 0.0).any()
    end, touched = driven(world, plant, Start(0.0, 0.0, 0.0))
    assert end > 2.8
    assert touched is None
    end, touched = driven(world, plant, Start(2.8, 0.0, np.pi))
    assert end < 0.0
    assert touched is None


@PLANTS
@pytest.mark.parametrize(
    ("make", "size"),
    [
        *((kerb_world, 0.06), (kerb_world, 0.1), (root_world, 0.065)),
        *((stem_world, 0.01), (stem_world, 0.1)),
    ],
)
def test_what_a_wheel_may_not_touch_is_struck_where_it_is(plant, make, size):
    """Kerbs of 6 and 10 cm, a root of 6.5 cm and stems: all plants touch them within 20 cm."""
    world = make(size)
    assert world.truth.forbidden_at(1.5, 0.1)
    end, touched = driven(world, plant, Start(0.0, 0.0, 0.0))
    assert touched == pytest.approx(1.5 - ROBOT.wheelbase / 2 - ROBOT.wheel_radius, abs=0.25)
    # Wheels of mujoco that spin have no grip aside: it turns around a thin stem, and stays there.
    if size == 0.1 or (make is stem_world and plant != "mujoco"):
        assert end < 1.35


def bush_world(slope_deg=0.0):
    """Return ground that rises to the east, all in a bush that is higher than the robot."""
    x = np.linspace(-8.0, 8.0, 161)
    heights = np.tile(np.tan(np.deg2rad(slope_deg)) * x[:, None], (1, 161)).astype(np.float32)
    bush = box(SemanticClass.BUSH, (0.0, 0.0, 0.0), (14.0, 14.0, 20.0))
    return plain_world("bush", Heightfield(heights, 0.1), (bush,))


DRAG = RESISTANCE[SemanticClass.BUSH] * BODY_HEIGHT * ROBOT.width
"""Force of the bush on the robot [N]."""


@pytest.mark.parametrize("plant", [BULLET, MUJOCO, "wheels"])
def test_plants_cost_their_force_times_the_way(plant):
    """On level ground the motors hold their speed, and do the work of the drag."""
    vehicle = make_vehicle(plant, bush_world(), ROBOT, np.random.default_rng(0))
    for way in (1.0, -1.0):
        vehicle.place(Start(0.0, 0.0, 0.5))
        wheels = SkidSteer(ROBOT).wheel_speeds(0.3 * way, 0.0)
        vehicle.drive(wheels, 100)
        before = vehicle.state
        vehicle.drive(wheels, 400)
        after = vehicle.state
        moved = np.hypot(*(after.pose.position - before.pose.position)[:2])
        assert moved == pytest.approx(1.2, rel=0.02)
        assert after.work - before.work == pytest.approx(DRAG * moved, rel=0.05)
        assert not after.collided
    vehicle.close()


@PLANTS
@pytest.mark.parametrize(("slope_deg", "passes"), [(18.0, True), (29.0, False)])
def test_plants_and_slope_together_stop_a_robot_that_either_alone_does_not(
    plant, slope_deg, passes
):
    """Of the grip on 29 degrees too little is left for a bush; downhill there is enough."""
    start = Start(-2.0, 0.0, 0.0)
    end, _ = driven(bush_world(slope_deg), plant, start)
    assert end - start.x > 2.2 if passes else end - start.x < 0.9
    end, _ = driven(bush_world(slope_deg), plant, Start(2.0, 0.0, np.pi))
    assert end < -0.4
    bare = replace(bush_world(slope_deg), objects=())
    assert driven(bare, plant, start)[0] - start.x > 2.2
