"""The trained parts of a robot: shipped or given, by file or by bytes."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.models import Models, shipped_forest, shipped_ground_classifier, shipped_policy
from andabata.navigation.guided import GuidedController
from traversability.cartesian.classifier import (
    GroundClassifier,
    GroundClassifierConfig,
    GroundSamples,
    train_stage,
)
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.features import GROUND_FEATURES


@pytest.fixture(scope="module")
def others():
    """Return ground_classifier that are not the shipped ones."""
    rng = np.random.default_rng(0)
    looks = []
    for names in (GROUND_FEATURES, CONTEXT_FEATURES):
        features = rng.uniform(0, 1, (500, len(names))).astype(np.float32)
        samples = GroundSamples(features, features[:, 0] > 0.5, np.zeros(500, bool))
        looks.append(train_stage(samples, names, GroundClassifierConfig(trees=2), 0))
    return GroundClassifier(*looks, 0.1)


def test_what_is_not_given_is_shipped(tmp_path, others):
    file = tmp_path / "ground_classifier.npz"
    file.write_bytes(others.to_bytes())
    models = Models.load(ground_classifier=file)
    assert models.forest is shipped_forest()
    assert models.policy is shipped_policy()
    assert (
        models.ground_classifier.to_bytes()
        == others.to_bytes()
        != shipped_ground_classifier().to_bytes()
    )
    assert Models.load() == Models()


def test_they_come_back_from_bytes_and_hashes_tell_them_apart(others):
    models = replace(Models(), ground_classifier=others)
    again = Models.from_bytes(models.to_bytes())
    assert again.to_bytes() == models.to_bytes()
    shipped, given = Models().hashes, again.hashes
    assert given == models.hashes
    assert [name for name in shipped if shipped[name] != given[name]] == ["ground_classifier"]


def test_a_controller_drives_with_the_squares_that_it_is_given(others):
    driver = make_controller(
        "learned", None, SimulatedRobotConfig(), replace(Models(), ground_classifier=others)
    )
    assert isinstance(driver, GuidedController)
    assert driver.local_planner.evidence.ground_classifier._forest is others
