"""Splits of the world seeds: disjoint, and refused beyond their bounds."""

import pytest

from worlds.catalogue import make_world
from worlds.rooms.barn import NARROW, barn_world
from worlds.rooms.catalogue import make_room
from worlds.scenes import SceneCache
from worlds.splits import (
    DATASET_CLOUDS,
    DATASET_START,
    DEVELOPMENT_SEEDS,
    EVALUATION_START,
    EVALUATIONS,
    JUDGING_START,
    JUDGING_TRIALS,
    TRAINING_SEEDS,
    VALIDATION_SEEDS,
    JudgingSeedError,
    dataset_world,
    evaluation_world,
    judged_release,
    judging_world,
    refuse_judging,
    split_of,
)

JUDGED = judging_world("0.2.0", 7)
"""A seed that judges; its world is never made here."""


def test_the_splits_are_disjoint_and_in_order():
    """Training, validation, development, judging and data sets share no world seed."""
    assert max(TRAINING_SEEDS) < min(VALIDATION_SEEDS)
    assert max(VALIDATION_SEEDS) < min(DEVELOPMENT_SEEDS)
    assert max(DEVELOPMENT_SEEDS) < EVALUATION_START
    assert evaluation_world(EVALUATIONS - 1, EVALUATIONS - 1) < JUDGING_START
    assert judging_world("9.99.99", JUDGING_TRIALS - 1) < DATASET_START


@pytest.mark.parametrize(
    ("world", "last"), [(evaluation_world, EVALUATIONS - 1), (dataset_world, DATASET_CLOUDS - 1)]
)
def test_every_pair_has_a_world_of_its_own(world, last):
    """The last world of a seed is followed by the first of the next."""
    assert world(0, last) + 1 == world(1, 0)
    assert world(3, 5) == world(3, 4) + 1


def test_the_first_worlds_are_known():
    """Published results depend on these numbers."""
    assert (len(TRAINING_SEEDS), len(VALIDATION_SEEDS)) == (100, 32)
    assert evaluation_world(2, 3) == 1_020_003
    assert dataset_world(2, 3) == 1_000_200_003


@pytest.mark.parametrize("seed_and_trial", [(-1, 0), (0, -1), (EVALUATIONS, 0), (0, EVALUATIONS)])
def test_evaluations_stay_in_their_split(seed_and_trial):
    """A seed or trial out of bounds is refused."""
    with pytest.raises(ValueError, match="expected 0 to 9999, got"):
        evaluation_world(*seed_and_trial)


@pytest.mark.parametrize("seed_and_number", [(-1, 0), (0, -1), (0, DATASET_CLOUDS)])
def test_data_sets_stay_in_their_split(seed_and_number):
    """A seed or cloud out of bounds is refused."""
    with pytest.raises(ValueError, match="expected seed >= 0 and 0 to 99999 clouds, got"):
        dataset_world(*seed_and_number)


def test_each_release_has_worlds_of_its_own():
    """Published results depend on these numbers; the last of a release precedes the next's."""
    assert judging_world("0.2.0", 0) == 500_800_000
    assert judging_world("1.2.3", 4) == JUDGING_START + 10_203 * JUDGING_TRIALS + 4
    for release, after in (("0.2.0", "0.2.1"), ("0.2.99", "0.3.0"), ("0.99.99", "1.0.0")):
        assert judging_world(release, JUDGING_TRIALS - 1) + 1 == judging_world(after, 0)


@pytest.mark.parametrize("release", ["0.0.0", "0.2.0", "3.14.15", "9.99.99"])
@pytest.mark.parametrize("trial", [0, JUDGING_TRIALS - 1])
def test_a_judging_seed_knows_its_release(release, trial):
    """It is the inverse of ``judging_world``."""
    assert judged_release(judging_world(release, trial)) == release


@pytest.mark.parametrize(
    "release", ["", "0.2", "v0.2.0", "0.2.0rc1", "10.0.0", "0.100.0", "0.02.0", "0.2.0\n", "0.2.-1"]
)
def test_a_release_is_a_version(release):
    """Anything else is refused with the form that is expected."""
    with pytest.raises(ValueError, match=r"release: expected a version .* as 0\.2\.0.*, got"):
        judging_world(release, 0)


@pytest.mark.parametrize("trial", [-1, JUDGING_TRIALS])
def test_judging_trials_stay_in_their_release(trial):
    """A trial out of bounds is refused."""
    with pytest.raises(ValueError, match="trial: expected 0 to 3999, got"):
        judging_world("0.2.0", trial)


def test_every_seed_has_one_split():
    """Also those that no range names, which are development, as all evaluations so far are."""
    assert {split_of(seed) for seed in TRAINING_SEEDS} == {"training"}
    assert {split_of(seed) for seed in VALIDATION_SEEDS} == {"validation"}
    looked_at = (*DEVELOPMENT_SEEDS, 132, 5000, EVALUATION_START, evaluation_world(9999, 9999))
    assert {split_of(seed) for seed in looked_at} == {"development"}
    assert {split_of(seed) for seed in (JUDGED, JUDGING_START, 899_999_999)} == {"judging"}
    assert {split_of(seed) for seed in (JUDGING_START - 1, 900_000_000)} == {"development"}
    assert split_of(DATASET_START) == split_of(dataset_world(700, 3)) == "data set"
    with pytest.raises(ValueError, match="seed: expected 0 or more, got -1"):
        split_of(-1)


def test_a_judging_seed_is_for_its_release_alone():
    """Without it, or for another one, it is refused; other seeds are for anybody."""
    refuse_judging(JUDGED, "0.2.0")
    refuse_judging(7300)
    refuse_judging(7300, "0.2.0")
    for release in (None, "0.2.1"):
        with pytest.raises(JudgingSeedError, match=r"got 500800007, which judges 0\.2\.0; take"):
            refuse_judging(JUDGED, release)


@pytest.mark.parametrize(
    "make",
    [
        lambda: make_world("maze", JUDGED),
        lambda: make_world("maze", JUDGED, release="0.2.1"),
        lambda: SceneCache().get("maze", JUDGED),
        lambda: make_room(f"random-{JUDGED}"),
        lambda: make_room(f"clutter-movers-{JUDGED}"),
        lambda: make_room(f"barn-{JUDGED}"),
        lambda: barn_world(JUDGED, NARROW),
    ],
)
def test_nothing_makes_a_judging_world_for_another_purpose(make):
    """Whatever trains, tunes, draws or shows gets its worlds and rooms from one of these."""
    with pytest.raises(JudgingSeedError, match="expected one that does not judge a release"):
        make()


def test_a_release_makes_its_own_worlds(monkeypatch):
    """Tried with a split that is patched to seeds that were looked at."""
    monkeypatch.setattr("worlds.splits.JUDGING_START", EVALUATION_START)
    seed = judging_world("0.0.0", 3)
    with pytest.raises(JudgingSeedError):
        make_world("maze", seed)
    scene = SceneCache().get("maze", seed, release="0.0.0")
    assert scene.world.seed == seed == EVALUATION_START + 3
