"""SPN's settings: the paper's rooms and laser, sizes of observations, names."""

import pytest
from pydantic import ValidationError

from andabata.machine.planar.lidar import TRAINING_LIDAR
from andabata.tasks.rooms.env import room_renderer
from andabata.tasks.rooms.observations import LidarRandomization
from andabata.tasks.rooms.spn_config import TRAINING_ROOMS, SpnConfig, spn_config


def test_the_defaults_are_those_of_the_paper():
    """Four rooms, 1080 beams all around, 400 steps of 0.2 s, a robot of 0.2 m at 0.5 m/s."""
    config = SpnConfig()
    assert (config.task, config.rooms) == ("spn", TRAINING_ROOMS)
    assert (config.lidar, config.lidar.count) == (TRAINING_LIDAR, 1080)
    assert config.terminations.time_limit / config.robot.period == pytest.approx(400)
    assert (config.robot.radius, config.robot.max_speed) == (0.2, 0.5)
    assert config.terminations.goal_radius == 0.3
    assert config.random_rooms == config.earlier_scan == 0


def test_settings_say_the_size_of_observations():
    """All beams become points without a number of them; a paper's goal has two numbers."""
    config = SpnConfig(points=None, goal_encoding="polar")
    assert config.observations.size == 3 * 1080 + 36 + 2 + 2
    assert SpnConfig().capacity == 120
    small = SpnConfig(points=10, randomization=LidarRandomization())
    assert room_renderer(small).terms.points == 10
    assert small.fixed.randomization is None


def test_wrong_settings_are_refused():
    """Unknown fields are named, and a curriculum needs rooms."""
    with pytest.raises(ValidationError, match="favorite"):
        SpnConfig.model_validate({"favorite": 0.5})
    with pytest.raises(ValidationError, match="rooms"):
        SpnConfig(rooms=())


def test_names_change_rooms_and_laser_alone():
    """What is not named stays that of the settings."""
    base = SpnConfig(random_rooms=3, points=7)
    named = spn_config("spn-env5", "ten-beams", base)
    changes = {"rooms": ("spn-env5",), "lidar": named.lidar}
    assert named == base.model_copy(update=changes)
    assert named.lidar.count == 10
    assert spn_config(config=base) == base
