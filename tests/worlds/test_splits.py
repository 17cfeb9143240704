"""Splits of the world seeds: disjoint, and refused beyond their bounds."""

import pytest

from worlds.splits import (
    DATASET_CLOUDS,
    DATASET_START,
    DEVELOPMENT_SEEDS,
    EVALUATION_START,
    EVALUATIONS,
    TRAINING_SEEDS,
    VALIDATION_SEEDS,
    dataset_world,
    evaluation_world,
)


def test_the_splits_are_disjoint_and_in_order():
    """Training, validation, development, evaluation and data sets share no world seed."""
    assert max(TRAINING_SEEDS) < min(VALIDATION_SEEDS)
    assert max(VALIDATION_SEEDS) < min(DEVELOPMENT_SEEDS)
    assert max(DEVELOPMENT_SEEDS) < EVALUATION_START
    assert evaluation_world(EVALUATIONS - 1, EVALUATIONS - 1) < DATASET_START


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
