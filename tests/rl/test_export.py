"""The exported policy gives the same actions as ours."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.models import shipped_policy
from rl.export import ExportError, policy_to_onnx
from rl.networks import Actor
from rl.spaces import ActionSpec, ObservationSpec
from tests.known_environments import TARGETS, TWO_ACTIONS

onnx = pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed (extra `onnx`)")


def run(policy, states):
    session = runtime.InferenceSession(policy_to_onnx(policy), providers=["CPUExecutionProvider"])
    return session.run(["action"], {"observation": states})[0]


def test_the_shipped_policy_is_the_same_in_onnx():
    """Over the whole space, in crowded and in open places, the yaw rate is the same."""
    policy, rng = shipped_policy(), np.random.default_rng(0)
    low, high = policy.observations.bounds()
    states = rng.uniform(low, high, (5_000, policy.observations.size)).astype(np.float32)
    states[:, :32] *= rng.uniform(0.05, 1, (5_000, 1))  # Crowded and open places.
    expected = np.array([policy.act(state) for state in states])
    assert np.abs(expected).max() > 0.4
    assert np.ptp(expected) > 0.8
    np.testing.assert_allclose(run(policy, states), expected, atol=1e-5)


def test_two_actions_are_exported():
    """Both actions come out in their order, in SI units of their own bounds."""
    policy = Actor(TARGETS, TWO_ACTIONS, (16, 16)).policy({})
    states = np.random.default_rng(0).uniform(-1, 1, (100, 2)).astype(np.float32)
    expected = np.array([policy.act(state) for state in states])
    found = run(policy, states)
    assert found.shape == (100, 2)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_the_model_holds_its_spaces():
    """The metadata of the model are both specs as JSON."""
    policy = Actor(TARGETS, TWO_ACTIONS, (4,)).policy({})
    model = onnx.load_from_string(policy_to_onnx(policy))
    about = {one.key: one.value for one in model.metadata_props}
    assert ObservationSpec.model_validate_json(about["observations"]) == TARGETS
    assert ActionSpec.model_validate_json(about["actions"]) == TWO_ACTIONS


def test_another_architecture_is_refused():
    """A policy that is no perceptron is refused by its name."""
    with pytest.raises(ExportError, match="expected a multilayer perceptron, got a policy 'gru'"):
        policy_to_onnx(SimpleNamespace(architecture="gru"))
