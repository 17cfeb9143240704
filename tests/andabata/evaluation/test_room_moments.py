"""Moments of drives in rooms: the same drive again, with beams, support points and rewards."""

import numpy as np
import pytest

from andabata.evaluation.barn import BarnEvaluationConfig, drive_barn_run, load_world
from andabata.evaluation.room_drives import drive_tasks
from andabata.evaluation.room_moments import beam_ends, watch_barn, watch_cell
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig, cell_task, tasks_of
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.models import shipped_policy
from worlds.rooms.catalogue import make_room

CONFIG = RoomEvaluationConfig(rooms=("spn-env1",), lidars=("ten-beams",), pairs=3)
CELL = Cell("shipped", "ten-beams", "spn-env1", "reactive")


@pytest.fixture(scope="module")
def policy():
    """Return the shipped policy on points."""
    return shipped_policy("spn")


@pytest.fixture(scope="module")
def watched(policy):
    """Return the second drive of the cell with its moments."""
    return watch_cell(CONFIG, policy, CELL, 1)


def test_a_drive_alone_is_the_drive_among_others(policy, watched):
    """Same outcome and path as in the evaluation, but for the last digits."""
    tasks = tasks_of(make_room("spn-env1"), CONFIG)
    drive = drive_tasks(policy, cell_task(CELL, CONFIG, policy), tasks)[1]
    path = np.array([moment.pose for moment in watched.moments])
    assert watched.outcome == str(drive.outcome)
    assert path == pytest.approx(drive.path, abs=1e-3)


def test_beams_that_met_something_end_there(watched):
    """On the edge of an obstacle, within a millimetre; others in the open."""
    for moment in watched.moments[::20]:
        gaps = watched.room.clearance(moment.ends)
        assert np.abs(gaps[moment.hits]).max(initial=0.0) < 1e-3
        assert len(moment.ends) == 10


def test_support_points_are_ends_of_beams(watched):
    """Each is one of the moment's own; the last moment, after which nothing is done, has none."""
    for moment in watched.moments[:-1:20]:
        gaps = np.linalg.norm(moment.support.places[:, None] - moment.ends, axis=2).min(axis=1)
        assert gaps.max() < 1e-3
        assert moment.support.counts.sum() > 0
    assert watched.moments[-1].support is None


def test_rewards_are_those_of_each_step(watched):
    """The start has none, the goal its bonus."""
    assert watched.moments[0].rewards == {}
    assert watched.outcome == "goal"
    assert sum(watched.moments[-1].rewards.values()) > 4
    assert sum(watched.moments[1].rewards.values()) < 1


def test_a_drive_that_there_is_not_is_refused(policy):
    """The error says how many there are."""
    with pytest.raises(ValueError, match="expected 0 to 2, got 3"):
        watch_cell(CONFIG, policy, CELL, 3)


def test_a_laser_ahead_and_turned_sees_from_its_place():
    """Robot at (1, 2) heading along y, laser 0.1 m ahead, turned to the left by 90 degrees."""
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=90, max_range=5, x=0.1, yaw_deg=90)
    pose, ranges = np.array([1.0, 2.0, np.pi / 2]), np.array([3.0, 5.0, np.inf])
    origin, ends, hits = beam_ends(pose, lidar, ranges)
    assert origin == pytest.approx([1.0, 2.1])
    assert ends == pytest.approx(np.array([[1.0, 5.1], [-4.0, 2.1], [1.0, -2.9]]))
    assert hits.tolist() == [True, False, False]


def test_a_run_of_barn_is_the_run_of_the_evaluation():
    """Same outcome, and beams that end on cylinders and walls but for their noise."""
    config = BarnEvaluationConfig(count=1, first_seed=200_000, controllers=("gap",), trials=1)
    watched = watch_barn(config, "barn-200000", "gap", 0)
    run = drive_barn_run(config, load_world(config, "barn-200000"), "barn-200000", "gap", 0)
    assert watched.outcome == str(run.outcome)
    moment = watched.moments[5]
    gaps = np.abs(watched.room.clearance(moment.ends[moment.hits]))
    assert np.median(gaps) < 0.03
    assert watched.outline.shape == (4, 2)
