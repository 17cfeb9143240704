"""The replay buffer: rows as they were driven, the oldest overwritten, a time-out no end."""

import numpy as np
import pytest

from rl.replay import Replay
from rl.training import Episode


def episode(states, terminated=True, actions=1):
    count = len(states)
    return Episode(
        states=states,
        actions=np.tile(np.arange(count, dtype=np.float32)[:, None], (1, actions)),
        rewards=np.ones(count),
        last_state=np.full(states.shape[1], 99, dtype=np.float32),
        terminated=terminated,
        outcome="x",
        is_success=False,
        steps=5 * count,
    )


@pytest.mark.parametrize("terminated", [True, False])
def test_a_time_out_is_not_an_end(terminated):
    """Only the last decision of a terminated episode is marked; rewards are scaled."""
    replay = Replay(4, 1, 1000)
    states = np.arange(12, dtype=np.float32).reshape(3, 4)
    assert replay.add(episode(states, terminated), 0.5) == 3
    rows = replay.sample(200, np.random.default_rng(0))
    last = rows["next_states"][:, 0] == 99
    assert last.any()
    assert (rows["terminated"][last] == float(terminated)).all()
    assert (rows["terminated"][~last] == 0).all()
    assert (rows["rewards"] == 0.5).all()


def test_rows_belong_together():
    """A row's next state is the state after it, its actions are those of its state."""
    replay = Replay(1, 2, 1000)
    replay.add(episode(np.arange(10, dtype=np.float32)[:, None], actions=2), 1.0)
    rows = replay.sample(300, np.random.default_rng(0))
    states, after = rows["states"][:, 0], rows["next_states"][:, 0]
    assert set(states.tolist()) == set(range(10))
    np.testing.assert_array_equal(after[states < 9], states[states < 9] + 1)
    assert (after[states == 9] == 99).all()
    assert rows["actions"].shape == (300, 2)
    np.testing.assert_array_equal(rows["actions"][:, 0], states)


def test_the_oldest_decisions_are_overwritten():
    """A full buffer holds exactly the latest decisions."""
    replay = Replay(1, 1, 1000)
    for k in range(30):
        replay.add(episode(np.full((70, 1), k, np.float32)), 1.0)
    assert len(replay) == 1000
    states = replay.sample(20_000, np.random.default_rng(0))["states"]
    # 2,100 decisions came, so the first 1,100 are gone: 15 episodes and 50 rows of the sixteenth.
    assert states.min() == 15
    assert states.max() == 29
    assert (states == 15).float().mean() == pytest.approx(20 / 1000, abs=0.006)


def test_a_restored_buffer_goes_on():
    """A restored buffer holds the same rows and overwrites the same ones next."""
    replay, again = Replay(1, 1, 100), Replay(1, 1, 100)
    for k in range(3):
        replay.add(episode(np.full((40, 1), k, np.float32)), 1.0)
    again.restore(replay.tensors())
    for k in range(3, 5):
        for one in (replay, again):
            one.add(episode(np.full((40, 1), k, np.float32)), 1.0)
    first, second = (one.sample(500, np.random.default_rng(1)) for one in (replay, again))
    for name, column in first.items():
        np.testing.assert_array_equal(column, second[name])


def test_a_buffer_that_is_not_full_is_restored():
    """Of a buffer that is not full only the rows that were written are drawn."""
    replay, again = Replay(1, 1, 1000), Replay(1, 1, 1000)
    replay.add(episode(np.full((5, 1), 7, np.float32)), 1.0)
    assert replay.tensors()["replay.states"].shape == (5, 1)
    again.restore(replay.tensors())
    assert len(again) == 5
    assert (again.sample(50, np.random.default_rng(0))["states"] == 7).all()


class Doubler:
    """Renders a situation of one number as an observation of three, with one draw a call."""

    size = 1

    def __init__(self):
        self.calls = 0

    def __call__(self, situations, rng):
        self.calls += 1
        draw = np.full_like(situations, rng.integers(1000))
        return np.hstack([situations, 2 * situations, draw])


def test_situations_are_rendered_when_drawn():
    """Both ends of a decision are rendered in one call, anew at each draw."""
    renderer = Doubler()
    replay = Replay(3, 1, 1000, renderer)
    replay.add(episode(np.arange(10, dtype=np.float32)[:, None]), 1.0)
    rng = np.random.default_rng(0)
    first, second = replay.sample(50, rng), replay.sample(50, rng)
    assert renderer.calls == 2
    for rows in (first, second):
        states, after = rows["states"].numpy(), rows["next_states"].numpy()
        assert states.shape == after.shape == (50, 3)
        expected = np.where(states[:, 0] == 9, 99, states[:, 0] + 1)
        np.testing.assert_array_equal(after[:, 0], expected)
        np.testing.assert_array_equal(states[:, 1], 2 * states[:, 0])
        assert np.unique(np.hstack([states[:, 2], after[:, 2]])).size == 1
    assert first["states"][0, 2] != second["states"][0, 2]
    assert replay.tensors()["replay.states"].shape == (10, 1)


def test_a_buffer_of_situations_is_restored():
    """A restored buffer of situations draws the same and counts its episodes on."""
    replay, again = Replay(3, 1, 100, Doubler()), Replay(3, 1, 100, Doubler())
    for k in range(4):
        replay.add(episode(np.full((40, 1), k, np.float32)), 1.0)
    again.restore(replay.tensors())
    assert again.episodes == replay.episodes == 4
    first, second = (one.sample(50, np.random.default_rng(1)) for one in (replay, again))
    for name, column in first.items():
        np.testing.assert_array_equal(column, second[name])


def test_states_and_situations_are_not_mixed_up():
    """Situations without a renderer and states with one are refused."""
    with pytest.raises(ValueError, match="expected states of 3 values, got 1; give the learner"):
        Replay(3, 1, 100).add(episode(np.zeros((5, 1), np.float32)), 1.0)
    with pytest.raises(ValueError, match="expected situations of 1 values, got 3"):
        Replay(3, 1, 100, Doubler()).add(episode(np.zeros((5, 3), np.float32)), 1.0)
