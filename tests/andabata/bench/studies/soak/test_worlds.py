"""Drives in worlds: floors of goals, and what is said below them."""

import pytest

from andabata.bench.studies.soak import worlds
from andabata.bench.studies.soak.worlds import FLOOR, WORLDS, floor_of, shortfalls
from andabata.evaluation.comparison import DrivenCell
from andabata.evaluation.offroad import OffroadComparison
from tests.support.offroad_attempts import trial


def test_the_worlds_are_those_of_the_development_suite():
    """natural-test, world seeds 7300 to 7323, three goals in a row, bullet."""
    config = worlds.evaluation()
    assert [each.seed for each in config.scenarios] == list(range(7300, 7324))
    assert {each.world for each in config.scenarios} == {"natural-test"}
    assert (config.goals, config.simulated_robot.plant) == (3, "bullet")


def test_goals_are_counted_in_a_row(monkeypatch):
    """Of two worlds, one reaches two goals, the other all three."""
    ends = {0: 2, 1: 3}

    def drive(comparison, world):
        return DrivenCell(tuple(trial(world, comparison.config.controllers[0], ends[world])))

    monkeypatch.setattr(OffroadComparison, "drive", drive)
    assert worlds.drive_worlds(2, 1) == [2, 2, 1]


def test_the_floor_of_all_worlds_is_the_stated_one():
    """Fewer worlds allow as many misses as all of them do."""
    assert floor_of(WORLDS) == FLOOR == (22, 22, 20)
    assert floor_of(10) == (8, 8, 6)
    assert floor_of(1) == (0, 0, 0)


def test_only_goals_below_the_floor_are_named():
    """At the floor nothing is wrong; one drive fewer is."""
    assert shortfalls(FLOOR, WORLDS) == []
    assert shortfalls((22, 21, 20), WORLDS) == ["goal 2: expected at least 22 of 24 drives, got 21"]
    assert len(shortfalls((0, 0, 0), WORLDS)) == 3


@pytest.mark.parametrize(("third", "failed"), [(20, 0), (19, 1)])
def test_a_shortfall_is_a_failure(third, failed, tmp_path, monkeypatch):
    """The figure has the goals either way; the shortfall is named."""
    monkeypatch.setattr(worlds, "drive_worlds", lambda *_: [WORLDS, WORLDS, third])
    outcome = worlds.worlds_are_driven(WORLDS, tmp_path)
    assert (outcome.trials, outcome.failed) == (WORLDS, failed)
    assert outcome.figure == f"goals 1, 2 and 3 in 24, 24 and {third} of 24 worlds"
    assert ["goal 3" in text for text in outcome.failures] == [True] * failed
