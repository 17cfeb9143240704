"""SPN's environments by names: rooms, lasers, Gymnasium's id."""

import gymnasium as gym
import pytest

import andabata
from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.tasks.rooms.spn import make_spn, make_spn_vector
from andabata.tasks.rooms.spn_config import SpnConfig
from worlds.rooms.catalogue import UnknownRoomError

SMALL = SpnConfig(rooms=("spn-env0",), lidar=PLANAR_LIDARS["ten-beams"], points=10)


def test_robots_are_made_by_names():
    """Rooms and lasers are taken by name; a name without a room is refused."""
    env = make_spn("spn-env5", "ten-beams", SMALL)
    assert env.observation_space.contains(env.reset(seed=0)[0])
    many = make_spn_vector(2, ["spn-env5", "spn-env4"], "90|10|4|0.1")
    assert many.config.rooms == ("spn-env5", "spn-env4")
    assert many.config.lidar.x == 0.1
    assert many.num_envs == 2
    with pytest.raises(UnknownRoomError, match="spn-env9"):
        make_spn("spn-env9")


def test_gymnasium_makes_one_and_many():
    """The id gives the robots of SPN's settings."""
    gym.register_envs(andabata)
    env = gym.make("andabata/SPN-v0", config=SMALL)
    assert env.unwrapped.config == SMALL
    assert gym.make_vec("andabata/SPN-v0", num_envs=3, config=SMALL).unwrapped.config == SMALL
