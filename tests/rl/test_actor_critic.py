"""The paper's learner: one step of temporal difference, near the policy that drove."""

import copy

import numpy as np
import pytest
import torch

from rl.actor_critic import ActorCritic, ActorCriticConfig
from rl.curriculum import Curriculum
from rl.curriculum_config import CurriculumConfig, Stage
from rl.spaces import steering_actions, steering_observations
from rl.training import Episode, EpisodeSpec, play
from tests.support.curricula import serial_rollouts
from tests.support.known_environments import TARGETS, TWO_ACTIONS, MatchTargets, TurnToGoal

OBSERVATIONS, ACTIONS = steering_observations(4, 10.0, 0.5), steering_actions(0.5)


def rollouts():
    return serial_rollouts([TurnToGoal(), TurnToGoal()])


@pytest.mark.parametrize("critic", ["reward-input", "state", "action-input"])
def test_it_learns_and_resumes(critic):
    """Returns grow with either critic, and a resumed run ends with the same bytes."""
    numbers = {"hidden": (32, 32), "actor_rate": 3e-3, "critic_rate": 1e-2}
    learner = ActorCriticConfig(
        critic=critic, reward_scale=0.1, gamma=0.9, episodes_per_iteration=16, **numbers
    )
    plan = CurriculumConfig(
        stages=(Stage(name="turn", episodes=480),),
        learner=learner,
        observations=OBSERVATIONS,
        actions=ACTIONS,
        seed=3,
        final_lr_scale=1.0,
    )
    whole, first = (Curriculum(plan, rollouts()) for _ in range(2))
    figures, checkpoint = [], b""
    for iteration in whole.run():
        figures.append(iteration)
        if len(figures) == 28:
            checkpoint = whole.to_bytes()
    returns = [iteration.mean_return for iteration in figures]
    assert np.mean(returns[-5:]) > np.mean(returns[:3]) + 40
    assert next(first.run()) == figures[0]
    second = Curriculum(plan, rollouts(), checkpoint)
    assert list(second.run()) == figures[28:]
    assert second.to_bytes() == whole.to_bytes()


def test_the_actor_stays_near_the_one_that_drove():
    """Without the clip range, late decisions are learnt by an actor that never drove."""
    moved = []
    for clip_range in (0.2, 1e9):
        config = ActorCriticConfig(clip_range=clip_range, hidden=(32, 32), actor_rate=3e-3)
        learner = ActorCritic(OBSERVATIONS, ACTIONS, config, seed=1)
        rng = np.random.default_rng(2)
        behaviour = learner.behaviour_policy()
        episodes = [play(TurnToGoal(), behaviour, 1, EpisodeSpec(0, (5, k))) for k in range(8)]
        states = torch.from_numpy(np.concatenate([e.states for e in episodes]))
        actions = torch.from_numpy(np.concatenate([e.actions for e in episodes]))
        before = learner.actor.log_probability(states, actions).detach()
        learner.update(episodes, rng)
        after = learner.actor.log_probability(states, actions).detach()
        moved.append(float((after - before).abs().quantile(0.9)))
    assert moved[0] < 0.5
    assert moved[1] > 5.0


def learner(**changes):
    settings = {"hidden": (8,), "actor_rate": 1e-3, "critic_rate": 1e-2, **changes}
    return ActorCritic(OBSERVATIONS, ACTIONS, ActorCriticConfig(**settings), seed=2)


def episode(count, terminated, reward=3.0):
    rng = np.random.default_rng(count)
    return Episode(
        states=rng.uniform(0, 1, (count, 7)).astype(np.float32),
        actions=rng.uniform(-1, 1, (count, 1)).astype(np.float32),
        rewards=reward + np.arange(count, dtype=np.float64),
        last_state=rng.uniform(0, 1, 7).astype(np.float32),
        terminated=terminated,
        outcome="x",
        is_success=False,
        steps=count,
    )


def batches(one, episodes, monkeypatch):
    """Return the batches of an update and leave the learner as it is."""
    found = []
    monkeypatch.setattr(one, "_update", lambda batch, _: found.append(batch) or torch.zeros(3))
    one.update(episodes, np.random.default_rng(0))
    return found


def test_decisions_are_taken_in_their_order(monkeypatch):
    """Batch t holds decision t of each episode that lasts so long, and the rewards around it."""
    one, episodes = learner(reward_scale=0.5), [episode(2, True), episode(3, False)]
    found = batches(one, episodes, monkeypatch)
    assert [len(batch["states"]) for batch in found] == [2, 2, 1]
    for t, batch in enumerate(found):
        going = [e for e in episodes if t < len(e.actions)]
        np.testing.assert_array_equal(batch["states"], [e.states[t] for e in going])
        np.testing.assert_array_equal(batch["actions"], [e.actions[t] for e in going])
        np.testing.assert_array_equal(batch["rewards"], [0.5 * e.rewards[t] for e in going])
        before = [0.5 * e.rewards[t - 1] if t else 0.0 for e in going]
        np.testing.assert_array_equal(batch["rewards_before"], before)
        after = [e.states[t + 1] if t + 1 < len(e.actions) else e.last_state for e in going]
        np.testing.assert_array_equal(batch["next_states"], after)
    assert [batch["terminated"].tolist() for batch in found] == [[0, 0], [1, 0], [0]]


@pytest.mark.parametrize("terminated", [True, False])
def test_the_one_step_target(terminated):
    """The critic learns r + gamma (1 - end) V(next), where V takes the reward that came."""
    one, drive = learner(gamma=0.5, reward_scale=1.0), episode(1, terminated)
    states = torch.from_numpy(drive.states)
    last = torch.from_numpy(drive.last_state[None])
    with torch.no_grad():
        value = one.critic(states, torch.zeros(1, 1))
        after = one.critic(last, torch.tensor([[3.0]]))
        target = 3.0 + 0.5 * (1 - terminated) * after
        loss = torch.nn.functional.smooth_l1_loss(value, target)
    figures = one.update([drive], np.random.default_rng(0))
    with torch.no_grad():
        spread = one.actor(states)[1].mean()
    assert figures["critic_loss"] == pytest.approx(float(loss), rel=1e-5)
    assert figures["value"] == pytest.approx(float(value), rel=1e-5)
    assert figures["spread"] == pytest.approx(float(spread), rel=1e-5)


@pytest.mark.parametrize("terminated", [True, False])
def test_the_target_of_a_critic_that_reads_the_action(terminated, monkeypatch):
    """r + gamma Q(next, the action that came next), and at a cut Q(last, the best action there)."""
    one = learner(gamma=0.5, reward_scale=1.0, critic="action-input")
    drive = episode(2, terminated)
    found = batches(one, [drive], monkeypatch)
    monkeypatch.undo()
    states, actions = torch.from_numpy(drive.states), torch.from_numpy(drive.actions)
    last = torch.from_numpy(drive.last_state[None])
    behaviour = copy.deepcopy(one.actor)
    for t, nexts in ((0, states[1:]), (1, last)):
        with torch.no_grad():
            coming = actions[1:] if t == 0 else torch.tanh(one.actor(last)[0])
            goes_on = t == 0 or not terminated
            target = drive.rewards[t] + 0.5 * goes_on * one.critic(nexts, coming)
            value = one.critic(states[t : t + 1], actions[t : t + 1])
            loss = torch.nn.functional.smooth_l1_loss(value, target.float())
        figures = one._update(found[t], behaviour)
        assert float(figures[0]) == pytest.approx(float(loss), rel=1e-5)


def test_the_baseline_of_a_critic_that_reads_the_action_is_the_best_ones_value(monkeypatch):
    """An action that is as good as the critic says still gains where the best one is worse."""
    for best, sign in ((-5.0, 1), (5.0, -1)):
        one, drive = learner(critic="action-input"), episode(1, True, 0.0)
        states, actions = torch.from_numpy(drive.states), torch.from_numpy(drive.actions)
        one._best = lambda states: torch.full((len(states), 1), 0.125)
        values = lambda _, beside, best=best: torch.where(beside[:, 0] == 0.125, best, 0.0)  # noqa: E731
        monkeypatch.setattr(one, "critic", lambda s, b, v=values: v(s, b).requires_grad_())
        monkeypatch.setattr(one, "_step", _only_actor(one._step))
        before = float(one.actor.log_probability(states, actions).detach())
        one.update([drive], np.random.default_rng(0))
        after = float(one.actor.log_probability(states, actions).detach())
        assert sign * (after - before) > 0


def _only_actor(step):
    """Return a step that leaves the critic as it is."""
    return lambda name, loss: step(name, loss) if name == "actor" else None


def test_better_than_expected_becomes_likelier():
    """An action of positive temporal difference gains probability, one of negative loses."""
    for reward, sign in ((50.0, 1), (-50.0, -1)):
        one, drive = learner(), episode(1, True, reward)
        states, actions = torch.from_numpy(drive.states), torch.from_numpy(drive.actions)
        before = float(one.actor.log_probability(states, actions).detach())
        one.update([drive], np.random.default_rng(0))
        after = float(one.actor.log_probability(states, actions).detach())
        assert sign * (after - before) > 0


def test_the_learning_rates_are_scaled():
    """``lr_scale`` is a share of the actor's and of the critic's own rate."""
    one = learner()
    one.update([episode(2, True)], np.random.default_rng(0), 0.5)
    rates = {name: o.param_groups[0]["lr"] for name, o in one._optimisers.items()}
    assert rates == {"actor": 0.5e-3, "critic": 0.5e-2}


def test_the_present_actor_is_the_policy():
    """The policy that is kept is the present actor, with its description."""
    one, state = learner(), TurnToGoal().reset(seed=0)[0]
    one.update([episode(4, True)], np.random.default_rng(0))
    policy = one.policy({"stage": "turn"})
    assert policy.info == {"stage": "turn"}
    np.testing.assert_array_equal(policy.act(state), one.behaviour_policy().act(state))


def test_two_actions_are_learnt():
    """With two actions, the mean error of each to its own target falls."""
    config = ActorCriticConfig(
        hidden=(32,), gamma=0.1, reward_scale=1.0, actor_rate=3e-3, critic_rate=1e-2, critic="state"
    )
    one = ActorCritic(TARGETS, TWO_ACTIONS, config, seed=1)
    targets = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 2)).astype(np.float32)

    def errors():
        policy = one.policy({})
        shares = np.array([policy.best(target) for target in targets])
        return np.abs(shares - targets).mean(axis=0)

    before, rng = errors(), np.random.default_rng(5)
    for n in range(40):
        policy = one.behaviour_policy()
        played = [play(MatchTargets(), policy, 1, EpisodeSpec(0, (n, k))) for k in range(16)]
        one.update(played, rng)
    assert (errors() < 0.6 * before).all()


def test_the_settings_of_the_shipped_policy():
    """The defaults are those with which the shipped policy was trained."""
    assert ActorCriticConfig().model_dump() == {
        "algorithm": "actor-critic",
        "hidden": (200, 200),
        "action_repeat": 5,
        "driving_repeat": 1,
        "episodes_per_iteration": 8,
        "device": "cpu",
        "driving_noise": 0.0,
        "critic": "reward-input",
        "actor_rate": 1e-3,
        "critic_rate": 3e-3,
        "gamma": 0.9,
        "reward_scale": 0.1,
        "max_td_error": 10.0,
        "clip_range": 0.2,
    }
