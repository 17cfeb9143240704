"""Imitation of the teacher: what is fitted, mirror images, the same again, and going on."""

import numpy as np
import pytest

from andabata.training.imitation import (
    ImitationConfig,
    beyond_best,
    fit,
    imitate,
    labelled_config,
    refit,
)
from andabata.training.map_labels import MapLabels
from rl.policies.crop_prices import CropPricesPolicy
from rl.policy import policy_from_bytes
from tests.support.labels import DRIVING, labels_that_turn_to_the_goal

TINY = ImitationConfig(
    driving=DRIVING, drives=(1, 1), teacher_shares=(1.0, 0.0), hidden=(16,), epochs=1
)
SPEC = DRIVING.observations


def test_prices_count_from_the_best_up_to_the_clip():
    """Whatever the rest of the way costs, and however bad an action is."""
    found = beyond_best(np.array([[7.0, 9.0, 40.0], [3.0, 2.0, 2.5]], dtype=np.float32), 6.0)
    np.testing.assert_array_equal(found, [[0, 2, 6], [1, 0, 0.5]])


def test_a_fit_finds_what_was_labelled():
    """A student of these labels turns to the goal's side; its regret falls."""
    config = ImitationConfig(
        driving=DRIVING, hidden=(32,), epochs=40, batch_size=25, learning_rate=3e-3
    )
    labels = labels_that_turn_to_the_goal()
    policy = fit(labels, config, 0, {})
    assert isinstance(policy, CropPricesPolicy)
    for side in (-0.8, 0.8):
        seen = np.zeros(SPEC.size, dtype=np.float32)
        seen[SPEC.slice_of("goal").start + 1] = side
        assert policy.act(seen)[1] * side > 0.25
    assert policy.info["regret"] < 0.1


def test_a_fit_goes_on_from_a_policy():
    """One pass from a fitted policy loses less than one from fresh weights."""
    labels = labels_that_turn_to_the_goal()
    config = ImitationConfig(driving=DRIVING, hidden=(16,), epochs=1, batch_size=50)
    first = fit(labels, config.model_copy(update={"epochs": 8}), 0, {})
    again, fresh = fit(labels, config, 1, {}, first), fit(labels, config, 1, {})
    assert again.info["loss"] < 0.8 * fresh.info["loss"]


def test_an_imitation_goes_on_and_is_the_same(tmp_path):
    """Whole drives: a student drives the second round; a round that is missing is made again."""
    calls = []
    policy, rounds = imitate(TINY, 3, tmp_path, on_drive=lambda *each: calls.append(each))
    assert calls == [(0, 1), (1, 1)]
    assert [one.round for one in rounds] == [0, 1]
    assert rounds[1].labels > rounds[0].labels > 0
    assert rounds[0].goals == 1
    (tmp_path / "round-1.npz").unlink()
    (tmp_path / "round-1.safetensors").unlink()
    again, _ = imitate(TINY, 3, tmp_path)
    for name, weights in policy.tensors().items():
        np.testing.assert_array_equal(weights, again.tensors()[name])


def test_drives_without_a_decision_are_refused():
    """There is nothing to learn from before the first scan."""
    empty = MapLabels(np.zeros((0, SPEC.size), np.float16), np.zeros((0, 19), np.float32))
    with pytest.raises(ValueError, match="got none"):
        fit(empty, TINY, 0, {})


def test_rounds_without_a_driver_are_refused():
    """By the setting's name."""
    with pytest.raises(ValueError, match="teacher_shares"):
        ImitationConfig(drives=(1,), teacher_shares=(0.5,))


def test_a_student_may_read_some_terms_alone(tmp_path):
    """What it does not read changes nothing; its file says so, and drives."""
    labels = labels_that_turn_to_the_goal(60)
    config = ImitationConfig(driving=DRIVING, hidden=(8,), epochs=1, reads=("map_far", "goal"))
    policy = fit(labels, config, 0, {})
    again = policy_from_bytes(policy.to_bytes())
    assert isinstance(again, CropPricesPolicy)
    assert again.terms == ("map_far", "goal")
    rng = np.random.default_rng(1)
    seen = rng.uniform(0.0, 1.0, (2, SPEC.size)).astype(np.float32)
    for name in again.terms:
        seen[1, SPEC.slice_of(name)] = seen[0, SPEC.slice_of(name)]
    np.testing.assert_array_equal(again.prices(seen[0]), again.prices(seen[1]))
    seen[1, SPEC.slice_of("map_far")] = 0.0
    assert not np.array_equal(again.prices(seen[0]), again.prices(seen[1]))


@pytest.mark.parametrize("reads", [("goal",), ("map_near",), ("map_near", "goal", "lidar")])
def test_a_student_reads_a_crop_and_numbers_that_there_are(reads):
    """Others are refused by the setting's name."""
    with pytest.raises(ValueError, match="reads: expected map_near, map_far or both"):
        ImitationConfig(driving=DRIVING, reads=reads)


def kept_rounds(folder, config, counts):
    """Write rounds of labels with those numbers of decisions, and the first one's policy."""
    for k, count in enumerate(counts):
        labels = labels_that_turn_to_the_goal(count)
        np.savez(folder / f"round-{k}.npz", **labels._asdict(), goals=4, reached=k)
    about = {"config": config.model_dump(mode="json")}
    (folder / "round-0.safetensors").write_bytes(fit(labels, config, 0, about).to_bytes())


def test_a_student_is_fitted_again_to_labels_that_are_there(tmp_path):
    """From fresh weights, to as many rounds as asked for, with the settings of their drives."""
    config = ImitationConfig(
        driving=DRIVING, drives=(2, 2), teacher_shares=(1.0, 0.0), hidden=(8,), epochs=1
    )
    kept_rounds(tmp_path, config, (30, 20))
    assert labelled_config(tmp_path) == config
    wide = config.model_copy(update={"hidden": (12,)})
    policy, result = refit(wide, 1, tmp_path)
    assert (result.labels, result.goals, result.reached) == (50, 4, 0.25)
    assert policy.tensors()["layer0.bias"].shape == (12,)
    first = config.model_copy(update={"drives": (2,), "teacher_shares": (1.0,)})
    assert refit(first, 1, tmp_path)[1].labels == 30


def test_labels_that_are_not_there_are_refused(tmp_path):
    """A folder without rounds, too few of them, and drives with other settings."""
    config = ImitationConfig(driving=DRIVING, drives=(2,), teacher_shares=(1.0,), hidden=(8,))
    with pytest.raises(ValueError, match="andabata policy imitate --out"):
        labelled_config(tmp_path)
    kept_rounds(tmp_path, config, (10,))
    more = config.model_copy(update={"drives": (2, 2), "teacher_shares": (1.0, 0.5)})
    with pytest.raises(ValueError, match="expected 2 finished rounds"):
        refit(more, 0, tmp_path)
    other = config.model_copy(update={"driving": DRIVING.model_copy(update={"goals": 3})})
    with pytest.raises(ValueError, match="leave `driving` as it is"):
        refit(other, 0, tmp_path)
