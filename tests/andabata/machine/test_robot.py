"""Robot models: each stands, drives and turns; parameters are checked."""

import json
from xml.etree import ElementTree

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import make_vehicle
from andabata.training.plans import load_plan
from tests.support.plants import BULLET
from worlds.world import Start

NAMES = ("andabata", "husky", "jackal")


@pytest.mark.parametrize("plant", [BULLET, "wheels"])
@pytest.mark.parametrize("name", NAMES)
def test_a_robot_stands_drives_and_turns(make_ground, name, plant):
    """Each robot of the package rests level, drives and turns as commanded."""
    robot = RobotModel.load(name)
    vehicle = make_vehicle(plant, make_ground(), robot, np.random.default_rng(0))
    ratios = []
    for heading in (0.0, 0.4, 0.8, 1.2):
        vehicle.place(Start(0.0, 0.0, heading))
        still = vehicle.drive(WheelSpeeds(0.0, 0.0), 100)
        assert np.abs(still[-1, 2]) < 0.02
        wheels = SkidSteer(robot).wheel_speeds(0.3, 0.4)
        vehicle.drive(wheels, 100)
        before = vehicle.state.pose.yaw
        rows = vehicle.drive(wheels, 200)
        ratios.append(wrap(vehicle.state.pose.yaw - before) / 2.0 / 0.4)
        driven = np.hypot(*np.diff(rows[:, :2], axis=0).T).sum()
        assert driven == pytest.approx(0.597, rel=0.1)
        assert not vehicle.state.tipped
    vehicle.close()
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.12)


def test_a_run_learns_with_another_body():
    """A training plan takes another robot."""
    assert {
        plan.environment.simulated_robot.robot.name
        for plan in load_plan(robot="jackal").stages.values()
    } == {"jackal"}


def test_another_body_drives_from_the_command_line(capsys, tmp_path):
    """The command line drives another robot and lists the known ones."""
    words = ["drive", "--world", "maze", "--robot", "husky", "--controller", "straight"]
    words += ["--time-limit", "6", "--out", str(tmp_path), "--set", "plant=kinematic", "--json"]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["attempts"]
    assert main([*words[:3], "--robot", "walker"]) != 0
    assert "husky" in capsys.readouterr().err


def test_a_body_that_cannot_be_is_refused():
    """A negative mass is an error."""
    with pytest.raises(ValueError, match="mass"):
        RobotModel(mass=-1.0)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"dead_zone": 0.5}, "dead_zone: expected less than max_steering"),
        ({"wheel_mass": 11.0}, "wheel_mass: expected four wheels lighter than the robot"),
    ],
)
def test_parameters_that_contradict_each_other_are_refused(fields, message):
    """A dead zone or wheels that do not fit the other parameters are an error."""
    with pytest.raises(ValueError, match=message):
        RobotModel(**fields)


def test_derived_sizes_are_known():
    """The effective track is the slip factor's multiple; two circles cover the rectangle."""
    robot = RobotModel()
    assert robot.effective_track == pytest.approx(1.275 * 0.46)
    assert robot.half_radius == pytest.approx(np.hypot(0.67 / 4, 0.27))


def test_the_urdf_has_the_robots_mass_and_wheels():
    """Masses of all links sum up to the robot's, and wheels stand at track and wheelbase."""
    robot = RobotModel()
    root = ElementTree.fromstring(robot.to_urdf(spheres=True))
    masses = [float(mass.get("value")) for mass in root.iter("mass")]
    assert sum(masses) == pytest.approx(robot.mass)
    joints = {
        joint.get("name"): joint.find("origin").get("xyz")
        for joint in root.iter("joint")
        if joint.get("type") == "continuous"
    }
    place = [float(part) for part in joints["front_left_joint"].split()]
    assert place == pytest.approx([robot.wheelbase / 2, robot.track / 2, 0.0])
    spheres = [sphere.get("radius") for sphere in root.iter("sphere")]
    assert spheres == [str(robot.wheel_radius)] * 4
    assert "<sphere" not in robot.to_urdf()
