"""Decisions of a student: judged by whom, and which are shown."""

import numpy as np
import pytest

from andabata.training.imitation import ImitationConfig, fit
from andabata.training.judged_decisions import dearest, judge_decisions
from andabata.training.map_labels import MapLabels
from tests.support.labels import DRIVING, labels_that_turn_to_the_goal
from tests.support.room_policies import window_policy


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
