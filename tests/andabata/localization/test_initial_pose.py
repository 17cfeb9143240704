"""A pose from gravity, the compass and a fix: known answers, and rows that say nothing."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.datum import Datum, DatumError, consistent_fixes, make_datum
from andabata.localization.initial_pose import initial_pose, levelled_field
from andabata.machine.geo_reference import GeoReference
from andabata.machine.sensor_readings import SensorReadings

REFERENCE = GeoReference(declination_deg=-9.5, inclination_deg=69.0, field=53.3)


def standing(roll=0.1, pitch=-0.2, yaw=1.0, place=(3.0, -2.0, 0.5), seconds=2.0, rate=50):
    """Return what a robot at rest senses without any noise."""
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


@pytest.mark.parametrize("yaw", [-3.0, -0.7, 0.0, 1.0, 2.9])
def test_a_robot_at_rest_is_found_exactly(yaw):
    pose = initial_pose(standing(yaw=yaw), REFERENCE)
    np.testing.assert_allclose(pose.position, [3.0, -2.0, 0.5], atol=1e-6)
    angles = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
    np.testing.assert_allclose(angles, [yaw, -0.2, 0.1], atol=1e-6)


def test_a_declination_turns_the_heading():
    turned = REFERENCE.model_copy(update={"declination_deg": 0.5})
    first, second = (initial_pose(standing(), r) for r in (REFERENCE, turned))
    assert np.rad2deg(second.yaw - first.yaw) == pytest.approx(-10.0, abs=1e-6)


def test_what_was_sensed_long_before_the_fix_does_not_count():
    before, now = standing(yaw=-2.0, seconds=10.0), standing(yaw=1.0, seconds=2.0)
    readings = SensorReadings(
        12.0,
        imu=np.concatenate([before.imu, now.imu + np.array([10.0, *np.zeros(6)])]),
        mag=np.concatenate([before.mag, now.mag + np.array([10.0, *np.zeros(3)])]),
        gnss=now.gnss,
    )
    assert initial_pose(readings, REFERENCE).yaw == pytest.approx(1.0, abs=1e-6)


def test_a_fix_without_altitude_or_covariance_will_do():
    readings = standing()
    readings.gnss[0, 3:] = np.nan
    pose = initial_pose(readings, REFERENCE)
    np.testing.assert_allclose(pose.position, [3.0, -2.0, 0.0], atol=1e-3)


@pytest.mark.parametrize(
    ("name", "column", "value"),
    [("fixes", 4, np.inf), ("fixes", 1, 120.0), ("imu", 5, np.nan), ("field", 2, np.nan)],
)
def test_a_sense_that_says_nothing_gives_no_pose(name, column, value):
    readings = standing()
    getattr(readings, name)[:, column] = value
    assert initial_pose(readings, REFERENCE) is None
    assert initial_pose(SensorReadings(1.0), REFERENCE) is None


def test_the_levelled_field_dips_as_the_place_says():
    ahead, left, up = levelled_field(standing()) * 1e6
    assert np.hypot(ahead, left) == pytest.approx(np.hypot(*REFERENCE.flux[:2]))
    assert up == pytest.approx(REFERENCE.flux[2])


def fixes(*places):
    """Return a fix each second at places in the map [m]."""
    geodetic = REFERENCE.to_geodetic(np.array(places, dtype=float))
    return np.column_stack([np.arange(len(places)), geodetic, np.full(len(places), 0.5)])


def test_the_first_fix_that_fits_is_the_datum():
    rows = fixes((6000, 0, 0), (1, 2, 3), (2, 2, 3), (3, 2, 3))
    assert consistent_fixes(rows).tolist() == [False, True, True, True]
    datum = make_datum({}, rows, 2026.9)
    np.testing.assert_allclose(datum.reference.to_map(rows[1:2, 1:4]), 0, atol=1e-6)
    assert datum.loose
    assert make_datum({}, rows[:0], 2026.9) is None


def test_longitudes_of_both_conventions_give_a_datum():
    rows = fixes((1, 2, 3), (2, 2, 3))
    rows[:, 2] += 360.0
    reference = make_datum({}, rows, 2026.9).reference
    assert reference.longitude_deg == pytest.approx(REFERENCE.longitude_deg, abs=1e-4)


def test_the_users_numbers_win_over_the_model():
    rows = fixes((1, 2, 3))
    told = {"declination_deg": 5.0, "inclination_deg": 40.0, "field": 30.0}
    datum = make_datum(told, rows, 2026.9)
    assert datum.reference.declination_deg == 5.0
    assert datum.reference.field == 30.0
    assert not datum.loose
    assert datum.magnetic_source == "given (declination_deg, field, inclination_deg)"
    assert datum.with_compass(standing()).expected.field == 30.0


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        (lambda rows: rows[:, [0, 1, 2, 3, 4]] + np.array([0, 1, 0, 0, 0]), "111 km away;"),
        (lambda rows: rows[:, [0, 2, 1, 3, 4]], "swapped"),
        (lambda rows: np.column_stack([rows[:, :1], np.deg2rad(rows[:, 1:3]), rows[:, 3:]]), "rad"),
    ],
)
def test_fixes_far_from_a_given_datum_say_what_is_wrong(change, hint):
    given = {"latitude_deg": REFERENCE.latitude_deg, "longitude_deg": REFERENCE.longitude_deg}
    assert make_datum(given, fixes((9000, 0, 0)), 2026.9).source == "given"
    with pytest.raises(DatumError, match=hint):
        make_datum(given, change(fixes((1, 2, 3))), 2026.9)


@pytest.mark.parametrize("altitude", [0.0, 60.0, 105.0])
def test_a_given_altitude_of_another_kind_does_not_matter_to_a_told_start(altitude):
    given = {"latitude_deg": REFERENCE.latitude_deg, "longitude_deg": REFERENCE.longitude_deg}
    rows = fixes((1, 2, 0.0))
    datum = make_datum({**given, "altitude": altitude}, rows, 2026.9, np.zeros(3))
    assert abs(datum.reference.to_map(rows[:, 1:4])[0, 2]) < 1e-3
    assert ("by the fixes" in datum.source) == (altitude != 60.0)


def test_a_datum_goes_there_and_back():
    datum = make_datum({}, fixes((1, 2, 3)), 2026.9).with_compass(standing())
    assert Datum.from_dict(datum.as_dict()) == datum
    with pytest.raises(DatumError, match="expected a place and a field"):
        Datum.from_dict({"datum": {"latitude_deg": "here"}})


def test_a_compass_that_reads_another_field_is_said():
    datum = make_datum({}, fixes((1, 2, 3)), 2026.9)
    away = datum.with_compass(standing())
    assert "the compass reads 53.3 uT" in away.notes[2]
    assert away.expected.inclination_deg == pytest.approx(69.0)
    assert away.expected.declination_deg == datum.reference.declination_deg
    near = {"inclination_deg": 69.0, "field": 53.3}
    assert len(make_datum(near, fixes((1, 2, 3)), 2026.9).with_compass(standing()).notes) == 2
