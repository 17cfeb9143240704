"""Drives in rooms: known ways, what robots observe, files, and policies of another kind."""

import io
from itertools import pairwise

import numpy as np
import pytest

from andabata.evaluation.room_drives import (
    drive_tasks,
    drive_tour,
    drives_from_bytes,
    drives_to_bytes,
)
from andabata.evaluation.room_policies import fitted
from andabata.machine.planar.mover_contact import Contact
from andabata.models import shipped_policy
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from andabata.tasks.terminations import Outcome
from rl.driving import DRIVING_NOISE
from rl.goal_laws import ProportionalPolicy
from rl.policy import with_info
from tests.support.room_policies import window_policy
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import RoomTask, random_task
from worlds.world import Start

TASK = SpnConfig(rooms=("spn-env0",))
AHEAD = RoomTask(Start(0.0, 0.0, 0.0), (1.55, 0.0))
INTO_THE_BOX = RoomTask(Start(1.6, 0.0, -np.pi / 2), (1.6, -3.0))
"""The box of the room begins at y = -1.4."""


def proportional(task=TASK):
    return ProportionalPolicy({}, task.observations, task.actions)


def test_a_straight_way_takes_the_steps_of_its_length():
    """0.1 m a step until less than 0.3 m are left; the box stops the robot at its radius."""
    reached, hit = drive_tasks(proportional(), TASK, [AHEAD, INTO_THE_BOX])
    assert reached.outcome is Outcome.GOAL
    assert reached.detail.steps == 13
    assert reached.distance == pytest.approx(1.3)
    np.testing.assert_allclose(reached.path[:, 0], 0.1 * np.arange(14), atol=1e-9)
    assert hit.outcome is Outcome.COLLISION
    assert -1.3 <= hit.path[-1, 1] <= -1.2 + 1e-9
    assert hit.detail.task == INTO_THE_BOX
    names = [(each.scenario, each.repetition) for each in (reached, hit)]
    assert names == [("spn-env0", 0), ("spn-env0", 1)]
    assert reached.time == pytest.approx(13 * TASK.robot.period)
    assert (reached.contact, hit.contact) == (Contact.NONE, Contact.OBSTACLE)


def test_each_drive_is_the_same_alone_and_beside_others(monkeypatch):
    """Paths do not depend on the robots beside, nor on how many drive together."""
    tasks = [*make_room("spn-env0").tasks, INTO_THE_BOX]
    together = drive_tasks(proportional(), TASK, tasks)
    monkeypatch.setattr("andabata.evaluation.room_drives._BATCH", 2)
    for one, other in zip(together, drive_tasks(proportional(), TASK, tasks), strict=True):
        assert (one.outcome, one.detail.steps) == (other.outcome, other.detail.steps)
        np.testing.assert_array_equal(one.path, other.path)


def test_observers_see_every_state_before_its_step(monkeypatch):
    """Each drive is seen once a step, by its number among all tasks."""
    monkeypatch.setattr("andabata.evaluation.room_drives._BATCH", 2)
    seen = []
    drives = drive_tasks(
        proportional(),
        TASK,
        [AHEAD, INTO_THE_BOX, AHEAD],
        lambda numbers, states: seen.extend(zip(numbers.tolist(), states.copy(), strict=True)),
    )
    for k, drive in enumerate(drives):
        mine = [state for number, state in seen if number == k]
        assert len(mine) == drive.detail.steps
    goal = TASK.observations.slice_of("goal")
    first = next(state for number, state in seen if number == 2)
    np.testing.assert_allclose(first[goal], [1.55 / 5, 1, 0], atol=1e-6)


def test_goals_come_in_the_form_that_the_policy_reads():
    """A policy of polar goals drives the same way in a task of the other form."""
    polar = TASK.model_copy(update={"goal_encoding": "polar"})
    (one,) = drive_tasks(proportional(polar), TASK, [AHEAD])
    assert (one.outcome, one.detail.steps) == (Outcome.GOAL, 13)
    assert fitted(proportional(polar), TASK)[1].goal_encoding == "polar"


def test_drives_go_through_a_file():
    """Drives of a file are those that were written, but for rounded paths."""
    drives = drive_tasks(proportional(), TASK, [AHEAD, INTO_THE_BOX])
    found = drives_from_bytes(drives_to_bytes(drives), "x.npz")
    assert [(d.detail.task, d.outcome, d.detail.steps, d.contact) for d in found] == [
        (d.detail.task, d.outcome, d.detail.steps, d.contact) for d in drives
    ]
    for one, other in zip(found, drives, strict=True):
        np.testing.assert_allclose(one.path, other.path, atol=1e-6)


def test_a_file_without_contacts_is_read():
    """Drives from before there were movers come without contacts."""
    data = drives_to_bytes(drive_tasks(proportional(), TASK, [INTO_THE_BOX]))
    with np.load(io.BytesIO(data)) as file:
        parts = {name: file[name] for name in file if name != "contacts"}
    stream = io.BytesIO()
    np.savez(stream, **parts)
    (found,) = drives_from_bytes(stream.getvalue(), "x.npz")
    assert (found.outcome, found.contact) == (Outcome.COLLISION, Contact.NONE)


def test_a_mover_that_drives_into_a_robot_is_told_apart():
    """A robot told to stand is hit at rest at some time; none of its crashes is its own fault."""
    movers = Td3TaskConfig(rooms=("clutter-movers-7300",), random_rooms=0)
    standing = window_policy()
    weights = {name: np.zeros_like(value) for name, value in standing.tensors().items()}
    last = max(name for name in weights if name.endswith("bias"))
    weights[last] = np.array([-20.0, 0.0], dtype=weights[last].dtype)
    robot = type(standing)(weights, standing.observations, standing.actions, standing.info)
    room = make_room("clutter-movers-7300")
    rng = np.random.default_rng(0)
    tasks = [random_task(room, rng, 0.2, 0.4, 2.0) for _ in range(12)]
    drives = drive_tasks(robot, movers, tasks)
    contacts = {drive.contact for drive in drives if drive.outcome is Outcome.COLLISION}
    assert contacts == {Contact.HIT_AT_REST}
    assert all(d.contact is Contact.NONE for d in drives if d.outcome is Outcome.TIMEOUT)


@pytest.mark.parametrize("cut", [0, 10, 300])
def test_a_damaged_file_of_drives_is_named(cut):
    """A file that is empty or cut short is an error with its name."""
    data = drives_to_bytes(drive_tasks(proportional(), TASK, [AHEAD]))
    with pytest.raises(ValueError, match=r"x\.npz: expected drives of andabata"):
        drives_from_bytes(data[:cut], "x.npz")


def test_a_policy_of_another_kind_is_refused():
    """The off-road policy is told by what it reads, with the command that trains another."""
    with pytest.raises(ValueError, match=r"expected one that drives in rooms, got one of kind mlp"):
        drive_tasks(shipped_policy(), TASK, [AHEAD])


def test_a_tour_goes_on_where_the_robot_stands():
    """Each leg starts at the end of the one before; a leg that fails ends the tour."""
    goals = [(1.0, 0.0), (1.0, 1.0), (1.6, -3.0), (0.0, 0.0)]
    legs = drive_tour(proportional(), TASK, Start(0.0, 0.0, 0.0), goals)
    outcomes = [leg.outcome for leg in legs]
    assert outcomes == [Outcome.GOAL, Outcome.GOAL, Outcome.COLLISION]
    for before, leg in pairwise(legs):
        np.testing.assert_array_equal(leg.path[0], before.path[-1])


def test_noise_that_a_policy_keeps_is_drawn_for_each_drive():
    """Two drives of one task differ, in a batch or not; another call gives the same again."""
    noisy = with_info(proportional(), {DRIVING_NOISE: 0.3})
    first, second = drive_tasks(noisy, TASK, [AHEAD, AHEAD])
    assert not np.array_equal(first.path[:5], second.path[:5])
    (alone,) = drive_tasks(noisy, TASK, [AHEAD])
    np.testing.assert_array_equal(alone.path, first.path)
