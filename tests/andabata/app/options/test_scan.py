"""Settings of a scan and of reading clouds, from the options of the command."""

import numpy as np
import pytest

from andabata.app.options.scan import CloudOptions, ScanOptions
from andabata.configuration.usage import UsageError


def test_the_options_are_the_settings_of_a_scan():
    """Each reaches its field; the height is that of the sensor where no mounting has one."""
    config = ScanOptions(0.9, ["0.2,0,0,10,0"], 0.5, "1,2,3", True, 64, 0.3).resolve()
    assert (config.mounting.x, config.mounting.z) == (0.2, 0.9)
    pitch = config.mounting.rotation.as_euler("ZYX", degrees=True)[1]
    assert pitch == pytest.approx(10.0)
    assert (config.own_body, config.level, config.n_sectors) == (0.5, True, 64)
    assert config.max_traversable_vegetation == 0.3
    np.testing.assert_allclose(config.sensor_at, (1, 2, 3))
    assert ScanOptions().resolve().sensor_at is None


def test_a_position_has_three_numbers():
    """The error names the option."""
    with pytest.raises(UsageError, match="--sensor-at: expected 3 numbers"):
        ScanOptions(sensor_at="1,2").resolve()
    with pytest.raises(UsageError, match="--mounting: expected one of laser"):
        ScanOptions(mounting=["imu=0,0,0,0,0"]).mountings()


def test_the_options_say_how_clouds_are_read():
    """Table of classes, unit, columns, topic and number."""
    source = CloudOptions(5, 0.3048, "/points", -1, "goose").source({})
    assert (source.columns, source.unit, source.topic, source.number) == (5, 0.3048, "/points", -1)
    assert source.labels.name == "goose"
    assert CloudOptions().source({}).labels is None
