"""What learners with a replay buffer share: counts, rates, situations, the warm-up, a resume."""

import numpy as np
import pytest
import torch

from rl.learners import make_learner
from rl.sac import SacConfig
from rl.spaces import steering_actions, steering_observations
from rl.td3 import Td3Config
from rl.training import Episode, EpisodeSpec, play
from tests.support.known_environments import TurnToGoal
from tests.support.point_sets import ACTIONS as POINT_ACTIONS
from tests.support.point_sets import observation, point_observations

OBSERVATIONS, ACTIONS = steering_observations(4, 10.0, 0.5), steering_actions(0.5)

LEARNERS = pytest.mark.parametrize("config", [SacConfig, Td3Config])


def small(config, seed=2, **changes):
    settings = {"hidden": (8,), "batch_size": 8, "learning_rate": 1e-3, **changes}
    return make_learner(config(**settings), OBSERVATIONS, ACTIONS, seed)


@LEARNERS
def test_the_number_of_gradient_steps_follows_the_decisions(config, monkeypatch):
    """There are ``updates_per_step`` gradient steps for each new decision, one at least."""
    learner, count = small(config, updates_per_step=0.3), []
    monkeypatch.setattr(learner, "_update", lambda *_: count.append(1) or torch.zeros(3))
    episode = play(TurnToGoal(), learner.behaviour_policy(), 2, EpisodeSpec(0, (1,)))
    assert len(episode.actions) == 50
    learner.update([episode, episode], np.random.default_rng(0))
    assert len(count) == 30
    assert len(learner.replay) == learner.replay.decisions == 100
    few = small(config, updates_per_step=0.001)
    monkeypatch.setattr(few, "_update", lambda *_: count.append(1) or torch.zeros(3))
    few.update([episode], np.random.default_rng(0))
    assert len(count) == 31


@LEARNERS
def test_the_figures_are_means_over_the_steps(config, monkeypatch):
    """Loss and value are means over all steps, the actor's figure over the actor's own."""
    learner = small(config, updates_per_step=0.1, policy_delay=2)
    steps = iter([(1.0, 10.0, 4.0), (3.0, 30.0, 0.0), (5.0, 50.0, 6.0), (7.0, 70.0, 0.0)] * 2)
    monkeypatch.setattr(learner, "_update", lambda *_: torch.tensor(next(steps)))
    episode = play(TurnToGoal(), learner.behaviour_policy(), 2, EpisodeSpec(0, (1,)))
    figures = learner.update([episode], np.random.default_rng(0))
    of_actor = {SacConfig: "entropy", Td3Config: "actor_value"}[config]
    found = figures["critic_loss"], figures["value"], figures[of_actor]
    assert found == pytest.approx(((1 + 3 + 5 + 7 + 1) / 5, (10 + 30 + 50 + 70 + 10) / 5, 14 / 3))


@LEARNERS
def test_the_learning_rate_is_scaled(config):
    """``lr_scale`` is a share of every optimiser's configured rate."""
    learner = small(config, learning_rate=1e-3)
    episode = play(TurnToGoal(), learner.behaviour_policy(), 50, EpisodeSpec(0, (1,)))
    learner.update([episode], np.random.default_rng(0), 0.25)
    rates = {g["lr"] for o in learner._optimisers.values() for g in o.param_groups}
    assert rates == {0.25e-3}


@LEARNERS
def test_rewards_are_scaled(config):
    """What is remembered are the rewards times their scale."""
    learner = small(config, reward_scale=0.25)
    episode = play(TurnToGoal(), learner.behaviour_policy(), 50, EpisodeSpec(0, (1,)))
    learner.update([episode], np.random.default_rng(0))
    np.testing.assert_allclose(
        learner.replay.tensors()["replay.rewards"], 0.25 * episode.rewards, rtol=1e-6
    )


def point_episode(n=12, rows=40, is_situation=False):
    rng = np.random.default_rng(0)
    states = np.array([observation(n, rng) for _ in range(rows)])
    kept = np.arange(rows, dtype=np.float32)[:, None] if is_situation else states
    return states, Episode(
        states=kept,
        actions=rng.uniform(-1, 1, (rows, 2)).astype(np.float32),
        rewards=rng.normal(size=rows),
        last_state=kept[-1],
        terminated=True,
        outcome="x",
        is_success=False,
        steps=rows,
    )


def in_rooms(config, seed=2, renderer=None, **changes):
    terms = ("windows", "goal", "velocity")
    settings = {"hidden": (16, 16), "batch_size": 16, "updates_per_step": 0.2}
    made = config(**{**settings, "actor_terms": terms, "critic_terms": terms, **changes})
    return make_learner(made, point_observations(12), POINT_ACTIONS, seed, renderer)


@LEARNERS
def test_situations_are_learnt_as_their_observations(config):
    """A learner that renders situations makes the update of one that remembers states."""
    states, plain = point_episode()
    _, situated = point_episode(is_situation=True)

    class Table:
        size = 1

        def __call__(self, situations, rng):
            return states[situations[:, 0].astype(int)]

    first, second = in_rooms(config), in_rooms(config, renderer=Table())
    figures = [
        learner.update([episode], np.random.default_rng(0))
        for learner, episode in ((first, plain), (second, situated))
    ]
    assert figures[0] == figures[1]
    assert first.policy({}).to_bytes() == second.policy({}).to_bytes()


@LEARNERS
def test_the_warm_up_is_driven_by_the_proportional_controller(config):
    """The first ``warmup_episodes`` are the controller's, also after a resume; then the actor's."""
    learner, (_, episode) = in_rooms(config, warmup_episodes=3), point_episode()
    own = learner.policy({}).architecture
    assert learner.behaviour_policy().architecture == "proportional" != own
    learner.update([episode, episode], np.random.default_rng(0))
    again = in_rooms(config, seed=9, warmup_episodes=3)
    again.restore(learner.to_bytes({}, {}))
    for one in (learner, again):
        assert one.behaviour_policy().architecture == "proportional"
        one.update([episode], np.random.default_rng(1))
        assert one.behaviour_policy().architecture == own
    assert again.to_bytes({}, {}) == learner.to_bytes({}, {})


@LEARNERS
def test_a_warm_up_without_a_goal_is_refused(config):
    """A task without a goal term cannot be driven by the controller."""
    with pytest.raises(ValueError, match="expected a term 'goal'"):
        small(config, warmup_episodes=1)


@LEARNERS
def test_networks_read_their_own_terms(config):
    """Critics and actor of some terms do not see the others."""
    learner, (states, episode) = in_rooms(config), point_episode()
    learner.update([episode], np.random.default_rng(0))
    other = states.copy()
    other[:, : 12 * 3] = 0.25
    policy, actions = learner.policy({}), torch.zeros(len(states), 2)
    np.testing.assert_array_equal(policy.best_many(other), policy.best_many(states))
    with torch.no_grad():
        found = [learner.critics(torch.from_numpy(rows), actions) for rows in (states, other)]
    torch.testing.assert_close(*found, rtol=0, atol=0)
