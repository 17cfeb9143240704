"""Imitation of the teacher: what is fitted, mirror images, the same again, and going on."""

import numpy as np
import pytest

from andabata.navigation.map_observation import action_table
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.training.imitation import (
    ImitationConfig,
    beyond_best,
    dearest,
    fit,
    imitate,
    judge_decisions,
)
from andabata.training.map_labels import MapLabels, MapLabelsConfig
from rl.policies.crop_prices import CropPricesPolicy
from tests.support.room_policies import window_policy

DRIVING = MapLabelsConfig(
    presets=("natural-test",), goals=1, terminations=TerminationConfig(time_limit=4.0)
)
TINY = ImitationConfig(
    driving=DRIVING, drives=(1, 1), teacher_shares=(1.0, 0.0), hidden=(16,), epochs=1
)
SPEC = DRIVING.observations
TABLE = action_table(DRIVING.simulated_robot.robot)


def labels_that_turn_to_the_goal(count=400):
    """Return labels whose cheapest action turns to the side of the goal."""
    rng = np.random.default_rng(0)
    seen = np.zeros((count, SPEC.size), dtype=np.float16)
    side = rng.uniform(-1, 1, count)
    seen[:, SPEC.slice_of("goal").start + 1] = side
    prices = 2.0 * np.abs(TABLE[None, :, 1] - 0.5 * side[:, None]) + 5.0
    return MapLabels(seen, prices.astype(np.float32))


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


def test_decisions_are_judged_by_the_policy_that_has_not_learned_from_them(tmp_path):
    """The labels are the last round's, the policy that of the round before."""
    config = ImitationConfig(
        driving=DRIVING, hidden=(32,), epochs=20, batch_size=25, learning_rate=3e-3
    )
    labels = labels_that_turn_to_the_goal()
    away = MapLabels(labels.observations[:50], labels.prices[:50][:, ::-1])
    about = {"config": config.model_dump(mode="json")}
    policies = [fit(labels, config, 0, about), fit(away, config, 0, about)]
    for k, (one, policy) in enumerate(zip((labels, away), policies, strict=True)):
        np.savez(tmp_path / f"round-{k}.npz", **one._asdict())
        (tmp_path / f"round-{k}.safetensors").write_bytes(policy.to_bytes())
    judged = judge_decisions(tmp_path)
    np.testing.assert_array_equal(judged.labels.prices, away.prices)
    seen = away.observations.astype(np.float32)
    np.testing.assert_array_equal(judged.given[3], policies[0].prices(seen[3]))
    choice = int(judged.given[3].argmin())
    assert judged.regrets[3] == away.prices[3, choice] - away.prices[3].min()
    assert judged.regrets.mean() > 0.2
    (tmp_path / "round-1.safetensors").unlink()
    assert judge_decisions(tmp_path).regrets.mean() < 0.1
    (tmp_path / "round-0.safetensors").unlink()
    with pytest.raises(ValueError, match="andabata policy imitate --out"):
        judge_decisions(tmp_path)
    (tmp_path / "round-0.safetensors").write_bytes(window_policy("td3").to_bytes())
    with pytest.raises(ValueError, match="got a policy of architecture deterministic"):
        judge_decisions(tmp_path)


def test_the_dearest_decisions_are_of_different_times():
    """The neighbours of a dear one are left out."""
    regrets = np.array([0.0, 5.0, 6.0, 4.0, 1.0, 3.0, 0.5], dtype=np.float32)
    assert dearest(regrets, 3, apart=2) == [2, 5, 0]
    assert dearest(regrets, 1) == [2]
