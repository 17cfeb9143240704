"""Squares of ground: the slopes of the model, east and north as on Earth, and no holes."""

import re

import numpy as np
import pytest

from tests.support.elevation_models import (
    EAST,
    NORTH,
    SCALE,
    grid,
    needs_rasterio,
    plane,
    save,
    save_plane,
)
from worlds.elevation.errors import ElevationError
from worlds.elevation.local_frame import WGS_84, LocalFrame
from worlds.elevation.raster import open_raster
from worlds.elevation.square import read_square

needs_rasterio()


def xy(square):
    """Return map x and y of the nodes of a square [m]."""
    return np.meshgrid(square.ground.x, square.ground.y, indexing="ij")


def test_a_plane_keeps_its_slope_and_north_is_y(tmp_path):
    """It rises to the east, x, and falls to the north, y; lengths are the ground's."""
    square = read_square(save_plane(tmp_path / "a.tif"), size=80.0, cell=0.5)
    x, y = xy(square)
    np.testing.assert_allclose(square.ground.heights, SCALE * (0.1 * x - 0.05 * y), atol=1e-3)
    assert square.ground.heights.shape == (161, 161)
    assert (square.ground.width, square.ground.cell) == (80.0, 0.5)
    assert square.datum.altitude == pytest.approx(500.0, abs=1e-3)
    assert square.datum.longitude_deg == pytest.approx(9.0, abs=1e-9)
    assert square.frame == LocalFrame(square.datum.latitude_deg, square.datum.longitude_deg)
    assert square.crs == "EPSG:32632"
    assert square.resolution == pytest.approx((1 / SCALE, 1 / SCALE), rel=1e-4)


def test_a_model_in_degrees_becomes_metres(tmp_path):
    """At 45 degrees a degree is 111,131.8 m to the north and 78,846.8 m to the east."""
    x, y, numbers = grid((300, 400), 1e-5, (7.0, 45.0))
    heights = plane(x, y, (0.1 * 78_846.8, -0.05 * 111_131.8), 300.0, (7.0, 45.0))
    path = save(tmp_path / "a.tif", heights.astype(np.float32), numbers, "EPSG:4326")
    square = read_square(path, (45.0, 7.0), size=80.0, cell=0.5)
    x, y = xy(square)
    np.testing.assert_allclose(square.ground.heights, 0.1 * x - 0.05 * y, atol=2e-3)
    assert square.datum.altitude == pytest.approx(300.0, abs=1e-3)
    assert square.resolution == pytest.approx((0.7885, 1.1113), rel=1e-3)


def test_rows_from_the_south_and_turned_grids_give_the_same_ground(tmp_path):
    """The numbers of a grid say where its cells are."""
    x, y, (cell, _, west, _, _, north) = grid((200, 240))
    heights = plane(x, y).astype(np.float32)
    south = (cell, 0.0, west, 0.0, cell, north - 200 * cell)
    turned = (0.0, cell, west, -cell, 0.0, north)
    files = [
        save(tmp_path / "a.tif", heights, (cell, 0.0, west, 0.0, -cell, north)),
        save(tmp_path / "b.tif", heights[::-1].copy(), south),
        save(tmp_path / "c.tif", heights.T.copy(), turned),
    ]
    first, *others = (read_square(path, size=60.0, cell=0.5) for path in files)
    for each in others:
        np.testing.assert_allclose(each.ground.heights, first.ground.heights, atol=1e-3)


def test_the_middle_is_where_it_was_asked_for(tmp_path):
    """The top of a cone at a known place is the middle of the square about that place."""
    x, y, numbers = grid()
    top = (EAST + 30.0, NORTH - 20.0)
    heights = 600.0 - np.hypot(x - top[0], y - top[1])
    path = save(tmp_path / "a.tif", heights.astype(np.float32), numbers)
    longitude, latitude = (v[0] for v in places_of(np.array([top[0]]), np.array([top[1]])))
    square = read_square(path, (latitude, longitude), size=60.0)
    i, j = np.unravel_index(square.ground.heights.argmax(), square.ground.heights.shape)
    assert [square.ground.x[i], square.ground.y[j]] == pytest.approx([0.0, 0.0], abs=0.51)
    assert (square.datum.latitude_deg, square.datum.longitude_deg) == (latitude, longitude)


def places_of(x, y):
    """Return longitudes and latitudes of UTM coordinates."""
    from rasterio.warp import transform

    return tuple(map(np.array, transform("EPSG:32632", "OGC:CRS84", x, y)))


def test_between_the_cells_of_a_coarse_model_the_ground_is_smooth(tmp_path):
    """Hills of 100 m come back within 2 cm from cells of 10 m, and bend no more than they do."""
    x, _, numbers = grid((40, 40), 10.0)
    wave = 2 * np.pi / 100.0
    heights = 3.0 * np.sin(wave * (x - EAST)) + 200.0
    path = save(tmp_path / "a.tif", heights.astype(np.float32), numbers)
    ground = read_square(path, size=100.0, cell=0.5).ground
    expected = 3.0 * np.sin(wave * SCALE * ground.x)
    np.testing.assert_allclose(ground.heights, expected[:, None] + 0 * ground.y, atol=0.02)
    bend = np.abs(np.diff(ground.heights.astype(np.float64), 2, axis=0)).max() / 0.5**2
    assert bend < 1.1 * 3.0 * wave**2 + 1e-3


def test_what_is_finer_than_the_grid_is_averaged_and_said(tmp_path):
    """Waves of half a metre are level at half a metre; a finer grid keeps them."""
    x, _, numbers = grid((480, 480), 0.1)
    heights = 500.0 + 0.1 * np.sin(2 * np.pi / 0.5 * (x - EAST))
    path = save(tmp_path / "a.tif", heights.astype(np.float32), numbers, unit="m")
    square = read_square(path, size=40.0, cell=0.5)
    assert np.ptp(square.ground.heights) < 0.02
    (remark,) = square.remarks
    assert "finer than the grid of 0.5 m" in remark
    fine = read_square(path, size=40.0, cell=float(re.search(r"--cell (\S+)", remark)[1]))
    assert fine.remarks == ()
    assert np.ptp(fine.ground.heights) > 0.1


def test_a_coarse_model_is_said_to_be_smooth(tmp_path):
    """With the edge of its cells; one of 1 m is not."""
    path = save_plane(tmp_path / "a.tif", (20, 20), 30.0, unit="m")
    assert "cells of 30 m" in read_square(path).remarks[0]
    assert read_square(save_plane(tmp_path / "b.tif", unit="m")).remarks == ()


def test_the_remarks_of_the_file_come_first(tmp_path):
    """What is assumed of its heights."""
    path = save_plane(tmp_path / "a.tif", dtype=np.int16)
    assert [each.split(":")[0] for each in read_square(path).remarks] == [
        "no unit of height in the file",
        "heights are whole numbers (int16)",
    ]


def with_voids(path, rows, columns, value=np.nan):
    """Write a plane of 200 m with voids."""
    x, y, numbers = grid()
    heights = plane(x, y).astype(np.float32)
    heights[rows, columns] = value
    return save(path, heights, numbers, unit="m")


@pytest.mark.parametrize("value", [np.nan, -9999.0])
def test_a_void_in_the_square_is_an_error_that_says_where(tmp_path, value):
    """Number and place of the cells; the size that it advises is free of them."""
    path = with_voids(tmp_path / "a.tif", slice(150, 153), slice(105, 107), value)
    with pytest.raises(ElevationError, match=r"got none in 6 of them") as error:
        read_square(path)
    text = str(error.value)
    x, y = map(float, re.search(r"at x (\S+), y (\S+) m", text).groups())
    # Rows 150 to 152 are 50 to 53 m to the south, columns 105 and 106 5 to 7 m to the east.
    assert (x, y) == (pytest.approx(6.0, abs=2.5), pytest.approx(-50.5, abs=1.5))
    assert "gdal_fillnodata.py a.tif filled.tif" in text
    size = float(re.search(r"--size (\S+),", text)[1])
    assert 95.0 < size <= 101.0
    assert read_square(path, size=size).ground.width == size


def test_a_void_in_the_middle_leaves_no_smaller_square(tmp_path):
    """Another place, or filling it, is the way out; one void counts once."""
    path = with_voids(tmp_path / "a.tif", 100, 100)
    with pytest.raises(
        ElevationError, match=r"got none in 1 of them.*; take another place"
    ) as error:
        read_square(path)
    assert "--size" not in str(error.value)


def test_a_void_between_the_nodes_of_a_coarser_grid_is_an_error(tmp_path):
    """No cell is passed over because it is small."""
    x, y, numbers = grid((900, 900), 0.05)
    heights = plane(x, y).astype(np.float32)
    heights[455, 457] = np.nan
    path = save(tmp_path / "a.tif", heights, numbers)
    with pytest.raises(ElevationError, match="got none in 1 of them"):
        read_square(path, size=40.0, cell=0.5)


def test_voids_beyond_the_square_do_not_matter(tmp_path):
    """They may be next to it: the ground is the same within millimetres."""
    whole = read_square(with_voids(tmp_path / "a.tif", 0, 0), size=100.0)
    voids = read_square(with_voids(tmp_path / "b.tif", slice(152, 200), slice(0, 200)), size=100.0)
    np.testing.assert_allclose(voids.ground.heights, whole.ground.heights, atol=5e-3)


def test_a_square_larger_than_the_model_is_an_error_with_a_size_that_fits(tmp_path):
    """Never a hole, never a repeated border."""
    path = save_plane(tmp_path / "a.tif", (100, 140))
    with pytest.raises(ElevationError, match=r"expected the square of 120 m .* outside") as error:
        read_square(path)
    assert "latitude 46." in str(error.value)
    size = float(re.search(r"an edge of (\S+) m or less", str(error.value))[1])
    assert 98.0 <= size <= 100.0
    x, y = xy(square := read_square(path, size=size))
    # Up to the outer edge of the border's cells, half a cell beyond their middles.
    np.testing.assert_allclose(square.ground.heights, SCALE * (0.1 * x - 0.05 * y), atol=2e-3)


def test_a_place_outside_is_an_error_that_says_what_the_model_covers(tmp_path):
    """Latitude and longitude that were swapped are recognized."""
    path = save_plane(tmp_path / "a.tif")
    with open_raster(path) as raster:
        middle = raster.middle()
    with pytest.raises(ElevationError, match=r"100\.0% of it") as error:
        read_square(path, (middle.longitude_deg, middle.latitude_deg))
    assert "; latitude comes first" in str(error.value)
    with pytest.raises(ElevationError, match="choose a place inside") as error:
        read_square(path, (46.0, 9.5))
    assert "latitude comes first" not in str(error.value)
    for far in ((-33.0, 151.0), (10.0, -171.0), (0.0, 99.0)):
        with pytest.raises(ElevationError, match=r"100\.0% of it outside: the file covers"):
            read_square(path, far)
    with pytest.raises(ElevationError, match="latitude within 89"):
        read_square(path, (89.5, 9.0))


@pytest.mark.parametrize("wrong", [{"size": 39.0}, {"size": 301.0}, {"cell": 0.0}, {"cell": 0.6}])
def test_sizes_out_of_bounds_are_refused(tmp_path, wrong):
    """A world is 40 to 300 m wide, its grid lines up to half a metre apart."""
    with pytest.raises(ValueError, match=f"{next(iter(wrong))}: expected"):
        read_square(tmp_path / "none.tif", **wrong)


def test_a_system_may_be_given(tmp_path):
    """The ground is that of the same file with it."""
    own, bare = (
        save_plane(tmp_path / f"{k}.tif", crs=crs) for k, crs in enumerate(("EPSG:32632", None))
    )
    found = read_square(bare, crs="EPSG:32632", size=60.0)
    np.testing.assert_array_equal(found.ground.heights, read_square(own, size=60.0).ground.heights)
    assert WGS_84 != found.crs == "EPSG:32632"
