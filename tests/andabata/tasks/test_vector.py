"""Many robots, in one process or in two: the same as each alone, to the bit."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.vector import OffroadVectorEnv, make_vector

SMALL = stage_config("Maze3D").model_copy(
    update={"seeds": (0,), "terminations": TerminationConfig(time_limit=6.0)}
)


def drive(env, steps, count):
    """Return the answers of a reset and a number of steps."""
    found = [env.reset(seed=7)]
    for k in range(steps):
        actions = np.array([[np.sin(k / (5 + n))] for n in range(count)], dtype=np.float32)
        found.append(env.step(actions))
    env.close()
    return found


@pytest.mark.parametrize("workers", [1, 2])
def test_robots_together_do_what_each_does_alone(scenes, workers):
    """With any number of processes robot k does what it does alone with seed + k."""
    count, steps = 3, 30
    if workers == 1:
        env = make_vector("Maze3D", count, SMALL, workers, scenes)
    else:
        env = OffroadVectorEnv(SMALL, count, workers)
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    together = drive(env, steps, count)
    ends = 0
    for robot in range(count):
        alone = OffroadEnv(SMALL, scenes=scenes)
        state, _ = alone.reset(seed=7 + robot)
        np.testing.assert_array_equal(together[0][0][robot], state)
        for k in range(steps):
            action = np.array([np.sin(k / (5 + robot))], dtype=np.float32)
            state, reward, end, cut, info = alone.step(action)
            states, rewards, terminated, truncated, infos = together[1 + k]
            assert (rewards[robot], terminated[robot], truncated[robot]) == (reward, end, cut)
            if end or cut:
                ends += 1
                np.testing.assert_array_equal(infos["final_obs"][robot], state)
                assert infos["final_info"]["outcome"][robot] == info["outcome"]
                state, _ = alone.reset()
            np.testing.assert_array_equal(states[robot], state)
        alone.close()
    assert ends == count  # The cloud takes 3.4 s of the 6.


def test_gymnasium_makes_robots_in_processes():
    """``make_vec`` with workers starts processes; an error of one is raised here."""
    env = gym.make_vec("andabata/Maze3D-v0", num_envs=2, config=SMALL, workers=2)
    assert isinstance(env.unwrapped, OffroadVectorEnv)
    states, _ = env.reset(seed=3)
    assert env.observation_space.contains(states)
    with pytest.raises(ValueError, match="command: expected a finite twist"):
        env.step(np.full((2, 1), np.nan, dtype=np.float32))
    env.close()
