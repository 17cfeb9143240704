"""Learning: it learns something known, resumes bit for bit, and knows a time-out from an end."""

import numpy as np
import pytest
import torch

from rl.actor_critic import ActorCritic, ActorCriticConfig
from rl.curriculum import Curriculum, CurriculumConfig, Difficulty, Stage
from rl.learner import DeviceError
from rl.networks import ValueCritic
from rl.replay import Replay
from rl.sac import SacConfig
from rl.spaces import ObservationLayout
from rl.training import Episode, EpisodeSpec, play, serial_sampler


class TurnToGoal:
    """A point that turns: the reward is for facing the goal. Real dynamics, a known best policy."""

    def reset(self, *, seed=None, options=None):
        rng = np.random.default_rng(seed)
        self._error = float(rng.uniform(-np.pi, np.pi))
        self._steps = 0
        return self._state(), {}

    def step(self, action):
        self._error -= 0.05 * float(action[0])
        self._error = float((self._error + np.pi) % (2 * np.pi) - np.pi)
        self._steps += 1
        reward = float(np.cos(self._error))
        over = self._steps >= 100
        info = {"is_success": abs(self._error) < 0.3, "outcome": "timeout"}
        info["reward_terms"] = {"facing": reward}
        return self._state(), reward, False, over, info

    def _state(self):
        state = np.full(7, 5.0, dtype=np.float32)
        state[-3:] = 0.0, 0.0, self._error
        return state

    def close(self):
        pass


def config(episodes=16, **learner):
    numbers = {"hidden": (32, 32), "batch": 4, "reward_scale": 0.1, "minibatch": 64, **learner}
    return CurriculumConfig(
        stages=(Stage(name="turn", episodes=episodes), Stage(name="again", episodes=4)),
        learner=SacConfig(**numbers),
        n_sectors=4,
        seed=3,
        dead_zone=0.0,
    )


def run(curriculum, generations=10**9):
    told = []
    for generation in curriculum.run():
        told.append(generation)
        if len(told) == generations:
            break
    return told


def sampler():
    return serial_sampler([TurnToGoal(), TurnToGoal()])


def test_it_learns_to_face_the_goal():
    curriculum = Curriculum(config(80, steps_per_decision=1.0, learning_rate=2e-3), sampler())
    run(curriculum)
    policy = curriculum.policy({})
    episodes = [
        play(TurnToGoal(), policy, 1, EpisodeSpec(0, (9, k)), explore=False) for k in range(20)
    ]
    assert np.mean([episode.is_success for episode in episodes]) >= 0.9


def test_a_killed_run_goes_on_bit_for_bit():
    whole = Curriculum(config(), sampler())
    told = run(whole)
    assert [g.name for g in told] == ["turn"] * 4 + ["again"]
    for killed_after in (1, 3, 4):
        first = Curriculum(config(), sampler())
        run(first, killed_after)
        second = Curriculum(config(), sampler(), first.to_bytes())
        assert run(second) == told[killed_after:]
        assert second.to_bytes() == whole.to_bytes()


def test_a_checkpoint_of_another_run_is_refused():
    first = Curriculum(config(), sampler())
    run(first, 1)
    with pytest.raises(ValueError, match="expected one of this configuration"):
        Curriculum(config(24), sampler(), first.to_bytes())
    with pytest.raises(ValueError, match="checkpoint: expected one of this learner"):
        Curriculum(config(), sampler(), first.to_bytes()[:-10])


@pytest.mark.skipif(torch.cuda.is_available(), reason="torch finds a GPU here")
def test_a_gpu_that_is_not_there_is_refused_or_done_without():
    with pytest.raises(DeviceError, match="expected a GPU that torch finds for 'cuda', got none"):
        Curriculum(config(device="cuda"), sampler())
    assert Curriculum(config(device="auto"), sampler()).learner.device.type == "cpu"


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")
def test_a_gpu_learns_and_resumes():
    whole = Curriculum(config(device="cuda"), sampler())
    told = run(whole)
    first = Curriculum(config(device="auto"), sampler())
    assert first.learner.device.type == "cuda"
    first = Curriculum(config(device="cuda"), sampler())
    run(first, 3)
    second = Curriculum(config(device="cuda"), sampler(), first.to_bytes())
    assert run(second) == told[3:]


@pytest.mark.parametrize("terminated", [True, False])
def test_a_time_out_is_not_an_end(terminated):
    states = np.arange(12, dtype=np.float32).reshape(3, 4)
    episode = Episode(
        states=states,
        actions=np.zeros(3, dtype=np.float32),
        rewards=np.ones(3),
        last_state=np.full(4, 99, dtype=np.float32),
        terminated=terminated,
        outcome="x",
        is_success=False,
        steps=15,
    )
    replay = Replay(4, 1000)
    assert replay.add(episode, 0.5) == 3
    rows = replay.draw(200, np.random.default_rng(0))
    last = rows["next_states"][:, 0] == 99
    assert (rows["terminated"][last] == float(terminated)).all()
    assert (rows["terminated"][~last] == 0).all()
    assert (rows["rewards"] == 0.5).all()


def test_the_oldest_decisions_make_room():
    replay = Replay(1, 1000)
    for k in range(30):
        episode = Episode(
            states=np.full((70, 1), k, np.float32),
            actions=np.zeros(70, np.float32),
            rewards=np.zeros(70),
            last_state=np.zeros(1, np.float32),
            terminated=True,
            outcome="x",
            is_success=False,
            steps=70,
        )
        replay.add(episode, 1.0)
    assert len(replay) == 1000
    assert replay.draw(2000, np.random.default_rng(0))["states"].min() >= 15


@pytest.mark.parametrize("critic", ["reward-input", "state"])
def test_the_papers_learner_learns_and_resumes(critic):
    numbers = {"hidden": (32, 32), "batch": 16, "actor_rate": 3e-3, "critic_rate": 1e-2}
    learner = ActorCriticConfig(critic=critic, reward_scale=0.1, discount=0.9, **numbers)
    stages = (Stage(name="turn", episodes=480),)
    plan = CurriculumConfig(stages=stages, learner=learner, n_sectors=4, seed=3, final_pace=1.0)
    whole, first = (Curriculum(plan, sampler()) for _ in range(2))
    told = run(whole)
    returns = [generation.mean_return for generation in told]
    assert np.mean(returns[-5:]) > np.mean(returns[:3]) + 40
    run(first, 28)
    second = Curriculum(plan, sampler(), first.to_bytes())
    assert run(second) == told[28:]
    assert second.to_bytes() == whole.to_bytes()


def test_the_papers_actor_stays_near_the_one_that_drove():
    """Without that limit what comes late in an episode is learnt by an actor that never drove."""
    moved = []
    for trust in (0.2, 1e9):
        config = ActorCriticConfig(trust=trust, hidden=(32, 32), actor_rate=3e-3)
        learner = ActorCritic(ObservationLayout(4), 10.0, 0.5, config, seed=1)
        rng = np.random.default_rng(2)
        driver = learner.explorer(0.0)
        episodes = [play(TurnToGoal(), driver, 1, EpisodeSpec(0, (5, k))) for k in range(8)]
        states = torch.from_numpy(np.concatenate([e.states for e in episodes]))
        actions = torch.from_numpy(np.concatenate([e.actions for e in episodes]))
        before = learner.actor.log_probability(states, actions).detach()
        learner.update(episodes, rng)
        after = learner.actor.log_probability(states, actions).detach()
        moved.append(float((after - before).abs().quantile(0.9)))
    assert moved[0] < 0.5
    assert moved[1] > 5.0


def test_a_checkpoint_of_the_other_learner_is_refused():
    first = Curriculum(config(), sampler())
    run(first, 1)
    other = config().model_copy(update={"learner": ActorCriticConfig()})
    with pytest.raises(ValueError, match="expected one of this configuration"):
        Curriculum(other, sampler(), first.to_bytes())


def test_the_value_of_a_state_takes_the_reward_as_printed():
    layout = ObservationLayout(32)
    printed, plain = (ValueCritic(layout, 0.5, (200, 200), takes) for takes in (True, False))
    assert printed.linear[0].weight.shape == (200, 36)
    assert plain.linear[0].weight.shape == (200, 35)
    states, rewards = torch.ones(2, 35), torch.tensor([0.0, 100.0])
    apart = [torch.diff(critic(states, rewards)).abs().item() for critic in (printed, plain)]
    assert apart[0] > 1e-2
    assert apart[1] < 1e-5


def test_worlds_get_harder_and_easier_by_success():
    rule = Difficulty(start=0.3, least=0.2, most=0.4, step=0.1, window=4)
    assert rule.after(0.3, [True] * 3) == 0.3
    assert rule.after(0.3, [True] * 4) == 0.4
    assert rule.after(0.4, [True] * 4) == 0.4
    assert rule.after(0.3, [True, False, True, False]) == 0.3
    assert rule.after(0.3, [False] * 4) == 0.2
    assert rule.after(0.2, [False] * 4) == 0.2


class Recorder:
    """A sampler that keeps what was assigned; the episodes are real ones."""

    def __init__(self):
        self.assigned, self.tried = [], []
        self._play = serial_sampler([TurnToGoal() for _ in range(4)])

    def __call__(self, policy, hold, specs, explore):
        (self.assigned if explore else self.tried).append(list(specs))
        return self._play(policy, hold, specs, explore)


def test_old_stages_are_rehearsed_and_all_are_tried():
    recorder = Recorder()
    harder = Difficulty(start=0.3, most=0.5, window=4, raise_at=0.0, lower_at=0.0)
    plan = config().model_copy(
        update={
            "stages": (
                Stage(name="turn", episodes=8, difficulty=harder),
                Stage(name="again", episodes=8, rehearsal=0.5),
            ),
            "validation": 3,
        }
    )
    told = run(Curriculum(plan, recorder))
    levels = [[one.difficulty for one in generation] for generation in recorder.assigned[:2]]
    assert levels == [[0.3] * 4, [0.4] * 4]
    for generation in recorder.assigned[2:]:
        assert [one.stage for one in generation] == [1, 1, 0, 0]
    seeds = [one.seed for generation in recorder.assigned for one in generation]
    assert len(seeds) == len(set(seeds))
    assert [g.validation.keys() for g in told if g.is_last] == [{"turn"}, {"turn", "again"}]
    assert [[one.stage for one in played] for played in recorder.tried] == [
        [2, 2, 2],
        [3, 3, 3],
        [2, 2, 2],
    ]
    assert not {one.seed for played in recorder.tried for one in played} & set(seeds)


@pytest.mark.parametrize(("batch", "rehearsal"), [(1, 0.5), (1, 0.9), (2, 0.9), (4, 0.9)])
def test_however_much_is_rehearsed_the_stage_itself_is_played(batch, rehearsal):
    recorder, plan = Recorder(), config()
    stages = (Stage(name="turn", episodes=2), Stage(name="again", episodes=2, rehearsal=rehearsal))
    learner = plan.learner.model_copy(update={"batch": batch})
    told = run(Curriculum(plan.model_copy(update={"stages": stages, "learner": learner}), recorder))
    assert sum(generation.played for generation in told if generation.name == "again") == 2
    for generation in recorder.assigned:
        assert len(generation) <= batch
        assert generation[0].stage == max(one.stage for one in generation)


def test_a_stage_that_is_learnt_ends_early():
    easy = Stage(name="turn", episodes=100, promote_at=0.01, window=8)
    plan = config().model_copy(update={"stages": (easy, Stage(name="again", episodes=4))})
    told = run(Curriculum(plan, sampler()))
    assert told[-1].name == "again"
    assert sum(g.played for g in told if g.name == "turn") < 100


def test_the_policy_that_did_best_is_kept():
    plan = config(32).model_copy(update={"validation": 4, "validate_every": 1})
    curriculum, rates = Curriculum(plan, Recorder()), []
    for generation in curriculum.run():
        if generation.stage == 1:
            break
        rates.append(generation.validation["turn"])
        if generation.is_last:
            assert rates[-1] == max(rates)
    assert len(rates) == 8
