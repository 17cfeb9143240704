"""Soft actor-critic: learns known answers, one action or two, with the textbook's targets."""

import numpy as np
import pytest
import torch

from rl.export import policy_to_onnx
from rl.policy import policy_from_bytes
from rl.sac import SacConfig, SoftActorCritic
from rl.training import EpisodeSpec, play
from tests.support.known_environments import TARGETS, TWO_ACTIONS, MatchTargets, TurnToGoal
from tests.support.small_learners import (
    ACTIONS,
    OBSERVATIONS,
    batch,
    copies,
    moved,
    share_facing_the_goal,
    train,
)


def test_it_learns_to_face_the_goal():
    """The learnt policy turns to the goal in nine of ten new episodes."""
    config = SacConfig(
        hidden=(32, 32),
        reward_scale=0.1,
        batch_size=64,
        updates_per_step=0.6,
        learning_rate=3e-3,
        ema_rate=0.01,
    )
    learner = SoftActorCritic(OBSERVATIONS, ACTIONS, config, seed=3)
    train(learner, TurnToGoal(), 12, 4, repeat=2)
    assert share_facing_the_goal(learner.policy({})) >= 0.9


@pytest.fixture(scope="module")
def two_actions():
    torch.manual_seed(0)
    config = SacConfig(
        hidden=(32,),
        gamma=0.1,
        reward_scale=1.0,
        batch_size=64,
        updates_per_step=1.0,
        learning_rate=5e-3,
        ema_rate=0.01,
        temperature=0.02,
        target_entropy=-3.0,
    )
    learner = SoftActorCritic(TARGETS, TWO_ACTIONS, config, seed=1)
    train(learner, MatchTargets(), 16, 5)
    return learner


def test_two_actions_are_learnt_each_its_own(two_actions):
    """Each action follows its own target, in the order of the spec and in SI units."""
    policy = two_actions.policy({})
    targets = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 2)).astype(np.float32)
    shares = np.array([policy.best(target) for target in targets])
    assert shares.shape == (200, 2)
    assert np.abs(shares - targets).mean(axis=0).max() < 0.15
    values = np.array([policy.act(target) for target in targets])
    np.testing.assert_allclose(values, TWO_ACTIONS.scaled(shares))
    assert np.abs(values[:, 0] - (0.2 + 0.2 * targets[:, 0])).mean() < 0.03
    assert np.abs(values[:, 1] - 0.5 * targets[:, 1]).mean() < 0.08


def test_two_actions_survive_the_file(two_actions):
    """A policy of two actions comes back from its bytes with both spaces and the same actions."""
    policy = two_actions.policy({"stage": "match"})
    again = policy_from_bytes(policy.to_bytes())
    assert (again.observations, again.actions) == (TARGETS, TWO_ACTIONS)
    for target in np.random.default_rng(1).uniform(-1, 1, (20, 2)).astype(np.float32):
        np.testing.assert_array_equal(again.act(target), policy.act(target))


def test_two_actions_are_exported(two_actions):
    """The ONNX model of a policy of two actions gives the same values in SI units."""
    pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
    runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
    policy = two_actions.policy({})
    targets = np.random.default_rng(1).uniform(-1, 1, (50, 2)).astype(np.float32)
    session = runtime.InferenceSession(policy_to_onnx(policy), providers=["CPUExecutionProvider"])
    (found,) = session.run(["action"], {"observation": targets})
    np.testing.assert_allclose(found, [policy.act(one) for one in targets], atol=1e-5)


def test_two_actions_resume(two_actions):
    """A restored learner of two actions makes the same update, to the bit."""
    again = SoftActorCritic(TARGETS, TWO_ACTIONS, two_actions.config, seed=7)
    again.restore(two_actions.to_bytes({}, {}))
    episodes = [play(MatchTargets(), again.behaviour_policy(), 1, EpisodeSpec(0, (8, 8)))]
    first = two_actions.to_bytes({}, {})
    figures = [
        learner.update(episodes, np.random.default_rng(2)) for learner in (two_actions, again)
    ]
    assert figures[0] == figures[1]
    assert two_actions.to_bytes({}, {}) == again.to_bytes({}, {}) != first


def small(**changes):
    settings = {"hidden": (8,), "batch_size": 8, "learning_rate": 1e-3, **changes}
    return SoftActorCritic(OBSERVATIONS, ACTIONS, SacConfig(**settings), seed=2)


@pytest.mark.parametrize("terminated", [0.0, 1.0])
def test_the_soft_bellman_target(terminated):
    """The critics learn r + gamma (1 - end) (min of both targets - alpha log p)."""
    learner, one = small(gamma=0.5, temperature=0.3), batch(reward=2.0, terminated=terminated)
    with torch.no_grad():
        noise = torch.Generator().manual_seed(4)
        actions, log_p = learner.actor.sample(one["next_states"], noise)
        next_q = learner.targets(one["next_states"], actions)
        target = 2.0 + 0.5 * (1 - terminated) * (torch.minimum(*next_q) - 0.3 * log_p)
        q = learner.critics(one["states"], one["actions"])
        loss = torch.nn.functional.smooth_l1_loss(q, target.expand_as(q))
    figures = learner._update(one, torch.Generator().manual_seed(4))
    assert float(figures[0]) == pytest.approx(float(loss), rel=1e-5)
    assert float(figures[1]) == pytest.approx(float(q.mean()), rel=1e-5)


def test_the_temperature_seeks_the_target_entropy():
    """The temperature rises while the entropy is below its target, and falls above it."""
    for target, sign in ((5.0, 1), (-20.0, -1)):
        learner = small(target_entropy=target)
        before = float(learner.log_temperature.detach())
        learner._update(batch(), torch.Generator().manual_seed(4))
        assert sign * (float(learner.log_temperature.detach()) - before) > 0


def test_the_actor_climbs_the_critics():
    """A step of the actor raises the value of its own actions, and moves no critic."""
    learner = small(temperature=1e-6, learning_rate=1e-3)
    with torch.no_grad():
        for tensors in (learner.critics, learner.targets):
            for parameter in tensors.parameters():
                parameter.mul_(3.0)
    states = batch(256)["states"]

    def value():
        with torch.no_grad():
            actions, _ = learner.actor.sample(states, torch.Generator().manual_seed(9))
            return float(learner.critics(states, actions).amin(dim=0).mean())

    for group in learner._optimisers["critics"].param_groups:
        group["lr"] = 0.0
    before = value()
    for k in range(30):
        learner._update(batch(64), torch.Generator().manual_seed(k))
    assert value() > before
    assert all(parameter.requires_grad for parameter in learner.critics.parameters())


def test_targets_and_average_follow_slowly():
    """After a step the targets moved by ``tau`` to the critics, the average by ``ema_rate``."""
    learner = small(tau=0.25, ema_rate=0.125)
    old_target = [p.clone() for p in learner.targets.parameters()]
    old_average = [p.clone() for p in learner.average.parameters()]
    learner._update(batch(), torch.Generator().manual_seed(4))
    for old, new, online in zip(
        old_target, learner.targets.parameters(), learner.critics.parameters(), strict=True
    ):
        torch.testing.assert_close(new, old + 0.25 * (online - old))
    for old, new, online in zip(
        old_average, learner.average.parameters(), learner.actor.parameters(), strict=True
    ):
        torch.testing.assert_close(new, old + 0.125 * (online - old))


def test_the_seed_gives_the_weights():
    """Equal seeds give equal learners, other seeds others, whatever torch's global state."""
    first = small().to_bytes({}, {})
    torch.manual_seed(99)
    assert small().to_bytes({}, {}) == first
    other = SoftActorCritic(OBSERVATIONS, ACTIONS, small().config, seed=3)
    assert other.to_bytes({}, {}) != first


def test_targets_and_average_begin_as_their_networks():
    """At the start the targets equal the critics and the average the actor."""
    learner = small()
    state = TurnToGoal().reset(seed=0)[0]
    np.testing.assert_array_equal(
        learner.policy({}).act(state), learner.behaviour_policy().act(state)
    )
    for a, b in zip(learner.targets.parameters(), learner.critics.parameters(), strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=0)


def test_the_settings_of_the_shipped_policy():
    """The defaults are those with which the shipped policy was trained."""
    assert SacConfig().model_dump() == {
        "algorithm": "sac",
        "hidden": (200, 200),
        "action_repeat": 5,
        "episodes_per_iteration": 8,
        "device": "cpu",
        "driving_noise": 0.0,
        "driving_repeat": 1,
        "learning_rate": 5e-4,
        "gamma": 0.98,
        "tau": 0.005,
        "batch_size": 256,
        "updates_per_step": 0.3,
        "target_entropy": -0.5,
        "temperature": 0.1,
        "ema_rate": 0.001,
        "reward_scale": 0.02,
        "buffer_size": 200_000,
        "actor": {"kind": "mlp", "width": 64, "features": 20},
        "actor_terms": None,
        "critic_terms": None,
        "critic_hidden": None,
        "normalised": True,
        "loss": "huber",
        "policy_delay": 1,
        "warmup_episodes": 0,
        "state_value": False,
        "learn_temperature": True,
        "min_temperature": 0.0,
    }


def test_the_actor_steps_for_every_mth_step_of_the_critics():
    """With ``policy_delay`` 3 the actor, its average and the temperature move in steps 0, 3, 6."""
    learner = small(policy_delay=3, updates_per_step=0.07)
    episode = play(TurnToGoal(), learner.behaviour_policy(), 1, EpisodeSpec(0, (1,)))
    step, steps = learner._update, []

    def watched(*arguments):
        parts = (learner.actor, learner.average, learner.critics, learner.targets)
        before, alpha = [copies(part) for part in parts], float(learner.log_temperature.detach())
        figures = step(*arguments)
        has_moved = [moved(a.parameters(), b) for a, b in zip(parts, before, strict=True)]
        steps.append([*has_moved, float(learner.log_temperature.detach()) != alpha])
        assert bool(figures[2] != 0) == has_moved[0]
        return figures

    learner._update = watched
    # Seven steps an update: the count goes on from one update to the next.
    for _ in range(2):
        learner.update([episode], np.random.default_rng(0))
    expected = [[k % 3 == 0, k % 3 == 0, True, True, k % 3 == 0] for k in range(14)]
    assert steps == expected


def test_the_count_of_the_steps_is_resumed():
    """A restored learner takes its actor's steps at the same counts."""
    learner, again = (small(policy_delay=3, updates_per_step=0.02) for _ in range(2))
    episode = play(TurnToGoal(), learner.behaviour_policy(), 1, EpisodeSpec(0, (1,)))
    learner.update([episode], np.random.default_rng(0))
    again.restore(learner.to_bytes({}, {}))
    for one in (learner, again):
        one.update([episode], np.random.default_rng(1))
    assert again.to_bytes({}, {}) == learner.to_bytes({}, {})


def test_a_fixed_temperature_stays():
    """Without learning the temperature is what it was, whatever the entropy."""
    learner = small(learn_temperature=False, target_entropy=5.0)
    before = float(learner.log_temperature.detach())
    learner._update(batch(), torch.Generator().manual_seed(4))
    assert float(learner.log_temperature.detach()) == before


def test_the_temperature_has_a_floor():
    """The temperature that falls stops at its least value."""
    learner = small(temperature=0.05, min_temperature=0.0499, target_entropy=-20.0)
    free = small(temperature=0.05, target_entropy=-20.0)
    for k in range(5):
        for one in (learner, free):
            one._update(batch(), torch.Generator().manual_seed(k))
    assert float(learner.log_temperature.detach().exp()) == pytest.approx(0.0499)
    assert float(free.log_temperature.detach().exp()) < 0.0499


@pytest.mark.parametrize("terminated", [0.0, 1.0])
def test_the_target_with_the_value_of_states(terminated):
    """With a network of the state's value, Q learns r + gamma (1 - end) of its target network."""
    learner = small(gamma=0.5, state_value=True, tau=0.25)
    one = batch(reward=2.0, terminated=terminated)
    with torch.no_grad():
        target = 2.0 + 0.5 * (1 - terminated) * learner.targets(one["next_states"])
        q = learner.critics(one["states"], one["actions"])
        loss = torch.nn.functional.smooth_l1_loss(q, target.expand_as(q))
    old = copies(learner.targets)
    figures = learner._update(one, torch.Generator().manual_seed(4))
    assert float(figures[0]) == pytest.approx(float(loss), rel=1e-5)
    for before, new, online in zip(
        old, learner.targets.parameters(), learner.state_value.parameters(), strict=True
    ):
        torch.testing.assert_close(new, before + 0.25 * (online - before))


@pytest.mark.parametrize("loss", ["squared", "huber"])
def test_the_loss_of_all_critics_is_that_of_the_settings(loss):
    """Errors well beyond 1 tell the two apart; the value of states takes the same one."""
    learner = small(loss=loss, state_value=True)
    one, taken = batch(reward=30.0, terminated=1.0), {}
    learner._step = lambda name, value: taken.setdefault(name, float(value.detach()))
    with torch.no_grad():
        error = 30.0 - learner.critics(one["states"], one["actions"])
        learner.state_value.weights[-1].zero_()
        learner.state_value.biases[-1].fill_(50.0)
    assert float(error.min()) > 1.0
    learner._update(one, torch.Generator().manual_seed(4))
    expected = error**2 if loss == "squared" else error - 0.5
    assert taken["critics"] == pytest.approx(2 * float(expected.mean()), rel=1e-5)
    # The critics' own values are small beside 50.
    assert taken["state_value"] == pytest.approx(50.0**2 if loss == "squared" else 49.5, rel=0.1)


@pytest.mark.parametrize("normalised", [True, False])
def test_hidden_layers_of_all_critics_are_normalised_or_not(normalised):
    """A first layer ten times as large changes the values of a plain network alone."""
    learner, one = small(normalised=normalised, state_value=True), batch()
    twins = SoftActorCritic(
        OBSERVATIONS, ACTIONS, learner.config.model_copy(update={"state_value": False}), seed=2
    )
    states, actions = one["states"], one["actions"]
    networks = (
        (learner.critics, (states, actions)),
        (twins.targets, (states, actions)),
        (learner.state_value, (states,)),
        (learner.targets, (states,)),
    )
    for network, inputs in networks:
        with torch.no_grad():
            before = network(*inputs)
            network.weights[0].mul_(10.0)
            network.biases[0].mul_(10.0)
            after = network(*inputs)
        assert torch.allclose(before, after, rtol=1e-3, atol=1e-3) == normalised


def test_the_value_of_a_state_is_the_actors_own():
    """The state's value comes to be the mean of min Q - alpha log p over the actor's actions."""
    learner = small(state_value=True, temperature=0.3, learning_rate=1e-2)
    states = batch()["states"]
    for name in ("actor", "critics", "temperature"):
        learner._set_learning_rate(name, 0.0)
    for k in range(300):
        learner._update(batch(), torch.Generator().manual_seed(k))
    with torch.no_grad():
        noise, found = torch.Generator().manual_seed(1), []
        for _ in range(400):
            actions, log_p = learner.actor.sample(states, noise)
            found.append(learner.critics(states, actions).amin(dim=0) - 0.3 * log_p)
        expected = torch.stack(found).mean(dim=0)
        assert float((learner.state_value(states) - expected).abs().mean()) < 0.1
