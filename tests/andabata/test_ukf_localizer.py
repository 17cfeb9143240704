"""The robot's filter on real drives, with senses that lie, fall silent or come late."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
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
    senses = [simulator.reset(start)]
    for k in range(1200):
        steering = 0.0 if k < 30 else 0.4 * np.sin(k / 40)
        speed = 0.0 if k < 30 else 0.3
        senses.append(simulator.step(kinematics.wheel_speeds(speed, steering), blind=True))
    simulator.close()
    return senses


@pytest.fixture(scope="module")
def drive():
    senses = winding(4, 0.3, Start(-8.0, 0.0, 0.3))
    assert not senses[-1].truth.collided
    return senses


def run(drive, change=lambda s: s, config=None, seconds=120.0):
    """Return the localizer and its errors in x, y [m] and yaw [rad] after each step."""
    localizer = UkfLocalizer(config or UkfConfig(), ROBOT, GeoReference())
    localizer.reset(drive[0].truth.pose, 0.0)
    errors = []
    for senses in drive:
        if senses.stamp > seconds:
            break
        localizer.update(change(senses))
        truth, pose = senses.truth.pose, localizer.pose
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
    for senses in drive:
        localizer.update(senses)
        steps.append(np.hypot(*(localizer.odometry.position - before)[:2]))
        before = localizer.odometry.position
    assert max(steps) < 0.3 * 0.1 * 1.3
    assert localizer.track.latest == pytest.approx(drive[-1].stamp)


def test_a_late_fix_is_worth_what_a_punctual_one_is(drive):
    held = []

    def later(senses):
        held.append(senses.fixes)
        late = held[-10] if len(held) >= 10 else None
        return replace(senses, fixes=late)

    _, punctual = run(drive)
    localizer, late = run(drive, later)
    believed, _, refused = localizer.counts["gnss"]
    assert believed > 90
    assert refused == 0
    # The second from the last fix to its arrival is all the difference.
    np.testing.assert_allclose(late[-5, :2], punctual[-5, :2], atol=0.15)


def test_a_fix_older_than_the_memory_is_refused(drive):
    localizer, _ = run(drive, seconds=10.0)
    old = drive[1].fixes
    given = np.array([[3.0, 36.715, -4.478, 60.0, 0.5]])
    assert old is None or len(old) == 0
    refused = localizer.counts["gnss"][2]
    localizer.update(replace(drive[102], fixes=given))
    assert localizer.counts["gnss"][2] == refused + 1


def test_a_jump_of_ten_kilometres_moves_nothing(drive):
    def jumping(senses):
        fixes = senses.fixes
        if fixes is not None and len(fixes) and 40 < senses.stamp < 50:
            fixes = fixes + np.array([0, 0.1, 0, 0, 0])
        return replace(senses, fixes=fixes)

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
    def spoilt(senses):
        rows = getattr(senses, sense)
        if rows is None or not len(rows) or not 30 < senses.stamp < 31.5:
            return senses
        rows = rows.copy()
        rows[:, 1:] = value
        return replace(senses, **{sense: rows})

    localizer, errors = run(drive, spoilt, seconds=60.0)
    assert np.isfinite(errors).all()
    assert position(errors) < 1.0
    name = {"imu": "imu", "encoders": "wheels", "field": "compass", "fixes": "gnss"}[sense]
    _, gated, refused = localizer.counts[name]
    assert gated + refused >= 1


def test_stamps_that_run_back_are_refused(drive):
    def reversed_rows(senses):
        if senses.imu is None or not 30 < senses.stamp < 30.35:
            return senses
        return replace(senses, imu=senses.imu[::-1].copy())

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
    def silent(senses):
        return replace(senses, **dict.fromkeys(missing)) if senses.stamp > 30 else senses

    localizer, errors = run(drive, silent, seconds=60.0)
    assert localizer.health is health
    assert localizer.complaints
    assert position(errors) < bound


def test_it_recovers_when_a_sense_speaks_again(drive):
    def gap(senses):
        return replace(senses, imu=None) if 30 < senses.stamp < 33 else senses

    localizer, errors = run(drive, gap)
    assert localizer.health is Health.OK
    assert position(errors) < 0.8


def test_a_receiver_without_a_fix_is_no_reason_to_doubt(drive):
    def tunnel(senses):
        fixes = senses.fixes
        if fixes is not None and senses.stamp > 10:
            fixes = fixes.copy()
            fixes[:, 1:4], fixes[:, 4] = np.nan, np.inf
        return replace(senses, fixes=fixes)

    localizer, errors = run(drive, tunnel)
    assert "gnss: not believed" in "; ".join(localizer.complaints)
    assert localizer.counts["gnss"][2] == 0
    assert np.sqrt(localizer.covariance[0, 0]) < 1.0
    assert np.hypot(*errors[-1, :2]) < 1.5


def test_a_long_detour_of_the_signals_is_waited_out(drive):
    def detour(senses):
        fixes = senses.fixes
        if fixes is not None and 15 < senses.stamp < 45:
            fixes = fixes + np.array([0, 6e-5, 0, 0, 0])  # Seven metres to the north.
        return replace(senses, fixes=fixes)

    _, errors = run(drive, detour)
    assert np.hypot(*errors[:, :2].T).max() < 1.5


def test_a_wrong_start_is_doubted_and_mended(drive):
    """The robot was put down 40 m from where it was told."""
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    pose = drive[0].truth.pose
    localizer.reset(replace(pose, position=pose.position + np.array([40.0, 0, 0])), 0.0)
    for senses in drive:
        localizer.update(senses)
    error = localizer.pose.position[:2] - drive[-1].truth.pose.position[:2]
    assert np.hypot(*error) < 1.5


def test_rows_of_another_width_are_an_error(drive):
    localizer = UkfLocalizer(UkfConfig(), ROBOT, GeoReference())
    with pytest.raises(ValueError, match=r"expected shape \(k, 7\)"):
        localizer.update(replace(drive[5], imu=np.zeros((3, 6))))
