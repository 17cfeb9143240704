"""Scenarios: one unseen world a trial, of one preset or of a suite."""

import pytest

from andabata.evaluation.scenarios import Scenario, scenarios
from worlds.catalogue import preset_names
from worlds.splits import EVALUATION_START, evaluation_world, judging_world


def test_the_suite_is_wide_and_unseen():
    """160 worlds of four presets, from easy to hard, that nothing trains on, new for each seed."""
    found = scenarios("generalisation", "maze", 3, 0)
    assert len(found) == len(set(found)) == 160
    assert {scenario.world for scenario in found} <= set(preset_names())
    counts = [sum(one.world == name for one in found) for name in ("maze", "hollow")]
    assert counts == [20, 20]
    assert all(scenario.seed >= EVALUATION_START for scenario in found)
    natural = [scenario.difficulty for scenario in found if scenario.world == "natural-far"]
    assert len(natural) == 100
    assert natural == sorted(natural)
    assert (natural[0], natural[-1]) == (0.0, 0.8)
    assert not set(found) & set(scenarios("generalisation", "maze", 3, 1))


def test_an_unknown_suite_is_named():
    """The error lists the suites."""
    with pytest.raises(
        ValueError, match="--suite: expected one of generalisation, development, walkers, got 'x'"
    ):
        scenarios("x", "maze", 3, 0)


def test_all_trials_of_one_world_have_its_seed():
    """Whatever the seed of the evaluation, which draws tasks and noise."""
    for seed in (0, 7):
        found = scenarios(None, "natural-row", 3, seed, world_seed=0)
        assert found == (Scenario("natural-row", 0, None),) * 3


def test_trials_of_a_preset_have_worlds_of_their_own():
    """Trial k of a seed has evaluation world k of that seed, at the preset's own difficulty."""
    found = scenarios(None, "hollow", 4, 2)
    assert found == tuple(Scenario("hollow", evaluation_world(2, k), None) for k in range(4))
    assert len({one.seed for one in found}) == 4
    assert not {one.seed for one in found} & {one.seed for one in scenarios(None, "hollow", 4, 3)}


def test_the_development_suite_is_apart_from_every_other_split():
    """24 worlds, the same for every seed, that nothing is trained, validated or published on."""
    found = scenarios("development", "maze", 3, 0)
    assert found == scenarios("development", "maze", 3, 7)
    assert [scenario.seed for scenario in found] == list(range(7300, 7324))
    assert {scenario.world for scenario in found} == {"natural-test"}


def test_the_walkers_of_the_development_worlds_are_a_suite():
    """Trial by trial the same world, with walkers in it."""
    found, bare = (scenarios(name, "maze", 3, 0) for name in ("walkers", "development"))
    assert {scenario.world for scenario in found} == {"natural-walkers"}
    assert [one.seed for one in found] == [one.seed for one in bare]


def test_a_release_is_judged_in_worlds_of_its_own():
    """Trial k has judging world k of its preset, whatever the seed."""
    for world, first in (("natural-test", 0), ("maze", 2500)):
        found = scenarios(None, world, 3, 5, "0.2.0")
        assert found == tuple(Scenario(world, judging_world("0.2.0", first + k)) for k in range(3))
