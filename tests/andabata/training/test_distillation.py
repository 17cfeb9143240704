"""Distillation: labels of the expert, the same again, going on, other folders, the fit."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.distilled_observation import ACTIONS, OBSERVATIONS, check_distilled
from andabata.navigation.planar.mpc_navigator import MpcNavigator
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from andabata.training.distillation import DistillationConfig, distill_mpc, fit
from andabata.training.expert_labels import (
    LabelledDrive,
    LabelledDriveConfig,
    Labels,
    Mixture,
    drive_and_label,
)
from rl.policies.deterministic import DeterministicPolicy
from worlds.rooms.barn import barn_world

SHORT = LabelledDriveConfig(time_limit=0.5)
TINY = DistillationConfig(
    driving=SHORT, drives=(2, 1), expert_shares=(1.0, 0.0), hidden=(8,), epochs=1, last_epochs=1
)
BACKWARDS = DeterministicPolicy(
    {
        "layer0.weight": np.zeros((2, OBSERVATIONS.size), dtype=np.float32),
        "layer0.bias": np.array([-9.0, 0.0], dtype=np.float32),
    },
    OBSERVATIONS,
    ACTIONS,
)


def test_labels_are_the_experts_commands():
    """A drive of the expert alone is labelled with what the robot was given."""
    labels, reached = drive_and_label(SHORT, 0, None, LabelledDrive(0, 1.0))
    assert not reached
    assert labels.observations.shape == (len(labels.shares), OBSERVATIONS.size)
    given = ACTIONS.scaled(labels.shares)[:-1]
    seen = labels.observations[1:]
    for name, axis in (("previous_speeds", 0), ("previous_yaw_rates", 1)):
        newest = seen[:, OBSERVATIONS.slice_of(name).start]
        np.testing.assert_allclose(newest, given[:, axis], atol=1e-5)


def test_the_policy_drives_and_the_expert_labels():
    """The robot goes back as the policy has it; the labels go ahead, and the expert knows."""
    world, vehicle = barn_world(300_000), PLANAR_VEHICLES["barn"]
    (task,) = world.room.tasks
    rng = np.random.default_rng(0)
    robot = SimulatedPlanarRobot(world.room, task, vehicle, BARN_LIDAR, rng)
    expert = MpcNavigator(vehicle, np.random.default_rng(1))
    took = []
    expert.took = lambda command: took.append(command)
    driver = Mixture(expert, BACKWARDS, 0.0, 20.0, np.random.default_rng(2))
    result = drive_to_goal(driver, robot, task, DriveRules(time_limit=0.5))
    assert result.goal_distance > 10.0
    assert np.mean([command.linear for command in driver.commands]) > 0.5
    assert took[-1].linear == pytest.approx(-0.5, abs=1e-3)


def test_the_expert_takes_note_of_other_commands():
    """What it plans with, and identifies from, is what the robot was given."""
    expert = MpcNavigator(PLANAR_VEHICLES["barn"], np.random.default_rng(0))
    world = barn_world(300_000)
    (task,) = world.room.tasks
    rng = np.random.default_rng(0)
    robot = SimulatedPlanarRobot(world.room, task, PLANAR_VEHICLES["barn"], BARN_LIDAR, rng)
    expert.reset(BARN_LIDAR, (10.0, 0.0))
    seen = []
    expert.identification.update = lambda command, measured: seen.append(command)
    for _ in range(3):
        expert.act(robot.read())
        expert.took(Twist(0.25, -0.5))
        robot.step(Twist(0.25, -0.5))
    assert seen == [Twist(0.25, -0.5)] * 2


def test_a_distillation_is_the_same_again_and_goes_on(tmp_path):
    """Same seed, same weights; a round that is missing is made again; other settings are not."""
    calls = []
    policy, rounds = distill_mpc(TINY, 3, tmp_path / "a", on_drive=lambda *each: calls.append(each))
    assert calls == [(0, 1), (0, 1), (1, 1)]
    assert [one.round for one in rounds] == [0, 1]
    assert check_distilled(policy, "policy").info["seed"] == 3
    again, _ = distill_mpc(TINY, 3, tmp_path / "b")
    (tmp_path / "a" / "round-1.safetensors").unlink()
    (tmp_path / "a" / "round-1.npz").unlink()
    calls.clear()
    resumed, _ = distill_mpc(TINY, 3, tmp_path / "a", on_drive=lambda *each: calls.append(each))
    assert calls == [(0, 2), (1, 1)]
    for name, weights in policy.tensors().items():
        np.testing.assert_array_equal(weights, again.tensors()[name])
        np.testing.assert_array_equal(weights, resumed.tensors()[name])
    with pytest.raises(ValueError, match="expected rounds with these settings"):
        distill_mpc(TINY, 4, tmp_path / "a")


def test_a_fit_finds_what_was_labelled():
    """A law that left and right share: speed by the nearest ahead, a turn towards the goal."""
    rng = np.random.default_rng(0)
    low, high = OBSERVATIONS.bounds()
    seen = rng.uniform(low, high, (600, OBSERVATIONS.size)).astype(np.float32)
    turn = seen[:, OBSERVATIONS.slice_of("goal_direction").stop - 1]
    shares = np.stack([np.full(600, 0.4), 0.8 * turn], axis=1).astype(np.float32)
    config = DistillationConfig(hidden=(32,), batch_size=32, learning_rate=3e-3)
    policy = fit(Labels(seen, shares), config, 40, 0, {})
    errors = np.abs(policy.best_many(seen) - shares)
    assert errors.mean() < 0.08
    assert policy.info["loss"] < 0.02


@pytest.mark.parametrize(
    "change", [{"expert_shares": (1.0,)}, {"expert_shares": (0.5, 0.5)}, {"drives": (2, 0)}]
)
def test_rounds_without_a_driver_are_refused(change):
    """As many shares as rounds, the expert alone in the first, a drive at least."""
    with pytest.raises(ValueError, match="expected"):
        DistillationConfig.model_validate(TINY.model_dump() | change)
