"""Corrections, and predictions between them, against filterpy's filter; gates; signs."""

import numpy as np
import pytest

from andabata.localization import measurement_models as model
from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.filter_state import PITCH, ROLL, STATES
from andabata.localization.process_model import predict
from andabata.localization.sigma_points import Workspace
from andabata.machine.proprioception import GRAVITY
from tests.support.textbook_filter import (
    GATED,
    HEADING_ONLY,
    OPEN,
    bearing,
    field,
    force,
    fresh,
    gyro,
    levelled,
    moved,
    oracle,
    process_noise,
    wheel_speed,
    wrapped,
)


def test_a_prediction_and_every_correction_equal_filterpys():
    """State, covariance and NIS are filterpy's, step by step."""
    noise, workspace = NoiseModel(), Workspace.allocate()
    vibration = noise.vibration**2
    x, P = fresh()
    ukf = oracle(x, P)
    omega = np.array([0.02, -0.05, 0.4])
    rng = np.random.default_rng(3)
    for _ in range(25):
        assert predict(x, P, gyro(omega), 0.01, OPEN, workspace)
        ukf.Q = process_noise(0.01, noise)
        ukf.predict(dt=0.01, fx=lambda s, dt: moved(s, dt, omega, noise))
        imu = np.array([0.0, *omega, *(force(x, omega) + rng.normal(0, 0.5, 3))])
        mag = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
        fix = np.array([0.0, *(x[6:9] + rng.normal(0, 0.7, 3)), 0.66, 1.4])

        def heading(mag=mag):
            """Return the bearing of the field, levelled by the state before the correction."""
            mean, level = x.copy(), levelled(field(x), x[:2])
            z = np.arctan2(*levelled(mag[1:], x[:2])[1::-1])
            white = noise.mag**2 / (level[:2] @ level[:2])
            return lambda s: bearing(s, mean), np.array([z]), [white]

        def wheels():
            """Return the speed by wheels at the pitch before the correction."""
            pitch = x[1]
            return (
                lambda s: wheel_speed(s, 0.31, pitch),
                np.array([0.31]),
                [noise.wheel_speed**2],
            )

        steps = (
            (lambda: model.correct_wheels(x, P, 0.31, OPEN, workspace), wheels),
            (
                lambda i=imu: model.correct_gravity(x, P, i, OPEN, workspace),
                lambda i=imu: (
                    lambda s: force(s, omega),
                    i[4:],
                    [vibration, vibration, 4 * vibration],
                ),
            ),
            (lambda f=mag: model.correct_heading(x, P, f, OPEN, workspace), heading),
            (
                lambda f=fix: model.correct_gnss(x, P, f, OPEN, workspace),
                lambda f=fix: (
                    lambda s: s[6:9] + np.array([s[14], s[15], 0]),
                    f[1:4],
                    [0.66**2, 0.66**2, 1.4**2],
                ),
            ),
            (
                lambda i=imu: model.correct_zero_rate(x, P, i, OPEN, workspace),
                lambda i=imu: (lambda s: s[3:6], i[1:4], [noise.zero_rate**2] * 3),
            ),
        )
        for ours, textbook in steps:
            hx, z, R = textbook()
            nis = ours()
            ukf.sigmas_f = ukf.points_fn.sigma_points(ukf.x, ukf.P)
            ukf.update(z, R=np.diag(R), hx=hx)
            ukf.x = wrapped(ukf.x)
            assert nis == pytest.approx(ukf.mahalanobis**2, rel=1e-7)
            np.testing.assert_allclose(wrapped(x - ukf.x), 0, atol=1e-9)
            np.testing.assert_allclose(P, ukf.P, atol=1e-9)


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


def test_corrections_report_a_covariance_that_is_not_positive_definite():
    """They return NaN if the covariance is invalid."""
    workspace = Workspace.allocate()
    x, P = fresh(2)
    P[1, 1] = -1.0
    mag = np.array([0.0, *field(x)])
    assert np.isnan(model.correct_heading(x, P, mag, GATED, workspace))
    P[9, 9] = -1.0
    assert np.isnan(model.correct_wheels(x, P, 0.3, GATED, workspace))
    P[14, 14] = -1.0
    fix = np.array([0.0, *x[6:9], 0.1, 0.1])
    assert np.isnan(model.correct_gnss(x, P, fix, GATED, workspace))


def test_gravity_at_rest_levels_the_robot():
    """A specific force that leans to the left raises the roll, one ahead lowers the pitch."""
    workspace = Workspace.allocate()
    for axis, index, sign in ((5, ROLL, 1), (4, PITCH, -1)):
        x, P = np.zeros(STATES), np.diag(np.full(STATES, 1e-2))
        imu = np.array([0.0, 0, 0, 0, 0, 0, GRAVITY])
        imu[axis] = 0.5
        model.correct_gravity(x, P, imu, OPEN, workspace)
        assert sign * x[index] > 0.01


def test_a_compass_error_that_stays_does_not_become_heading():
    """A minute of one wrong bearing moves the heading by no more than its share of the doubt."""
    workspace, x = Workspace.allocate(), np.zeros(STATES)
    P = np.diag(np.full(STATES, 1e-6))
    P[2, 2], P[13, 13] = 0.02**2, GATED.noise.compass_error**2
    wrong = x.copy()
    wrong[2] = 0.1
    for _ in range(6000):
        assert model.correct_heading(x, P, np.array([0.0, *field(wrong)]), GATED, workspace) < 10
    share = 0.02**2 / (0.02**2 + GATED.noise.compass_error**2)
    assert x[2] == pytest.approx(0.1 * share, rel=0.02)
    assert x[2] + x[13] == pytest.approx(0.1, rel=0.02)


def test_noise_of_the_compass_does_not_feed_the_hard_iron():
    """White noise on every axis, for a minute at one heading: hard iron stays where it is."""
    workspace, rng = Workspace.allocate(), np.random.default_rng(2)
    x, true = np.zeros(STATES), np.zeros(STATES)
    x[2] = true[2] = -1.9
    P = np.diag(np.full(STATES, 1e-6))
    P[2, 2], P[11, 11], P[12, 12], P[13, 13] = 0.05**2, 4.0, 4.0, 0.06**2
    for _ in range(6000):
        mag = np.array([0.0, *(field(true) + rng.normal(0, 0.4, 3))])
        model.correct_heading(x, P, mag, GATED, workspace)
    assert np.hypot(*x[11:13]) < 0.5
    assert abs(x[2] - true[2]) < 0.01


@pytest.mark.parametrize(
    "added",
    [[0.0, 0.0, 20.0], [0.0, 20.0, 0.0], [0.0, -20.0, 0.0]],
)
def test_a_field_that_is_not_the_earths_is_gated(added):
    """Length or dip far from those of the place: whatever its bearing, nothing is corrected."""
    workspace, (x, P) = Workspace.allocate(), (np.zeros(STATES), np.eye(STATES) * 1e-4)
    before, mag = x.copy(), np.array([0.0, *field(x)])
    assert np.isfinite(model.correct_heading(x.copy(), P.copy(), mag, GATED, workspace))
    mag[1:] += added
    assert model.correct_heading(x, P, mag, GATED, workspace) == np.inf
    np.testing.assert_array_equal(x, before)
    # Where the field is known roughly, only its direction counts.
    assert np.isfinite(model.correct_heading(x, P, mag, HEADING_ONLY, workspace))


@pytest.mark.parametrize(("pitch", "index"), [(0.0, 18), (-0.3, 19), (0.3, 19)])
def test_wheels_that_read_too_fast_show_scale_or_slip(pitch, index):
    """Speed that fixes hold fast: on level ground the scale explains the rest, on slopes the slip.

    Pitch is positive nose down: a climb makes wheels too fast, a descent too slow.
    """
    workspace, x = Workspace.allocate(), np.zeros(STATES)
    x[PITCH], x[9] = pitch, 0.3
    P = np.diag(np.full(STATES, 1e-10))
    P[index, index] = 0.04
    excess = 0.05 * (1.0 if index == 18 else -np.sin(pitch))
    for _ in range(2000):
        model.correct_wheels(x, P, 0.3 / (1 - excess), OPEN, workspace)
    assert x[index] == pytest.approx(0.05, rel=0.05)
