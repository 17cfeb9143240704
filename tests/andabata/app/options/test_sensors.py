"""Options of recorded or real sensors become settings, mountings and names."""

import pytest

from andabata.app.options.sensors import SensorOptions, TopicOptions
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.usage import UsageError


def test_a_setting_wins_over_the_height_and_the_datum_over_a_setting():
    """``--set`` comes over ``--sensor-height``, and ``--datum`` over ``--set``."""
    sensors = SensorOptions(
        settings=["robot.lidar_height=0.5", "sensing.geo_reference.latitude_deg=10"],
        sensor_height=1.5,
        datum="40,-3",
    )
    found = sensors.configure(SimulatedRobotConfig())
    assert found.robot.lidar_height == 0.5
    assert found.sensing.geo_reference.latitude_deg == 40.0
    alone = SensorOptions(sensor_height=1.5).configure(SimulatedRobotConfig())
    assert alone.robot.lidar_height == 1.5


def test_a_recorded_configuration_is_kept_where_nothing_is_given():
    """Without options the base comes back as it is."""
    base = SimulatedRobotConfig(plant="kinematic")
    assert SensorOptions().configure(base) == base
    assert SensorOptions().mountings() == {}


def test_mountings_and_units_are_read_once():
    """Mountings, names and units come as dictionaries; wrong texts are usage errors."""
    assert set(SensorOptions(mounting=["imu=0,0,0,0,0", "1,0,0,0,0"]).mountings()) == {"imu", ""}
    topics = TopicOptions(["/fix=/gps"], ["wheels=rpm"])
    assert (topics.names(), topics.units()) == ({"/fix": "/gps"}, {"wheels": "rpm"})
    assert (TopicOptions().names(), TopicOptions().units()) == ({}, {})
    with pytest.raises(UsageError, match="--map"):
        TopicOptions(["/fix"]).names()
    with pytest.raises(UsageError, match="knots"):
        TopicOptions(None, ["wheels=knots"]).units()
