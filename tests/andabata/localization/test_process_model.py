"""Process and measurement models against filterpy's filter, and their laws."""

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from scipy.stats import chi2

from andabata.localization import process_model as model
from andabata.localization.process_model import (
    ANGULAR,
    STATES,
    BodyParameters,
    FilterModel,
    Gates,
    Measurements,
    NoiseModel,
    Workspace,
)
from andabata.localization.ukf import SigmaWeights, wrap_angle

BODY = BodyParameters(0.1, 0.18, 0.09, 0.31, 0.2, 26.0, -34.0)
GATED = FilterModel(BODY, NoiseModel(), Gates(), SigmaWeights.merwe(STATES))
OPEN = GATED._replace(gates=Gates(1e9, 1e9, 1e9))
HEADING_ONLY = GATED._replace(body=BODY._replace(heading_only=True))


def gyro(omega):
    """Return an inertial row with an angular velocity [rad/s]."""
    return np.array([0.0, *omega, 0.0, 0.0, 0.0])


def fresh(seed=0):
    """Return a state near the seam of the heading, and a full covariance."""
    rng = np.random.default_rng(seed)
    x = np.zeros(STATES)
    x[:3] = [0.1, -0.2, 3.1]  # A heading near the seam.
    x[3:6], x[9:11] = rng.normal(0, 0.01, 3), [0.3, 0.01]
    x[11:14] = rng.normal(0, 1, 3)
    A = rng.normal(0, 0.02, (STATES, STATES))
    return x, A @ A.T + np.diag(np.linspace(1e-4, 1e-2, STATES))


def wrapped(angles):
    """Return a state whose angles are wrapped."""
    angles = np.array(angles)
    angles[ANGULAR] = [wrap_angle(a) for a in angles[ANGULAR]]
    return angles


def oracle(x, P):
    """Return filterpy's filter with the same points, means and residuals."""

    def mean(points, weights):
        turns = np.array([wrapped(point - points[0]) for point in points])
        return wrapped(points[0] + weights @ turns)

    ukf = UnscentedKalmanFilter(
        dim_x=STATES,
        dim_z=3,
        dt=0.01,
        hx=None,
        fx=None,
        points=MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0),
        x_mean_fn=mean,
        residual_x=lambda a, b: wrapped(a - b),
    )
    ukf.x, ukf.P = x.copy(), P.copy()
    return ukf


def rotation(x):
    """Return the rotation matrix from base to map of a state."""
    sr, cr, sp, cp, sy, cy = (f(a) for a in x[:3] for f in (np.sin, np.cos))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def aside(x, rate):
    """Return the lateral speed of a state at a yaw rate."""
    creep = abs(rate) * BODY.creep * np.tanh(np.sin(x[0]) / BODY.creep_slope)
    return x[10] - creep - rate * BODY.pivot * np.sin(x[1])


def moved(x, dt, omega, noise):
    """Return a state a step later, as section 1 of any textbook writes it."""
    rate = omega - x[3:6]
    roll, pitch = x[:2]
    T = np.array(
        [
            [1, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)],
            [0, np.cos(roll), -np.sin(roll)],
            [0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)],
        ]
    )
    y = x.copy()
    y[6:9] += dt * rotation(x) @ [x[9], aside(x, rate[2]), 0.0]
    y[:3] += dt * T @ rate
    y[10] *= np.exp(-dt / noise.lateral_speed_time)
    y[14:16] *= np.exp(-dt / noise.gnss_error_time)
    return y


def process_noise(dt, noise):
    """Return the covariance of the process noise of a step."""
    Q = np.zeros(STATES)
    Q[:3], Q[3:6] = noise.gyro**2 * dt, noise.gyro_bias_walk**2 * dt
    Q[6:9] = np.array([noise.position_walk, noise.position_walk, noise.height_walk]) ** 2 * dt
    Q[9] = noise.speed_walk**2 * dt
    Q[10] = noise.lateral_speed**2 * (1 - np.exp(-2 * dt / noise.lateral_speed_time))
    Q[11:14] = noise.hard_iron_walk**2 * dt
    Q[14:16] = noise.gnss_error**2 * (1 - np.exp(-2 * dt / noise.gnss_error_time))
    Q[16:18] = noise.accel_bias_walk**2 * dt
    return np.diag(Q)


def force(x, omega):
    """Return the specific force that a state expects."""
    rate = omega - x[3:6]
    level = rotation(x).T @ [0, 0, model.GRAVITY] + np.cross(rate, [x[9], aside(x, rate[2]), 0])
    return level + np.array([x[16], x[17], 0])


def field(x):
    """Return the magnetic field that a state expects."""
    return rotation(x).T @ [BODY.flux_east, BODY.flux_north, BODY.flux_up] + x[11:14]


def test_a_prediction_and_every_correction_equal_filterpys():
    """State, covariance and NIS are filterpy's, step by step."""
    noise, workspace = NoiseModel(), Workspace.allocate()
    x, P = fresh()
    ukf = oracle(x, P)
    omega = np.array([0.02, -0.05, 0.4])
    rng = np.random.default_rng(3)
    for _ in range(25):
        assert model.predict(x, P, gyro(omega), 0.01, OPEN, workspace)
        ukf.Q = process_noise(0.01, noise)
        ukf.predict(dt=0.01, fx=lambda s, dt: moved(s, dt, omega, noise))
        imu = np.array([0.0, *omega, *(force(x, omega) + rng.normal(0, 0.5, 3))])
        mag = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
        fix = np.array([0.0, *(x[6:9] + rng.normal(0, 0.7, 3)), 0.66, 1.4])
        vibration = noise.vibration**2
        steps = (
            (
                lambda: model.correct_wheels(x, P, 0.31, OPEN, workspace),
                lambda s: s[9:10],
                np.array([0.31]),
                [noise.wheel_speed**2],
            ),
            (
                lambda i=imu: model.correct_gravity(x, P, i, OPEN, workspace),
                lambda s: force(s, omega),
                imu[4:],
                [vibration, vibration, 4 * vibration],
            ),
            (
                lambda f=mag: model.correct_mag(x, P, f, OPEN, workspace),
                field,
                mag[1:],
                [noise.mag**2] * 3,
            ),
            (
                lambda f=fix: model.correct_gnss(x, P, f, OPEN, workspace),
                lambda s: s[6:9] + np.array([s[14], s[15], 0]),
                fix[1:4],
                [0.66**2, 0.66**2, 1.4**2],
            ),
            (
                lambda i=imu: model.correct_zero_rate(x, P, i, OPEN, workspace),
                lambda s: s[3:6],
                imu[1:4],
                [noise.zero_rate**2] * 3,
            ),
        )
        for ours, hx, z, R in steps:
            nis = ours()
            ukf.sigmas_f = ukf.points_fn.sigma_points(ukf.x, ukf.P)
            ukf.update(z, R=np.diag(R), hx=hx)
            ukf.x = wrapped(ukf.x)
            assert nis == pytest.approx(ukf.mahalanobis**2, rel=1e-7)
            np.testing.assert_allclose(wrapped(x - ukf.x), 0, atol=1e-9)
            np.testing.assert_allclose(P, ukf.P, atol=1e-9)


def test_named_states_are_the_table_of_the_module():
    """Slices and single indices cover the state in the order of the module's table."""
    covered = [
        *range(STATES)[model.ATTITUDE],
        *range(STATES)[model.GYRO_BIAS],
        *range(STATES)[model.POSITION],
        model.SPEED,
        model.LATERAL_SPEED,
        *range(STATES)[model.HARD_IRON],
        *range(STATES)[model.GNSS_ERROR],
        *range(STATES)[model.ACCEL_BIAS],
    ]
    assert covered == list(range(STATES))
    assert ANGULAR.tolist() == [True] * 3 + [False] * 15


def test_gates_are_chi_square_quantiles():
    """Gates compare squared innovations with quantiles at 0.999, for fixes at 0.99."""
    gates = Gates()
    assert gates.wheels == pytest.approx(chi2.ppf(0.999, 1), abs=0.01)
    assert gates.vector == pytest.approx(chi2.ppf(0.999, 3), abs=0.01)
    assert gates.gnss == pytest.approx(chi2.ppf(0.99, 3), abs=0.01)


def test_the_gate_lies_at_the_root_of_its_number_of_standard_deviations():
    """A fix just within sqrt(gate) standard deviations is accepted, one just beyond is not."""
    workspace = Workspace.allocate()
    for share, moved_state in ((0.99, True), (1.01, False)):
        x, P = fresh(1)
        sigma = np.sqrt(P[6, 6] + 2 * P[6, 14] + P[14, 14] + 0.66**2)
        fix = np.array([0.0, *x[6:9], 1.0, 1.0])
        fix[4:6] = 0.66, 1e6
        # Without correlation to y the NIS is the squared number of standard deviations.
        P[7, :], P[:, 7] = 0.0, 0.0
        P[15, :], P[:, 15] = 0.0, 0.0
        P[7, 7] = P[15, 15] = 1e-4
        fix[1] += share * np.sqrt(GATED.gates.gnss) * sigma
        before = x.copy()
        nis = model.correct_gnss(x, P, fix, GATED, workspace)
        assert nis == pytest.approx(share**2 * GATED.gates.gnss, rel=1e-6)
        assert np.array_equal(x, before) is not moved_state


def test_a_measurement_beyond_the_gate_changes_nothing():
    """A gated fix returns its NIS and leaves state and covariance as they are."""
    workspace = Workspace.allocate()
    x, P = fresh(1)
    before = x.copy(), P.copy()
    fix = np.array([0.0, *(x[6:9] + 50.0), 0.66, 1.4])
    assert model.correct_gnss(x, P, fix, GATED, workspace) > GATED.gates.gnss
    np.testing.assert_array_equal(x, before[0])
    np.testing.assert_array_equal(P, before[1])


def test_a_covariance_that_is_not_positive_definite_is_reported():
    """Prediction returns false and corrections NaN if the covariance is invalid."""
    workspace = Workspace.allocate()
    x, P = fresh(2)
    for i in range(STATES):
        wrong = P.copy()
        wrong[i, i] = -1.0
        assert not model.predict(x, wrong, gyro(np.zeros(3)), 0.01, GATED, workspace)
    P[1, 1] = -1.0
    mag = np.array([0.0, *field(x)])
    assert np.isnan(model.correct_mag(x, P, mag, GATED, workspace))
    P[9, 9] = -1.0
    assert np.isnan(model.correct_wheels(x, P, 0.3, GATED, workspace))
    P[14, 14] = -1.0
    fix = np.array([0.0, *x[6:9], 0.1, 0.1])
    assert np.isnan(model.correct_gnss(x, P, fix, GATED, workspace))


def test_the_covariance_stays_symmetric_and_positive():
    """Thousands of steps leave the covariance symmetric and positive definite."""
    workspace = Workspace.allocate()
    x, P = fresh(4)
    rng = np.random.default_rng(5)
    for k in range(4000):
        omega = rng.normal(0, 0.5, 3)
        assert model.predict(x, P, gyro(omega), 0.01, GATED, workspace)
        model.correct_wheels(x, P, 0.3, GATED, workspace)
        if k % 10 == 0:
            mag = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
            model.correct_mag(x, P, mag, GATED, workspace)
        x[0], x[1] = np.clip(x[:2], -0.5, 0.5)
    np.testing.assert_array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > 0


def period(stamps, omega=0.0, **rows):
    """Return measurements of a level robot at rest with inertial rows at some stamps."""
    imu = np.zeros((len(stamps), 7))
    imu[:, 0], imu[:, 3], imu[:, 6] = stamps, omega, model.GRAVITY
    widths = {"wheels": 3, "mag": 4, "gnss": 6}
    given = {name: rows.get(name, np.empty((0, width))) for name, width in widths.items()}
    return Measurements(imu, **given)


def run(measurements, filter_model=GATED, x=None, now=0.0):
    """Return state, covariance, odometry, counts and track after a period."""
    x = np.zeros(STATES) if x is None else x.copy()
    P = np.diag(np.full(STATES, 1e-2))
    odometry, counts = np.zeros(4), np.zeros((6, 3), dtype=np.int64)
    track = np.zeros((len(measurements.imu), 8))
    workspace = Workspace.allocate()
    _, filled, valid = model.run_period(
        x, P, now, odometry, measurements, filter_model, workspace, counts, track
    )
    assert valid
    return x, P, odometry, counts, track[:filled]


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
    assert counts[model.WHEELS].tolist() == [1, 0, 0]


def test_rows_are_counted_as_accepted_gated_and_rejected():
    """NaN rows are rejected, far ones gated, and a stamp that decreases is rejected."""
    wheels = np.array([[0.01, 0.0, 0.0], [0.02, np.nan, 0.0], [0.03, 500.0, 500.0]])
    stamps = STAMPS.copy()
    stamps[5] = stamps[3]
    counts = run(period(stamps, wheels=wheels))[3]
    assert counts[model.WHEELS].tolist() == [1, 1, 1]
    assert counts[model.IMU].tolist() == [9, 0, 1]
    assert counts[model.ZERO_RATE].tolist() == [1, 0, 0]


def test_a_step_longer_than_the_limit_is_rejected():
    """An inertial row after a long gap is rejected."""
    counts = run(period(np.array([2.5])))[3]
    assert counts[model.IMU].tolist() == [0, 0, 1]


def test_dead_reckoning_moves_as_the_process_does_on_a_cross_slope():
    """One step of a turning, tilted robot: creep and pivot included, with a heading of its own."""
    dt, omega = 0.01, np.array([0.02, -0.05, 0.4])
    row = np.array([[dt, *omega, np.nan, np.nan, np.nan]])  # Without force nothing is corrected.
    x, _, odometry, _, _ = run(period([])._replace(imu=row), OPEN, fresh()[0])
    own = x.copy()
    own[model.YAW] = odometry[3]
    rate = omega - x[model.GYRO_BIAS]
    velocity = rotation(own) @ [x[model.SPEED], aside(own, rate[2]), 0.0]
    assert np.abs(aside(own, rate[2])) > 0.01
    np.testing.assert_allclose(odometry[:3], dt * velocity, atol=1e-12)
    turn = np.sin(x[model.ROLL]) * rate[1] + np.cos(x[model.ROLL]) * rate[2]
    assert odometry[3] == pytest.approx(dt * turn / np.cos(x[model.PITCH]), abs=1e-12)


def test_dead_reckoning_drives_an_arc():
    """At constant speed and yaw rate odometry follows the circle of radius v / w."""
    x = np.zeros(STATES)
    x[model.SPEED] = 0.5
    stamps = np.arange(1, 101) / 100
    quiet = OPEN._replace(noise=NoiseModel(vibration=1e3))
    _, _, odometry, _, track = run(period(stamps, omega=0.4), quiet, x)
    radius = 0.5 / 0.4
    expected = [radius * np.sin(0.4), radius * (1 - np.cos(0.4))]
    np.testing.assert_allclose(odometry[:2], expected, atol=2e-3)
    assert odometry[3] == pytest.approx(0.4, abs=1e-6)
    np.testing.assert_allclose(track[-1, 1:4], odometry[:3])
    assert 2 * np.arctan2(track[-1, 6], track[-1, 7]) == pytest.approx(0.4, abs=1e-6)


def test_gravity_at_rest_levels_the_robot():
    """A specific force that leans to the left raises the roll, one ahead lowers the pitch."""
    workspace = Workspace.allocate()
    for axis, index, sign in ((5, model.ROLL, 1), (4, model.PITCH, -1)):
        x, P = np.zeros(STATES), np.diag(np.full(STATES, 1e-2))
        imu = np.array([0.0, 0, 0, 0, 0, 0, model.GRAVITY])
        imu[axis] = 0.5
        model.correct_gravity(x, P, imu, OPEN, workspace)
        assert sign * x[index] > 0.01


def test_with_a_modelled_field_compass_and_fixes_leave_the_motion_alone():
    """Considered states keep value and covariance; heading and position are corrected."""
    x = np.zeros(STATES)
    x[model.YAW] = 0.2
    mag = np.array([[0.05, *field(np.zeros(STATES))]])
    fix = np.array([[0.05, 0.3, 0.2, 0.1, 0.5, 1.0]])
    one = run(period(STAMPS), HEADING_ONLY, x)
    two = run(period(STAMPS, mag=mag, gnss=fix), HEADING_ONLY, x)
    motion = [0, 1, 3, 4, 5, 9, 10, 16, 17]
    np.testing.assert_allclose(two[0][motion], one[0][motion], atol=1e-12)
    block = np.ix_(motion, motion)
    np.testing.assert_allclose(two[1][block], one[1][block], rtol=1e-6, atol=1e-9)
    assert abs(two[0][model.YAW]) < 0.1
    assert np.abs(two[0][6:8]).min() > 1e-3
    free = run(period(STAMPS, mag=mag, gnss=fix), GATED, x)
    assert np.abs(free[0][motion] - one[0][motion]).max() > 1e-6
