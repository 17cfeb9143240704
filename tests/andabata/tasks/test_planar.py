"""Many robots of stage 1 at once do what each would do alone."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.planar import FlatVectorEnv
from rl.policy import Policy
from rl.training import EpisodeSpec, play, play_together

SMALL = stage_config("Maze2D").model_copy(
    update={"seeds": (0, 1, 2), "terminations": TerminationConfig(time_limit=40.0)}
)

SHAPES = tuple(enumerate([(16, 35), (2, 16)]))


def wiggle(k, robot):
    return np.float32(np.sin(k / (5 + robot)) * (0.3 + 0.1 * robot))


def test_they_drive_as_each_would_alone(scenes):
    count, steps = 6, 500
    together = FlatVectorEnv(SMALL, count, scenes, autoreset=False)
    seeds = [40 + robot for robot in range(count)]
    states, info = together.reset(seed=seeds)
    alone = [OffroadEnv(SMALL, scenes=scenes) for _ in range(count)]
    over, ends = np.zeros(count, dtype=bool), set()
    for robot, env in enumerate(alone):
        state, about = env.reset(seed=seeds[robot])
        assert about["world_seed"] == info["world_seed"][robot]
        np.testing.assert_allclose(states[robot], state, atol=2e-6)
    for k in range(steps):
        actions = np.array([[wiggle(k, robot)] for robot in range(count)])
        states, rewards, terminated, truncated, info = together.step(actions)
        for robot, env in enumerate(alone):
            if over[robot]:
                assert not (terminated | truncated)[robot]
                assert rewards[robot] == 0.0
                continue
            state, reward, end, cut, about = env.step(actions[robot])
            # Sines by numpy and by the compiler differ in the last bit.
            np.testing.assert_allclose(states[robot], state, atol=1e-5)
            assert rewards[robot] == pytest.approx(reward, abs=1e-3)
            assert (terminated[robot], truncated[robot]) == (end, cut)
            if end or cut:
                over[robot] = True
                ends.add(about["outcome"])
                assert info["outcome"][robot] == about["outcome"]
                assert info["is_success"][robot] == about["is_success"]
            for name, term in about["reward_terms"].items():
                assert info["reward_terms"][name][robot] == pytest.approx(term, abs=1e-3)
    assert over.all()
    assert ends >= {"collision", "timeout"}


def test_an_episode_that_ends_is_followed_by_the_next_in_the_same_step(scenes):
    config = SMALL.model_copy(update={"terminations": TerminationConfig(time_limit=1.0)})
    env = FlatVectorEnv(config, 3, scenes)
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    env.reset(seed=5)
    forward = np.zeros((3, 1), dtype=np.float32)
    for _ in range(9):
        _, _, terminated, truncated, _ = env.step(forward)
        assert not (terminated | truncated).any()
    states, _, terminated, truncated, info = env.step(forward)
    assert truncated.all()
    assert not terminated.any()
    assert (info["outcome"] == "timeout").all()
    assert not np.allclose(states, info["final_obs"])
    assert env.observation_space.contains(states)
    again, rewards, _, truncated, _ = env.step(forward)
    assert not truncated.any()
    assert np.isfinite(rewards).all()
    assert np.abs(again[:, :32] - states[:, :32]).max() < 2.0  # It goes on from there.


def test_a_robot_that_is_begun_again_leaves_the_others_alone(scenes):
    env, other = (FlatVectorEnv(SMALL, 2, scenes, autoreset=False) for _ in range(2))
    env.reset(seed=1)
    other.reset(seed=1)
    actions = np.full((2, 1), 0.5, dtype=np.float32)
    for _ in range(20):
        env.step(actions)
        other.step(actions)
    before, _ = env.reset(seed=[None, 9], options={"reset_mask": np.array([False, True])})
    fresh, _ = FlatVectorEnv(SMALL, 1, scenes).reset(seed=9)
    np.testing.assert_array_equal(before[1], fresh[0])
    np.testing.assert_array_equal(env.step(actions)[0][0], other.step(actions)[0][0])


def test_gymnasium_makes_it():
    env = gym.make_vec("andabata/Maze2D-v0", num_envs=2, config=SMALL)
    assert isinstance(env.unwrapped, FlatVectorEnv)
    env.reset(seed=0)
    states, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(states)
    env.close()


def test_nonsense_is_named(scenes):
    with pytest.raises(ValueError, match="expected a maze, horizontal scanner"):
        FlatVectorEnv(stage_config("Maze3D"), 2, scenes)
    env = FlatVectorEnv(SMALL, 2, scenes)
    with pytest.raises(ValueError, match="reset: expected before the first step"):
        env.step(np.zeros((2, 1), dtype=np.float32))
    with pytest.raises(ValueError, match="seed: expected 2"):
        env.reset(seed=[1])
    env.reset(seed=0)
    with pytest.raises(ValueError, match="expected finite"):
        env.step(np.array([[np.nan], [0.0]], dtype=np.float32))


def test_episodes_depend_on_their_seeds_alone(scenes):
    layers = [(0.1 * np.random.default_rng(k).normal(size=s), np.zeros(s[0])) for k, s in SHAPES]
    policy = Policy(
        tuple((w.astype(np.float32), b.astype(np.float32)) for w, b in layers), 10.0, 0.5, 0.15
    )
    seeds = [EpisodeSpec(0, (3, 0, k), (None, 0.2)[k % 2]) for k in range(9)]
    played = []
    for lanes in (1, 4, 16):
        robots = FlatVectorEnv(SMALL, lanes, scenes, autoreset=False)
        played.append(play_together(robots, policy, 5, seeds))
    alone = [play(OffroadEnv(SMALL, scenes=scenes), policy, 5, seed) for seed in seeds]
    for few, more, many, one in zip(*played, alone, strict=True):
        for other in (more, many):
            for name in ("states", "actions", "rewards", "last_state"):
                np.testing.assert_array_equal(getattr(few, name), getattr(other, name))
            assert (few.outcome, few.steps) == (other.outcome, other.steps)
        # The last bits of sines differ from a single environment's.
        assert (few.outcome, few.is_success, few.terminated, few.steps) == (
            one.outcome,
            one.is_success,
            one.terminated,
            one.steps,
        )
        np.testing.assert_allclose(few.states, one.states, atol=1e-3)
        np.testing.assert_allclose(few.rewards, one.rewards, atol=0.1)
    assert len({episode.outcome for episode in alone}) > 1
