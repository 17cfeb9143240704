"""Scale of the wheels by the fixes: errors of scale, detours of the signals, standstill."""

import numpy as np
import pytest

from andabata.localization.wheel_scale import WheelScale, WheelScaleConfig


def drive(scale, seconds=40, noise=0.3, speed=0.5, turn=0.1, angle=0.0, jump=None, begin=0):
    """Return the verdicts of a drive on a bend whose wheels read ``scale`` times too much."""
    check, rng = WheelScale(WheelScaleConfig()), np.random.default_rng(1)
    verdicts, place, way = [], np.zeros(2), np.zeros(2)
    for k in range(begin, begin + seconds):
        step = speed * np.array([np.cos(turn * k), np.sin(turn * k)])
        sine, cosine = np.sin(angle), np.cos(angle)
        place = place + np.array([[cosine, -sine], [sine, cosine]]) @ step
        way = way + scale * step
        fix = place + noise * rng.standard_normal(2)
        if jump and jump[0] <= k < jump[1]:
            fix = fix + np.array([6.0, 3.0])
        check.add(float(k), fix, way)
        verdicts.append(check.is_wrong)
    return verdicts, check


@pytest.mark.parametrize("scale", [2.0, 10.0, 0.5])
def test_wheels_out_of_scale_are_wrong(scale):
    """Once the fixes of a quarter of a minute are there, in whatever direction the map lies."""
    verdicts, check = drive(scale, angle=2.0)
    assert verdicts[:15] == [None] * 15
    assert True in verdicts[15:20]
    assert False not in verdicts
    assert check.begin == 24.0


@pytest.mark.parametrize("scale", [0.85, 1.0, 1.2])
def test_wheels_that_slip_are_not_wrong(scale):
    """A fifth more or less is slip; the heading of the map plays no part."""
    verdicts = drive(scale, angle=-1.0)[0]
    assert True not in verdicts
    assert False in verdicts


@pytest.mark.parametrize("seconds", [2, 6, 9])
def test_a_detour_of_the_signals_is_no_proof(seconds):
    """Fixes that are off by metres for some seconds have another shape than a scale."""
    assert True not in drive(1.0, jump=(20, 20 + seconds))[0]


def test_wheels_that_stand_while_the_fixes_drive_on_are_wrong():
    """On a straight way of three metres and more; fixes of a standing robot scatter or jump."""
    verdicts = drive(0.0, turn=0.0)[0]
    assert verdicts[:16] == [None] * 16
    assert verdicts[16] is True
    assert set(drive(0.0, turn=0.0, speed=0.1)[0]) == {None}
    assert set(drive(0.0, speed=0.0, jump=(10, 20))[0]) == {None}


def test_without_motion_or_with_poor_fixes_there_is_no_proof():
    """Standing wheels have no scale; fixes off by metres say nothing of it."""
    assert set(drive(1.0, speed=0.0)[0]) == {None}
    assert set(drive(2.0, noise=3.0)[0]) == {None}


def test_fixes_that_come_too_seldom_are_not_compared():
    """Sixteen fixes within 25 s are needed."""
    check = WheelScale(WheelScaleConfig())
    for k in range(40):
        check.add(2.0 * k, np.array([1.0 * k, 0.0]), np.array([5.0 * k, 0.0]))
    assert check.is_wrong is None
