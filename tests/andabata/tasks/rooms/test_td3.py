"""TD3's environments by names: rooms, lasers, states, Gymnasium's id."""

import gymnasium as gym
import numpy as np
import pytest

import andabata
from andabata.tasks.rooms.td3 import make_td3, make_td3_vector
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from worlds.rooms.catalogue import UnknownRoomError

POOL = Td3TaskConfig(random_rooms=4, random_kind="clutter-movers")


def test_robots_are_made_by_names():
    """Rooms, lasers and states are taken by name; a name without a room is refused."""
    env = make_td3("clutter-7", state="gdae")
    assert env.observation_space.shape == (24,)
    assert env.observation_space.contains(env.reset(seed=0)[0])
    many = make_td3_vector(3, ["clutter-7", "clutter-movers-9"], "270|1|8")
    assert many.config.all_rooms == ("clutter-7", "clutter-movers-9")
    assert many.single_observation_space.shape == (45,)
    with pytest.raises(UnknownRoomError, match="td3-env9"):
        make_td3("td3-env9")


def test_gymnasium_makes_one_and_many():
    """The id gives robots that drive in a pool of random rooms, each its own."""
    gym.register_envs(andabata)
    env = gym.make("andabata/TD3-v0", config=POOL)
    assert env.unwrapped.config == POOL
    state, info = env.reset(seed=3)
    assert env.observation_space.contains(state)
    robots = gym.make_vec("andabata/TD3-v0", num_envs=16, config=POOL)
    states, infos = robots.reset(seed=3)
    np.testing.assert_array_equal(states[0], state)
    assert infos["world_seed"][0] == info["world_seed"]
    assert set(infos["world_seed"].tolist()) == {0, 1, 2, 3}
    actions = np.random.default_rng(0).uniform(-1, 1, (16, 2)).astype(np.float32)
    assert robots.observation_space.contains(robots.step(actions)[0])


def test_a_drive_by_the_batch_is_a_drive_alone():
    """Robot k of many does what one robot does with seed + k, among movers too."""
    config = POOL.model_copy(update={"earlier_scan": 2, "noise": 0.01})
    many, alone = make_td3_vector(3, config=config), make_td3(config=config)
    states, _ = many.reset(seed=7)
    single, _ = alone.reset(seed=9)
    action = np.array([0.1, 0.4], dtype=np.float32)
    for _ in range(20):
        np.testing.assert_array_equal(states[2], single)
        states, rewards, terminated, _, _ = many.step(np.tile(action, (3, 1)))
        single, reward, ended, _, _ = alone.step(action)
        assert (rewards[2], terminated[2]) == (reward, ended)
        if ended:
            break
