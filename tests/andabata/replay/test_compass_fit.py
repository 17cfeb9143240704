"""Fit of a compass to a gyro: fields that are known come out, whatever the tilt and the drift."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.replay.compass_fit import CompassSamples, fit_compass

LEVEL, UP = 26.0, -34.0


def samples(hard=(0.0, 0.0, 0.0), soft=None, drift=0.0, begin=0.7, count=1500, noise=0.3):
    """Return a winding drive over hills of a compass with iron near it."""
    rng = np.random.default_rng(0)
    stamps = 0.1 * np.arange(count)
    yaws = begin + 2.5 * np.sin(0.05 * stamps) + 0.4 * np.sin(0.7 * stamps)
    tilts = 0.15 * np.stack([np.sin(0.3 * stamps), np.cos(0.21 * stamps)], axis=1)
    attitude = Rotation.from_euler("ZYX", np.column_stack([yaws, tilts]))
    fields = attitude.apply([0.0, LEVEL, UP], inverse=True)
    fields = fields @ (np.eye(3) if soft is None else soft).T + hard
    fields += rng.normal(0.0, noise, fields.shape)
    return CompassSamples(stamps, yaws - begin + drift * stamps, tilts, fields)


@pytest.mark.parametrize("drift", [0.0, 0.004, -0.006])
def test_a_sound_compass_has_the_earths_field_alone(drift):
    """Its angle is the field's at turn 0 in the middle of the drive; the gyro's bias is found."""
    given = samples(drift=drift)
    fit = fit_compass(given)
    angle = np.pi / 2 - 0.7 + drift * given.stamps.mean()
    assert fit.earth == pytest.approx(LEVEL * np.exp(1j * angle), abs=1.0)
    assert abs(fit.soft) < 0.5
    assert abs(fit.hard) < 0.5
    assert fit.up == pytest.approx(UP, abs=0.5)
    assert fit.drift == pytest.approx(drift, abs=0.0006)


def test_hard_iron_is_what_turns_with_the_robot():
    """Forward and left, within a microtesla."""
    fit = fit_compass(samples(hard=(8.0, -5.0, 0.0)))
    assert fit.hard == pytest.approx(8.0 - 5.0j, abs=1.0)
    assert abs(fit.soft) < 1.0


def test_soft_iron_turns_the_other_way():
    """Axes stretched by 1 + s and 1 - s give s of the field."""
    fit = fit_compass(samples(soft=np.diag([1.2, 0.8, 1.0])))
    assert abs(fit.soft) == pytest.approx(0.2 * LEVEL, rel=0.1)
    assert abs(fit.earth) == pytest.approx(LEVEL, rel=0.05)


def test_a_mirrored_compass_turns_against_the_gyro():
    """The rotation that is given is applied before."""
    mirror = np.diag([1.0, -1.0, 1.0])
    fit = fit_compass(samples(soft=mirror))
    assert abs(fit.soft) > 5 * abs(fit.earth)
    undone = fit_compass(samples(soft=mirror), mirror)
    assert abs(undone.earth) > 5 * abs(undone.soft)


def test_few_headings_are_unsure():
    """Without a turn nobody can tell the Earth's field from the robot's own."""
    short = samples(count=200)
    still = short._replace(turns=0.02 * short.turns)
    assert min(fit_compass(still).sigma[1:]) > 5 * max(fit_compass(short).sigma[1:])
