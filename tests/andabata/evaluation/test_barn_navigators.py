"""Navigators of the benchmark by name: each drives, and policies keep to their training."""

import numpy as np
import pytest

from andabata.evaluation.barn_navigators import BARN_NAVIGATORS, ROOM_POLICIES, barn_navigator
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from andabata.tasks.rooms.policy_navigator import RoomPolicyNavigator
from worlds.rooms.barn import barn_world

VEHICLE = PLANAR_VEHICLES["barn"]


def made(name):
    return barn_navigator(name, VEHICLE, BARN_LIDAR, np.random.default_rng(0))


@pytest.mark.parametrize("name", list(ROOM_POLICIES))
def test_policies_of_rooms_drive_towards_the_goal(name):
    """After six seconds each is metres nearer to the goal, or has arrived or touched something."""
    world = barn_world(1000)
    (task,) = world.room.tasks
    robot = SimulatedPlanarRobot(world.room, task, VEHICLE, BARN_LIDAR, np.random.default_rng(0))
    result = drive_to_goal(made(name), robot, task, DriveRules(time_limit=6.0))
    assert result.goal_distance < 9.0


def test_names_are_those_of_both_kinds():
    """The flat-ground navigators come from their catalogue, the policies from here."""
    assert set(BARN_NAVIGATORS) == set(PLANAR_NAVIGATORS) | set(ROOM_POLICIES)
    assert isinstance(made("arcs"), type(PLANAR_NAVIGATORS["arcs"](VEHICLE, None)))
    assert isinstance(made("spn"), RoomPolicyNavigator)


def test_an_unknown_name_is_refused():
    """A name of neither kind is a key error of the catalogue."""
    with pytest.raises(KeyError):
        made("fly")
