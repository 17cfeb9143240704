"""Geometry of beams: rays, each from the pose of its own instant, and bearings."""

import numpy as np
import pytest

from andabata.machine.beams import BeamTables, beam_bearings, beam_rays
from andabata.machine.pose import PoseTrack
from tests.andabata.machine.beam_sweeps import HEIGHT, expected_rays, sweeps, track


@pytest.mark.parametrize("table", [[-0.4, 0.9, 1.9], [[-0.4, 0.9, 1.9], [0.2, -1.5, 0.1]]])
def test_bearings_are_those_of_the_rays_of_a_level_robot(table):
    """Each beam's bearing is the direction of its ray, for one table of elevations or one each."""
    poses = PoseTrack()
    for stamp in (0.0, 2.0):
        poses.append(stamp, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    given = sweeps(elevations=np.array(table, dtype=np.float32))
    rays, rows = beam_rays(given, poses, HEIGHT, BeamTables()), np.array([5, 0, 1, 3, 4])
    differences = beam_bearings(given, rows) - np.arctan2(rays[rows, 4], rays[rows, 3])
    np.testing.assert_allclose(np.exp(1j * differences), 1.0, atol=1e-5)


def test_each_ray_has_the_pose_and_head_angle_of_its_own_instant():
    """Rays equal those of scipy's rotations, beam by beam."""
    rays = beam_rays(sweeps(), track(), HEIGHT, BeamTables())
    np.testing.assert_allclose(rays, expected_rays(track()), atol=2e-6)


def test_tables_follow_the_beams_that_they_are_given():
    """A cache that served other beams gives the same rays as a new one."""
    tables = BeamTables()
    beam_rays(sweeps(elevations=np.zeros(3, dtype=np.float32)), track(), HEIGHT, tables)
    rays = beam_rays(sweeps(), track(), HEIGHT, tables).copy()
    np.testing.assert_array_equal(rays, beam_rays(sweeps(), track(), HEIGHT, BeamTables()))
    other = beam_rays(sweeps(head_rate=-1.5), track(), HEIGHT, tables)
    assert not np.array_equal(rays, other)
