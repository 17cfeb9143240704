"""The deterministic perceptron: equal to torch and ONNX, and how it explores."""

import numpy as np
import pytest
import torch

from rl.export import policy_to_onnx
from rl.networks import DeterministicActor
from rl.policies.deterministic import DeterministicPolicy
from rl.policy import policy_from_bytes, with_info, with_observations
from rl.spaces import ObservationSpec, ObservationTerm
from tests.support.known_environments import TARGETS, TWO_ACTIONS
from tests.support.point_sets import ACTIONS, observation, point_observations

TERMS = ("windows", "goal", "velocity")
SPACE = ObservationSpec(
    terms=(ObservationTerm(name="ranges", shape=(2,), low=0.0, high=10.0, unit="m"),)
)


@pytest.fixture(scope="module")
def actor():
    torch.manual_seed(0)
    found = DeterministicActor(point_observations(8), ACTIONS, (24, 16), TERMS)
    # Larger weights: actions over the whole range.
    for parameter in found.parameters():
        parameter.data.mul_(2.0)
    return found


def rows(n=50, points=8):
    rng = np.random.default_rng(0)
    return np.array([observation(points, rng) for _ in range(n)])


def test_it_equals_torch(actor):
    """The best shares are the network's outputs, and actions are those shares in SI units."""
    policy = actor.policy({})
    with torch.no_grad():
        expected = actor(torch.from_numpy(rows())).numpy()
    assert np.ptp(expected, axis=0).min() > 0.3
    np.testing.assert_allclose(policy.best_many(rows()), expected, atol=1e-6)
    found = np.array([policy.act(row) for row in rows()])
    np.testing.assert_allclose(found, ACTIONS.scaled(expected), atol=1e-6)


def test_a_file_comes_back(actor):
    """The file names architecture and terms, and gives the same actions."""
    policy = actor.policy({"stage": "x"})
    again = policy_from_bytes(policy.to_bytes())
    assert (again.architecture, again.terms, again.info) == ("deterministic", TERMS, policy.info)
    np.testing.assert_array_equal(again.best_many(rows()), policy.best_many(rows()))


def test_other_terms_may_change(actor):
    """A policy that reads windows drives with any number of points beside them."""
    policy = actor.policy({})
    other = with_observations(policy, point_observations(30))
    many, few = rows(points=30), rows()
    for name in TERMS:
        few[:, policy.observations.slice_of(name)] = many[:, other.observations.slice_of(name)]
    np.testing.assert_array_equal(other.best_many(many), policy.best_many(few))


def test_it_is_exported(actor):
    """The ONNX model takes the whole observation and gives the same actions."""
    pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
    runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
    policy = actor.policy({})
    session = runtime.InferenceSession(policy_to_onnx(policy), providers=["CPUExecutionProvider"])
    (found,) = session.run(["action"], {"observation": rows()})
    np.testing.assert_allclose(found, [policy.act(row) for row in rows()], atol=1e-5)


def test_outputs_are_actions_alone():
    """A last layer with a spread for each action is refused."""
    weights = {"layer0.weight": np.zeros((4, 2), np.float32), "layer0.bias": np.zeros(4, "f4")}
    with pytest.raises(ValueError, match=r"expected action of each action as outputs \(2\), got 4"):
        DeterministicPolicy(weights, TARGETS, TWO_ACTIONS)


def constant(means=(0.0, 0.0), **exploration):
    """Return a policy whose best actions do not depend on two ranges."""
    weights = {
        "layer0.weight": np.zeros((2, 2), np.float32),
        "layer0.bias": np.array(means, np.float32),
    }
    return DeterministicPolicy(weights, SPACE, ACTIONS, {"exploration": exploration})


FAR, NEAR = np.full(2, 5.0, np.float32), np.array([5.0, 0.3], np.float32)
TURNS = {"term": "ranges", "near_range": 0.6, "probability": 0.15, "steps": (8, 14)}


def test_the_noise_is_normal_around_the_best_action():
    """Explored shares have the best share as mean and ``sigma`` as spread, after tanh."""
    policy, rng = constant((0.3, -0.2), sigma=0.05), np.random.default_rng(0)
    drawn = np.array([policy.explore(FAR, rng) for _ in range(4000)])
    np.testing.assert_allclose(drawn.mean(axis=0), np.tanh([0.3, -0.2]), atol=0.004)
    np.testing.assert_allclose(drawn.std(axis=0), 0.05, rtol=0.05)
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 0.05


def test_noisy_actions_stay_within_bounds():
    """Much noise is clipped to shares from -1 to 1."""
    policy, rng = constant(sigma=1.0), np.random.default_rng(0)
    drawn = np.array([policy.explore(FAR, rng) for _ in range(500)])
    assert (np.abs(drawn).max(axis=0) == 1.0).all()
    assert 0.25 < (np.abs(drawn) == 1.0).mean() < 0.39  # Beyond one sigma: 0.317.


def test_a_policy_without_noise_does_its_best():
    """Without a description of noise, and after it is replaced, nothing is explored."""
    noisy = constant((0.3, -0.2), sigma=0.5)
    silent = with_info(noisy, {"stage": "x"})
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(silent.explore(FAR, rng), noisy.best(FAR))
    assert (noisy.explore(FAR, rng) != noisy.best(FAR)).all()


def test_the_noise_survives_the_file():
    """A policy of bytes, as other processes get it, explores the same."""
    policy = constant((0.3, -0.2), sigma=0.2, random_turns=TURNS)
    again = policy_from_bytes(policy.to_bytes())
    rngs = [np.random.default_rng(3) for _ in range(2)]
    for state in [FAR, NEAR] * 20:
        found = [one.explore(state, rng) for one, rng in zip((policy, again), rngs, strict=True)]
        np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("wrong", [{"sigma": -1.0}, {"random_turns": {**TURNS, "term": "sonar"}}])
def test_impossible_noise_is_refused(wrong):
    """Negative noise, and turns by a term that the observation lacks."""
    with pytest.raises((ValueError, KeyError), match=r"sigma|sonar"):
        constant(**wrong)


def turning(states, seed=0, **changes):
    """Return where a robot turns on the spot, and its yaw rates."""
    policy = constant((0.5, 0.0), random_turns={**TURNS, **changes})
    rng = np.random.default_rng(seed)
    found = np.array([policy.explore(state, rng) for state in states])
    return found[:, 0] == -1.0, found[:, 1]


def test_a_turn_is_held_with_one_rate_and_no_speed():
    """A turn stops the robot for 8 to 14 decisions with a yaw rate of its own, wherever it is."""
    is_turning, rates = turning([NEAR] + [FAR] * 20, probability=1.0)
    count = int(is_turning.sum())
    assert is_turning[:count].all()
    assert 8 <= count <= 14
    assert len(set(rates[:count])) == 1
    assert rates[0] != 0.0
    assert (rates[count:] == 0.0).all()
    lengths = {
        int(turning([NEAR] + [FAR] * 20, seed, probability=1.0)[0].sum()) for seed in range(99)
    }
    assert lengths == set(range(8, 15))


def test_turns_begin_near_obstacles_alone_with_their_probability():
    """Far away none begins; near an obstacle one in ``1 / probability`` decisions begins one."""
    assert not turning([FAR] * 500)[0].any()
    is_turning, _ = turning([NEAR] * 4000, steps=(1, 1))
    assert is_turning.mean() == pytest.approx(0.15, abs=0.02)


def test_robots_turn_each_for_itself():
    """Rows together give the actions of each alone, to the bit, also while turns are made."""
    policy, alone = (constant(sigma=0.3, random_turns=TURNS) for _ in range(2))
    rngs, own = ([np.random.default_rng(k) for k in range(5)] for _ in range(2))
    for step in range(60):
        states = np.array([NEAR if (step + k) % 3 else FAR for k in range(5)])
        many = policy.explore_many(states, rngs)
        for k in range(5):
            np.testing.assert_array_equal(many[k], alone.explore(states[k], own[k]))
    with pytest.raises(ValueError, match="zip"):
        policy.explore_many(states, rngs[:4])
