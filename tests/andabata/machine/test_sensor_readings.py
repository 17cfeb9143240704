"""Sensor readings: the identity filter."""

from andabata.machine.sensor_readings import ReadingsFilter, SensorReadings, unfiltered


def test_the_default_filter_is_the_identity():
    """Unfiltered readings are the very same object, and absent sensors are None."""
    default: ReadingsFilter = unfiltered
    readings = SensorReadings(1.0)
    assert default(readings) is readings
    assert readings.mag is None
    assert readings.gnss is None
