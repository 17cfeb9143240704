"""Beams that show what moves: which count, where they end, and from where they come."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.navigation.look_rays import LookConfig, LookRays
from tests.support.still_scenes import EYE, frame_readings, standing_track, turning_readings

WALKER = np.array([[3.0, 0.2, 0.25, 1.7]])


def first_sweeps():
    return next(turning_readings(0.1, lambda stamp: WALKER)).sweeps


def test_beams_of_a_turning_laser_end_where_they_met_something():
    """Each plane has one stamp, and the laser stands over the robot."""
    sweeps, rays = first_sweeps(), LookRays(LookConfig(beam_stride=1), EYE)
    look = rays.of_sweeps(sweeps, standing_track(1.0))
    np.testing.assert_allclose(look.origin, [0.0, 0.0, EYE], atol=1e-6)
    np.testing.assert_array_equal(np.unique(look.stamps), sweeps.stamps)
    over = np.degrees(
        np.arcsin((look.ends[:, 2] - EYE) / np.linalg.norm(look.ends - look.origin, axis=1))
    )
    assert over.min() == pytest.approx(-35.0, abs=0.3)
    assert over.max() == pytest.approx(55.0, abs=0.3)
    met = look.ends[look.is_return]
    assert np.abs(met[:, 2]).min() < 1e-3
    assert np.hypot(*(met[met[:, 2] > 0.5, :2] - WALKER[0, :2]).T).max() < 0.26


def test_beams_that_met_nothing_pass_the_free_range():
    """They are no returns."""
    look = LookRays(LookConfig(free_range=7.0), EYE).of_sweeps(first_sweeps(), standing_track(1.0))
    away = np.linalg.norm(look.ends - look.origin, axis=1)[~look.is_return]
    np.testing.assert_allclose(away, 7.0, atol=1e-3)


def test_the_stride_leaves_beams_out_and_no_sweeps_are_no_look():
    """Half of the beams at stride 2."""
    sweeps, track = first_sweeps(), standing_track(1.0)
    counts = [
        len(LookRays(LookConfig(beam_stride=n), EYE).of_sweeps(sweeps, track).stamps)
        for n in (1, 2)
    ]
    assert counts[1] == pytest.approx(counts[0] / 2, abs=8)
    none = replace(
        sweeps, stamps=np.empty(0), head_angles=np.empty(0), ranges=np.empty((0, 1081), np.float32)
    )
    assert LookRays(LookConfig(), EYE).of_sweeps(none, track) is None


def test_clouds_are_thinned_to_their_largest_number_by_turns():
    """All points count in the end, and all beams of a cloud are one look."""
    frame = next(frame_readings(0.1, lambda stamp: WALKER)).frames[0]
    rays, track = LookRays(LookConfig(max_points=1000), EYE), standing_track(1.0)
    stride = -(-len(frame.points) // 1000)
    looks = [rays.of_frame(frame, track) for _ in range(stride)]
    assert max(len(look.ends) for look in looks) <= 1000
    everything = np.concatenate([look.ends for look in looks])
    expected = frame.points + np.float32([0.0, 0.0, EYE])
    np.testing.assert_allclose(np.sort(everything, axis=0), np.sort(expected, axis=0), atol=1e-4)
    assert len(np.unique(looks[0].stamps)) == 1
    assert looks[0].is_return.all()
    np.testing.assert_allclose(looks[0].origin, [0.0, 0.0, EYE])
    empty = frame.select(np.zeros(len(frame.points), dtype=np.bool_))
    assert rays.of_frame(empty, track) is None


def test_beams_of_known_rows_that_met_nothing_are_added_now_and_then():
    """Every second cloud here; without known rows there are none."""
    frame = next(frame_readings(0.1, lambda stamp: WALKER)).frames[0]
    rows = tuple(np.linspace(-22.5, 22.5, 40).tolist())
    config, track = LookConfig(silent_interval=2, free_range=6.0), standing_track(1.0)
    known, unknown = LookRays(config, EYE, rows), LookRays(config, EYE)
    looks = [known.of_frame(frame, track) for _ in range(4)]
    counts = [np.count_nonzero(~look.is_return) for look in looks]
    assert counts[0] == counts[2] == 0
    assert counts[1] == counts[3] > 100
    silent = looks[1].ends[~looks[1].is_return]
    np.testing.assert_allclose(np.linalg.norm(silent - looks[1].origin, axis=1), 6.0, rtol=1e-5)
    # Above the horizon nothing is met but the walker.
    bearings = np.degrees(np.arctan2(silent[:, 1], silent[:, 0]))
    assert np.abs(bearings - np.degrees(np.arctan2(*WALKER[0, 1::-1]))).min() > 3.0
    assert all(unknown.of_frame(frame, track).is_return.all() for _ in range(4))
