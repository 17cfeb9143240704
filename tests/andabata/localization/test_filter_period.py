"""One period of the filter: instants, counts, dead reckoning, considered states."""

import numpy as np
import pytest

from andabata.localization import filter_state as state
from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.filter_period import (
    GNSS,
    IMU,
    OUTCOMES,
    WHEELS,
    ZERO_RATE,
    first_inertial,
    run_period,
)
from andabata.localization.filter_state import STATES, Belief
from andabata.localization.measurements import Measurements
from andabata.localization.sigma_points import Workspace
from andabata.machine.proprioception import GRAVITY
from terrain.record import packed
from tests.support.textbook_filter import GATED, HEADING_ONLY, OPEN, aside, field, fresh, rotation


def period(stamps, omega=0.0, **rows):
    """Return measurements of a level robot at rest with inertial rows at some stamps."""
    imu = np.zeros((len(stamps), 7))
    imu[:, 0], imu[:, 3], imu[:, 6] = stamps, omega, GRAVITY
    widths = {"wheels": 3, "mag": 4, "gnss": 6}
    given = {name: rows.get(name, np.empty((0, width))) for name, width in widths.items()}
    return Measurements(imu, **given)


def run(measurements, filter_model=GATED, x=None, now=0.0):
    """Return state, covariance, odometry, counts and track after a period."""
    belief, odometry = begin(x), np.zeros(4)
    track = np.zeros((len(measurements.imu), 8))
    model, workspace = packed(filter_model), packed(Workspace.allocate())
    _, filled, _, valid = run_period(belief, now, odometry, measurements, model, workspace, track)
    assert valid
    x, P, counts = belief[0]
    return x, P, odometry, counts, track[:filled]


def begin(x=None):
    """Return the record of a belief about a state, zeros without one."""
    x = np.zeros(STATES) if x is None else x
    counts = np.zeros((6, OUTCOMES), dtype=np.int64)
    return packed(Belief(x, np.diag(np.full(STATES, 1e-2)), counts))


STAMPS = np.arange(1, 11) / 100


def test_a_measurement_corrects_at_the_first_inertial_row_that_is_not_older():
    """A speed of the third tick is seen by the track from the third row on, not before."""
    for tick in (3, 4):
        wheels = np.array([[tick / 100, 5.0, 5.0]])
        *_, track = run(period(STAMPS, wheels=wheels), OPEN)
        steps = np.diff(track[:, 1], prepend=0.0)
        assert np.abs(steps[: tick - 1]).max() < 1e-9
        assert steps[tick - 1] > 1e-3


def test_measurements_after_the_last_inertial_row_are_not_taken():
    """Rows later than the inertial rows stay uncounted, those at the same stamp are taken."""
    wheels = np.array([[0.1, 0.1, 0.1], [0.1001, 0.1, 0.1]])
    counts = run(period(STAMPS, wheels=wheels), OPEN)[3]
    assert counts[WHEELS].tolist() == [1, 0, 0, 0]


def test_rows_are_counted_as_accepted_gated_and_rejected():
    """NaN rows are rejected, far ones gated, and a stamp that decreases is rejected."""
    wheels = np.array([[0.01, 0.0, 0.0], [0.02, np.nan, 0.0], [0.03, 500.0, 500.0]])
    stamps = STAMPS.copy()
    stamps[5] = stamps[3]
    counts = run(period(stamps, wheels=wheels))[3]
    assert counts[WHEELS].tolist() == [1, 1, 1, 0]
    assert counts[IMU].tolist() == [9, 0, 1, 0]
    assert counts[ZERO_RATE].tolist() == [1, 0, 0, 0]


def test_rows_ahead_of_the_inertial_rows_wait_and_others_pass_them():
    """Rows ahead are numbered, those too far ahead rejected, and rows behind them are taken."""
    wheels = np.array([[0.3, 0.0, 0.0], [0.05, 0.0, 0.0], [0.7, 0.0, 0.0]])
    belief, track = begin(), np.zeros((10, 8))
    given = (period(STAMPS, wheels=wheels), packed(GATED), packed(Workspace.allocate()), track)
    now, _, waiting, _ = run_period(belief, 0.0, np.zeros(4), *given)
    assert (now, waiting) == (STAMPS[-1], 1)
    assert belief["counts"][0, WHEELS].tolist() == [1, 0, 1, 0]


def test_a_rate_that_no_robot_turns_at_is_rejected():
    """Fifty radians per second are too many, on any axis; the first valid row is found."""
    measurements = period(STAMPS)
    measurements.imu[0, 2], measurements.imu[1, 0], measurements.imu[4, 1] = -50.0, np.nan, 49.9
    assert run(measurements)[3][IMU].tolist() == [8, 0, 2, 0]
    assert first_inertial(measurements.imu) == 2
    assert first_inertial(measurements.imu[:2]) == 2


def test_the_first_inertial_row_lies_in_its_time():
    """After the begin, which is no row of the time, and up to the end, which is one."""
    imu = period(STAMPS).imu
    assert first_inertial(imu, 0.03, 0.08) == 3
    assert first_inertial(imu, 0.03, 0.04) == 3
    assert first_inertial(imu, 0.03, 0.039) == len(imu)
    assert first_inertial(imu, 1000.0) == len(imu)


def test_a_step_longer_than_the_limit_is_rejected():
    """An inertial row after a long gap is rejected."""
    counts = run(period(np.array([2.5])))[3]
    assert counts[IMU].tolist() == [0, 0, 1, 0]


def test_dead_reckoning_moves_as_the_process_does_on_a_cross_slope():
    """One step of a turning, tilted robot: creep and pivot included, with a heading of its own."""
    dt, omega = 0.01, np.array([0.02, -0.05, 0.4])
    row = np.array([[dt, *omega, np.nan, np.nan, np.nan]])  # Without force nothing is corrected.
    x, _, odometry, _, _ = run(period([])._replace(imu=row), OPEN, fresh()[0])
    own = x.copy()
    own[state.YAW] = odometry[3]
    rate = omega - x[state.GYRO_BIAS]
    velocity = rotation(own) @ [x[state.SPEED], aside(own, rate[2]), 0.0]
    assert np.abs(aside(own, rate[2])) > 0.01
    np.testing.assert_allclose(odometry[:3], dt * velocity, atol=1e-12)
    turn = np.sin(x[state.ROLL]) * rate[1] + np.cos(x[state.ROLL]) * rate[2]
    assert odometry[3] == pytest.approx(dt * turn / np.cos(x[state.PITCH]), abs=1e-12)


def test_dead_reckoning_drives_an_arc():
    """At constant speed and yaw rate odometry follows the circle of radius v / w."""
    x = np.zeros(STATES)
    x[state.SPEED] = 0.5
    stamps = np.arange(1, 101) / 100
    quiet = OPEN._replace(noise=NoiseModel(vibration=1e3))
    _, _, odometry, _, track = run(period(stamps, omega=0.4), quiet, x)
    radius = 0.5 / 0.4
    expected = [radius * np.sin(0.4), radius * (1 - np.cos(0.4))]
    np.testing.assert_allclose(odometry[:2], expected, atol=2e-3)
    assert odometry[3] == pytest.approx(0.4, abs=1e-6)
    np.testing.assert_allclose(track[-1, 1:4], odometry[:3])
    assert 2 * np.arctan2(track[-1, 6], track[-1, 7]) == pytest.approx(0.4, abs=1e-6)


def test_with_a_modelled_field_compass_and_fixes_leave_the_motion_alone():
    """Considered states keep value and covariance; heading and position are corrected."""
    x = np.zeros(STATES)
    x[state.YAW] = 0.2
    mag = np.array([[0.05, *field(np.zeros(STATES))]])
    fix = np.array([[0.05, 0.3, 0.2, 0.1, 0.5, 1.0]])
    one = run(period(STAMPS), HEADING_ONLY, x)
    two = run(period(STAMPS, mag=mag, gnss=fix), HEADING_ONLY, x)
    motion = [0, 1, 3, 4, 5, 9, 10, 16, 17, 18, 19]
    np.testing.assert_allclose(two[0][motion], one[0][motion], atol=1e-12)
    block = np.ix_(motion, motion)
    np.testing.assert_allclose(two[1][block], one[1][block], rtol=1e-6, atol=1e-9)
    assert abs(two[0][state.YAW]) < 0.12
    assert np.abs(two[0][6:8]).min() > 1e-3
    free = run(period(STAMPS, mag=mag, gnss=fix), GATED, x)
    assert np.abs(free[0][motion] - one[0][motion]).max() > 1e-6


def test_a_fix_of_the_instant_at_which_a_period_begins_corrects_before_it():
    """State and covariance are those of a fix at the end of the period before, bit for bit."""
    first, second = STAMPS, STAMPS + 0.1
    fix = np.array([[0.1, 0.3, 0.2, 0.1, 0.5, 1.0]])
    states = []
    for of_first, of_second in ((fix, fix[:0]), (fix[:0], fix)):
        belief, now, odometry, track = begin(), 0.0, np.zeros(4), np.zeros((10, 8))
        model, workspace = packed(GATED), packed(Workspace.allocate())
        for stamps, gnss in ((first, of_first), (second, of_second)):
            given = period(stamps, omega=0.2, gnss=gnss)
            now, *_ = run_period(belief, now, odometry, given, model, workspace, track)
        assert belief["counts"][0, GNSS].tolist() == [1, 0, 0, 0]
        states.append((belief["x"], belief["P"]))
    for before, after in zip(*states, strict=True):
        np.testing.assert_array_equal(before, after)
