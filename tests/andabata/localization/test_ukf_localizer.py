"""Localizer of the robot on real drives, with sensors that fail, fall silent or are late."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.localizer import Health
from andabata.localization.ukf_config import InitialSigma
from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig, Simulator
from worlds.catalogue import make_world, patch
from worlds.rays.scene import RayScene
from worlds.world import Start

ROBOT = RobotModel()


def winding(seed, difficulty, start):
    """Return the readings of two minutes of a winding drive over a hill."""
    world = make_world("hill", seed, difficulty, patch("hill", 60.0, 0.25))
    rng = np.random.default_rng(0)
    sensing = SensingConfig(scanner="horizontal")
    simulator = Simulator(world, RayScene(world), ROBOT, "kinematic", sensing, rng)
    kinematics = SkidSteer(ROBOT)
    readings = [simulator.reset(start)]
    for k in range(1200):
        steering = 0.0 if k < 30 else 0.4 * np.sin(k / 40)
        speed = 0.0 if k < 30 else 0.3
        readings.append(simulator.step(kinematics.wheel_speeds(speed, steering), skip_scan=True))
    simulator.close()
    return readings


@pytest.fixture(scope="module")
def drive():
    """Return the readings of a drive without collision."""
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
    """Return the root mean square of the horizontal error [m]."""
    return float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()))


def test_it_estimates_position_and_heading(drive):
    """Position and heading stay near the truth, and all is well."""
    localizer, errors = run(drive)
    assert position(errors) < 0.6
    assert np.rad2deg(np.sqrt((errors[:, 2] ** 2).mean())) < 1.0
    assert localizer.health is Health.OK
    assert np.linalg.eigvalsh(localizer.covariance).min() > 0
    assert localizer.counts["imu"] == (12_000, 0, 0)


def test_the_odometry_never_jumps(drive):
    """Dead reckoning moves by the speed alone, however the map pose jumps."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    steps, before = [], localizer.odometry.position
    for readings in drive:
        localizer.update(readings)
        steps.append(np.hypot(*(localizer.odometry.position - before)[:2]))
        before = localizer.odometry.position
    assert max(steps) < 0.3 * 0.1 * 1.3
    assert localizer.track.latest == pytest.approx(drive[-1].stamp)


def test_late_fixes_are_as_good_as_punctual_ones(drive):
    """Fixes a second late are accepted and lead to the same estimate."""
    held = []

    def later(readings):
        held.append(readings.gnss)
        late = held[-10] if len(held) >= 10 else None
        return replace(readings, gnss=late)

    _, punctual = run(drive)
    localizer, late = run(drive, later)
    accepted, _, rejected = localizer.counts["gnss"]
    assert accepted > 90
    assert rejected == 0
    # The only difference is the second from the last fix to its arrival.
    np.testing.assert_allclose(late[-5, :2], punctual[-5, :2], atol=0.15)


def test_a_fix_that_is_sent_again_counts_once(drive):
    """Punctual or late, and one that is too old or too far ahead does not change a bit either."""

    def with_bad(readings):
        if readings.gnss is None or not len(readings.gnss) or readings.stamp < 5.0:
            return readings
        old, ahead = readings.gnss[-1:].copy(), readings.gnss[-1:].copy()
        old[:, 0] -= 10.0
        ahead[:, 0] += 10.0
        again = np.concatenate([readings.gnss, readings.gnss, old, ahead])
        return replace(readings, gnss=again)

    once, _ = run(drive, seconds=30.0)
    again, _ = run(drive, with_bad, seconds=30.0)
    assert again.belief.x.tobytes() == once.belief.x.tobytes()
    assert again.belief.P.tobytes() == once.belief.P.tobytes()
    (accepted, gated, _), (same, also, rejected) = once.counts["gnss"], again.counts["gnss"]
    assert (same, also) == (accepted, gated)
    assert rejected == 3 * sum(len(r.gnss) > 0 for r in drive if 5.0 <= r.stamp <= 30.0) > 60


def test_a_late_fix_gives_the_very_estimate_of_a_punctual_one(drive):
    """A fix that arrives 0.7 s late acts at its own time: the state is the same, bit for bit."""
    fix = fix_at(drive, 203).gnss
    states = []
    for arrival in (203, 210):
        localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
        localizer.reset(drive[0].truth.pose, 0.0)
        for k in range(212):
            given = fix if k == arrival else None
            localizer.update(replace(drive[k], gnss=given))
        assert localizer.counts["gnss"] == (1, 0, 0)
        states.append((localizer.pose.position, localizer.pose.quaternion, localizer.covariance))
    for punctual, late in zip(*states, strict=True):
        np.testing.assert_array_equal(punctual, late)


def test_a_late_fix_does_not_change_the_past_of_dead_reckoning(drive):
    """The track in odom up to the arrival is the same with and without a late fix."""
    tracks = []
    for fix in (fix_at(drive, 203).gnss, None):
        localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
        localizer.reset(drive[0].truth.pose, 0.0)
        for k in range(211):
            localizer.update(replace(drive[k], gnss=fix if k == 210 else None))
        tracks.append(localizer.track.at(np.arange(2030, 2091) / 100))
    np.testing.assert_array_equal(*tracks)


def test_the_lever_arm_of_the_antenna_is_removed(drive):
    """Fixes of an antenna ahead of the base lead to the position of the base."""
    arm = np.array([2.0, 0.5, 1.0])

    def with_antenna(readings):
        if readings.gnss is None or not len(readings.gnss):
            return replace(readings, antenna=arm)
        positions = GeoReference().to_map(readings.gnss[:, 1:4])
        turn = Rotation.from_quat(readings.truth.pose.quaternion)
        fixes = readings.gnss.copy()
        fixes[:, 1:4] = GeoReference().to_geodetic(positions + turn.apply(arm))
        return replace(readings, gnss=fixes, antenna=arm)

    _, plain = run(drive, seconds=60.0)
    _, moved = run(drive, with_antenna, seconds=60.0)
    np.testing.assert_allclose(moved[:, :2], plain[:, :2], atol=0.3)


def test_rows_ahead_of_the_inertial_rows_wait(drive):
    """Rows up to half a second ahead wait for their time, those further ahead are rejected."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    ahead = np.array([[0.15, 0.0, 0.0], [0.9, 0.0, 0.0]])
    localizer.update(replace(drive[1], encoders=ahead))
    assert localizer.counts["wheels"] == (0, 0, 1)
    localizer.update(replace(drive[2], encoders=None))
    assert localizer.counts["wheels"] == (1, 0, 1)


def test_a_fix_older_than_the_memory_is_rejected(drive):
    """A fix older than the buffer is counted as rejected."""
    localizer, _ = run(drive, seconds=10.0)
    old = drive[1].gnss
    given = np.array([[3.0, 36.715, -4.478, 60.0, 0.5]])
    assert old is None or len(old) == 0
    rejected = localizer.counts["gnss"][2]
    localizer.update(replace(drive[102], gnss=given))
    assert localizer.counts["gnss"][2] == rejected + 1


def test_a_jump_of_ten_kilometres_moves_nothing(drive):
    """Fixes far off are gated."""

    def jumping(readings):
        fixes = readings.gnss
        if fixes is not None and len(fixes) and 40 < readings.stamp < 50:
            fixes = fixes + np.array([0, 0.1, 0, 0, 0])
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, jumping)
    assert position(errors) < 0.7
    assert localizer.counts["gnss"][1] >= 9


def test_spinning_wheels_mislead_it_for_seconds_only():
    """The robot pushes against a tree: wheels turn, fixes stay; the error remains bounded."""
    blocked = winding(6, 0.4, Start(0.0, -12.0, 1.0))
    assert blocked[-1].truth.collided
    localizer, errors = run(blocked)
    far = np.hypot(*errors[:, :2].T)
    assert far.max() < 10.0
    assert np.median(far) < 2.5
    assert np.rad2deg(np.abs(errors[:, 2])).max() < 6.0
    assert localizer.counts["gnss"][1] > 0


@pytest.mark.parametrize("sense", ["imu", "encoders", "mag", "gnss"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_invalid_rows_are_rejected_and_counted(drive, sense, value):
    """Rows of NaN, infinite or huge numbers change little and are counted."""

    def corrupted(readings):
        rows = getattr(readings, sense)
        if rows is None or not len(rows) or not 30 < readings.stamp < 31.5:
            return readings
        rows = rows.copy()
        rows[:, 1:] = value
        return replace(readings, **{sense: rows})

    localizer, errors = run(drive, corrupted, seconds=60.0)
    assert np.isfinite(errors).all()
    assert position(errors) < 1.0
    name = {"imu": "imu", "encoders": "wheels", "mag": "compass", "gnss": "gnss"}[sense]
    _, gated, rejected = localizer.counts[name]
    assert gated + rejected >= 1


def test_decreasing_stamps_are_rejected(drive):
    """Inertial rows whose stamps decrease are rejected one by one."""

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
        (("gnss",), Health.DEGRADED, 1.5),
        (("mag",), Health.DEGRADED, 1.0),
        (("encoders",), Health.DEGRADED, 3.0),
        (("imu",), Health.DEGRADED, 1.5),
        (("imu", "encoders"), Health.LOST, 30.0),
    ],
)
def test_it_continues_without_a_silent_sensor_and_warns(drive, missing, health, bound):
    """Health and warnings name a silent sensor; the error stays bounded."""

    def silent(readings):
        return replace(readings, **dict.fromkeys(missing)) if readings.stamp > 30 else readings

    localizer, errors = run(drive, silent, seconds=60.0)
    assert localizer.health is health
    assert localizer.warnings
    assert position(errors) < bound


@pytest.mark.parametrize("sense", ["imu", "encoders", "mag"])
def test_a_sense_that_sends_nothing_valid_is_a_silent_one(drive, sense):
    """Rows of NaN, and rows of a thousand seconds ago, end in the very health of no rows at all."""

    def changed(readings, rows):
        return replace(readings, **{sense: rows}) if readings.stamp > 10 else readings

    def invalid(readings):
        rows = getattr(readings, sense)
        return changed(readings, rows * [1.0, *[np.nan] * (rows.shape[1] - 1)])

    def old(readings):
        rows = getattr(readings, sense)
        return changed(readings, rows - [1000.0, *[0.0] * (rows.shape[1] - 1)])

    steps = drive[1:]  # A drive begins without a row.
    silent, errors = run(steps, lambda readings: changed(readings, None), seconds=40.0)
    assert silent.health is Health.DEGRADED
    for change in (invalid, old):
        localizer, others = run(steps, change, seconds=40.0)
        assert localizer.warnings == silent.warnings
        np.testing.assert_array_equal(others, errors)
    name = {"imu": "imu", "encoders": "wheels", "mag": "compass"}[sense]
    assert localizer.counts[name][2] >= 3000
    if sense != "imu":
        assert localizer.status.unused[name]["stale: too old or out of order"] == 3000


FAULT = 40.0
"""Time from which on a sense fails [s]."""


def repeated(field):
    """Return a change after which a sense repeats its last row, with new stamps."""
    last = []

    def change(readings):
        rows = getattr(readings, field)
        if rows is None or not len(rows):
            return readings
        if readings.stamp < FAULT:
            last[:] = [rows[-1, 1:].copy()]
            return readings
        rows = rows.copy()
        rows[:, 1:] = last[0]
        return replace(readings, **{field: rows})

    return change


def out_of_scale(field, columns, factor):
    """Return a change of the scale of a sense."""

    def change(readings):
        rows = getattr(readings, field)
        if rows is None or readings.stamp < FAULT:
            return readings
        rows = rows.copy()
        rows[:, columns] *= factor
        return replace(readings, **{field: rows})

    return change


def watched(drive, change):
    """Return the localizer, its errors, and the stamp and words of the first warning after."""
    localizer, errors, first = UkfLocalizer(UkfConfig(), ROBOT, GeoReference()), [], None
    localizer.reset(drive[0].truth.pose, 0.0)
    for readings in drive:
        localizer.update(change(readings))
        errors.append(localizer.pose.position[:2] - readings.truth.pose.position[:2])
        if first is None and localizer.health is not Health.OK:
            first = readings.stamp, localizer.status.cause
    return localizer, np.hypot(*np.array(errors).T), first


@pytest.mark.parametrize(
    ("change", "words", "within"),
    [
        (repeated("gnss"), "gnss: repeats its last fix while the wheels turn, for", 2.2),
        (repeated("imu"), "imu: repeats its last row while the wheels turn, for", 0.7),
        (repeated("mag"), "compass: repeats its last row while the robot moves, for", 0.7),
        # The bend of this drive is long: the yaw rate changes slowly.
        (repeated("encoders"), "wheels: ", 4.0),
        (out_of_scale("imu", slice(4, 7), 2.0), "gravity: ", 0.5),
        (out_of_scale("imu", slice(1, 4), 2.0), "imu: its gyro contradicts", 2.0),
        (out_of_scale("encoders", slice(1, 3), 2.0), "wheels: ", 0.4),
        (out_of_scale("encoders", slice(1, 3), 10.0), "wheels: ", 0.4),
    ],
)
def test_a_sense_that_lies_is_named_and_not_believed(drive, change, words, within):
    """Seconds after it began; the error is within 2 % of the way and 1 m, 1.5 m without an IMU."""
    localizer, errors, (stamp, cause) = watched(drive, change)
    assert FAULT <= stamp <= FAULT + within
    assert cause.startswith(words)
    assert localizer.health is Health.DEGRADED
    name = words.split(":")[0]
    assert errors[-1] < 1.0 + 0.02 * 0.3 * (120.0 - FAULT) + 0.5 * (name == "imu")
    assert localizer.counts[name][2] > (5 if name == "gnss" else 500)
    reasons = {"repeated", "out of scale", "not as the accelerometer"}
    assert set(localizer.status.unused[name]) & reasons


def test_the_estimate_is_never_moved_towards_a_fix_that_repeats_itself(drive):
    """A receiver that hangs while all its places are coarse is not followed either."""

    def coarse(readings):
        fixes = readings.gnss
        if fixes is None or not len(fixes):
            return readings
        fixes = fixes.copy()
        fixes[:, 1:3] = np.round(fixes[:, 1:3], 5)
        fixes[:, 3] = 60.0
        return replace(readings, gnss=fixes)

    hang = repeated("gnss")
    localizer, errors, _ = watched(drive, lambda readings: hang(coarse(readings)))
    assert localizer.health is Health.DEGRADED
    assert errors[-1] < 2.5
    assert np.sqrt(localizer.covariance[0, 0]) < 2.0


def test_a_fix_out_of_reach_is_told_at_once(drive):
    """The first fix that is off by a hundred metres is in the health word, and moves nothing."""

    def jumping(readings):
        fixes = readings.gnss
        if fixes is None or readings.stamp < FAULT:
            return readings
        return replace(readings, gnss=fixes + np.array([0, 0.001, 0, 0, 0]))

    localizer, errors, (stamp, cause) = watched(drive[:460], jumping)
    first = next(r.stamp for r in drive if r.stamp >= FAULT and r.gnss is not None and len(r.gnss))
    assert stamp == first
    assert cause.startswith("gnss: off by 11")
    assert errors.max() < 1.5
    assert localizer.status.cause.startswith("gnss: not accepted")


def test_what_is_reported_is_in_health_and_status_until_the_next_report(drive):
    """A laser is no sense of the filter, and yet in its word."""
    localizer, _ = run(drive, seconds=1.0)
    localizer.report(("laser: silent for 0.4 s",))
    assert localizer.health is Health.DEGRADED
    assert localizer.status.causes == ("laser: silent for 0.4 s",)
    localizer.report(())
    assert localizer.health is Health.OK
    localizer.report(("laser: silent for 0.4 s",))
    localizer.reset(drive[0].truth.pose, 0.0)
    assert localizer.health is Health.OK


def test_it_recovers_when_a_sensor_sends_again(drive):
    """A gap of the inertial unit is bridged and forgotten."""

    def gap(readings):
        return replace(readings, imu=None) if 30 < readings.stamp < 33 else readings

    localizer, errors = run(drive, gap)
    assert localizer.health is Health.OK
    assert position(errors) < 0.8


def test_a_receiver_without_a_fix_inflates_nothing(drive):
    """Without any fix there is a warning, but no inflation of the covariance."""

    def no_fix(readings):
        fixes = readings.gnss
        if fixes is not None and readings.stamp > 10:
            fixes = fixes.copy()
            fixes[:, 1:4], fixes[:, 4] = np.nan, np.inf
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, no_fix)
    assert "gnss: not accepted" in "; ".join(localizer.warnings)
    assert localizer.counts["gnss"][2] == 0
    assert np.sqrt(localizer.covariance[0, 0]) < 1.0
    assert np.hypot(*errors[-1, :2]) < 1.5


def test_the_status_says_why_and_which_readings_were_not_used(drive):
    """Causes are the warnings; each reason has its sensor; all readings add up."""

    def spoilt(readings):
        if readings.mag is None or readings.stamp < 10:
            return readings
        mag = readings.mag.copy()
        mag[:, 3] += 30e-6 if readings.stamp < 20 else 0.0
        mag[:, 1:3] *= -1.0 if readings.stamp >= 20 else 1.0
        return replace(readings, mag=mag)

    localizer, _ = run(drive, spoilt, seconds=25.0)
    status = localizer.status
    assert status.health is localizer.health is Health.DEGRADED
    assert status.causes == localizer.warnings
    assert "compass: not accepted" in status.cause
    compass = status.unused["compass"]
    assert compass["in a field that is not the Earth's"] == pytest.approx(1000, abs=10)
    assert compass["beyond the gate"] == pytest.approx(500, abs=10)
    assert sum(compass.values()) == localizer.counts["compass"][1]
    assert status.accepted["compass"] == localizer.counts["compass"][0]
    np.testing.assert_array_equal(status.planar_covariance, localizer.covariance)
    assert np.diag(status.covariance).min() > 0


def test_a_rejected_fix_has_its_reason_in_the_status_until_a_reset(drive):
    """One that is impossible, and one that comes too late to be put in its place."""
    localizer = UkfLocalizer(UkfConfig(max_delay=0.3), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    for k in range(1, 12):
        localizer.update(replace(drive[k], gnss=None))
    localizer.update(fix_at(drive, 12, variance=-1.0))
    localizer.update(fix_at(drive, 13, stamp=0.1))
    assert localizer.status.unused["gnss"] == {"a negative variance": 1, "too late or too early": 1}
    localizer.reset(drive[0].truth.pose, 0.0)
    assert localizer.status.unused == {}
    assert not localizer.rejected_fixes


def test_long_multipath_is_waited_out(drive):
    """Half a minute of constant offset is rejected to its end."""

    def multipath(readings):
        fixes = readings.gnss
        if fixes is not None and 15 < readings.stamp < 45:
            fixes = fixes + np.array([0, 6e-5, 0, 0, 0])  # Seven metres to the north.
        return replace(readings, gnss=fixes)

    _, errors = run(drive, multipath)
    assert np.hypot(*errors[:, :2].T).max() < 1.5


def test_a_wrong_start_is_corrected(drive):
    """A robot that starts 40 m from its given pose finds its position in the end."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    localizer.reset(replace(pose, position=pose.position + np.array([40.0, 0, 0])), 0.0)
    for readings in drive:
        localizer.update(readings)
    error = localizer.pose.position[:2] - drive[-1].truth.pose.position[:2]
    assert np.hypot(*error) < 1.5


def test_rows_of_another_width_are_an_error(drive):
    """Rows of another width are an error that names the shape."""
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
def test_an_impossible_fix_is_rejected_by_reason(drive, columns, reason):
    """Each impossible fix is counted under its reason."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    localizer.update(drive[1])
    localizer.update(fix_at(drive, 2, **columns))
    assert [n for text, n in localizer.rejected_fixes.items() if reason in text] == [1]
    assert localizer.counts["gnss"] == (0, 0, 1)
    assert not localizer.assumed_fixes


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_a_fix_without_a_covariance_has_the_default(drive, value):
    """A missing covariance is replaced by the configured sigma, and counted."""

    def pulled(variance, sigma):
        localizer = UkfLocalizer(UkfConfig(fix_sigma=sigma), ROBOT, GeoReference())
        localizer.reset(drive[0].truth.pose, 0.0)
        for k in range(1, 4):
            localizer.update(fix_at(drive, k, variance=variance))
        return localizer

    unknown, known = pulled(value, 2.0), pulled(4.0, 1.0)
    np.testing.assert_array_equal(unknown.pose.position, known.pose.position)
    assert list(unknown.assumed_fixes.values()) == [3]
    assert not known.assumed_fixes
    assert unknown.counts["gnss"][0] == 3
    wider = pulled(value, 50.0)
    assert wider.covariance[0, 0] > unknown.covariance[0, 0]


def test_a_fix_without_an_altitude_corrects_position_and_not_height(drive):
    """A missing altitude leaves the height to dead reckoning, and is counted."""

    def flat(readings):
        if readings.gnss is None:
            return readings
        fixes = readings.gnss.copy()
        fixes[:, 3] = np.nan
        return replace(readings, gnss=fixes)

    localizer, errors = run(drive, flat)
    accepted = localizer.counts["gnss"][0]
    assert accepted > 100
    assert position(errors) < 0.7
    blind, _ = run(drive, lambda s: replace(s, gnss=None))
    assert abs(localizer.pose.position[2] - blind.pose.position[2]) < 0.5
    assert sum(localizer.assumed_fixes.values()) == sum(localizer.counts["gnss"])


def test_heights_are_counted_from_the_first_where_the_datum_has_none(drive):
    """The vertical datum of the receiver does not matter without an altitude of the map's."""
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


def rough(drive, reference, heading_only=True, change=lambda s: s):
    """Return the poses in odom of a drive that begins with a rough start."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, reference)
    localizer.set_geo_reference(reference, heading_only)
    pose = drive[0].truth.pose
    turned = np.deg2rad(GeoReference().declination_deg - reference.declination_deg)
    localizer.reset(Pose.from_euler(pose.position, 0.0, 0.0, pose.yaw + turned), 0.0, rough=True)
    found = []
    for readings in drive[:400]:
        localizer.update(change(readings))
        found.append([*localizer.odometry.position, localizer.odometry.yaw])
    return localizer, np.array(found)


def test_a_rough_start_begins_odom_at_its_own_origin(drive):
    """After a rough start odom begins at zero, the map pose at the start."""
    localizer, poses = rough(drive, GeoReference())
    np.testing.assert_allclose(poses[0], 0, atol=1e-3)
    row = localizer.track.at(np.array([drive[399].stamp]))[0]
    np.testing.assert_allclose(row[:3], localizer.odometry.position)
    assert np.hypot(*(localizer.pose.position - drive[399].truth.pose.position)[:2]) < 2.0


def test_with_a_modelled_field_dead_reckoning_depends_on_neither_declination_nor_fixes(drive):
    """Compass and fixes do not change the motion if the field is a model."""
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
    """In a map of UTM coordinates odom begins at its own origin: its clouds are float32."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    far = np.array([370_000.0, 4_064_000.0, 60.0])
    localizer.reset(replace(pose, position=far), 0.0)
    localizer.update(drive[1])
    assert np.abs(localizer.odometry.position).max() < 1.0
    assert np.abs(localizer.track.at(np.zeros(1))[0, :3]).max() < 1.0
    np.testing.assert_allclose(localizer.pose.position, far, atol=1.0)


def test_it_restarts_at_its_last_position(drive):
    """A covariance that is not positive definite leads to a restart in place, in great doubt."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    localizer.reset(replace(pose, position=np.array([20.0, 30.0, 0.0])), 0.0, rough=True)
    localizer.update(drive[1])
    localizer._P[:] = -1.0
    localizer.update(drive[2])
    np.testing.assert_allclose(localizer.pose.position[:2], [20.0, 30.0], atol=0.5)
    assert np.sqrt(np.diag(localizer.covariance)) == pytest.approx([10.0, 10.0, 0.5], rel=0.02)


def test_without_a_heading_two_fixes_tell_it(drive):
    """Neither compass nor start: the robot is disoriented until its way shows where it heads."""
    config = UkfConfig(initial_sigma=InitialSigma(yaw=2.0))
    localizer = UkfLocalizer(config, ROBOT, GeoReference())
    start = drive[0].truth.pose
    turned = Rotation.from_euler("z", 2.5) * Rotation.from_quat(start.quaternion)
    localizer.reset(Pose(start.position, turned.as_quat()), 0.0)
    healths = []
    for readings in drive:
        localizer.update(replace(readings, mag=None))
        healths.append(localizer.health)
    assert healths[30] is Health.DISORIENTED
    known = healths.index(Health.DEGRADED, 30)
    assert Health.DISORIENTED not in healths[known:]
    assert abs(wrap(localizer.pose.yaw - drive[-1].truth.pose.yaw)) < 0.2


def soft_iron(readings):
    """Return readings whose compass has four percent of soft iron."""
    if readings.mag is None:
        return readings
    mag = readings.mag.copy()
    mag[:, 1:] = mag[:, 1:] @ (np.eye(3) + 0.04 * np.array([[1, 1, 0], [1, -1, 0], [0, 0, 0]]))
    return replace(readings, mag=mag)


def test_soft_iron_never_loses_the_robot(drive):
    """Three degrees that turn with the robot: no more of heading, honest, none of it lost."""
    localizer, errors = run(drive, soft_iron)
    assert localizer.health is Health.OK
    assert np.rad2deg(np.sqrt((errors[:, 2] ** 2).mean())) < 3.0
    assert abs(errors[-1, 2]) < 3 * np.sqrt(localizer.covariance[2, 2])
    assert localizer.counts["compass"][1] < 0.01 * localizer.counts["compass"][0]


def test_false_fixes_after_an_outage_are_not_followed(drive):
    """Half a minute without fixes, then fixes 700 m off to the end: the robot stays where it is."""

    def faulty(readings):
        if readings.gnss is None or not len(readings.gnss):
            return readings
        fixes = readings.gnss[readings.gnss[:, 0] < 20].copy()
        if readings.gnss[0, 0] >= 50:
            fixes = readings.gnss.copy()
            fixes[:, 1] += 700 / 111_320
        return replace(readings, gnss=fixes)

    _, errors = run(drive, faulty)
    assert np.hypot(*errors[:, :2].T).max() < 2.5
