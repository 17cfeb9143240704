"""Tyres of ray-cast wheels: springs, the friction ellipse, and stones under a wheel."""

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.machine.solid_contact import build_solids
from andabata.machine.vectors import axes_of
from andabata.machine.wheels.body import WheelsConfig, wheels_body
from andabata.machine.wheels.contact import MOMENT, Motion
from andabata.machine.wheels.tyres import press_tyres, strike_tyres
from terrain.classes import SemanticClass
from terrain.objects import box

ROBOT, CONFIG = RobotModel(), WheelsConfig()
BODY = wheels_body(ROBOT, CONFIG)
LEVEL = axes_of(np.array([0.0, 0.0, 0.0, 1.0]))
ZERO = (0.0, 0.0, 0.0)
FLAT = np.zeros((41, 41), dtype=np.float32), 0.1
DEPTH = BODY.tyres.sag


def loads_of(velocity=ZERO, speeds=0.0, grips=None, depth=DEPTH):
    """Return the loads of level ground on a body whose tyres are pressed in by some depth."""
    loads, grips = np.zeros(10), np.zeros((8, 2)) if grips is None else grips
    motion = Motion((0.0, 0.0, BODY.height + DEPTH - depth), LEVEL, velocity, ZERO)
    press_tyres(motion, BODY, np.full(4, speeds), grips, FLAT, loads)
    return loads


def test_springs_carry_a_body_at_rest():
    """The force is stiffness times depth of eight rims, without torque; none above the ground."""
    loads = loads_of()
    assert loads[2] == pytest.approx(8 * BODY.tyres.stiffness * DEPTH)
    np.testing.assert_allclose(np.delete(loads, 2), 0.0, atol=1e-9)
    np.testing.assert_array_equal(loads_of(depth=-0.001), 0.0)


def test_dampers_resist_and_never_pull():
    """Sinking adds to the force; wheels that leave the ground fast are not held."""
    rest = loads_of()[2]
    sinking = loads_of((0.0, 0.0, -0.1))[2]
    assert sinking == pytest.approx(rest + 8 * BODY.tyres.damping * 0.1)
    assert loads_of((0.0, 0.0, 5.0))[2] == 0.0


@pytest.mark.parametrize("heading", np.deg2rad([0, 30, 60, 90, 135]).tolist())
def test_a_sliding_tyre_is_on_the_ellipse_where_it_dissipates_most(heading):
    """Along and across the wheel the force is that of the ellipse's gradient along the slip."""
    slip = 2.0 * np.cos(heading), 2.0 * np.sin(heading), 0.0
    loads = loads_of(slip)
    axes = CONFIG.friction * np.array([1.0, CONFIG.lateral_friction_ratio])
    forces = loads[:2] / loads[2]
    assert np.hypot(*(forces / axes)) == pytest.approx(1.0)
    angles = np.linspace(0, 2 * np.pi, 3601)
    ellipse = axes * np.column_stack([np.cos(angles), np.sin(angles)])
    assert forces @ slip[:2] == pytest.approx((ellipse @ slip[:2]).min(), rel=1e-4)


def test_spinning_wheels_drive_the_body_and_brake_themselves():
    """The force is friction times load, and each wheel's moment is its force times the radius."""
    loads = loads_of(speeds=20.0)
    assert loads[0] == pytest.approx(CONFIG.friction * loads[2])
    np.testing.assert_allclose(loads[MOMENT:], -loads[0] * ROBOT.wheel_radius / 4)


def test_a_patch_keeps_its_force_at_rest_and_loses_it_rolling():
    """A wheel at rest holds; fresh rubber comes in over the relaxation length."""
    held = np.full((8, 2), 1e-4)
    before = held.copy()
    loads_of(grips=held)
    np.testing.assert_array_equal(held, before)
    speed = 3.0
    velocity = (speed * ROBOT.wheel_radius, 0.0, 0.0)
    loads_of(velocity, speed, held)
    way = velocity[0] * 0.005
    np.testing.assert_allclose(held, before / (1 + way / CONFIG.relaxation), rtol=1e-6)


@pytest.mark.parametrize(("height", "too_high"), [(0.04, False), (0.08, True)])
def test_a_stone_before_the_wheels_pushes_them_back(make_ground, height, too_high):
    """A stone that is met higher than the wheel climbs is struck, a lower one only pushes."""
    stone = box(SemanticClass.ROCK, (0.4, 0.0, 0.0), (0.25, 1.0, 2 * height))
    world = make_ground(objects=[stone], size=4.0)
    loads = np.zeros(10)
    motion = Motion((0.0, 0.0, BODY.height), LEVEL, ZERO, ZERO)
    ground = world.ground.heights, world.ground.cell
    arguments = np.zeros(4), np.zeros((8, 2)), ground, build_solids(world), np.array([0]), loads
    assert strike_tyres(motion, BODY, *arguments) is too_high
    assert loads[0] < 0.0 < loads[2]
