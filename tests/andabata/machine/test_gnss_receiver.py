"""Satellite receiver: fixes of whole seconds, their latency, errors and stated variance."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.geo_reference import GeoReference
from andabata.machine.gnss_receiver import GnssConfig, GnssReceiver
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from terrain.classes import SemanticClass
from terrain.objects import frustum

PERFECT = GnssConfig(noise=0, correlated_error=0, dropout=0, multipath_rate=0)


def poses(seconds, speed=0.0, yaw=0.0):
    """Rows of the true track of a level robot that drives east."""
    stamps = np.arange(1, round(seconds * 100) + 1) / 100
    rows = np.zeros((len(stamps), 8))
    rows[:, 0], rows[:, 1] = stamps, speed * stamps
    rows[:, 4:] = Rotation.from_euler("z", yaw).as_quat()
    return rows


def received(gnss=PERFECT, objects=(), seed=0, constants=AS_BELIEVED, **motion):
    """Return the true rows of a motion and all fixes of it."""
    rows = poses(**motion)
    receiver = GnssReceiver(gnss, GeoReference(), objects)
    receiver.reset(np.random.default_rng(seed), constants)
    return rows, np.concatenate(
        [receiver.arrived(rows[k : k + 10]) for k in range(0, len(rows), 10)]
    )


def test_fixes_are_of_whole_seconds_and_arrive_late():
    """Fixes have the position of their own whole second."""
    rows, fixes = received(seconds=5.5, speed=1.0)
    np.testing.assert_allclose(fixes[:, 0], [1, 2, 3, 4, 5], atol=1e-9)
    places = GeoReference().to_map(fixes[:, 1:4])
    np.testing.assert_allclose(places, rows[[99, 199, 299, 399, 499], 1:4], atol=1e-4)


def found(fixes):
    """Return the valid fixes, without the rows in which the receiver reports none."""
    np.testing.assert_array_equal(np.isnan(fixes[:, 1]), np.isinf(fixes[:, 4]))
    return fixes[np.isfinite(fixes[:, 4])]


def test_the_error_of_fixes_is_a_metre_in_the_open():
    """The horizontal error in the open is a metre, and few fixes are lost."""
    _, fixes = received(GnssConfig(multipath_rate=0), seconds=900.0)
    assert len(fixes) == 899  # The last one is on its way.
    fixes = found(fixes)
    error = GeoReference().to_map(fixes[:, 1:4])[:, :2]
    assert np.sqrt((error**2).sum(axis=1).mean()) == pytest.approx(1.0, abs=0.1)
    assert 0.002 < 1 - len(fixes) / 900 < 0.03


def test_trees_shade_the_receiver():
    """Near a tree more fixes are lost and more lie far off."""
    tree = frustum(SemanticClass.TRUNK, (1.0, 0.0, 0.0), (0.2, 0.2), 3.0)
    config = GnssConfig(dropout=0.05, multipath_rate=0.02)
    _, clear = received(config, seconds=900.0)
    _, shaded = received(config, objects=(tree,), seconds=900.0)
    clear, shaded = found(clear), found(shaded)
    assert len(shaded) < 0.85 * len(clear)
    far = [
        (np.hypot(*GeoReference().to_map(f[:, 1:4])[:, :2].T) > 4).mean() for f in (clear, shaded)
    ]
    assert far[1] > 2 * far[0]


def test_a_fix_arrives_after_its_latency_and_not_before():
    """A fix of second 1 with a latency of 0.15 s comes with the period that ends at 1.2 s."""
    receiver = GnssReceiver(PERFECT, GeoReference(), ())
    receiver.reset(np.random.default_rng(0), AS_BELIEVED)
    rows = poses(2.0)
    counts = [len(receiver.arrived(rows[k : k + 10])) for k in range(0, 200, 10)]
    assert counts == [0] * 11 + [1] + [0] * 8


def fix_errors(gnss, seconds=3000.0, **more):
    """Return the horizontal errors of one fix per second of a robot at rest [m], shape (k, 2)."""
    _, fixes = received(gnss, seconds=seconds, **more)
    return GeoReference().to_map(fixes[:, 1:4])[:, :2]


def test_the_correlated_error_of_fixes_has_its_spread_and_its_correlation_time():
    """Without white noise the error is a Gauss-Markov process of the configured numbers."""
    gnss = GnssConfig(
        noise=0, correlated_error=0.5, correlation_time=10.0, dropout=0, multipath_rate=0
    )
    error = fix_errors(gnss)
    assert error.std() == pytest.approx(0.5, rel=0.2)
    for lag in (1, 5):
        expected = np.exp(-lag / 10.0)
        for axis in error.T:
            assert np.corrcoef(axis[:-lag], axis[lag:])[0, 1] == pytest.approx(expected, abs=0.12)


def test_the_white_noise_of_fixes_is_independent():
    """Without correlated error neighbouring errors are independent, of the configured spread."""
    gnss = GnssConfig(noise=0.6, correlated_error=0, dropout=0, multipath_rate=0)
    error = fix_errors(gnss)
    assert error.std() == pytest.approx(0.6, rel=0.05)
    assert abs(np.corrcoef(error[:-1, 0], error[1:, 0])[0, 1]) < 0.06


def test_multipath_is_an_offset_that_lasts_its_mean_time():
    """Multipath shifts fixes by a constant for some seconds, and then they are right again."""
    gnss = GnssConfig(noise=0, correlated_error=0, dropout=0, multipath_rate=0.1, multipath_time=5)
    error = fix_errors(gnss)
    off = np.hypot(*error.T) > 1e-3
    assert off.mean() == pytest.approx(0.1 * 5 / (1 + 0.1 * 5), abs=0.08)
    begins = np.flatnonzero(off[1:] & ~off[:-1]) + 1
    spans = [int(np.argmin(off[b:])) or len(off) - b for b in begins]
    assert np.mean(spans) == pytest.approx(5.0, rel=0.25)
    both = off[1:] & off[:-1]
    np.testing.assert_allclose(error[1:][both], error[:-1][both], atol=1e-3)


def test_a_receiver_reports_its_variance_without_multipath():
    """The reported variance is that of white and correlated error together."""
    gnss = GnssConfig(dropout=0)
    _, fixes = received(gnss, seconds=20.0)
    np.testing.assert_allclose(fixes[:, 4], gnss.noise**2 + gnss.correlated_error**2)


def test_the_slow_error_has_its_spread_and_its_correlation_time():
    """The slow error is a Gauss-Markov process of its own numbers, beside the fast one."""
    errors = [
        fix_errors(PERFECT, constants=TrueConstants(seed, gnss_drift=0.66, gnss_drift_time=30.0))
        for seed in range(4)
    ]
    assert np.std(errors) == pytest.approx(0.66, rel=0.1)
    for lag in (10, 30):
        pairs = [(e[:-lag].ravel(), e[lag:].ravel()) for e in errors]
        before, after = (np.concatenate(column) for column in zip(*pairs, strict=True))
        found = np.corrcoef(before, after)[0, 1]
        assert found == pytest.approx(np.exp(-lag / 30.0), abs=0.1)


def test_the_slow_error_is_there_from_the_first_fix_on():
    """A receiver is not right at the start and wrong later: the process is stationary."""
    firsts = [
        fix_errors(PERFECT, 2.0, constants=TrueConstants(seed, gnss_drift=0.66))[0]
        for seed in range(200)
    ]
    assert np.std(firsts) == pytest.approx(0.66, rel=0.12)


def test_the_slow_error_adds_to_the_others_and_moves_none_of_them():
    """Twice the slow error is twice its course: fixes differ by it alone."""
    errors = [
        fix_errors(GnssConfig(), 300.0, constants=TrueConstants(5, gnss_drift=drift))
        for drift in (0.0, 0.3, 0.6)
    ]
    lost = np.isnan(errors[0])
    assert lost.any()
    np.testing.assert_array_equal(lost, np.isnan(errors[2]))
    np.testing.assert_allclose(errors[2] - errors[0], 2 * (errors[1] - errors[0]), atol=1e-4)
    assert np.nanstd(errors[1] - errors[0]) > 0.05


def test_the_true_white_noise_takes_the_place_of_the_configured():
    """A level's white noise holds for both horizontal axes, and twice of it for the height."""
    _, fixes = received(
        GnssConfig(correlated_error=0, dropout=0, multipath_rate=0),
        seconds=2000.0,
        constants=TrueConstants(gnss_noise=0.25),
    )
    error = GeoReference().to_map(fixes[:, 1:4])
    np.testing.assert_allclose(error.std(axis=0), [0.25, 0.25, 0.5], rtol=0.06)


def test_the_antenna_turns_with_the_robot():
    """An antenna 0.5 m ahead of its believed place is north of it on a robot that looks north."""
    error = fix_errors(PERFECT, 3.0, yaw=np.pi / 2, constants=TrueConstants(antenna=(0.5, 0.1, 0)))
    np.testing.assert_allclose(error, np.tile([-0.1, 0.5], (len(error), 1)), atol=1e-4)


def test_a_receiver_states_its_true_variance_times_the_square_of_its_ratio():
    """A receiver that states a third of its sigma states a ninth of the variance of all errors."""
    liar = TrueConstants(gnss_noise=0.25, gnss_drift=0.66, gnss_sigma_ratio=1 / 3)
    _, fixes = received(GnssConfig(dropout=0), seconds=5.0, constants=liar)
    np.testing.assert_allclose(fixes[:, 4], (0.25**2 + 0.25**2 + 0.66**2) / 9)
