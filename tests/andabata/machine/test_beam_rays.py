"""Rays of many beams at once, with the poses of their own instants."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.beam_rays import beam_rays
from andabata.machine.beams import BeamTables
from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import Sweeps

BEAMS, PERIOD = 40, 0.003


def swept(stamps, head_angles, elevations):
    """Return sweeps without ranges."""
    ranges = np.full((len(stamps), np.shape(elevations)[-1]), np.inf, dtype=np.float32)
    return Sweeps(stamps, head_angles, 2.0, PERIOD, np.float32(elevations), ranges)


def wandering(count):
    """Return a track of poses ten milliseconds apart, from 0.1 s on."""
    rng = np.random.default_rng(0)
    track = PoseTrack()
    turns = Rotation.from_rotvec(rng.normal(scale=0.2, size=(count, 3))).as_quat()
    stamps = 0.1 + np.arange(count) / 100
    track.extend(np.column_stack([stamps, rng.normal(size=(count, 3)), turns]))
    return track


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("poses", [1, 2, 30])
def test_beams_taken_together_have_the_rays_of_each_alone(rows, poses):
    """Beams before, between and after the poses of a track are as in a sweep of their own."""
    track, stamps, heads = wandering(poses), np.array([0.05, 0.25]), np.array([0.3, 1.1])
    elevations = np.linspace(-2.0, 2.0, rows * BEAMS).reshape(rows, BEAMS)
    rays, times = beam_rays(swept(stamps, heads, elevations), track, 0.7, BeamTables())
    assert rays.shape == (2 * BEAMS, 6)
    np.testing.assert_allclose(times.reshape(2, BEAMS), stamps[:, None] + np.arange(BEAMS) * PERIOD)
    turned = np.ravel(heads[:, None] + 2.0 * PERIOD * np.arange(BEAMS))
    tilts = np.broadcast_to(elevations, (2, BEAMS)).reshape(-1, 1)
    alone, _ = beam_rays(swept(times.copy(), turned, tilts), track, 0.7, BeamTables())
    np.testing.assert_allclose(rays, alone, atol=1e-6)
