"""Drawing of cells, ranges and the map: where patches, arcs and squares lie."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.report.drive_frames import DriveFrame, MapFrame
from andabata.viewer.cell_drawing import (
    cell_patches,
    map_squares,
    plane_height,
    range_lines,
)
from traversability.grid import PolarGrid

GRID = PolarGrid()


def level(x=0.0, y=0.0, yaw=0.0, roll=0.0, pitch=0.0):
    """Return a pose."""
    return Pose.from_euler(np.array([x, y, 0.0]), roll, pitch, yaw)


def test_patches_lie_in_their_cells():
    """Every place of a patch is within the sector and the ring of its cell."""
    patches, triangles = cell_patches(GRID)
    radii, angles = np.hypot(*patches.T).T, np.arctan2(patches[..., 1], patches[..., 0])
    cells = np.arange(len(patches))
    ring, sector = cells % GRID.n_rings, cells // GRID.n_rings
    edges = GRID.ring_edges
    assert (radii > edges[ring][:, None]).all()
    assert (radii < edges[ring + 1][:, None]).all()
    apart = (angles - GRID.bearings[sector][:, None] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(apart).max() < np.pi / GRID.n_sectors
    # All triangles face upwards.
    corners = patches.reshape(-1, 2)[triangles]
    (a, b), (c, d) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    assert (a * d - b * c > 0).all()


def test_ranges_are_arcs_at_their_distance():
    """Free sectors have green arcs at the last ring, unknown ones none, others blue ones."""
    ranges = np.full(GRID.n_sectors, 3.0, dtype=np.float32)
    ranges[0], ranges[1] = np.inf, np.nan
    lines, colours = range_lines(ranges, GRID)
    each = len(lines) // GRID.n_sectors
    reach = np.hypot(*lines[:, 0].T)
    assert reach[:each] == pytest.approx(GRID.outer_radius)
    assert not reach[each : 2 * each].any()
    assert reach[2 * each :] == pytest.approx(3.0)
    assert colours[0, 0, 1] > colours[0, 0, 2]
    assert colours[-1, 0, 2] > colours[-1, 0, 1]


def test_squares_of_the_map_are_where_its_cells_are():
    """Known cells around the robot come, in the colours of their values."""
    values = np.zeros((64, 64), dtype=np.float32)
    values[40, 32], values[30, 31] = 3.0, -3.0
    layer = MapFrame("occupancy", values, np.array([-6.4, -6.4]), 0.2, 3.0)
    places, colours = map_squares(layer, np.zeros(2))
    assert places == pytest.approx(np.array([[-0.3, -0.1], [1.7, 0.1]]))
    (free_red, free_green, _), (red, green, _) = colours.astype(int)
    assert free_green > free_red
    assert red > green
    assert not len(map_squares(layer, np.array([40.0, 0.0]))[0])


def test_the_plane_of_a_tilted_robot_rises_ahead():
    """Nose up by 10 degrees: a metre ahead lies 17.6 cm higher, beside nothing changes."""
    frame = DriveFrame(level(pitch=-np.deg2rad(10)))
    heights = plane_height(frame, np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    assert heights == pytest.approx([np.tan(np.deg2rad(10)), 0.0])
