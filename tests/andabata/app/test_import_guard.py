"""Import guard: the generic names are ours, and every seed has one purpose."""

import importlib.util
from types import SimpleNamespace

import pytest

from andabata.app.import_guard import OriginError, check_origins
from worlds.splits import TRAINING_SEEDS, dataset_world, evaluation_world


def test_the_packages_are_beside_each_other():
    """All five packages come from one place."""
    assert set(check_origins()) == {"andabata", "terrain", "worlds", "traversability", "rl"}


def test_another_distribution_of_a_name_is_refused(monkeypatch):
    """A sibling package from elsewhere is an error."""
    monkeypatch.setattr(
        "andabata.app.import_guard.find_spec",
        lambda name: SimpleNamespace(origin=f"/elsewhere/{name}/__init__.py"),
    )
    with pytest.raises(OriginError, match="package terrain: expected"):
        check_origins()
    assert importlib.util.find_spec("terrain").origin.endswith("terrain/__init__.py")


def test_no_world_serves_two_purposes():
    """Seeds of training, evaluation and data sets never meet."""
    training = set(TRAINING_SEEDS)
    evaluation = {evaluation_world(seed, trial) for seed in (0, 1, 9999) for trial in (0, 9999)}
    clouds = {dataset_world(seed, number) for seed in (0, 1, 50) for number in (0, 99_999)}
    assert max(training) < min(evaluation) <= max(evaluation) < min(clouds)


@pytest.mark.parametrize(("seed", "trial"), [(-1, 0), (10_000, 0), (0, 10_000)])
def test_seeds_that_would_reach_others_are_refused(seed, trial):
    """A seed or trial outside its range is an error."""
    with pytest.raises(ValueError, match="expected 0 to 9999"):
        evaluation_world(seed, trial)
