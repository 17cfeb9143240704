"""Learning: it learns something known, resumes bit for bit, and knows a time-out from an end."""

import numpy as np
import pytest

from rl.curriculum import Curriculum, CurriculumConfig, Stage
from rl.replay import Replay
from rl.sac import SacConfig
from rl.training import Episode, play, serial_sampler


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
    episodes = [play(TurnToGoal(), policy, 1, (9, k), explore=False) for k in range(20)]
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
