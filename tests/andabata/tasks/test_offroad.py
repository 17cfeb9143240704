"""The Gymnasium environments keep Gymnasium's and Stable-Baselines3's contracts."""

import gc
import weakref

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from stable_baselines3.common.env_checker import check_env as check_sb3

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import make_offroad, stage_config
from andabata.tasks.registration import STAGES

IDS = [f"andabata/{stage}-v0" for stage in STAGES]


@pytest.fixture(scope="module", params=IDS)
def env(request, scenes):
    config = stage_config(request.param.split("/")[1].split("-")[0])
    small = config.model_copy(update={"seeds": (0,)})
    made = gym.make(request.param, config=small, scenes=scenes)
    yield made
    made.close()


@pytest.mark.parametrize("name", IDS)
def test_gymnasium_and_stable_baselines_accept_them(name):
    env = gym.make(name).unwrapped
    check_gymnasium(env, skip_render_check=True)
    check_sb3(env, skip_render_check=True)
    env.close()


def test_the_same_seed_gives_the_same_episode(env):
    def episode():
        states, rewards = [env.reset(seed=11)[0]], []
        for k in range(30):
            state, reward, *_ = env.step(np.array([np.sin(k / 5)], dtype=np.float32))
            states.append(state)
            rewards.append(reward)
        return np.array(states), np.array(rewards)

    first, second = episode(), episode()
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def test_the_reward_is_the_sum_of_its_terms(env):
    env.reset(seed=3)
    _, reward, _, _, info = env.step(np.zeros(1, dtype=np.float32))
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert set(info["reward_terms"]) == {"attraction", "repulsion", "collision", "tipover"}


def test_the_dead_zone_and_the_previous_actions_are_in_the_state(env):
    env.reset(seed=4)
    env.step(np.array([0.8], dtype=np.float32))
    state = env.step(np.array([0.2], dtype=np.float32))[0]  # 0.1 rad/s: inside the dead zone.
    np.testing.assert_allclose(state[32:34], [0.0, 0.4], atol=1e-6)


def test_time_outs_truncate_and_collisions_terminate(scenes):
    config = stage_config("Maze2D").model_copy(
        update={"seeds": (0,), "terminations": TerminationConfig(time_limit=1.0)}
    )
    env = make_offroad("Maze2D", config, scenes=scenes)
    env.reset(seed=0)
    for _ in range(10):
        _, _, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated, info["outcome"]) == (False, True, "timeout")
    env = make_offroad(
        "Maze2D",
        config.model_copy(update={"terminations": TerminationConfig(time_limit=400.0)}),
        scenes=scenes,
    )
    env.reset(seed=0)
    over, steps = False, 0
    while not over and steps < 4000:  # A straight line ends at a wall.
        _, reward, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        over, steps = terminated or truncated, steps + 1
    assert (terminated, info["outcome"], info["is_success"]) == (True, "collision", False)
    assert reward < -900


@pytest.mark.parametrize("heading", ["goal", "subgoal"])
def test_whoever_looks_less_often_sees_the_same_when_it_does(scenes, heading):
    def drive(every):
        changes = {"seeds": (0,), "look_every": every, "heading": heading}
        env = make_offroad(
            "Maze3D", stage_config("Maze3D").model_copy(update=changes), scenes=scenes
        )
        states, attraction = [env.reset(seed=5)[0]], 0.0
        for k in range(40):
            turn = np.array([np.sin(k // 5)], dtype=np.float32)
            state, _, terminated, truncated, info = env.step(turn)
            assert not terminated
            assert not truncated
            states.append(state)
            attraction += info["reward_terms"]["attraction"]
        env.close()
        return np.array(states), attraction

    (often, gained), (seldom, again) = drive(1), drive(5)
    for k in range(40):
        np.testing.assert_array_equal(seldom[k], seldom[k - k % 5])
    np.testing.assert_array_equal(often[::5], seldom[::5])
    assert again == pytest.approx(gained, rel=0.02)


def test_it_keeps_the_robot_of_one_world_alone(scenes):
    """Each holds maps of its world: those of a whole pool would fill the memory."""
    env = make_offroad("Maze3D", scenes=scenes)
    with pytest.raises(ValueError, match="reset: expected it before the first step"):
        env.step(np.zeros(1, dtype=np.float32))
    env.reset(seed=0, options={"world_seed": 0})
    first = weakref.ref(env._simulated_robot)
    env.reset(seed=1, options={"world_seed": 0})
    assert env._simulated_robot is first()
    env.reset(seed=2, options={"world_seed": 1})
    gc.collect()
    assert first() is None
    env.close()


def test_an_unknown_stage_is_named():
    with pytest.raises(ValueError, match="expected Maze2D, Maze3D or Natural, got 'Moon'"):
        stage_config("Moon")
