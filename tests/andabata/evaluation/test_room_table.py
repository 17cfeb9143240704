"""Table of an evaluation in rooms: counts, ratios and intervals by hand."""

import numpy as np
import pytest

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.room_drives import RoomMeasures
from andabata.evaluation.room_table import Cell, over_rooms, room_table, task_score
from andabata.evaluation.statistics import wilson_interval
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome
from worlds.rooms.room import RoomTask
from worlds.world import Start

GOAL, HIT, LATE = Outcome.GOAL, Outcome.COLLISION, Outcome.TIMEOUT
ORACLE = ((40, 4.0), (50, 3.0), (30, 2.0), (0, 0.0))
LENGTHS = (5.0, 1.0, 9.0, 0.0)
STEPS = (50, 20, 400, 0)
TASK = RoomTask(Start(0.0, 0.0, 0.0), (1.0, 0.0))


def drives(
    policy="a",
    outcomes=(GOAL, HIT, LATE, GOAL),
    contacts=(Contact.NONE,) * 4,
    oracle=ORACLE,
    room="spn-env0",
):
    """Return the attempts of a cell beside those of an oracle."""
    found = []
    for k, (outcome, contact, best) in enumerate(zip(outcomes, contacts, oracle, strict=True)):
        steps, way = best or (None, np.nan)
        measures = RoomMeasures(TASK, STEPS[k], "ten-beams", "map", steps)
        row = (policy, room, k, outcome, contact, 0.1 * STEPS[k], LENGTHS[k], way, measures)
        found.append(Attempt(*row))
    return found


def row_of(attempts):
    """Return the row of the only cell."""
    (row,) = room_table(attempts, [(attempts[0].contender,)]).rows
    return row


def test_a_row_counts_ends_and_compares_with_the_oracle():
    """SPL and T/oracle by hand; a goal at the start counts as reached straight away."""
    row = row_of(drives())
    assert (row["trials"], row["successes"], row["collisions"], row["timeouts"]) == (4, 2, 1, 1)
    assert (row["wilson_low"], row["wilson_high"]) == wilson_interval(2, 4)
    assert row["steps_to_oracle"] == pytest.approx((50 / 40 + 0 / 1) / 2)
    assert row["spl"] == pytest.approx((4 / 5 + 0 + 0 + 1) / 4)
    assert row["score"] == pytest.approx(0.95 - 1 - 1 + 1)
    assert row["mean_steps"] == pytest.approx(470 / 4)
    cell = [row[name] for name in ("policy", "lidar", "room", "memory")]
    assert cell == ["a", "ten-beams", "spn-env0", "map"]
    assert Cell.of(drives()[0]) == Cell(*cell)


def test_collisions_that_movers_caused_are_counted_apart():
    """Hits while driving and while standing are among the collisions; no way, no ratio."""
    contacts = (Contact.HIT, Contact.HIT_AT_REST, Contact.OBSTACLE, Contact.NONE)
    row = row_of(drives("a", (HIT, HIT, HIT, GOAL), contacts, (*ORACLE[:3], None)))
    assert (row["collisions"], row["hit_by_mover"], row["hit_at_rest"]) == (3, 1, 1)
    assert (row["successes"], row["steps_to_oracle"], row["spl"]) == (1, None, 0.0)
    assert row["movers"] == 0


def test_the_score_of_a_task_is_the_papers():
    """1 - 0.001 T at the goal, -1 for any failure (equation 5)."""
    assert task_score(GOAL, 100) == pytest.approx(0.9)
    assert task_score(HIT, 5) == task_score(LATE, 400) == -1


def test_without_a_goal_there_is_no_ratio():
    """T/oracle is None where no goal was reached."""
    row = row_of(drives(outcomes=(HIT,) * 4))
    assert (row["steps_to_oracle"], row["spl"], row["success_rate"]) == (None, 0.0, 0.0)


def test_groups_of_policies_are_compared_on_the_same_tasks():
    """Each policy's rooms follow each other; the difference is that of the groups' rates."""
    better = (GOAL, GOAL, LATE, GOAL)
    attempts = [
        *(*drives("a"), *drives("b", better), *drives("c", better)),
        *(*drives("a", room="spn-env1"), *drives("b", room="spn-env1")),
        *drives("c", better, room="spn-env1"),
    ]
    (row,) = room_table(attempts, [("a",), ("b", "c")]).differences
    names = ("policy", "against", "lidar", "memory", "tasks")
    assert [row[name] for name in names] == ["b, c", "a", "ten-beams", "map", 8]
    assert row["success_rate_against"] == pytest.approx(4 / 8)
    assert row["success_rate"] == pytest.approx((5 + 6) / 16)
    assert row["difference"] == pytest.approx(3 / 16)
    assert row["difference_low"] < 3 / 16 < row["difference_high"]


def test_policies_are_pooled_by_task():
    """Counts add up; the interval of two equal policies is that of one, not of twice the tasks."""
    one = row_of(drives())
    table = room_table([*drives(), *drives("b"), *drives("other")], [("a", "b"), ("other",)])
    (both,) = table.pooled
    counts = [both[name] for name in ("policy", "policies", "trials", "successes")]
    assert counts == ["a, b", 2, 8, 4]
    for name in ("success_rate", "steps_to_oracle", "spl", "mean_steps"):
        assert both[name] == pytest.approx(one[name])
    assert both["score"] == pytest.approx(2 * one["score"])
    assert both["wilson_low"] == pytest.approx(one["wilson_low"])
    assert set(both) == {*one, "policies"}


def test_counts_of_all_rooms_together_add_up_by_policy_laser_and_memory():
    """Ends are counted over both rooms; another policy has a row of its own."""
    rows = room_table([*drives(), *drives(room="spn-env1")], [("a",)]).rows
    both, other = over_rooms([*rows, row_of(drives("b"))])
    names = ("policy", "lidar", "memory", "trials", "successes", "collisions", "timeouts")
    assert [both[name] for name in names] == ["a", "ten-beams", "map", 8, 4, 2, 2]
    assert [other[name] for name in names] == ["b", "ten-beams", "map", 4, 2, 1, 1]
    ends = (both["wilson_low"], both["wilson_high"])
    assert (both["success_rate"], ends) == (0.5, wilson_interval(4, 8))
