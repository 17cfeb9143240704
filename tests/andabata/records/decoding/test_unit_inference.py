"""Inference of units by the size of the numbers."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.geo_reference import GeoReference
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.row_history import RowHistory
from andabata.records.decoding.unit_inference import infer_units
from andabata.records.decoding.units import UnitError, UnitFactors, si_factor
from andabata.records.remarks import Remarks
from tests.support import computed_bags

ROBOT = RobotModel()
TOPIC = {"/imu": topics.IMU, "/encoder_data": topics.ENCODERS, "/mag_orientation": topics.MAG}


@pytest.fixture(scope="module")
def rows():
    """Return the rows of a winding drive."""
    return [row for row in computed_bags.drive(8.0) if row.topic in TOPIC]


def units_of(rows, asked=None, **scales):
    """Return the inferred units of rows whose numbers were scaled, and the remarks."""
    decoder, history, remarks = MessageDecoder(ROBOT, UnitFactors()), RowHistory(), Remarks()
    for row in rows:
        topic, stamp = TOPIC[row.topic], row.stamp_ns / 1e9
        found = np.array(decoder.raw(topic, row.content, stamp))
        if topic is topics.IMU:
            found[:3] *= scales.get("gyro", 1.0)
            found[3:] *= scales.get("force", 1.0)
        if topic is topics.MAG:
            found *= scales.get("field", 1.0)
        if topic is topics.ENCODERS:
            found *= scales.get("wheels", 1.0)
            found = found[:: scales.get("order", 1)]
        history.add(topic, [stamp, *found], row.kind)
    return infer_units(history, ROBOT, asked or {}, remarks, 43.6e-6), " ".join(remarks.texts)


def test_si_is_kept_without_a_remark(rows):
    """SI numbers keep factors of 1."""
    assert units_of(rows) == (UnitFactors(), "")
    row = [1.0, 0.1, 0.2]
    assert MessageDecoder(ROBOT, UnitFactors()).scaled(topics.ENCODERS, row) is row


@pytest.mark.parametrize(
    ("quantity", "scale", "name"),
    [
        ({"force": 1 / 9.81}, ("acceleration", 9.81), "g"),
        ({"force": 1000 / 9.81}, ("acceleration", 9.81e-3), "mg"),
        ({"gyro": 180 / np.pi}, ("angular_velocity", np.pi / 180), "deg/s"),
        ({"field": 1e6}, ("magnetic_field", 1e-6), "uT"),
        ({"field": 1e9}, ("magnetic_field", 1e-9), "nT"),
        ({"field": 1e3}, ("magnetic_field", 1e-3), "mT"),
        ({"field": 1e4}, ("magnetic_field", 1e-4), "G"),
        ({"field": 1e7}, ("magnetic_field", 1e-7), "mG"),
        ({"field": 1 / 43.6e-6}, ("magnetic_field", 43.6e-6), "direction"),
        ({"field": 3000 / 43.6e-6}, ("magnetic_field", 43.6e-6 / 3000), "direction"),
        ({"wheels": 0.1}, ("wheels", 10.0), "m/s"),
        ({"wheels": 60 / (2 * np.pi)}, ("wheels", 2 * np.pi / 60), "rpm"),
        ({"wheels": 180 / np.pi}, ("wheels", np.pi / 180), "deg/s"),
        ({"wheels": -1.0}, ("wheels", -1.0), "backwards"),
    ],
)
def test_another_unit_is_inferred_by_its_size(rows, quantity, scale, name):
    """Each unit is found, alone, and remarked on."""
    units, text = units_of(rows, **quantity)
    field, factor = scale
    assert getattr(units, field) == pytest.approx(factor, rel=0.02)
    assert replace(units, **{field: 1.0}) == UnitFactors()
    assert name in text


def test_swapped_sides_are_remarked_on(rows):
    """Exchanged sides keep their factor, with a remark."""
    units, text = units_of(rows, order=-1)
    assert units == UnitFactors()
    assert "left and right are swapped" in text


@pytest.mark.parametrize(
    ("quantity", "match"),
    [
        ({"force": 0.0}, "/imu: expected accelerations around 9.8 m/s2.*got 0 .*--unit"),
        ({"force": 0.3}, "got 2.943"),
        ({"gyro": 4.0}, "angular velocities in rad/s or deg/s.*turns by 0.2"),
        ({"gyro": 0.0}, "/imu: expected numbers that change"),
        ({"field": 0.0}, "/mag_orientation: expected a field"),
        ({"wheels": 0.0}, "/encoder_data: expected numbers that change"),
        ({"wheels": 0.4e-3}, "wheel speeds in rad/s, m/s, rpm or deg/s.*turns by 2.5e"),
    ],
)
def test_numbers_that_fit_no_unit_are_refused(rows, quantity, match):
    """Impossible numbers are errors with the topic, the number and the option."""
    with pytest.raises(UnitError, match=match):
        units_of(rows, **quantity)


def test_a_given_factor_outranks_inference(rows):
    """Factors of the user are taken as they are, whatever the numbers."""
    asked = {"acceleration": 3.0, "angular_velocity": 1.0, "magnetic_field": 2.0, "wheels": 4e3}
    units, _ = units_of(rows, asked, force=0.3, field=0.0, wheels=0.25e-3)
    assert units == UnitFactors(**asked)
    assert si_factor("wheels", "m/s", ROBOT) == 10.0
    assert si_factor("acceleration", "0.25", ROBOT) == 0.25
    for quantity, unit in (
        ("wheels", "knots"),
        ("mass", "kg"),
        ("wheels", "0"),
        ("wheels", "nan"),
    ):
        with pytest.raises(ValueError, match="--unit"):
            si_factor(quantity, unit, ROBOT)


def test_without_turns_gyro_and_wheels_are_kept():
    """Without a turn the units of the message types are assumed."""
    still = [row for row in computed_bags.drive(5.0, turning=0.0) if row.topic in TOPIC]
    assert units_of(still, gyro=180 / np.pi, wheels=0.1)[0] == UnitFactors()


def test_a_direction_gets_the_strength_of_the_earths_field(rows):
    """A unit vector is scaled to the field of the place."""
    units, _ = units_of(rows, field=1 / 43.6e-6)
    assert units.magnetic_field == pytest.approx(GeoReference().field * 1e-6, rel=0.01)
