"""The trained parts of a robot: shipped or given, by file or by bytes."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from andabata.evaluation.room_drives import drive_tasks
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig, cell_task, judged_task, tasks_of
from andabata.models import Models, shipped_forest, shipped_ground_classifier, shipped_policy
from andabata.training.plans import load_plan
from rl.driving import driving_noise
from rl.goal_laws import HeadingPolicy
from rl.policy import with_info
from traversability.cartesian.classifier import (
    GroundClassifier,
    GroundClassifierConfig,
    GroundSamples,
    train_stage,
)
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.features import GROUND_FEATURES
from worlds.rooms.catalogue import make_room


@pytest.fixture(scope="module")
def others():
    """Return a ground classifier that is not the shipped one."""
    rng = np.random.default_rng(0)
    stages = []
    for names in (GROUND_FEATURES, CONTEXT_FEATURES):
        features = rng.uniform(0, 1, (500, len(names))).astype(np.float32)
        samples = GroundSamples(features, features[:, 0] > 0.5, np.zeros(500, bool))
        stages.append(train_stage(samples, names, GroundClassifierConfig(trees=2), 0))
    return GroundClassifier(*stages, 0.1)


def test_what_is_not_given_is_shipped(tmp_path, others):
    """A file replaces the shipped model of its kind and no other."""
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


def test_forest_and_policy_are_read_from_files(tmp_path):
    """A policy and a forest of files are those of the robot."""
    policy = with_info(shipped_policy(), {"name": "another"})
    (tmp_path / "policy.safetensors").write_bytes(policy.to_bytes())
    (tmp_path / "forest.npz").write_bytes(shipped_forest().to_bytes())
    models = Models.load(tmp_path / "forest.npz", policy=tmp_path / "policy.safetensors")
    assert models.policy.info == {"name": "another"}
    assert models.forest.to_bytes() == shipped_forest().to_bytes()
    assert models.ground_classifier is shipped_ground_classifier()


def test_models_survive_bytes_and_their_hashes_differ(others):
    """The hash of each file is its SHA-256, so that one changed model changes one hash."""
    models = replace(Models(), ground_classifier=others)
    again = Models.from_bytes(models.to_bytes())
    assert again.to_bytes() == models.to_bytes()
    shipped, given = Models().hashes, again.hashes
    assert given == models.hashes
    assert [name for name in shipped if shipped[name] != given[name]] == ["ground_classifier"]
    assert given["ground_classifier"] == hashlib.sha256(others.to_bytes()).hexdigest()


def test_shipped_policies_differ():
    """Each is the policy of its own scheme."""
    names = ("policy", "actor-critic", "imitation")
    assert len({shipped_policy(name).to_bytes() for name in names}) == 3


@pytest.mark.parametrize(("task", "room"), [("spn", "random-7300"), ("td3", "clutter-7300")])
def test_shipped_policies_drive_in_rooms_that_no_training_holds(task, room):
    """Of 20 random starts they reach most goals, where a law that sees nothing reaches few."""
    config = RoomEvaluationConfig(task=judged_task(task), rooms=(room,), pairs=20)
    policy, tasks = shipped_policy(task), tasks_of(make_room(room), config)
    cell = Cell(task, "trained", room, "reactive")
    law = HeadingPolicy({}, config.task.observations, config.task.actions)
    ours, blind = (
        [drive.outcome for drive in drive_tasks(one, cell_task(cell, config, one), tasks)]
        for one in (policy, law)
    )
    assert ours.count("goal") >= 14
    assert blind.count("goal") < ours.count("goal") - 4


def test_the_shipped_policy_of_td3_keeps_its_noise():
    """It was trained by the plan as it is, and drives with the plan's noise."""
    policy = shipped_policy("td3")
    assert driving_noise(policy) == 0.3
    learner = load_plan(task="td3").learner
    # Settings that came later have, in a description without them, the values of before.
    assert type(learner).model_validate(policy.info["config"]["learner"]) == learner


def test_a_policy_that_is_not_shipped_names_the_next_step():
    """The error says how to get a policy of one's own."""
    with pytest.raises(ValueError, match="policy moon: expected one that comes with the package"):
        shipped_policy("moon")
