"""Soft actor-critic on observations of points, and on terms of which each network reads its own."""

import numpy as np
import torch

from rl.policy import policy_from_bytes
from rl.sac import ActorConfig, SacConfig, SoftActorCritic
from rl.training import Episode
from tests.support.point_sets import ACTIONS as POINT_ACTIONS
from tests.support.point_sets import observation, point_observations
from tests.support.small_learners import train

POINTS = {
    "hidden": (16, 16),
    "batch_size": 16,
    "updates_per_step": 0.2,
    "learning_rate": 1e-2,
    "critic_terms": ("windows", "goal", "velocity"),
    "critic_hidden": (8,),
}


def point_episode(n=12, rows=40):
    rng = np.random.default_rng(0)
    states = np.array([observation(n, rng) for _ in range(rows)])
    return states, Episode(
        states=states,
        actions=rng.uniform(-1, 1, (rows, 2)).astype(np.float32),
        rewards=rng.normal(size=rows),
        last_state=states[-1],
        terminated=True,
        outcome="x",
        is_success=False,
        steps=rows,
    )


def points(seed=2, **changes):
    settings = {"actor": ActorConfig(kind="points", width=16, features=5), **POINTS, **changes}
    return SoftActorCritic(point_observations(12), POINT_ACTIONS, SacConfig(**settings), seed)


def test_critics_and_actor_read_their_own_terms():
    """Critics see the windows and no points, the actor points and no windows."""
    learner, (states, episode) = points(), point_episode()
    learner.update([episode], np.random.default_rng(0))
    space, rows = point_observations(12), torch.from_numpy(states)
    actions = torch.zeros(len(rows), 2)
    other = {}
    for name in ("points", "windows"):
        other[name] = rows.clone()
        other[name][:, space.slice_of(name)] += 0.5
    with torch.no_grad():
        q, mean = learner.critics(rows, actions), learner.actor(rows)[0]
        torch.testing.assert_close(learner.critics(other["points"], actions), q, rtol=0, atol=0)
        assert (learner.critics(other["windows"], actions) != q).any()
        torch.testing.assert_close(learner.actor(other["windows"])[0], mean, rtol=0, atol=0)
        assert (learner.actor(other["points"])[0] != mean).any()
    assert learner.critics.weights[0].shape == (2, 41 + 2, 8)
    policy = policy_from_bytes(learner.policy({}).to_bytes())
    assert policy.architecture == "point_set"
    assert policy.weights["feature.weight"].shape == (5, 16)


def test_a_perceptron_reads_its_own_terms():
    """An actor of windows, goal and velocities ignores the points, also as a file."""
    terms = ("windows", "goal", "velocity")
    learner = points(actor=ActorConfig(), actor_terms=terms)
    states, episode = point_episode()
    learner.update([episode], np.random.default_rng(0))
    policy = policy_from_bytes(learner.policy({}).to_bytes())
    assert (policy.architecture, policy.terms) == ("mlp", terms)
    with torch.no_grad():
        mean, _ = learner.average(torch.from_numpy(states))
    np.testing.assert_allclose(policy.best_many(states), torch.tanh(mean), atol=1e-6)
    other = states[0].copy()
    other[: 12 * 3] = 0.25
    np.testing.assert_array_equal(policy.act(other), policy.act(states[0]))


def test_a_point_actor_resumes():
    """A restored learner with points and the value of states makes the same update, to the bit."""
    learner, again = (points(seed, state_value=True, policy_delay=2) for seed in (2, 3))
    _, episode = point_episode()
    learner.update([episode], np.random.default_rng(0))
    again.restore(learner.to_bytes({}, {}))
    for one in (learner, again):
        one.update([episode], np.random.default_rng(1))
    assert again.to_bytes({}, {}) == learner.to_bytes({}, {})


class ReachPoint:
    """One point among masked ones; the best two actions are its coordinates."""

    def reset(self, *, seed=None, options=None):
        self._rng, self._steps = np.random.default_rng(seed), 0
        return self._draw(), {}

    def step(self, action):
        reward = -float(np.abs(np.asarray(action) - self._target).sum())
        self._steps += 1
        info = {"is_success": True, "outcome": "timeout", "reward_terms": {"match": reward}}
        return self._draw(), reward, False, self._steps >= 20, info

    def _draw(self):
        self._target = self._rng.uniform(-0.8, 0.8, 2).astype(np.float32)
        place, n = self._rng.integers(6), 6
        parts = {
            "points": self._rng.uniform(-5, 5, (n, 2)),
            "mask": np.eye(n)[place],
            "windows": np.zeros(36),
            "goal": np.zeros(3),
            "velocity": np.zeros(2),
        }
        parts["points"][place] = self._target
        parts["windows"][:2] = self._target
        return point_observations(n).vector(parts)


def test_a_point_actor_learns():
    """The actor finds the one point that counts, wherever it stands, and repeats it."""
    config = SacConfig(
        **{**POINTS, "critic_hidden": (32,), "batch_size": 64, "updates_per_step": 1.0},
        actor=ActorConfig(kind="points", width=32, features=8),
        gamma=0.1,
        reward_scale=1.0,
        ema_rate=0.01,
        temperature=0.02,
        target_entropy=-3.0,
    )
    learner = SoftActorCritic(point_observations(6), POINT_ACTIONS, config, seed=1)
    train(learner, ReachPoint(), 12, 5)
    environment, policy, errors = ReachPoint(), learner.policy({}), []
    for k in range(100):
        state, _ = environment.reset(seed=k)
        errors.append(np.abs(policy.best(state) - environment._target))
    assert np.mean(errors) < 0.2
