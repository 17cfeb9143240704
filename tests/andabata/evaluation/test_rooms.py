"""Evaluation in rooms: the same tasks for all, rows that do not depend on each other, resuming."""

import json

import numpy as np
import pytest

from andabata.evaluation import rooms as evaluation
from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.room_drives import drives_from_bytes
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import (
    OracleQuery,
    RoomComparison,
    RoomEvaluationConfig,
    alike,
    cell_task,
    judged_task,
    oracle_of,
    tasks_of,
)
from andabata.models import shipped_policy
from andabata.tasks.rooms.spn_config import SpnConfig
from rl.goal_laws import ProportionalPolicy
from rl.laws import LAWS
from rl.policy import with_info
from tests.support.room_policies import window_policy
from tests.support.room_tables import evaluated_rooms
from worlds.rooms.catalogue import make_room

TASK = SpnConfig()
POLICIES = {"p": ProportionalPolicy({}, TASK.observations, TASK.actions)}


def small(**changes):
    settings = {
        "rooms": ("spn-env0", "spn-env1"),
        "lidars": ("ten-beams", "front-180"),
        "memories": ("reactive",),
        "pairs": 3,
    }
    return RoomEvaluationConfig(**settings | changes)


def test_tasks_depend_on_room_and_seed_alone():
    """Lasers, memories and other rooms change no task; each seed and each room has its own."""
    room = make_room("spn-env1")
    tasks = tasks_of(room, small())
    assert tasks == tasks_of(room, small(rooms=("spn-env1",), lidars=("front-180",)))
    assert tasks_of(room, small(pairs=5))[:3] == tasks
    other = tasks_of(room, small(seed=1))
    assert not set(tasks) & set(other)
    elsewhere = tasks_of(make_room("spn-env0"), small())
    assert not {task.start.yaw for task in tasks} & {task.start.yaw for task in elsewhere}
    assert all(np.hypot(*np.subtract(t.goal, (t.start.x, t.start.y))) >= 1 for t in tasks)


def test_no_pairs_take_the_fixed_tasks():
    """Zero pairs are the room's own tasks; a room without such is refused."""
    room = make_room("spn-env1")
    assert tasks_of(room, small(pairs=0)) == list(room.tasks)
    with pytest.raises(ValueError, match="random-1, which has no fixed tasks"):
        tasks_of(make_room("random-1"), small(pairs=0))


def test_a_cell_has_its_room_laser_and_memory():
    """All beams become points; training's randomised lasers and other rooms are left out."""
    config = small(task=SpnConfig(random_rooms=1, randomization={}))
    task = cell_task(Cell("p", "180|20|10|0.05", "spn-env1", "map"), config, POLICIES["p"])
    assert (task.all_rooms, task.lidar.x, task.capacity) == (("spn-env1",), 0.05, 10)
    assert (task.map, task.randomization) == (config.map, None)
    assert (
        cell_task(Cell("p", "ten-beams", "spn-env1", "reactive"), config, POLICIES["p"]).map is None
    )


def test_rows_do_not_depend_on_what_is_driven_beside():
    """A cell's row is the same alone; several policies have rows of their own and together."""
    both = {"p": POLICIES["p"], "q": POLICIES["p"]}
    table = evaluated_rooms(small(), both)
    assert len(table.rows) == 8
    assert [(row["policy"], row["policies"]) for row in table.pooled] == [("p, q", 2)] * 4
    config = small(rooms=("spn-env1",), lidars=("front-180",))
    alone = evaluated_rooms(config, POLICIES)
    assert alone.pooled == alone.differences == table.differences == []
    assert alone.rows == [
        row
        for row in table.rows
        if (row["policy"], row["lidar"], row["room"]) == ("p", "front-180", "spn-env1")
    ]
    assert all(
        row["steps_to_oracle"] is None or row["steps_to_oracle"] > 0.97 for row in table.rows
    )


def test_policies_are_alike_if_only_their_seeds_differ():
    """Seeds of the same settings belong together, other settings and other kinds do not."""
    policies = {
        name: with_info(POLICIES["p"], {"config": {"k": k}, "seed": seed})
        for name, k, seed in (("a", 2, 0), ("b", 5, 0), ("c", 2, 1))
    }
    policies["d"] = shipped_policy()
    assert alike(policies) == [("a", "c"), ("b",), ("d",)]


def test_policies_of_other_kinds_are_compared_with_the_first():
    """One row a laser and memory, all rooms together, over the tasks of both."""
    laws = {
        name: LAWS[name]({}, TASK.observations, TASK.actions) for name in ("proportional", "away")
    }
    table = evaluated_rooms(small(memories=("map",)), laws)
    assert [(row["policy"], row["against"], row["lidar"]) for row in table.differences] == [
        ("away", "proportional", lidar) for lidar in small().lidars
    ]
    for row in table.differences:
        rates = {
            name: np.mean(
                [
                    one["success_rate"]
                    for one in table.rows
                    if (one["policy"], one["lidar"]) == (name, row["lidar"])
                ]
            )
            for name in laws
        }
        assert row["tasks"] == 2 * 3
        assert row["difference"] == pytest.approx(rates["away"] - rates["proportional"])
        assert row["difference"] < 0


def test_a_map_is_another_memory():
    """With a map the proportional controller goes round what it hits without."""
    changes = {"rooms": ("spn-env1",), "lidars": ("front-180",), "memories": ("reactive", "map")}
    config = small(pairs=0, **changes)
    reactive, mapped = evaluated_rooms(config, POLICIES).rows
    assert (reactive["memory"], mapped["memory"]) == ("reactive", "map")
    assert reactive["trials"] == mapped["trials"] == 4
    assert mapped["successes"] >= reactive["successes"] + 2


def test_a_killed_evaluation_goes_on(tmp_path):
    """Cells of the journal are told at once; measures and files are the same."""
    comparison, told = RoomComparison.of(small(), POLICIES), []
    first = run_comparison(comparison, folder=tmp_path)
    path, drives = tmp_path / "cells.jsonl", tmp_path / "drives"
    lines = path.read_text().splitlines()
    assert len(lines) == 1 + 4
    path.write_text("\n".join(lines[:3]) + "\n" + lines[3][:40])  # A kill in the third cell.
    (drives / "0.npz").unlink()
    (drives / "3.npz").unlink()
    again = run_comparison(comparison, folder=tmp_path, on_cell=told.append)
    assert again == first
    assert told == list(comparison.cells())
    assert sorted(file.name for file in drives.iterdir()) == ["1.npz", "2.npz", "3.npz"]
    kept = drives_from_bytes((drives / "3.npz").read_bytes(), "3.npz")
    cell = comparison.cells()[3]
    mine = [each for each in again if Cell.of(each) == cell]
    assert [each.detail for each in comparison.drive(cell).attempts] == [d.detail for d in mine]
    assert [each.detail.task for each in kept] == [each.detail.task for each in mine]


def test_a_cell_is_driven_and_read_with_the_same_measures():
    """What the journal keeps is what was driven, but for the path."""
    comparison = RoomComparison.of(small(), POLICIES)
    cell = comparison.cells()[1]
    driven = comparison.drive(cell).attempts
    same, read = comparison.decode(json.loads(json.dumps(comparison.encode(cell, driven))))
    assert same == cell
    assert read == driven
    assert {(each.contender, each.scenario) for each in read} == {("p", cell.room)}
    assert [each.repetition for each in read] == [0, 1, 2]
    for each in read:
        assert each.time == pytest.approx(each.detail.steps * small().task.robot.period)


def test_each_policy_is_compared_with_an_oracle_of_its_robot():
    """GDAE's wide robot has a longer way of its own on the same tasks, and its own laser."""
    policies = {"td3": window_policy("td3"), "gdae": window_policy("gdae")}
    config = RoomEvaluationConfig(task=judged_task("td3"), rooms=("clutter-7300",), pairs=2)
    cells = {name: Cell(name, "trained", "clutter-7300", "reactive") for name in policies}
    tasks = {name: cell_task(cells[name], config, policies[name]) for name in policies}
    assert {name: task.lidar.count for name, task in tasks.items()} == {"td3": 360, "gdae": 181}
    narrow, wide = (
        oracle_of(config, OracleQuery("clutter-7300", task.robot)) for task in tasks.values()
    )
    for (steps, way), (other_steps, other_way) in zip(narrow, wide, strict=True):
        assert other_way >= way
        assert steps < other_steps * 1.05
    monster = tasks["td3"].robot.model_copy(update={"radius": 2.0})
    assert oracle_of(config, OracleQuery("clutter-7300", monster)) == [None, None]


@pytest.mark.parametrize("part", ["policies", "config", "commit"])
def test_a_journal_of_another_evaluation_is_refused(tmp_path, monkeypatch, part):
    """Other policies, settings or code do not go on with a journal."""
    config = small(rooms=("spn-env0",), lidars=("ten-beams",))
    run_comparison(RoomComparison.of(config, POLICIES), folder=tmp_path)
    policies = {"other": POLICIES["p"]} if part == "policies" else POLICIES
    other = config.model_copy(update={"seed": 3}) if part == "config" else config
    if part == "commit":
        monkeypatch.setattr(evaluation, "commit", lambda: "another")
    with pytest.raises(ValueError, match=f"got one that differs in {part}; take another --out"):
        run_comparison(RoomComparison.of(other, policies), folder=tmp_path)
