"""Episodes as data: held actions, summed rewards, seeds of their own, robots side by side."""

import numpy as np
import pytest

from rl.policies.mlp import MlpPolicy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm
from rl.training import EpisodeSpec, play, play_together

CLOCK = ObservationSpec(terms=(ObservationTerm(name="t", shape=(1,), low=0, high=100, unit=""),))
ACTION = ActionSpec(names=("angular",), low=(-1.0,), high=(1.0,), units=("rad/s",))


def policy(mean=0.5):
    weights = {
        "layer0.weight": np.zeros((2, 1), np.float32),
        "layer0.bias": np.array([mean, -1.0], np.float32),
    }
    return MlpPolicy(weights, CLOCK, ACTION)


class Clock:
    """Ends at its own time; the state is the number of steps, the reward grows with them."""

    def __init__(self, last=7, terminates=True):
        self._last, self._terminates = last, terminates
        self.actions, self.resets = [], []

    def reset(self, *, seed=None, options=None):
        self.resets.append((seed, options))
        self._steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.actions.append(float(action[0]))
        self._steps += 1
        over = self._steps == self._last
        info = {"reward_terms": {"steps": float(self._steps), "one": 1.0}}
        if over:
            info |= {"is_success": True, "outcome": "goal", "turns": 2.5}
        ends = over and self._terminates
        state = np.full(1, self._steps, np.float32)
        return state, float(self._steps), ends, over and not ends, info

    def close(self):
        pass


@pytest.mark.parametrize("repeat", [1, 3])
def test_an_action_is_held_for_its_repeat(repeat):
    """A decision holds for ``action_repeat`` steps, and its reward is their sum."""
    clock = Clock()
    episode = play(clock, policy(), repeat, EpisodeSpec(0, (1,)))
    decisions = -(-7 // repeat)
    assert len(episode.actions) == len(episode.states) == len(episode.rewards) == decisions
    assert episode.states[:, 0].tolist() == list(range(0, 7, repeat))
    held = [clock.actions[k : k + repeat] for k in range(0, 7, repeat)]
    assert [len(set(group)) for group in held] == [1] * decisions
    assert len(set(clock.actions)) == decisions
    sums = [sum(range(k + 1, min(k + repeat, 7) + 1)) for k in range(0, 7, repeat)]
    assert episode.rewards.tolist() == sums
    assert episode.last_state.tolist() == [7]
    assert episode.steps == 7
    assert episode.terms == {"steps": 28.0, "one": 7.0}
    assert (episode.outcome, episode.is_success, episode.turns) == ("goal", True, 2.5)


@pytest.mark.parametrize("terminates", [True, False])
def test_a_truncated_episode_is_not_terminated(terminates):
    """``terminated`` is the environment's own; a time-out leaves it False."""
    assert play(Clock(5, terminates), policy(), 2, EpisodeSpec(0, (1,))).terminated is terminates


def test_without_exploring_the_best_is_driven():
    """Without exploring every action is the policy's best share."""
    clock = Clock()
    play(clock, policy(0.5), 1, EpisodeSpec(0, (1,)), explore=False)
    assert clock.actions == [pytest.approx(np.tanh(0.5))] * 7


def test_the_seed_gives_the_episode():
    """Equal seeds give the same reset and noise, other seeds others of both."""
    resets, actions = [], []
    for seed in ((3, 0, 1), (3, 0, 1), (3, 0, 2), (3, 1, 1), (4, 0, 1)):
        clock = Clock()
        play(clock, policy(), 1, EpisodeSpec(0, seed))
        resets.append(clock.resets[0][0])
        actions.append(tuple(clock.actions))
    assert resets[0] == resets[1]
    assert actions[0] == actions[1]
    assert len(set(resets)) == len(set(actions)) == 4


def test_the_difficulty_is_an_option_of_the_reset():
    """A spec's difficulty goes to the environment; without one there is no option."""
    clock = Clock()
    play(clock, policy(), 1, EpisodeSpec(0, (1,), 0.4))
    play(clock, policy(), 1, EpisodeSpec(0, (1,)))
    assert [options for _, options in clock.resets] == [{"difficulty": 0.4}, {}]


class Clocks:
    """Clocks side by side, each with a length that follows from its seed."""

    def __init__(self, count):
        self.num_envs = count
        self._clocks = [None] * count
        self.difficulties = []

    def reset(self, *, seed, options):
        states = np.zeros((self.num_envs, 1), np.float32)
        for k in range(self.num_envs):
            if options["reset_mask"][k]:
                self._clocks[k] = Clock(3 + seed[k] % 9, seed[k] % 2 == 0)
                self._clocks[k].reset()
                self.difficulties.append(options["difficulty"][k])
            elif self._clocks[k] is not None and self._clocks[k]._steps < self._clocks[k]._last:
                states[k] = self._clocks[k]._steps
        return states, {}

    def step(self, actions):
        n = self.num_envs
        states, rewards = np.zeros((n, 1), np.float32), np.zeros(n)
        ends, cuts = np.zeros(n, bool), np.zeros(n, bool)
        info = {
            "reward_terms": {"steps": np.zeros(n), "one": np.zeros(n)},
            "is_success": np.zeros(n, bool),
            "outcome": np.full(n, "", object),
            "turns": np.zeros(n),
        }
        for k, clock in enumerate(self._clocks):
            if clock is None or clock._steps >= clock._last:
                continue
            states[k], rewards[k], ends[k], cuts[k], one = clock.step(actions[k])
            for name, value in one["reward_terms"].items():
                info["reward_terms"][name][k] = value
            for name in ("is_success", "outcome", "turns"):
                if name in one:
                    info[name][k] = one[name]
        return states, rewards, ends, cuts, info


class SeededClock(Clock):
    """A clock whose length follows from the seed of its reset, as in ``Clocks``."""

    def reset(self, *, seed=None, options=None):
        self._last, self._terminates = 3 + seed % 9, seed % 2 == 0
        return super().reset(seed=seed, options=options)


@pytest.mark.parametrize("count", [1, 4, 16])
@pytest.mark.parametrize("repeat", [1, 2])
def test_robots_side_by_side_play_what_each_plays_alone(count, repeat):
    """Any number of robots gives the episodes of one alone, in the order of the specs."""
    specs = [EpisodeSpec(0, (5, k), 0.1 * k) for k in range(9)]
    clocks = Clocks(count)
    together = play_together(clocks, policy(), repeat, specs)
    assert sorted(clocks.difficulties) == [one.difficulty for one in specs]
    alone = [play(SeededClock(), policy(), repeat, one) for one in specs]
    assert len({episode.steps for episode in alone}) > 3
    for one, other in zip(together, alone, strict=True):
        for name in ("states", "actions", "rewards", "last_state"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for name in ("terminated", "outcome", "is_success", "steps", "terms", "turns"):
            assert getattr(one, name) == getattr(other, name)


def test_an_episode_has_the_world_that_its_environment_gave():
    """A robot alone and robots side by side report theirs; environments without one None."""

    class Numbered(SeededClock):
        def reset(self, *, seed=None, options=None):
            state, info = super().reset(seed=seed, options=options)
            return state, {**info, "world_seed": seed % 7}

    class NumberedClocks(Clocks):
        def reset(self, *, seed=None, options=None):
            states, info = Clocks.reset(self, seed=seed, options=options)
            worlds = np.array([-1 if each is None else each % 7 for each in seed])
            return states, {**info, "world_seed": worlds}

    specs = [EpisodeSpec(0, (5, k)) for k in range(9)]
    alone = [play(Numbered(), policy(), 1, spec).world for spec in specs]
    assert len(set(alone)) > 3
    assert min(alone) >= 0
    together = play_together(NumberedClocks(3), policy(), 1, specs)
    assert [each.world for each in together] == alone
    assert {each.world for each in play_together(Clocks(3), policy(), 1, specs)} == {None}


class Situated(Clocks):
    """Clocks that also give the situation they are in, which is kept in the place of the state."""

    def reset(self, *, seed, options):
        self.tasks = options.get("task")
        return self._with(*super().reset(seed=seed, options=options))

    def step(self, actions):
        states, *rest, info = super().step(actions)
        return states, *rest, self._with(states, info)[1]

    def _with(self, states, info):
        return states, {**info, "situations": np.hstack([states, -states, states]) + 10}


@pytest.mark.parametrize("repeat", [1, 2])
def test_situations_are_kept_in_the_place_of_states(repeat):
    """Episodes hold the situations at each decision and at the end; the policy sees the states."""
    specs = [EpisodeSpec(0, (5, k), task=k) for k in range(7)]
    clocks = Situated(3)
    found = play_together(clocks, policy(), repeat, specs)
    plain = play_together(Clocks(3), policy(), repeat, specs)
    for one, other in zip(found, plain, strict=True):
        expected = np.hstack([other.states, -other.states, other.states]) + 10
        np.testing.assert_array_equal(one.states, expected)
        np.testing.assert_array_equal(one.last_state, other.last_state * [1, -1, 1] + 10)
        np.testing.assert_array_equal(one.actions, other.actions)
    assert all(task in range(7) for task in clocks.tasks if task is not None)


def test_one_robot_keeps_its_situations_too():
    """``play`` keeps situations as ``play_together`` does, the first from the reset."""

    class One(Clock):
        def reset(self, *, seed=None, options=None):
            state, info = super().reset(seed=seed, options=options)
            return state, info | {"situations": np.array([7.0, 0.0], np.float32)}

        def step(self, action):
            state, *rest, info = super().step(action)
            return state, *rest, info | {"situations": np.array([7.0, state[0]], np.float32)}

    clock = One(5)
    episode = play(clock, policy(), 2, EpisodeSpec(0, (1,), task=3))
    assert episode.states.tolist() == [[7, 0], [7, 2], [7, 4]]
    assert episode.last_state.tolist() == [7, 5]
    assert clock.resets[0][1] == {"task": 3}


def test_tasks_go_to_the_robots_that_play_them():
    """Each robot's task stands in its own place of the option; without tasks there is none."""
    seen = []

    class Tasks(Clocks):
        def reset(self, *, seed, options):
            seen.append((options["reset_mask"].copy(), options.get("task")))
            return super().reset(seed=seed, options=options)

    play_together(Tasks(4), policy(), 1, [EpisodeSpec(0, (5, k), task=k) for k in range(4)])
    assert seen[0][1] == [0, 1, 2, 3]
    seen.clear()
    play_together(Tasks(4), policy(), 1, [EpisodeSpec(0, (5, k)) for k in range(4)])
    assert all(tasks is None for _, tasks in seen)
