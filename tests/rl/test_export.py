"""The exported policy gives the same actions as ours."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from andabata.models import shipped_policy
from rl.driving import DRIVING_NOISE, DRIVING_REPEAT
from rl.export import PolicyExportError, policy_to_onnx
from rl.networks import Actor, DeterministicActor
from rl.point_set_actor import PointSetActor
from rl.policy import with_info
from rl.spaces import ActionSpec, ObservationSpec
from tests.support.known_environments import TARGETS, TWO_ACTIONS
from tests.support.point_sets import ACTIONS as POINT_ACTIONS
from tests.support.point_sets import observation, point_observations, with_points

onnx = pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed (extra `onnx`)")

CPU = ["CPUExecutionProvider"]


def run(policy, states):
    session = runtime.InferenceSession(policy_to_onnx(policy), providers=CPU)
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


def test_the_model_tells_the_noise_that_it_lacks():
    """A deterministic actor is the same in ONNX but for the noise, which the metadata names."""
    policy = DeterministicActor(TARGETS, TWO_ACTIONS, (8,)).policy({DRIVING_NOISE: 0.3})
    states = np.random.default_rng(0).uniform(-1, 1, (100, 2)).astype(np.float32)
    np.testing.assert_allclose(
        run(policy, states), [policy.act(state) for state in states], atol=1e-6
    )
    for one, expected in ((policy, "0.3"), (with_info(policy, {}), None)):
        model = onnx.load_from_string(policy_to_onnx(one))
        about = {row.key: row.value for row in model.metadata_props}
        assert about.get("driving_noise") == expected


def test_the_model_tells_how_long_an_action_is_held():
    """The metadata names it where it is more than a step."""
    policy = DeterministicActor(TARGETS, TWO_ACTIONS, (8,)).policy({DRIVING_REPEAT: 5})
    for one, expected in ((policy, "5"), (with_info(policy, {}), None)):
        model = onnx.load_from_string(policy_to_onnx(one))
        about = {row.key: row.value for row in model.metadata_props}
        assert about.get("driving_repeat") == expected


def test_another_architecture_is_refused():
    """A policy of another architecture is refused by its name."""
    with pytest.raises(PolicyExportError, match="or a policy on points, got a policy 'gru'"):
        policy_to_onnx(SimpleNamespace(architecture="gru"))


@pytest.fixture(scope="module")
def point_policy():
    torch.manual_seed(0)
    actor = PointSetActor(point_observations(120), POINT_ACTIONS, (32, 32))
    # Larger weights: actions over the whole range.
    for parameter in actor.linear.parameters():
        parameter.data.mul_(3.0)
    return actor.policy({})


def run_points(session, space, rows):
    columns = space.columns(("goal", "velocity"))
    feed = {
        "points": rows[:, space.slice_of("points")].reshape(len(rows), -1, 2),
        "mask": rows[:, space.slice_of("mask")],
        "goal": rows[:, columns],
    }
    return session.run(["action"], feed)[0]


def test_one_model_takes_any_number_of_points(point_policy):
    """The same model gives the policy's actions for 10, 120 and 1080 points, masked ones too."""
    session = runtime.InferenceSession(policy_to_onnx(point_policy), providers=CPU)
    rng = np.random.default_rng(0)
    for n in (10, 120, 1080):
        policy = with_points(point_policy, n)
        rows = np.array([observation(n, rng) for _ in range(50)])
        rows[:3, policy.observations.slice_of("mask")] = 0  # No point at all.
        expected = np.array([policy.act(row) for row in rows])
        assert np.ptp(expected, axis=0).min() > 0.05
        found = run_points(session, policy.observations, rows)
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_perceptron_of_some_terms_is_exported():
    """The model takes the whole observation and reads the policy's terms."""
    space = point_observations(8)
    policy = Actor(space, POINT_ACTIONS, (16,), ("windows", "velocity")).policy({})
    rng = np.random.default_rng(0)
    rows = np.array([observation(8, rng) for _ in range(50)])
    np.testing.assert_allclose(run(policy, rows), [policy.act(row) for row in rows], atol=1e-6)
