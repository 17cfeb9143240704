"""Units as factors to SI."""

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.decoding.units import UNITS, UnitError, UnitFactors, si_factor, units_of

ROBOT = RobotModel()


@pytest.mark.parametrize(
    ("quantity", "unit", "value", "si"),
    [
        ("acceleration", "g", 1.0, 9.81),
        ("acceleration", "mg", 1000.0, 9.81),
        ("angular_velocity", "deg/s", 180.0, np.pi),
        ("magnetic_field", "uT", 48.0, 48e-6),
        ("magnetic_field", "nT", 48e3, 48e-6),
        ("magnetic_field", "mT", 0.048, 48e-6),
        ("magnetic_field", "G", 0.48, 48e-6),
        ("magnetic_field", "mG", 480.0, 48e-6),
        ("wheels", "rpm", 60.0, 2 * np.pi),
        ("wheels", "deg/s", 360.0, 2 * np.pi),
        ("wheels", "m/s", ROBOT.wheel_radius, 1.0),
        ("wheels", "2.5", 2.0, 5.0),
    ],
)
def test_factors_bring_values_to_si(quantity, unit, value, si):
    """A value times its factor is the known value in SI."""
    assert value * si_factor(quantity, unit, ROBOT) == pytest.approx(si, rel=1e-3)


def test_si_has_a_factor_of_one():
    """The first unit of each quantity is SI, and the table is not written to."""
    assert all(next(iter(units.values())) == 1.0 for units in UNITS.values())
    assert UnitFactors() == UnitFactors(1.0, 1.0, 1.0, 1.0)
    assert UNITS["acceleration"]["g"] == pytest.approx(1000 * UNITS["acceleration"]["mg"])
    assert "m/s" in units_of("wheels", ROBOT)
    assert "m/s" not in UNITS["wheels"]


@pytest.mark.parametrize("unit", ["knots", "-knots", "0", "nan", "inf", "", "-"])
def test_other_units_are_refused(unit):
    """Neither a name nor a number other than zero: the error lists the names."""
    with pytest.raises(ValueError, match=r"--unit wheels: expected one of rad/s, rpm, deg/s, m/s"):
        si_factor("wheels", unit, ROBOT)
    with pytest.raises(ValueError, match="--unit: expected one of acceleration"):
        si_factor("mass", unit, ROBOT)


def test_the_factors_of_one_topic_replace_the_old_ones():
    """Only the quantities of the topic change."""
    new, old = UnitFactors(2.0, 3.0, 4.0, 5.0), UnitFactors(-2.0, -3.0, -4.0, -5.0)
    assert new.merged_into(old, topics.IMU) == UnitFactors(2.0, 3.0, -4.0, -5.0)
    assert new.merged_into(old, topics.MAG) == UnitFactors(-2.0, -3.0, 4.0, -5.0)
    assert new.merged_into(old, topics.ENCODERS) == UnitFactors(-2.0, -3.0, -4.0, 5.0)
    assert new.merged_into(old, None) == new


def test_a_unit_error_names_its_topic():
    """The reason alone is kept for counting."""
    error = UnitError(topics.IMU, "expected g")
    assert (str(error), error.reason) == ("/imu: expected g", "expected g")


@pytest.mark.parametrize(("unit", "factor"), [("-1", -1.0), ("-m/s2", -1.0), ("-g", -9.81)])
def test_a_minus_sign_turns_the_readings_round(unit, factor):
    """A name and a number may both be negative."""
    assert si_factor("acceleration", unit, RobotModel()) == pytest.approx(factor, rel=1e-3)
