"""Options that name models: files, or the shipped ones."""

import pytest

from andabata.app.options.models import (
    ClassifierOptions,
    ForestOptions,
    ModelOptions,
    PolicyOptions,
)
from andabata.models import shipped_forest, shipped_ground_classifier, shipped_policy


def test_shipped_models_stand_in_for_missing_files(tmp_path):
    """A file takes the place of its own model only."""
    path = tmp_path / "forest.npz"
    path.write_bytes(shipped_forest().to_bytes())
    assert ForestOptions().load() is shipped_forest()
    assert PolicyOptions().load() is shipped_policy()
    for models in (ModelOptions(forest=path).load(), ClassifierOptions(forest=path).load()):
        assert models.forest is not shipped_forest()
        assert models.ground_classifier is shipped_ground_classifier()
        assert models.policy is shipped_policy()
    with pytest.raises(FileNotFoundError):
        ModelOptions(policy=tmp_path / "none").load()
