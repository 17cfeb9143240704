"""TD3: learns known answers, with the textbook's targets, delay, smoothing and noise."""

import numpy as np
import pytest
import torch

from rl.critics import Fusion
from rl.policies.exploration import NoiseSchedule, RandomTurns
from rl.policy import policy_from_bytes
from rl.td3 import Td3Config, TwinDelayed
from rl.training import Episode, EpisodeSpec, play
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
    config = Td3Config(
        hidden=(32, 32),
        reward_scale=0.1,
        batch_size=64,
        updates_per_step=0.6,
        learning_rate=3e-3,
        noise=NoiseSchedule(steps=2000),
    )
    learner = TwinDelayed(OBSERVATIONS, ACTIONS, config, seed=3)
    train(learner, TurnToGoal(), 12, 4, repeat=2)
    assert share_facing_the_goal(learner.policy({})) >= 0.9


@pytest.fixture(scope="module")
def two_actions():
    config = Td3Config(
        hidden=(32,),
        gamma=0.1,
        batch_size=64,
        updates_per_step=1.0,
        learning_rate=5e-3,
        policy_delay=3,
        noise=NoiseSchedule(start=0.5, end=0.2, steps=1000),
    )
    learner = TwinDelayed(TARGETS, TWO_ACTIONS, config, seed=1)
    train(learner, MatchTargets(), 16, 5)
    return learner


def test_the_best_of_each_action_is_found(two_actions):
    """In a bandit of two actions each follows its own target, in the order of the spec."""
    policy = two_actions.policy({})
    targets = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 2)).astype(np.float32)
    shares = policy.best_many(targets)
    assert np.abs(shares - targets).mean(axis=0).max() < 0.1
    values = np.array([policy.act(target) for target in targets])
    np.testing.assert_allclose(values, TWO_ACTIONS.scaled(shares))


def test_it_resumes(two_actions):
    """A restored learner plays and learns on as the first one, to the bit."""
    again = TwinDelayed(TARGETS, TWO_ACTIONS, two_actions.config, seed=7)
    assert again.policy({}).to_bytes() != two_actions.policy({}).to_bytes()
    again.restore(two_actions.to_bytes({}, {}))
    first, figures = two_actions.to_bytes({}, {}), []
    for learner in (two_actions, again):
        episode = play(MatchTargets(), learner.behaviour_policy(), 1, EpisodeSpec(0, (8, 8)))
        figures.append(learner.update([episode], np.random.default_rng(2)))
    assert figures[0] == figures[1]
    assert two_actions.to_bytes({}, {}) == again.to_bytes({}, {}) != first
    for learner in (two_actions, again):
        assert learner.behaviour_policy().to_bytes() == two_actions.behaviour_policy().to_bytes()


def small(seed=2, **changes):
    settings = {"hidden": (8,), "batch_size": 8, "learning_rate": 1e-3, **changes}
    return TwinDelayed(OBSERVATIONS, ACTIONS, Td3Config(**settings), seed)


def generator(seed=4):
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("terminated", [0.0, 1.0])
@pytest.mark.parametrize("loss", ["squared", "huber"])
def test_the_target(terminated, loss):
    """The critics learn r + gamma (1 - end) min of both targets at a smoothed action."""
    learner = small(gamma=0.5, loss=loss, target_noise=0.4, target_noise_clip=0.3)
    # Targets of their own: online networks in their place would show.
    for parameter in (*learner.target_critics.parameters(), *learner.target_actor.parameters()):
        parameter.data.mul_(1.5)
    one = batch(reward=2.0, terminated=terminated)
    with torch.no_grad():
        smoothing = (0.4 * torch.randn((8, 1), generator=generator())).clamp(-0.3, 0.3)
        actions = (learner.target_actor(one["next_states"]) + smoothing).clamp(-1, 1)
        next_q = torch.minimum(*learner.target_critics(one["next_states"], actions))
        target = 2.0 + 0.5 * (1 - terminated) * next_q
        error = (learner.critics(one["states"], one["actions"]) - target).abs()
        expected = error.square()
        if loss == "huber":
            expected = torch.where(error < 1, error.square() / 2, error - 0.5)
        q = learner.critics(one["states"], one["actions"])
    figures = learner._update(one, generator())
    assert float(figures[0]) == pytest.approx(float(expected.mean()), rel=1e-5)
    assert float(figures[1]) == pytest.approx(float(q.mean()), rel=1e-5)


def test_the_noise_of_targets_is_clipped():
    """Smoothed actions are at most the clip away from the target actor's, and within bounds."""
    states = batch(500)["next_states"]
    learner = small(target_noise=10.0, target_noise_clip=0.25)
    with torch.no_grad():
        plain = learner.target_actor(states)
        away = (learner._smoothed_actions(states, generator()) - plain).abs()
        assert float(away.max()) == pytest.approx(0.25)
        assert float((away > 0.24).float().mean()) > 0.9
        learner.target_actor.linear[-1].bias[:] = 5.0
        found = learner._smoothed_actions(states, generator())
        assert float(found.max()) == 1.0
        assert float(found.min()) == pytest.approx(0.75, abs=0.001)
    with torch.no_grad():
        still = small(target_noise=0.0)
        expected = still.target_actor(states)
        torch.testing.assert_close(still._smoothed_actions(states, generator()), expected)


@pytest.mark.parametrize(("terminated", "value"), [(True, 1.0), (False, 5.0)])
def test_a_time_out_bootstraps_and_an_end_does_not(terminated, value):
    """A step that pays 1 is worth 1 if it ends, and 1 / (1 - gamma) if time alone cut it short."""
    learner = small(gamma=0.8, updates_per_step=60.0, learning_rate=5e-3, tau=0.1)
    state = np.full((1, 7), 0.5, dtype=np.float32)
    episode = Episode(
        states=state,
        actions=np.zeros((1, 1), dtype=np.float32),
        rewards=np.ones(1),
        last_state=state[0],
        terminated=terminated,
        outcome="x",
        is_success=False,
        steps=1,
    )
    for k in range(15):
        learner.update([episode], np.random.default_rng(k))
    with torch.no_grad():
        found = learner.critics(torch.from_numpy(state), torch.zeros(1, 1))
    np.testing.assert_allclose(found[:, 0], value, rtol=0.05)


def test_actor_and_targets_step_for_every_mth_step_of_the_critics():
    """With a delay of 3 the actor and all targets move in steps 0, 3, 6, the critics in each."""
    learner = small(policy_delay=3, updates_per_step=0.07)
    episode = play(TurnToGoal(), learner.behaviour_policy(), 1, EpisodeSpec(0, (1,)))
    step, steps = learner._update, []
    parts = (learner.actor, learner.target_actor, learner.target_critics, learner.critics)

    def watched(*arguments):
        before = [copies(part) for part in parts]
        figures = step(*arguments)
        steps.append(
            [moved(part.parameters(), old) for part, old in zip(parts, before, strict=True)]
        )
        assert bool(figures[2] != 0) == steps[-1][0]
        return figures

    learner._update = watched
    # Seven steps an update: the count goes on from one update to the next, and after a resume.
    learner.update([episode], np.random.default_rng(0))
    data = learner.to_bytes({}, {})
    learner.update([episode], np.random.default_rng(0))
    assert steps == [[k % 3 == 0] * 3 + [True] for k in range(14)]
    again = small(seed=5, policy_delay=3, updates_per_step=0.07)
    again.restore(data)
    again.update([episode], np.random.default_rng(0))
    assert again.to_bytes({}, {}) == learner.to_bytes({}, {})


def test_the_targets_follow_slowly():
    """After a step both targets moved by ``tau`` to their networks."""
    learner = small(tau=0.25)
    for online, target in (
        (learner.actor, learner.target_actor),
        (learner.critics, learner.target_critics),
    ):
        for a, b in zip(online.parameters(), target.parameters(), strict=True):
            torch.testing.assert_close(a, b, rtol=0, atol=0)
    old = [copies(learner.target_actor), copies(learner.target_critics)]
    learner._update(batch(), generator())
    for before, target, online in (
        (old[0], learner.target_actor, learner.actor),
        (old[1], learner.target_critics, learner.critics),
    ):
        for a, b, c in zip(before, target.parameters(), online.parameters(), strict=True):
            torch.testing.assert_close(b, a + 0.25 * (c - a))


def test_the_actor_climbs_the_first_critic():
    """Steps of the actor raise the first critic's value of its own actions, and move no critic."""
    learner = small(policy_delay=1)
    states = batch(256)["states"]
    with torch.no_grad():
        for weights in learner.critics.weights:
            weights[0].mul_(3.0)
            weights[1].mul_(-3.0)
    learner._set_learning_rate("critics", 0.0)

    def value():
        with torch.no_grad():
            return float(learner.critics(states, learner.actor(states))[0].mean())

    before, critics = value(), copies(learner.critics)
    figures = [learner._update(batch(256), generator(k)) for k in range(30)]
    assert float(figures[0][2]) == pytest.approx(before, rel=1e-5)
    assert value() > before
    assert not moved(learner.critics.parameters(), critics)


def test_the_noise_falls_with_the_decisions():
    """What plays to learn has the noise of its schedule, the turns, and the present actor."""
    noise = NoiseSchedule(start=0.9, end=0.1, steps=200)
    turns = RandomTurns(term="ranges")
    learner = small(noise=noise, random_turns=turns, updates_per_step=0.01)
    found = []
    for k in range(4):
        policy = learner.behaviour_policy()
        found.append(policy.info["exploration"]["sigma"])
        assert policy.info["exploration"]["random_turns"]["term"] == "ranges"
        assert policy_from_bytes(policy.to_bytes()).info == policy.info
        episode = play(TurnToGoal(), policy, 2, EpisodeSpec(0, (k,)))
        figures = learner.update([episode], np.random.default_rng(k))
    assert found == pytest.approx([0.9, 0.7, 0.5, 0.3])
    assert figures["noise"] == pytest.approx(0.1)
    assert learner.policy({"stage": "x"}).info == {"stage": "x"}


def test_the_kept_policy_is_the_actor_or_its_average():
    """``policy_network`` chooses between the actor and the target that follows it."""
    for network in ("actor", "target"):
        learner = small(policy_network=network)
        for k in range(6):
            learner._update(batch(), generator(k))
        networks = {"actor": learner.actor, "target": learner.target_actor}
        assert learner.policy({}).to_bytes() == networks[network].policy({}).to_bytes()
        assert learner.actor.policy({}).to_bytes() != learner.target_actor.policy({}).to_bytes()


@pytest.mark.parametrize("frozen", [True, False])
def test_gdaes_fusion_stays_as_it_was_drawn(frozen):
    """A frozen fusion and its target never move, the other layers do; a resume keeps it."""
    fusion = Fusion(kind="sum", layer=1, frozen=frozen)
    settings = {"hidden": (8, 6), "fusion": fusion, "normalised": False, "policy_delay": 1}
    learner = small(**settings)
    before = copies(learner.critics.weights)
    for k in range(5):
        learner._update(batch(), generator(k))
    assert moved(learner.critics.weights.parameters(), before)
    is_same = bool((learner.critics.weights[1] == before[1]).all())
    assert is_same == frozen
    assert bool((learner.target_critics.weights[1] == before[1]).all()) == frozen
    again = small(seed=9, **settings)
    again.restore(learner.to_bytes({}, {}))
    for one in (learner, again):
        one._update(batch(), generator())
    assert again.to_bytes({}, {}) == learner.to_bytes({}, {})


def test_the_seed_gives_the_weights():
    """Equal seeds give equal learners, other seeds others, whatever torch's global state."""
    first = small().to_bytes({}, {})
    torch.manual_seed(99)
    assert small().to_bytes({}, {}) == first
    assert small(seed=3).to_bytes({}, {}) != first


def test_the_settings_are_fujimotos_where_they_are_not_ours():
    """Noise of 0.2 clipped at 0.5 on the targets and a delay of 2; the rest is ours."""
    assert Td3Config().model_dump() == {
        "algorithm": "td3",
        "hidden": (200, 200),
        "action_repeat": 5,
        "episodes_per_iteration": 8,
        "device": "cpu",
        "driving_noise": 0.0,
        "driving_repeat": 1,
        "learning_rate": 5e-4,
        "gamma": 0.99,
        "tau": 0.01,
        "batch_size": 128,
        "updates_per_step": 1 / 32,
        "reward_scale": 1.0,
        "buffer_size": 200_000,
        "actor_terms": None,
        "critic_terms": None,
        "critic_hidden": None,
        "policy_delay": 2,
        "warmup_episodes": 0,
        "fusion": {"kind": "concatenation", "layer": 0, "frozen": False},
        "normalised": True,
        "loss": "squared",
        "target_noise": 0.2,
        "target_noise_clip": 0.5,
        "noise": {"start": 0.5, "end": 0.1, "steps": 60_000, "decay": "linear"},
        "random_turns": None,
        "policy_network": "actor",
    }
