"""Numbers of the plant of ray-cast wheels: mass properties, sag and margin of stability."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.machine.wheels.body import GRAVITY, SUB_STEP, WheelsConfig, wheels_body
from andabata.machine.wheels.vehicle import WheelsVehicle

ROBOTS = ["andabata", "husky", "jackal"]


@pytest.mark.parametrize("name", ROBOTS)
def test_mass_and_inertia_are_those_of_the_urdf(name):
    """The links' masses about their common centre, wheels' spin left out."""
    robot = RobotModel.load(name)
    urdf = ElementTree.fromstring(robot.to_urdf())
    origins = {
        joint.find("child").get("link"): joint.find("origin").get("xyz")
        for joint in urdf.iter("joint")
    }
    masses, places, moments = [], [], []
    for link in urdf.iter("link"):
        inertial = link.find("inertial")
        origin = inertial.find("origin")
        shift = origins.get(link.get("name"), "0 0 0") if origin is None else origin.get("xyz")
        masses.append(float(inertial.find("mass").get("value")))
        places.append(np.add(np.array(shift.split(), dtype=float), [0, 0, robot.wheel_radius]))
        found = inertial.find("inertia")
        moments.append([float(found.get(key)) for key in ("ixx", "iyy", "izz")])
    moments = np.array(moments)
    moments[1:, 1] = 0.0
    middle = np.average(places, axis=0, weights=masses)
    arms = np.square(np.array(places) - middle)
    levers = arms.sum(axis=1, keepdims=True) - arms
    body = wheels_body(robot, WheelsConfig())
    np.testing.assert_allclose(middle, [0.0, 0.0, body.height], atol=1e-12)
    expected = (moments + np.array(masses)[:, None] * levers).sum(axis=0)
    np.testing.assert_allclose(body.inertia, expected, rtol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_rests_as_high_as_it_is_built_and_does_not_ring(make_ground, name):
    """Tyres give way by the stated sag of at most 2.5 mm, which they are larger by."""
    robot = RobotModel.load(name)
    body = wheels_body(robot, WheelsConfig())
    vehicle = WheelsVehicle(make_ground(size=6.0), robot)
    sag = body.tyres.sag
    assert 0.0 < sag < 0.0025
    np.testing.assert_allclose(vehicle.state.pose.position, 0.0, atol=1e-9)
    assert np.abs(vehicle.state.linear).max() < 1e-9
    assert 8 * body.tyres.stiffness * sag == pytest.approx(robot.mass * GRAVITY, rel=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_springs_are_stiff_and_stable(make_ground, name):
    """A push of any direction is damped, and the stiffest motion keeps its margin."""
    robot = RobotModel.load(name)
    body, vehicle = wheels_body(robot, WheelsConfig()), WheelsVehicle(make_ground(size=6.0), robot)
    assert 8 * body.tyres.stiffness / body.mass * SUB_STEP**2 < 0.5
    for c in range(3):
        vehicle._state.momentum[c] = 0.02 * body.inertia[c]
        vehicle._state.velocity[c] = 0.01
        vehicle.drive(vehicle.state.wheels, 100)
        assert np.abs(vehicle.state.angular).max() < 1e-3
        assert np.abs(vehicle.state.linear).max() < 1e-3
