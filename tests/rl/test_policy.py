"""A policy file is complete and equals the network that it came from; damaged ones are refused."""

import numpy as np
import pytest
import torch

from rl.networks import Actor
from rl.policy import Policy, PolicyFileError
from rl.spaces import ObservationLayout

LAYOUT = ObservationLayout()


@pytest.fixture(scope="module")
def actor():
    torch.manual_seed(0)
    return Actor(LAYOUT, 10.0, 0.5, (200, 200))


def states(n=50):
    low, high = LAYOUT.bounds(10.0, 0.5)
    return np.random.default_rng(0).uniform(low, high, (n, 35)).astype(np.float32)


def test_the_papers_sizes(actor):
    shapes = [layer[0].shape for layer in actor.policy(0.15, {}).layers]
    assert shapes == [(200, 35), (200, 200), (2, 200)]  # Mean and spread: 35-200-200-1 drives.


def test_numpy_equals_torch(actor):
    policy = actor.policy(0.0, {})
    with torch.no_grad():
        mean, _ = actor(torch.from_numpy(states()))
    expected = 0.5 * torch.tanh(mean).numpy()
    np.testing.assert_allclose([policy.act(state) for state in states()], expected, atol=1e-6)


def test_exploration_spreads_as_the_network_says(actor):
    policy = actor.policy(0.0, {})
    state = states(1)
    with torch.no_grad():
        mean, sigma = actor(torch.from_numpy(state))
    rng = np.random.default_rng(0)
    drawn = np.arctanh([policy.explore(state[0], rng) for _ in range(4000)])
    assert drawn.mean() == pytest.approx(float(mean), abs=4 * float(sigma) / 4000**0.5)
    assert drawn.std() == pytest.approx(float(sigma), rel=0.05)


def test_bytes_come_back(actor):
    policy = actor.policy(0.15, {"commit": "abc", "stage": "Maze2D"})
    again = Policy.from_bytes(policy.to_bytes())
    assert (again.max_range, again.limit, again.dead_zone) == (10.0, 0.5, 0.15)
    assert again.info == policy.info
    assert [again.act(s) for s in states()] == [policy.act(s) for s in states()]


@pytest.mark.parametrize("bad", [np.full(35, np.nan), np.zeros(34), np.full(35, np.inf)])
def test_states_that_cannot_be_are_refused(actor, bad):
    with pytest.raises(ValueError, match="state: expected"):
        actor.policy(0.15, {}).act(bad.astype(np.float32))


def test_damaged_bytes_never_crash(actor):
    data = actor.policy(0.15, {}).to_bytes()
    rng = np.random.default_rng(0)
    for _ in range(200):
        spoilt = bytearray(data)
        if rng.random() < 0.4:
            spoilt = spoilt[: rng.integers(len(spoilt))]
        for _ in range(4):
            if spoilt:
                spoilt[rng.integers(min(len(spoilt), 600))] = rng.integers(256)
        try:
            Policy.from_bytes(bytes(spoilt))
        except PolicyFileError as error:
            assert "andabata train" in str(error)
