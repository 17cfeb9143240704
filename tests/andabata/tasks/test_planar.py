"""The base of planar tasks: episodes, seeds and options of many robots."""

import numpy as np
from gymnasium.vector import AutoresetMode

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.maze import MazeVectorEnv
from andabata.tasks.offroad import stage_config

SMALL = stage_config("Maze2D").model_copy(
    update={"seeds": (0, 1, 2), "terminations": TerminationConfig(time_limit=40.0)}
)


def test_the_next_episode_begins_in_the_same_step(scenes):
    """A time-out truncates, its last state is ``final_obs``, and the next episode goes on."""
    config = SMALL.model_copy(update={"terminations": TerminationConfig(time_limit=1.0)})
    env = MazeVectorEnv(config, 3, scenes)
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
    assert not info["is_success"].any()
    assert not np.allclose(states, info["final_obs"])
    assert env.observation_space.contains(states)
    again, rewards, _, truncated, _ = env.step(forward)
    assert not truncated.any()
    assert np.isfinite(rewards).all()
    assert np.abs(again[:, :32] - states[:, :32]).max() < 2.0  # It goes on from there.


def test_robots_of_one_seed_have_streams_of_their_own(scenes):
    """An integer seeds robot k with seed + k: other starts, and the same again next time."""
    env = MazeVectorEnv(SMALL, 4, scenes, autoreset=False)
    first, _ = env.reset(seed=5)
    again, _ = env.reset(seed=5)
    np.testing.assert_array_equal(first, again)
    assert len(np.unique(first, axis=0)) == 4
    shifted, _ = env.reset(seed=6)
    np.testing.assert_array_equal(shifted[:3], first[1:])


def test_options_choose_world_and_difficulty(scenes):
    """A world seed and a difficulty for each robot are taken from the options."""
    env = MazeVectorEnv(SMALL, 2, scenes, autoreset=False)
    options = {"world_seed": 1, "task": 0, "difficulty": [0.0, 0.5]}
    states, info = env.reset(seed=[3, 3], options=options)
    assert info["world_seed"].tolist() == [1, 1]
    assert not np.array_equal(states[0], states[1])
    same, _ = env.reset(seed=[3, 3], options={"world_seed": 1, "task": 0, "difficulty": 0.5})
    np.testing.assert_array_equal(same[0], same[1])
    np.testing.assert_array_equal(same[1], states[1])


def test_a_robot_that_begins_again_leaves_the_others_alone(scenes):
    """A reset of one robot changes nothing of another's drive."""
    env, other = (MazeVectorEnv(SMALL, 2, scenes, autoreset=False) for _ in range(2))
    env.reset(seed=1)
    other.reset(seed=1)
    actions = np.full((2, 1), 0.5, dtype=np.float32)
    for _ in range(20):
        env.step(actions)
        other.step(actions)
    before, _ = env.reset(seed=[None, 9], options={"reset_mask": np.array([False, True])})
    fresh, _ = MazeVectorEnv(SMALL, 1, scenes).reset(seed=9)
    np.testing.assert_array_equal(before[1], fresh[0])
    np.testing.assert_array_equal(env.step(actions)[0][0], other.step(actions)[0][0])
