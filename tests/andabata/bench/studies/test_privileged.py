"""Privileged information: what is counted, and what true ground cells are."""

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.privileged import (
    Drive,
    _ground_layer,
    drive_with,
    reached_in_a_row,
    true_layer_update,
    variant_row,
)
from andabata.models import Models
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import MAX_RANGE, MIN_RANGE
from worlds.scenes import SceneCache
from worlds.traversability_map import Reason


def test_goals_are_counted_in_a_row():
    """A drive that reached two goals counts for the first and the second."""
    drives = [Drive((1.0, 0.5, 0.5), ""), Drive((1.0, 0.5), "rock"), Drive((), "rock")]
    assert reached_in_a_row(drives) == [2, 2, 1]
    row = variant_row("as it is", drives)
    assert row["goal 1"].startswith("2 [")
    assert row["goal 3"].startswith("1 [")
    assert row["SPL"] == pytest.approx(0.7)
    assert row["failures"] == "2 rock"


def test_a_variant_without_a_name_is_refused():
    """The message lists the variants."""
    with pytest.raises(ValueError, match=r"expected one of as it is, true pose.*got 'true sky'"):
        drive_with("true sky", ("maze", 0))


def test_a_controller_without_a_map_has_no_ground_layer():
    """A policy alone cannot be given true ground cells."""
    scene, config = SceneCache().get("maze", 3), SimulatedRobotConfig(plant="kinematic")
    robot = make_robot("policy", scene, config)
    with pytest.raises(TypeError, match="expected one with a planner and ground cells"):
        _ground_layer(robot)
    robot.close()


def make_robot(name, scene, config):
    models = Models()
    return SimulatedRobot(scene, config, models, make_steering(name, scene.world, config, models))


def test_the_true_map_blocks_what_it_forbids():
    """Within reach every cell is certain; it is blocked where the true map forbids its centre."""
    scene, config = SceneCache().get("maze", 3), SimulatedRobotConfig(plant="kinematic")
    robot = make_robot("policy+planner", scene, config)
    task = scene.world.tasks[0]
    robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))
    layer, odometry = _ground_layer(robot), robot.localizer.odometry
    true = robot.simulator.vehicle.state.pose
    true_layer_update(robot, layer, unseen=True)(ElevationGrid(), odometry.position[:2])
    robot.close()
    odds, certain = layer.log_odds, config.local_planner.ground.max_log_odds
    assert set(np.unique(odds)) == {-np.float32(certain), 0.0, np.float32(certain)}
    area = np.pi * (MAX_RANGE**2 - MIN_RANGE**2) / 0.2**2
    assert (odds != 0).sum() == pytest.approx(area, rel=0.01)
    # Offsets from the robot as complex numbers, which the frames' rotation multiplies.
    n = np.arange(-52, 53)
    cells = (layer.centre[0] + n)[:, None], (layer.centre[1] + n)[None, :]
    offset = sum(
        u * ((c + 0.5) * 0.2 - p)
        for u, c, p in zip((1, 1j), cells, odometry.position[:2], strict=True)
    )
    spot = offset * np.exp(1j * (true.yaw - odometry.yaw)) + complex(*true.position[:2])
    forbidden = scene.world.truth.reason_at(spot.real, spot.imag) != Reason.FREE
    found = odds[cells[0] & (len(odds) - 1), cells[1] & (len(odds) - 1)]
    known = found != 0
    assert (found[known & forbidden] > 0).all()
    assert (known & forbidden).sum() > 20
    assert (found[known] > 0).mean() < 0.5
