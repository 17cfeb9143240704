"""Terrain-following plant: slip, creep and limits are as configured."""

import numpy as np
import pytest

from andabata.machine.clock import TICK
from andabata.machine.kinematic_vehicle import (
    KinematicConfig,
    KinematicVehicle,
    contact_map,
    plant_parameters,
)
from andabata.machine.pose import wrap
from terrain.classes import SemanticClass
from terrain.objects import box
from tests.support.driven_plants import ROBOT, twist
from worlds.world import Start

ORIGIN = Start(0.0, 0.0, 0.0)
EXACT = KinematicConfig(slip_sigma=0.0)


def exact(make_ground, height=lambda x, y: 0.0 * x, **options):
    """Return a plant without slip on a ground of some height function."""
    world = make_ground(height, **options)
    return KinematicVehicle(world, ROBOT, np.random.default_rng(0), EXACT)


def test_the_twist_follows_its_command_with_the_time_constant(make_ground):
    """After one time constant the speed is 1 - 1/e of the commanded one."""
    vehicle = exact(make_ground)
    twist(vehicle, 0.3, 0.5, EXACT.time_constant)
    share = 1 - np.exp(-1)
    assert vehicle.state.linear[0] == pytest.approx(0.3 * share)
    assert vehicle.state.angular[2] == pytest.approx(0.5 * share)


def test_a_constant_twist_is_an_arc(make_ground):
    """At constant speed and yaw rate the body moves on a circle of radius v / w."""
    vehicle = exact(make_ground)
    twist(vehicle, 0.3, 0.5, 2.0)
    before = vehicle.state.pose
    twist(vehicle, 0.3, 0.5, 1.0)
    after = vehicle.state.pose
    c, s = np.cos(before.yaw), np.sin(before.yaw)
    moved = np.array([[c, s], [-s, c]]) @ (after.position - before.position)[:2]
    expected = 0.6 * np.array([np.sin(0.5), 1 - np.cos(0.5)])
    np.testing.assert_allclose(moved, expected, atol=1e-5)
    assert wrap(after.yaw - before.yaw) == pytest.approx(0.5, abs=1e-6)


def test_slip_has_the_configured_spread_and_correlation(make_ground):
    """The relative error of the speed is a Gauss-Markov process of the configured numbers."""
    config = KinematicConfig(slip_sigma=0.1, slip_time=0.5)
    parameters = plant_parameters(ROBOT, config)
    decay, sigma = parameters.limits[0], parameters.slip
    assert decay == pytest.approx(np.exp(-TICK / 0.5))
    assert sigma / np.sqrt(1 - decay**2) == pytest.approx(0.1)
    world = make_ground(size=40.0)
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0), config)
    vehicle.place(Start(-15.0, 0.0, 0.0))
    rows = twist(vehicle, 0.3, 0.0, 60.0)
    speeds = np.hypot(*np.diff(rows[100:, :2], axis=0).T) / TICK / 0.3
    assert 0.05 < speeds.std() < 0.15


def test_a_turning_body_creeps_down_a_cross_slope(make_ground):
    """The lateral speed is downhill, by creep and by the pivot uphill of the middle."""
    slope = np.deg2rad(10.0)
    vehicle = exact(make_ground, lambda x, y: np.tan(slope) * y)
    twist(vehicle, 0.0, 0.4, 0.01)
    for rate in (0.4, -0.4):
        vehicle.place(ORIGIN)
        twist(vehicle, 0.0, rate, 0.5)
        state = vehicle.state
        yaw_rate, roll = state.angular[2], slope
        creep = -abs(yaw_rate) * ROBOT.creep * np.tanh(np.sin(roll) / ROBOT.creep_slope)
        assert state.linear[1] < 0
        assert state.linear[1] == pytest.approx(creep, rel=0.35)
    assert not exact(make_ground).state.linear[1]


def test_a_slope_beyond_the_climb_stops_it_uphill_and_not_downhill(make_ground):
    """Wheels spin on a slope that is too steep; downhill the body drives."""
    vehicle = exact(make_ground, lambda x, y: np.tan(np.deg2rad(37.0)) * x)
    up = twist(vehicle, 0.3, 0.0, 1.0)[-1, 0]
    vehicle.place(ORIGIN)
    down = twist(vehicle, -0.3, 0.0, 1.0)[-1, 0]
    assert up == pytest.approx(0.0, abs=1e-3)
    assert down < -0.15


def test_a_body_beyond_the_largest_tilt_has_tipped_and_stops(make_ground):
    """Beyond the tilt limit the body is tipped over and moves no more."""
    vehicle = exact(make_ground, lambda x, y: np.tan(np.deg2rad(42.0)) * y)
    assert vehicle.state.tipped
    rows = twist(vehicle, 0.3, 0.0, 1.0)
    np.testing.assert_allclose(rows[-1, :2], 0.0, atol=1e-9)


def test_the_contact_map_knows_solid_low_near_and_clear_cells(make_ground):
    """Cells of a rock are solid or low, those around it near, far ones clear."""
    wall = box(SemanticClass.WALL, (3.0, 0.0, 1.0), (0.4, 4.0, 2.0))
    rock = box(SemanticClass.ROCK, (-3.0, 0.0, 0.0), (0.4, 0.4, 0.15))
    truth = make_ground(objects=[wall, rock]).truth
    states = contact_map(truth, plant_parameters(ROBOT, EXACT).outline)

    def at(x, y):
        return states[int((x - truth.x_min) / truth.cell), int((y - truth.y_min) / truth.cell)]

    assert (at(3.0, 0.0), at(-3.0, 0.0), at(2.5, 0.0), at(0.0, 0.0)) == (2, 3, 1, 0)
    assert states[0, 0] == 1


@pytest.mark.parametrize(("y", "is_met"), [(0.0, False), (ROBOT.track / 2, True)])
def test_a_low_object_passes_under_the_body_and_stops_a_wheel(make_ground, y, is_met):
    """A rock before the middle is driven over, forwards and backwards; one in a track is met."""
    rock = box(SemanticClass.ROCK, (0.0, y, 0.0), (0.1, 0.1, 0.15))
    vehicle = exact(make_ground, objects=[rock])
    for speed in (0.3, -0.3):
        vehicle.place(Start(-4.0 * speed, 0.0, 0.0))
        twist(vehicle, speed, 0.0, 8.0)
        assert vehicle.state.collided == is_met
        has_passed = vehicle.state.pose.position[0] / speed > 3.0
        assert has_passed != is_met


def test_the_border_of_the_map_stops_the_body(make_ground):
    """Leaving the map counts as a collision; the body stays inside."""
    vehicle = exact(make_ground, size=4.0)
    twist(vehicle, 0.3, 0.0, 9.0)
    assert vehicle.state.collided
    assert vehicle.state.pose.position[0] + ROBOT.length / 2 < 2.1
