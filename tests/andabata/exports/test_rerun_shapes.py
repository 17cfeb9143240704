"""Shapes lie where the cells and ranges are that they show."""

from types import SimpleNamespace

import numpy as np

from andabata.exports.rerun_shapes import (
    CELL_COLOURS,
    height_colours,
    map_archetype,
    map_pixels,
    polar_mesh,
    scan_points,
)
from tests.support.situations import GRID, nothing_seen
from traversability.virtual_scan import VirtualScan


def test_a_cell_is_two_triangles_that_face_up():
    """Its corners have its bearings and ranges; a blocked cell is red, unknown ones are missing."""
    odds = nothing_seen()
    odds[3, 5], odds[20, 0] = -1.0, 2.0
    mesh = polar_mesh(VirtualScan(np.full(GRID.n_sectors, np.inf, "f4"), 10.0, odds), GRID)
    assert (len(mesh.vertices), len(mesh.triangles)) == (8, 4)
    reaches = np.hypot(*mesh.vertices[:4, :2].T)
    np.testing.assert_allclose(sorted(set(reaches.round(4))), GRID.ring_edges[5:7], atol=1e-3)
    middle = mesh.vertices[:4].mean(axis=0)
    assert abs(np.arctan2(middle[1], middle[0]) - GRID.bearings[3]) < 1e-6
    np.testing.assert_array_equal(mesh.colours[0], CELL_COLOURS[0])
    np.testing.assert_array_equal(mesh.colours[4], CELL_COLOURS[1])
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_the_triangles_of_a_cell_cover_it():
    """Their areas together are that of the trapezium between its corners."""
    odds = nothing_seen()
    odds[7, 9] = 1.0
    mesh = polar_mesh(VirtualScan(np.full(GRID.n_sectors, np.inf, "f4"), 10.0, odds), GRID)
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)[:, 2].sum() / 2
    near, far = GRID.ring_edges[9:11]
    assert abs(area - np.sin(2 * np.pi / GRID.n_sectors) * (far**2 - near**2) / 2) < 1e-3


def test_only_limited_ranges_have_ends():
    """Free and unknown sectors show no point."""
    ranges = np.array([2.0, np.inf, np.nan], dtype=np.float32)
    points = scan_points(ranges, np.array([np.pi / 2, 0.0, 1.0], dtype=np.float32))
    np.testing.assert_allclose(points, [[0.0, 2.0, 0.0]], atol=1e-6)


def test_colours_rise_with_the_height():
    """The lowest is darkest; a flat cloud and an empty one have colours, too."""
    colours = height_colours(np.linspace(0, 1, 11, dtype=np.float32)).astype(int)
    assert (np.diff(colours[:, 0]) >= 0).all()
    assert colours[-1, 0] > colours[0, 0]
    assert len(height_colours(np.zeros(3, dtype=np.float32))) == 3
    assert height_colours(np.empty(0, dtype=np.float32)).shape == (0, 3)


def test_an_old_sdk_gets_the_map_as_points():
    """Known cells alone, at their middles."""
    place = SimpleNamespace(x=10.0, y=20.0, z=1.0)
    info = SimpleNamespace(
        width=3, height=2, resolution=0.5, origin=SimpleNamespace(position=place)
    )
    grid = SimpleNamespace(info=info, data=np.array([-1, 0, -1, -1, -1, 100], dtype=np.int8))
    sdk = SimpleNamespace(Points3D=lambda places, colors, radii: (places, colors, radii))
    places, colours, radius = map_archetype(sdk, grid)
    np.testing.assert_allclose(places, [[10.75, 20.25, 1.0], [11.25, 20.75, 1.0]])
    np.testing.assert_array_equal(colours, CELL_COLOURS[:, :3])
    assert radius == 0.25


def test_unknown_cells_are_transparent():
    """Free is green, an obstacle red, in between mixed."""
    pixels = map_pixels(np.array([[-1, 0, 50, 100]], dtype=np.int8))[0].astype(int)
    assert pixels[0, 3] == 0
    np.testing.assert_array_equal(pixels[[1, 3]], CELL_COLOURS)
    assert CELL_COLOURS[0, 0] < pixels[2, 0] < CELL_COLOURS[1, 0]
