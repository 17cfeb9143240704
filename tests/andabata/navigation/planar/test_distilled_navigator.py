"""Driving by a distilled policy: the shipped file, other files, the shield."""

from importlib.resources import files

import numpy as np
import pytest

import andabata.models
from andabata.machine.kinematics import Twist
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.models import shipped_policy
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS, SHIPPED, planar_navigator
from andabata.navigation.planar.distilled_navigator import DistilledNavigator, DistilledObserver
from andabata.navigation.planar.distilled_observation import ACTIONS, OBSERVATIONS
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from andabata.tasks.terminations import Outcome
from rl.policies.deterministic import DeterministicPolicy
from rl.policy import PolicyFileError, load_policy
from worlds.rooms.barn import barn_world

VEHICLE = PLANAR_VEHICLES["barn"]
FASTEST = DeterministicPolicy(
    {
        "layer0.weight": np.zeros((2, OBSERVATIONS.size), dtype=np.float32),
        "layer0.bias": np.array([9.0, 0.0], dtype=np.float32),
    },
    OBSERVATIONS,
    ACTIONS,
)
"""Policy that drives straight ahead at full speed."""


def drive(navigator, seed):
    """Return how a drive in a generated field ends."""
    world = barn_world(seed)
    (task,) = world.room.tasks
    rng = np.random.default_rng(0)
    robot = SimulatedPlanarRobot(world.room, task, VEHICLE, BARN_LIDAR, rng)
    return drive_to_goal(navigator, robot, task, DriveRules(time_limit=15.0))


def test_the_shipped_policy_drives():
    """Its file is below 1 MB, and it reaches the goal of a field, the same way each time."""
    assert len(files(andabata.models).joinpath(f"{SHIPPED}.safetensors").read_bytes()) < 1_000_000
    navigator = PLANAR_NAVIGATORS["distilled"](VEHICLE, np.random.default_rng(0))
    one, other = (drive(navigator, 300_000) for _ in range(2))
    assert one.outcome == Outcome.GOAL
    np.testing.assert_array_equal(one.path, other.path)


def test_the_shield_keeps_a_blind_policy_from_contact():
    """What drives into the first post alone stands before it behind the shield."""
    assert drive(DistilledNavigator(VEHICLE, FASTEST), 300_000).outcome == Outcome.COLLISION
    behind = drive(DistilledNavigator(VEHICLE, FASTEST, has_shield=True), 300_000)
    assert behind.outcome == Outcome.TIMEOUT


def test_policies_come_from_files(tmp_path):
    """Written, read and driven: the same command; other policies and other files are refused."""
    file = tmp_path / "policy.safetensors"
    file.write_bytes(FASTEST.to_bytes())
    assert load_policy(file).tensors().keys() == FASTEST.tensors().keys()
    rng = np.random.default_rng(0)
    navigator = planar_navigator("distilled", VEHICLE, rng, file)
    navigator.reset(BARN_LIDAR, (10.0, 0.0))
    ranges = np.full(BARN_LIDAR.count, np.inf, dtype=np.float32)
    readings = PlanarReadings(0.0, PlanarPose(0, 0, 0), Twist(0, 0), ranges)
    assert navigator.act(readings).linear == pytest.approx(2.0, abs=1e-3)
    file.write_bytes(shipped_policy("spn").to_bytes())
    with pytest.raises(ValueError, match=r"policy\.safetensors: expected .* got .* policy distill"):
        planar_navigator("distilled", VEHICLE, rng, file)
    file.write_bytes(b"no policy")
    with pytest.raises(PolicyFileError, match=r"policy\.safetensors: expected a policy"):
        planar_navigator("distilled+shield", VEHICLE, rng, file)


def test_the_observer_identifies_the_robot():
    """It is told which commands were given; without motion it keeps the prior."""
    observer = DistilledObserver(VEHICLE.period)
    observer.reset(BARN_LIDAR, (10.0, 0.0))
    prior = observer.dynamics
    world = barn_world(300_000)
    (task,) = world.room.tasks
    slow = PLANAR_VEHICLES["barn-slow"]
    robot = SimulatedPlanarRobot(world.room, task, slow, BARN_LIDAR, np.random.default_rng(0))
    for k in range(30):
        observer.observe(robot.read())
        command = Twist(1.5 if k < 15 else 0.0, 0.3)
        observer.took(command)
        robot.step(command)
    found = observer.dynamics
    assert abs(found.acceleration - 1.5) < abs(prior.acceleration - 1.5) / 2
    assert found.delay == pytest.approx(0.15, abs=0.06)
