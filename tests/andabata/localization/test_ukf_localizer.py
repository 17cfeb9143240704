"""The robot's filter on real drives, with senses that lie, fall silent or come late."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig, Simulator
from worlds.catalogue import make_world, patch
from worlds.rays import RayScene
from worlds.world import Start

ROBOT = RobotModel()


def winding(seed, difficulty, start):
    """Return what is sensed in two minutes of a winding drive over a hill."""
    world = make_world("hill", seed, difficulty, patch("hill", 60.0, 0.25))
    rng = np.random.default_rng(0)
    sensing = SensingConfig(scanner="horizontal")
    simulator = Simulator(world, RayScene(world), ROBOT, "kinematic", sensing, rng)
    kinematics = SkidSteer(ROBOT)
    readings = [simulator.reset(start)]
    for k in range(1200):
        steering = 0.0 if k < 30 else 0.4 * np.sin(k / 40)
        speed = 0.0 if k < 30 else 0.3
        readings.append(simulator.step(kinematics.wheel_speeds(speed, steering), blind=True))
    simulator.close()
    return readings


@pytest.fixture(scope="module")
def drive():
    readings = winding(4, 0.3, Start(-8.0, 0.0, 0.3))
    assert not readings[-1].truth.collided
    return readings


def run(drive, change=lambda s: s, config=None, seconds=120.0):
    """Return the localizer and its errors in x, y [m] and yaw [rad] after each step."""
    localizer = UkfLocalizer(config or UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    errors = []
    for readings in drive:
        if readings.stamp > seconds:
            break
        localizer.update(change(readings))
        truth, pose = readings.truth.pose, localizer.pose
        errors.append([*(pose.position[:2] - truth.position[:2]), wrap(pose.yaw - truth.yaw)])
    return localizer, np.array(errors)


def position(errors):
    return float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()))


def test_it_knows_where_it_is(drive):
    localizer, errors = run(drive)
    assert position(errors) < 0.6
    assert np.rad2deg(np.sqrt((errors[:, 2] ** 2).mean())) < 1.0
    assert localizer.health is Health.OK
    assert np.linalg.eigvalsh(localizer.covariance).min() > 0
    assert localizer.counts["imu"] == (12_000, 0, 0)


def test_the_odometry_never_jumps_though_the_map_pose_does(drive):
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    steps, before = [], localizer.odometry.position
    for readings in drive:
        localizer.update(readings)
        steps.append(np.hypot(*(localizer.odometry.position - before)[:2]))
        before = localizer.odometry.position
    assert max(steps) < 0.3 * 0.1 * 1.3
    assert localizer.track.latest == pytest.approx(drive[-1].stamp)


def test_a_late_fix_is_worth_what_a_punctual_one_is(drive):
    held = []

    def later(readings):
        held.append(readings.gnss)
        late = held[-10] if len(held) >= 10 else None
        return replace(readings, gnss=late)

    _, punctual = run(drive)
    localizer, late = run(drive, later)
    believed, _, refused = localizer.counts["gnss"]
    assert believed > 90
    assert refused == 0
    # The second from the last fix to its arrival is all the difference.
    np.testing.assert_allclose(late[-5, :2], punctual[-5, :2], atol=0.15)


def test_a_fix_older_than_the_memory_is_refused(drive):
    localizer, _ = run(drive, seconds=10.0)
    old = drive[1].gnss
    given = np.array([[3.0, 36.715, -4.478, 60.0, 0.5]])
    assert old is None or len(old) == 0
    refused = localizer.counts["gnss"][2]
    localizer.update(replace(drive[102], gnss=given))
    assert localizer.counts["gnss"][2] == refused + 1


def test_a_jump_of_ten_kilometres_moves_nothing(drive):
    def jumping(readings):
        fixes = readings.gnss
        if fixes is not None and len(fixes) and 40 < readings.stamp < 50:
            fixes = fixes + np.array([0, 0.1, 0, 0, 0])
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, jumping)
    assert position(errors) < 0.7
    assert localizer.counts["gnss"][1] >= 9


def test_spinning_wheels_fool_it_for_seconds_and_not_for_ever():
    """The robot pushes against a tree: wheels turn, satellites say that it stays."""
    blocked = winding(6, 0.4, Start(0.0, -12.0, 1.0))
    assert blocked[-1].truth.collided
    localizer, errors = run(blocked)
    far = np.hypot(*errors[:, :2].T)
    assert far.max() < 10.0
    assert np.median(far) < 2.5
    assert np.rad2deg(np.abs(errors[:, 2])).max() < 6.0
    assert localizer.counts["gnss"][1] > 0


@pytest.mark.parametrize("sense", ["imu", "encoders", "field", "fixes"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_nonsense_is_refused_and_counted(drive, sense, value):
    def spoilt(readings):
        rows = getattr(readings, sense)
        if rows is None or not len(rows) or not 30 < readings.stamp < 31.5:
            return readings
        rows = rows.copy()
        rows[:, 1:] = value
        return replace(readings, **{sense: rows})

    localizer, errors = run(drive, spoilt, seconds=60.0)
    assert np.isfinite(errors).all()
    assert position(errors) < 1.0
    name = {"imu": "imu", "encoders": "wheels", "field": "compass", "fixes": "gnss"}[sense]
    _, gated, refused = localizer.counts[name]
    assert gated + refused >= 1


def test_stamps_that_run_back_are_refused(drive):
    def reversed_rows(readings):
        if readings.imu is None or not 30 < readings.stamp < 30.35:
            return readings
        return replace(readings, imu=readings.imu[::-1].copy())

    localizer, errors = run(drive, reversed_rows, seconds=60.0)
    assert localizer.counts["imu"][2] == 27  # Nine of ten in three periods.
    assert position(errors) < 1.0


@pytest.mark.parametrize(
    ("missing", "health", "bound"),
    [
        (("fixes",), Health.DEGRADED, 1.5),
        (("field",), Health.DEGRADED, 1.0),
        (("encoders",), Health.DEGRADED, 3.0),
        (("imu",), Health.DEGRADED, 1.5),
        (("imu", "encoders"), Health.LOST, 30.0),
    ],
)
def test_a_silent_sense_is_done_without_and_said(drive, missing, health, bound):
    def silent(readings):
        return replace(readings, **dict.fromkeys(missing)) if readings.stamp > 30 else readings

    localizer, errors = run(drive, silent, seconds=60.0)
    assert localizer.health is health
    assert localizer.complaints
    assert position(errors) < bound


def test_it_recovers_when_a_sense_speaks_again(drive):
    def gap(readings):
        return replace(readings, imu=None) if 30 < readings.stamp < 33 else readings

    localizer, errors = run(drive, gap)
    assert localizer.health is Health.OK
    assert position(errors) < 0.8


def test_a_receiver_without_a_fix_is_no_reason_to_doubt(drive):
    def tunnel(readings):
        fixes = readings.gnss
        if fixes is not None and readings.stamp > 10:
            fixes = fixes.copy()
            fixes[:, 1:4], fixes[:, 4] = np.nan, np.inf
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, tunnel)
    assert "gnss: not believed" in "; ".join(localizer.complaints)
    assert localizer.counts["gnss"][2] == 0
    assert np.sqrt(localizer.covariance[0, 0]) < 1.0
    assert np.hypot(*errors[-1, :2]) < 1.5


def test_a_long_detour_of_the_signals_is_waited_out(drive):
    def detour(readings):
        fixes = readings.gnss
        if fixes is not None and 15 < readings.stamp < 45:
            fixes = fixes + np.array([0, 6e-5, 0, 0, 0])  # Seven metres to the north.
        return replace(readings, gnss=fixes)

    _, errors = run(drive, detour)
    assert np.hypot(*errors[:, :2].T).max() < 1.5


def test_a_wrong_start_is_doubted_and_mended(drive):
    """The robot was put down 40 m from where it was told."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    localizer.reset(replace(pose, position=pose.position + np.array([40.0, 0, 0])), 0.0)
    for readings in drive:
        localizer.update(readings)
    error = localizer.pose.position[:2] - drive[-1].truth.pose.position[:2]
    assert np.hypot(*error) < 1.5


def test_rows_of_another_width_are_an_error(drive):
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    with pytest.raises(ValueError, match=r"expected shape \(k, 7\)"):
        localizer.update(replace(drive[5], imu=np.zeros((3, 6))))


def fix_at(drive, k, **columns):
    """Return a period of the drive with one fix, of which columns are replaced."""
    readings = drive[k]
    place = readings.truth.pose.position + np.array([0.5, 0.0, 0.0])
    row = np.array([readings.stamp - 0.05, *GeoReference().to_geodetic(place[None])[0], 0.5])
    for name, value in columns.items():
        row[["stamp", "latitude", "longitude", "altitude", "variance"].index(name)] = value
    return replace(readings, gnss=row[None])


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"latitude": 0.0, "longitude": 0.0}, "at latitude 0, longitude 0"),
        ({"latitude": 140.0}, "latitude beyond 90 degrees"),
        ({"latitude": 89.5}, "latitude beyond 89 degrees"),
        ({"longitude": 400.0}, "longitude beyond 360 degrees"),
        ({"altitude": 1e5}, "altitude outside of -500 to 9000 m"),
        ({"altitude": np.inf}, "altitude outside of -500 to 9000 m"),
        ({"variance": -1.0}, "a negative variance"),
        ({"variance": 1e7}, "a standard deviation beyond 1000 m"),
        ({"longitude": np.nan}, "a place that is no number"),
        ({"stamp": np.nan}, "a stamp that is no number"),
    ],
)
def test_a_fix_that_cannot_be_is_refused_by_reason(drive, columns, reason):
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    localizer.update(drive[1])
    localizer.update(fix_at(drive, 2, **columns))
    assert [n for text, n in localizer.refused.items() if reason in text] == [1]
    assert localizer.counts["gnss"] == (0, 0, 1)
    assert not localizer.assumed


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_a_fix_without_a_covariance_counts_for_the_default(drive, value):
    def pulled(variance, sigma):
        localizer = UkfLocalizer(UkfConfig(fix_sigma=sigma), ROBOT, GeoReference())
        localizer.reset(drive[0].truth.pose, 0.0)
        for k in range(1, 4):
            localizer.update(fix_at(drive, k, variance=variance))
        return localizer

    unknown, known = pulled(value, 2.0), pulled(4.0, 1.0)
    np.testing.assert_array_equal(unknown.pose.position, known.pose.position)
    assert list(unknown.assumed.values()) == [3]
    assert not known.assumed
    assert unknown.counts["gnss"][0] == 3
    wider = pulled(value, 50.0)
    assert wider.covariance[0, 0] > unknown.covariance[0, 0]


def test_a_fix_without_an_altitude_tells_the_place_and_no_height(drive):
    def flat(readings):
        if readings.gnss is None:
            return readings
        fixes = readings.gnss.copy()
        fixes[:, 3] = np.nan
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, flat)
    believed = localizer.counts["gnss"][0]
    assert believed > 100
    assert position(errors) < 0.7
    blind, _ = run(drive, lambda s: replace(s, gnss=None))
    assert abs(localizer.pose.position[2] - blind.pose.position[2]) < 0.5
    assert sum(localizer.assumed.values()) == sum(localizer.counts["gnss"])


def test_heights_are_counted_from_the_first_where_the_datum_has_none(drive):
    """Above the sea or above the ellipsoid: what a receiver counts from does not matter."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference(altitude=None))
    localizer.reset(drive[0].truth.pose, 0.0)
    for readings in drive[:600]:
        fixes = readings.gnss
        if fixes is not None:
            fixes = fixes + np.array([0, 0, 0, 1234.5, 0])
        localizer.update(replace(readings, gnss=fixes))
    truth = drive[599].truth.pose.position
    assert localizer.counts["gnss"][0] > 50
    assert np.hypot(*(localizer.pose.position - truth)[:2]) < 1.5
    assert abs(localizer.pose.position[2] - truth[2]) < 4.0


def rough(drive, reference, loose=True, change=lambda s: s):
    """Return the poses in odom of a drive that begins with a rough start."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, reference)
    localizer.refer(reference, loose)
    pose = drive[0].truth.pose
    turned = np.deg2rad(GeoReference().declination_deg - reference.declination_deg)
    localizer.reset(Pose.from_euler(pose.position, 0.0, 0.0, pose.yaw + turned), 0.0, rough=True)
    found = []
    for readings in drive[:400]:
        localizer.update(change(readings))
        found.append([*localizer.odometry.position, localizer.odometry.yaw])
    return localizer, np.array(found)


def test_a_rough_start_begins_odom_at_its_own_origin(drive):
    localizer, poses = rough(drive, GeoReference())
    np.testing.assert_allclose(poses[0], 0, atol=1e-3)
    row = localizer.track.at(np.array([drive[399].stamp]))[0]
    np.testing.assert_allclose(row[:3], localizer.odometry.position)
    assert np.hypot(*(localizer.pose.position - drive[399].truth.pose.position)[:2]) < 2.0


def test_dead_reckoning_knows_neither_declination_nor_fixes_where_the_field_is_a_model(drive):
    _, poses = rough(drive, GeoReference())
    others = (
        rough(drive, GeoReference(declination_deg=-120.0))[1],
        rough(drive, GeoReference(), change=lambda s: replace(s, gnss=None))[1],
        rough(drive, GeoReference(), change=lambda s: replace(s, mag=None))[1],
    )
    for other in others:
        np.testing.assert_allclose(other, poses, atol=2e-4)
    strict = rough(drive, GeoReference(), False, lambda s: replace(s, mag=None))[1]
    assert np.abs(strict - poses).max() > 1e-3


def test_far_from_the_origin_odom_is_near_its_own(drive):
    """Somebody's map in UTM: clouds in odom are float32."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    far = np.array([370_000.0, 4_064_000.0, 60.0])
    localizer.reset(replace(pose, position=far), 0.0)
    localizer.update(drive[1])
    assert np.abs(localizer.odometry.position).max() < 1.0
    assert np.abs(localizer.track.at(np.zeros(1))[0, :3]).max() < 1.0
    np.testing.assert_allclose(localizer.pose.position, far, atol=1.0)


def test_it_starts_over_where_it_was_in_the_map(drive):
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    localizer.reset(replace(pose, position=np.array([20.0, 30.0, 0.0])), 0.0, rough=True)
    localizer.update(drive[1])
    localizer._P[:] = -1.0
    localizer.update(drive[2])
    np.testing.assert_allclose(localizer.pose.position[:2], [20.0, 30.0], atol=0.5)
