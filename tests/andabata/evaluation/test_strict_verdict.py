"""Strict verdict: the outline's time on forbidden ground, and the body's distance from solids."""

import numpy as np
import pytest

from andabata.evaluation.strict_verdict import StrictMeasures, StrictVerdict, outline_of
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from terrain.classes import SemanticClass
from terrain.objects import box

ROBOT = RobotModel()


def state(x, y=0.0, yaw=0.0):
    """Return a true state on level ground."""
    pose = Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw)
    return VehicleState(0.0, pose, np.zeros(3), np.zeros(3), WheelSpeeds(0.0, 0.0))


def measured(world, *states, time=0.1):
    """Return the strict measures of states in a row."""
    verdict = StrictVerdict(world, ROBOT)
    for each in states:
        verdict.update(each, time)
    return verdict.measures


@pytest.mark.parametrize(
    ("measures", "failure"),
    [
        (StrictMeasures(0.5, None), ""),
        (StrictMeasures(0.5, 0.05), ""),
        (StrictMeasures(0.6, 0.3), "forbidden ground"),
        (StrictMeasures(0.0, 0.049), "solid"),
        (StrictMeasures(3.0, -0.1), "forbidden ground and solid"),
    ],
)
def test_limits_are_half_a_second_and_five_centimetres(measures, failure):
    """What is at a limit has not failed."""
    assert measures.failure == failure


@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, -np.pi / 2, np.pi])
def test_the_distance_is_that_of_the_body_from_what_stands(make_ground, yaw):
    """Half the length ahead, half the width aside, as the robot is turned."""
    wall = box(SemanticClass.WALL, (2.0, 0.0, 1.0), (1.0, 6.0, 2.0))
    half = ROBOT.length / 2 if abs(np.cos(yaw)) > 0.5 else ROBOT.width / 2
    found = measured(make_ground(objects=[wall]), state(1.0, 0.3, yaw))
    assert found.solid_distance == pytest.approx(0.5 - half, abs=1e-6)
    nearest = measured(make_ground(objects=[wall]), state(1.1, 0.0, yaw), state(0.9, 0.0, yaw))
    assert nearest.solid_distance == pytest.approx(0.4 - half, abs=1e-6)


def test_what_is_far_has_no_distance(make_ground):
    """Half a metre from the body is as far as it is looked for."""
    wall = box(SemanticClass.WALL, (2.0, 0.0, 1.0), (1.0, 6.0, 2.0))
    world = make_ground(objects=[wall])
    assert measured(world, state(1.5 - 0.335 - 0.51)).solid_distance is None
    assert measured(world, state(1.5 - 0.335 - 0.49)).solid_distance == pytest.approx(0.49)


@pytest.mark.parametrize(
    ("semantic", "height", "is_solid"),
    [
        (SemanticClass.ROCK, 0.3, True),
        (SemanticClass.ROCK, 0.07, True),  # Low: it passes under the body, and counts.
        (SemanticClass.ROCK, 0.04, False),  # A wheel climbs it.
        (SemanticClass.STONE, 0.3, False),  # Part of the path.
        (SemanticClass.BUSH, 0.3, False),  # Forbidden ground, and no solid.
    ],
)
def test_solids_are_what_a_robot_cannot_drive_over(make_ground, semantic, height, is_solid):
    """Rocks from 5 cm on; neither plants nor what is traversable."""
    thing = box(semantic, (0.6, 0.0, height / 2), (0.4, 0.4, height))
    found = measured(make_ground(objects=[thing]), state(0.0))
    assert (found.solid_distance is not None) == is_solid


@pytest.mark.parametrize(("height", "distance"), [(0.01, None), (-0.01, 0.165)])
def test_what_is_above_the_robot_does_not_count(make_ground, height, distance):
    """A beam that begins above the robot's height is no solid beside it, one below that is."""
    beam = box(SemanticClass.WALL, (1.0, 0.0, ROBOT.height + height + 0.2), (1.0, 1.0, 0.4))
    found = measured(make_ground(objects=[beam]), state(0.0))
    assert found.solid_distance == (None if distance is None else pytest.approx(distance, abs=1e-6))


def test_the_outline_counts_and_not_the_middle(make_ground):
    """One wheel in a bush is forbidden ground; the time is that of the states."""
    bush = box(SemanticClass.BUSH, (1.0, 0.6, 0.5), (0.8, 0.8, 1.0))
    world = make_ground(objects=[bush])
    assert not world.truth.forbidden_at(1.0, 0.0)
    found = measured(world, state(-1.0), state(1.0), state(1.1), time=0.2)
    assert found.forbidden_time == pytest.approx(0.4)
    assert measured(world, state(1.0, -0.2)).forbidden_time == 0.0


def test_the_strip_along_the_border_is_not_forbidden_here(make_ground):
    """Nothing tells a robot where it begins."""
    world = make_ground()
    assert world.truth.forbidden_at(9.5, 0.0)
    assert measured(world, state(9.5)).forbidden_time == 0.0


def test_the_outline_is_seen_at_every_cell(make_ground):
    """Points of the rectangle are at most a cell apart, corners among them."""
    points = outline_of(make_ground(), ROBOT).points
    x, y = ROBOT.length / 2, ROBOT.width / 2
    np.testing.assert_allclose(np.maximum(abs(points[:, 0]) / x, abs(points[:, 1]) / y), 1.0)
    for corner in ((x, y), (x, -y), (-x, y), (-x, -y)):
        assert (np.hypot(*(points - corner).T) < 1e-9).any()
    gaps = [np.sort(np.hypot(*(points - each).T))[1:3].max() for each in points]
    assert max(gaps) <= 0.1
