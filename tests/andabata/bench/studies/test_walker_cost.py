"""Cost of walkers: as many as were asked for, in the shares of the preset, and a row for each."""

from collections import Counter

import pytest

from andabata.bench.studies.walker_cost import time_steps, with_walkers
from worlds.agents import check_movers
from worlds.catalogue import make_world, patch


@pytest.fixture(scope="module")
def world():
    """Return a small natural world."""
    return make_world("natural-test", 3, config=patch("natural-test", 50.0, 0.25))


def test_a_world_gets_about_as_many_walkers_as_asked_for(world):
    """Of all kinds, in the shares of the preset."""
    peopled = with_walkers(world, 40)
    check_movers(peopled.movers)
    assert 34 <= len(peopled.movers) <= 46
    kinds = Counter(mover.kind for mover in peopled.movers)
    assert set(kinds) == {"person", "animal", "vehicle"}
    assert kinds["person"] > 20


def test_each_number_has_a_row(world):
    """Without walkers their motion costs nothing."""
    none, few = time_steps(world, (0, 6), 2)
    assert none["walkers"] == 0
    assert 3 <= few["walkers"] <= 9
    assert none["motion, median [ms]"] == 0.0
    assert few["motion, median [ms]"] > 0.0
    assert few["motion, 95 % [ms]"] >= few["motion, median [ms]"]
    assert none["simulator with laser, median [ms]"] > 0.0
