"""Table of faults: counts of responses, pairs with the robot without a fault."""

from dataclasses import replace

import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.fault_table import fault_rows
from andabata.evaluation.perturbation import arms
from andabata.machine.faults import Fault
from andabata.machine.planar.mover_contact import Contact
from andabata.navigation.fault_watch import FaultResponse
from andabata.tasks.terminations import Outcome
from tests.support.offroad_attempts import trial

FAULTS = (Fault.parse("gnss:stuck@20"), Fault.parse("laser:off@10"))
ARMS = arms(("planner",), SimulatedRobotConfig(), {"lag": 0.2}, FAULTS)
CLEAN = FaultResponse(30.0, None, 0, "ok")


def driven(number, arm, goals, response, error=1.0):
    """Return the attempts of a trial, whose last one has the response."""
    *others, last = trial(number, arm.name, goals)
    detail = replace(last.detail, response=response, position_error=error)
    return [*others, replace(last, detail=detail)]


def attempts():
    """Return three trials of each arm."""
    base, late, stuck, blind = ARMS
    found = []
    for number in range(3):
        found += driven(number, base, 3, CLEAN)
        found += trial(number, late.name, 3)
    found += driven(0, stuck, 3, FaultResponse(30.0, 2.0, 0, "ok"), 2.0)
    found += driven(1, stuck, 1, FaultResponse(30.0, 9.0, 3, "lost", 12.0), 6.0)
    found += driven(2, stuck, 0, FaultResponse(0.0, None, 7, "ok"), 100.0)
    found += driven(0, blind, 3, CLEAN)
    found += driven(1, blind, 0, FaultResponse(30.0, None, 0, "ok", 4.0))
    found += driven(2, blind, 3, CLEAN)
    return found


def test_responses_are_counted_over_the_drives_beyond_the_onset():
    """Flags with their median time, contacts, commands and healths; an early end is left out."""
    base, stuck, blind = fault_rows(attempts(), ARMS)
    assert (base["controller"], base["fault"], base["sense"], base["onset_s"]) == (
        *("planner", "", None, None),
    )
    assert (base["faulty"], base["flagged"], base["flagged_after_s"], base["contacts"]) == (
        *(3, 0, None, 0),
    )
    assert (stuck["fault"], stuck["sense"], stuck["kind"], stuck["onset_s"]) == (
        *("gnss:stuck@20", "gnss", "stuck", 20.0),
    )
    assert (stuck["faulty"], stuck["flagged"], stuck["flagged_within_2_s"]) == (2, 2, 1)
    assert (stuck["flagged_after_s"], stuck["position_error_m"]) == (5.5, 4.0)
    assert (stuck["contacts"], stuck["contacts_after_flag"], stuck["bad_commands"]) == (1, 1, 3)
    assert stuck["health_at_end"] == {"ok": 1, "lost": 1}
    assert (blind["flagged"], blind["contacts"], blind["contacts_after_flag"]) == (0, 1, 0)


def test_collisions_with_walkers_are_told_apart():
    """Each fault's row counts its own, by who drove into whom."""
    ends = {(ARMS[2].name, 2): Contact.HIT, (ARMS[3].name, 1): Contact.MOVER}
    found = [
        replace(each, outcome=Outcome.COLLISION, contact=contact)
        if (contact := ends.get((each.contender, each.repetition)))
        else each
        for each in attempts()
    ]
    keys = ("hit_mover", "hit_by_mover", "hit_at_rest")
    hits = [tuple(row[key] for key in keys) for row in fault_rows(found, ARMS)]
    assert hits == [(0, 0, 0), (0, 1, 0), (1, 0, 0)]


def test_a_flag_of_the_robot_without_a_fault_is_none_of_the_faults():
    """At the same time in the same trial; one before or after it is, and its own row has it."""
    base, _, stuck, blind = ARMS  # Watched from 10 s, 20 s and 10 s on.
    found = []
    for number in range(3):
        found += driven(number, base, 3, replace(CLEAN, flagged_after_s=12.0))
        found += driven(number, stuck, 3, replace(CLEAN, flagged_after_s=(2.0, 1.9, 12.0)[number]))
        found += driven(number, blind, 3, replace(CLEAN, flagged_after_s=(12.0, 2.0, 12.1)[number]))
    rows = fault_rows(found, ARMS)
    assert [row["flagged"] for row in rows] == [3, 2, 2]
    assert [row["flagged_within_2_s"] for row in rows] == [0, 1, 1]
    clean = [each for each in found if each.contender != base.name]
    clean += [each for number in range(3) for each in driven(number, base, 3, CLEAN)]
    assert sorted(row["flagged"] for row in fault_rows(clean, ARMS)) == [0, 3, 3]


def test_each_fault_is_compared_with_the_robot_without():
    """In pairs of trials that reach all goals; the first row has no difference."""
    base, stuck, blind = fault_rows(attempts(), ARMS)
    assert (base["trials"], base["successes"], base["difference"]) == (3, 3, None)
    assert (base["mcnemar_p"], set(base)) == (None, set(stuck))
    assert (stuck["successes"], stuck["mcnemar_lost"], stuck["mcnemar_gained"]) == (1, 2, 0)
    assert stuck["difference"] == pytest.approx(-2 / 3)
    assert stuck["difference_low"] < -2 / 3 < stuck["difference_high"]
    assert blind["difference"] == pytest.approx(-1 / 3)


def test_controllers_are_compared_with_themselves():
    """Each has its own row without a fault."""
    both = arms(("planner", "reactive"), SimulatedRobotConfig(), {}, FAULTS[:1])
    goals = (3, 0, 0, 3)
    found = [
        each
        for arm, reached in zip(both, goals, strict=True)
        for each in driven(0, arm, reached, CLEAN)
    ]
    rows = fault_rows(found, both)
    assert [(row["controller"], row["difference"]) for row in rows] == [
        *(("planner", None), ("planner", -1.0), ("reactive", None), ("reactive", 1.0)),
    ]
