"""Datum of the map: given or from the first fixes, with the magnetic field there."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.datum import (
    Datum,
    DatumError,
    consistent_fixes,
    datum_from_heading,
    make_datum,
    rejected_fixes,
)
from andabata.machine.geo_reference import GeoReference
from andabata.machine.sensor_readings import SensorReadings

REFERENCE = GeoReference(declination_deg=-9.5, inclination_deg=69.0, field=53.3)


def at_rest(roll=0.1, pitch=-0.2, yaw=1.0, place=(3.0, -2.0, 0.5), seconds=2.0, rate=50):
    """Return the noiseless readings of a robot at rest."""
    stamps = np.arange(1, int(seconds * rate) + 1) / rate
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll]).inv()
    force = np.tile(turn.apply([0, 0, 9.81]), (len(stamps), 1))
    field = np.tile(turn.apply(REFERENCE.flux) * 1e-6, (len(stamps), 1))
    fix = REFERENCE.to_geodetic(np.array([place]))[0]
    return SensorReadings(
        seconds,
        imu=np.column_stack([stamps, np.zeros((len(stamps), 3)), force]),
        mag=np.column_stack([stamps, field]),
        gnss=np.array([[seconds - 0.2, *fix, 0.5]]),
    )


def fixes(*places):
    """Return a fix each second at places in the map [m]."""
    geodetic = REFERENCE.to_geodetic(np.array(places, dtype=float))
    return np.column_stack([np.arange(len(places)), geodetic, np.full(len(places), 0.5)])


def test_the_first_consistent_fix_is_the_datum():
    """An outlier at the start is left out; without fixes there is no datum."""
    rows = fixes((6000, 0, 0), (1, 2, 3), (2, 2, 3), (3, 2, 3))
    assert consistent_fixes(rows).tolist() == [False, True, True, True]
    datum = make_datum({}, rows, 2026.9)
    np.testing.assert_allclose(datum.reference.to_map(rows[1:2, 1:4]), 0, atol=1e-6)
    assert datum.heading_only
    assert make_datum({}, rows[:0], 2026.9) is None


def test_longitudes_of_both_conventions_give_a_datum():
    """Longitudes of 0 to 360 degrees are wrapped."""
    rows = fixes((1, 2, 3), (2, 2, 3))
    rows[:, 2] += 360.0
    reference = make_datum({}, rows, 2026.9).reference
    assert reference.longitude_deg == pytest.approx(REFERENCE.longitude_deg, abs=1e-4)


def test_given_numbers_replace_the_model():
    """Given declination, inclination and strength replace the model."""
    rows = fixes((1, 2, 3))
    given = {"declination_deg": 5.0, "inclination_deg": 40.0, "field": 30.0}
    datum = make_datum(given, rows, 2026.9)
    assert datum.reference.declination_deg == 5.0
    assert datum.reference.field == 30.0
    assert not datum.heading_only
    assert datum.magnetic_source == "given (declination_deg, field, inclination_deg)"
    assert datum.with_compass(at_rest()).expected.field == 30.0


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        (lambda rows: rows[:, [0, 1, 2, 3, 4]] + np.array([0, 1, 0, 0, 0]), "111 km away;"),
        (lambda rows: rows[:, [0, 2, 1, 3, 4]], "swapped"),
        (lambda rows: np.column_stack([rows[:, :1], np.deg2rad(rows[:, 1:3]), rows[:, 3:]]), "rad"),
    ],
)
def test_fixes_far_from_a_given_datum_are_an_error_with_a_hint(change, hint):
    """The error names the distance, and swapped or radian coordinates."""
    given = {"latitude_deg": REFERENCE.latitude_deg, "longitude_deg": REFERENCE.longitude_deg}
    assert make_datum(given, fixes((9000, 0, 0)), 2026.9).source == "given"
    with pytest.raises(DatumError, match=hint):
        make_datum(given, change(fixes((1, 2, 3))), 2026.9)


@pytest.mark.parametrize("altitude", [0.0, 60.0, 105.0])
def test_a_given_altitude_of_another_vertical_datum_is_replaced(altitude):
    """With a given start the altitude of the fixes holds."""
    given = {"latitude_deg": REFERENCE.latitude_deg, "longitude_deg": REFERENCE.longitude_deg}
    rows = fixes((1, 2, 0.0))
    datum = make_datum({**given, "altitude": altitude}, rows, 2026.9, np.zeros(3))
    assert abs(datum.reference.to_map(rows[:, 1:4])[0, 2]) < 1e-3
    assert ("by the fixes" in datum.source) == (altitude != 60.0)


def test_a_datum_survives_its_dictionary():
    """A datum equals that of its dictionary; an invalid one is an error."""
    datum = make_datum({}, fixes((1, 2, 3)), 2026.9).with_compass(at_rest())
    assert Datum.from_dict(datum.as_dict()) == datum
    with pytest.raises(DatumError, match="expected a place and a field"):
        Datum.from_dict({"datum": {"latitude_deg": "here"}})


def test_a_compass_that_measures_another_field_is_noted():
    """A misfit is noted, and the own field of the compass expected; a fit is not noted."""
    datum = make_datum({}, fixes((1, 2, 3)), 2026.9)
    away = datum.with_compass(at_rest())
    assert "the compass reads 53.3 uT" in away.notes[2]
    assert away.expected.inclination_deg == pytest.approx(69.0)
    assert away.expected.declination_deg == datum.reference.declination_deg
    near = {"inclination_deg": 69.0, "field": 53.3}
    assert len(make_datum(near, fixes((1, 2, 3)), 2026.9).with_compass(at_rest()).notes) == 2


def test_a_given_heading_gives_the_declination():
    """The declination is the one with which the compass measures the given heading."""
    datum = datum_from_heading(at_rest(yaw=1.0), 1.0)
    assert datum.expected.declination_deg == pytest.approx(REFERENCE.declination_deg)
    assert datum.expected.field == pytest.approx(REFERENCE.field)
    turned = datum_from_heading(at_rest(yaw=1.0), 1.2)
    assert turned.expected.declination_deg == pytest.approx(
        REFERENCE.declination_deg - np.rad2deg(0.2)
    )
    assert datum_from_heading(SensorReadings(1.0), 1.0).measured is None


def test_rejected_fixes_are_counted_up_to_a_stamp():
    """Outliers and impossible fixes count once each, and only before the stamp."""
    rows = fixes((6000, 0, 0), (1, 2, 3), (2, 2, 3), (3, 2, 3), (4, 2, 3))
    rows[3, 1] = 120.0
    assert sum(rejected_fixes(rows).values()) == 2
    assert sum(rejected_fixes(rows, 3.0).values()) == 1
    assert not rejected_fixes(rows[1:3])


def test_a_latitude_without_a_longitude_is_an_error():
    """Latitude and longitude are given together or not at all."""
    with pytest.raises(DatumError, match="got only latitude_deg"):
        make_datum({"latitude_deg": 40.0}, fixes((1, 2, 3)), 2026.9)


def test_a_given_start_shifts_the_origin():
    """The first fix lies at the given start instead of the origin."""
    rows = fixes((1, 2, 3), (2, 2, 3))
    start = np.array([10.0, -5.0, 0.0])
    datum = make_datum({}, rows, 2026.9, start)
    np.testing.assert_allclose(datum.reference.to_map(rows[:1, 1:4])[0], start, atol=1e-3)
