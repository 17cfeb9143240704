"""Elevation models: what is a GeoTIFF of heights with a place on Earth, and what is not."""

import sys

import numpy as np
import pytest

from tests.support.elevation_models import (
    EAST,
    NORTH,
    UTM,
    grid,
    needs_rasterio,
    plane,
    save,
    save_plane,
)
from worlds.elevation.errors import ElevationError, MissingRasterioError
from worlds.elevation.local_frame import WGS_84
from worlds.elevation.raster import crs_name, open_raster

needs_rasterio()


def test_rows_and_columns_count_from_the_north_west(tmp_path):
    """The middle of a cell has whole numbers; a metre to the east is a column on."""
    path = save_plane(tmp_path / "a.tif", (100, 80))
    with open_raster(path) as raster:
        frame = raster.middle()
        rows, columns = raster.cells_at(frame, np.array([0.0, 10.0]), np.array([0.0, 20.0]))
        assert raster.shape == (100, 80)
        assert crs_name(raster) == UTM
    assert rows == pytest.approx([49.5, 29.5], abs=0.02)
    assert columns == pytest.approx([39.5, 49.5], abs=0.02)


def test_corners_and_middle_are_places_on_earth(tmp_path):
    """UTM's central meridian is at 9 degrees; a kilometre is 0.009 degrees of latitude."""
    path = save_plane(tmp_path / "a.tif", (1000, 1000))
    with open_raster(path) as raster:
        middle, corners = raster.middle(), raster.corners()
    assert middle.longitude_deg == pytest.approx(9.0, abs=1e-9)
    latitudes = [each.latitude_deg for each in corners]
    assert max(latitudes) - min(latitudes) == pytest.approx(0.009, rel=1e-3)
    assert min(each.longitude_deg for each in corners) < 9.0 < corners[-1].longitude_deg


def test_a_window_has_its_heights(tmp_path):
    """Of the named rows and columns, in metres."""
    x, y, numbers = grid((30, 40))
    path = save(tmp_path / "a.tif", plane(x, y).astype(np.float32), numbers)
    with open_raster(path) as raster:
        values = raster.read((3, 5), (10, 20))
    np.testing.assert_allclose(values, plane(x, y)[3:10, 5:20], atol=1e-4)


@pytest.mark.parametrize(
    ("value", "nodata"), [(np.nan, None), (123.0, 123.0), (-9999.0, None), (1e38, None)]
)
def test_a_void_is_no_height(tmp_path, value, nodata):
    """Declared or not: nothing on land is below -1000 or above 9000 m."""
    x, y, numbers = grid((10, 10))
    heights = plane(x, y).astype(np.float32)
    heights[4, 5] = value
    path = save(tmp_path / "a.tif", heights, numbers, nodata=nodata)
    with open_raster(path) as raster:
        values = raster.read((0, 0), (10, 10))
    assert np.argwhere(np.isnan(values)).tolist() == [[4, 5]]


@pytest.mark.parametrize(
    ("options", "metres", "remark"),
    [
        ({"unit": "m"}, 1.0, None),
        ({"unit": "ft"}, 0.3048, "heights in ft"),
        ({"crs": "EPSG:2263+6360"}, 1200 / 3937, "US survey foot"),
        ({}, 1.0, "no unit of height in the file: metres are assumed"),
        ({"unit": "m", "scale": (0.1, -50.0)}, 0.1, None),
    ],
)
def test_heights_become_metres(tmp_path, options, metres, remark):
    """By the band's unit, or the vertical datum's; what is assumed is said."""
    path = save_plane(tmp_path / "a.tif", (20, 20), **options)
    with open_raster(path) as raster:
        value = raster.read((9, 9), (11, 11)).mean()
        remarks = raster.remarks
    assert value == pytest.approx(500.0 * metres + (-50.0 if "scale" in options else 0.0))
    assert [remark in each for each in remarks] == ([True] if remark else [])


def test_whole_numbers_are_said_to_be_terraces(tmp_path):
    """With the height of their steps."""
    path = save_plane(tmp_path / "a.tif", (20, 20), dtype=np.int16, unit="ft")
    with open_raster(path) as raster:
        assert "terraces of 0.3048 m" in raster.remarks[1]


def test_a_system_is_given_where_the_file_has_none(tmp_path):
    """And only there."""
    bare, own = (save_plane(tmp_path / f"{crs}.tif", crs=crs) for crs in (None, "EPSG:32633"))
    with open_raster(bare, UTM) as raster:
        assert raster.middle().longitude_deg == pytest.approx(9.0, abs=1e-9)
    with pytest.raises(ElevationError, match=r"got none; give it: --crs EPSG"), open_raster(bare):
        pass
    with pytest.raises(ElevationError, match="EPSG:32633, got EPSG:32632"), open_raster(own, UTM):
        pass
    with pytest.raises(ElevationError, match="such as EPSG:32632"), open_raster(bare, "Zone 32"):
        pass


LOCAL = 'LOCAL_CS["site",UNIT["metre",1]]'


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"crs": LOCAL}, "expected a geographic or projected CRS, got site"),
        ({"unit": "fathom"}, "expected heights in metres or feet, got 'fathom'; state"),
        ({"dtype": np.complex64}, "expected real heights, got complex64"),
        ({"shape": (1, 50)}, "expected 2 x 2 cells or more"),
    ],
)
def test_what_is_no_model_of_heights_is_refused(tmp_path, change, text):
    """With the file's name."""
    path = save_plane(tmp_path / "a.tif", **change)
    with pytest.raises(ElevationError, match=f"a.tif: {text}"), open_raster(path):
        pass


def test_pictures_and_grids_without_a_place_are_refused(tmp_path):
    """Three bands are a picture, no geotransform is anywhere."""
    heights = np.zeros((3, 20, 20), dtype=np.uint8)
    path = save(tmp_path / "a.tif", heights, grid((20, 20))[2])
    with pytest.raises(ElevationError, match="one band of heights, got 3"), open_raster(path):
        pass
    path = save(tmp_path / "b.tif", heights[:1], None)
    with pytest.raises(ElevationError, match=r"\(a geotransform\), got none"), open_raster(path):
        pass


def test_other_and_damaged_files_are_refused(tmp_path, capfd):
    """No GeoTIFF, one that is cut off, and none at all; nothing else is printed."""
    path = tmp_path / "a.tif"
    path.write_text("no picture")
    with pytest.raises(ElevationError, match=r"a\.tif: expected a GeoTIFF"), open_raster(path):
        pass
    whole = save_plane(tmp_path / "b.tif", (300, 300)).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ElevationError, match=r"a\.tif: expected a"), open_raster(path) as raster:
        raster.read((0, 0), raster.shape)
    with pytest.raises(FileNotFoundError), open_raster(tmp_path / "none.tif"):
        pass
    assert capfd.readouterr() == ("", "")


def test_more_cells_than_fit_are_refused(tmp_path, monkeypatch):
    """Of a window and of a block, before they are read."""
    path = save_plane(tmp_path / "a.tif", (64, 64))
    monkeypatch.setattr("worlds.elevation.raster._MOST_CELLS", 2000)
    with pytest.raises(ElevationError, match="in blocks of"), open_raster(path):
        pass
    path = save_plane(tmp_path / "b.tif", (64, 64), tiled=True, blockxsize=16, blockysize=16)
    with open_raster(path) as raster, pytest.raises(ElevationError, match="at most 2,000 cells"):
        raster.read((0, 0), (64, 64))


def test_a_grid_may_be_turned(tmp_path):
    """Its six numbers say where rows and columns are, and where its corners."""
    heights = np.zeros((30, 20), dtype=np.float32)
    numbers = (1.6, 1.8, EAST, 1.2, -2.4, NORTH)
    path = save(tmp_path / "a.tif", heights, numbers)
    with open_raster(path) as raster:
        first, *_, last = raster.corners()
        x, y = first.of(UTM, np.array([EAST + 1.6 * 4 + 1.8 * 7]), np.array([NORTH - 12.0]))
        rows, columns = raster.cells_at(first, x, y)
        end = first.to(UTM, *first.of(WGS_84, *(np.array([each]) for each in place(last))))
    assert [rows[0], columns[0]] == pytest.approx([6.5, 3.5], abs=1e-3)
    expected = (EAST + 1.6 * 20 + 1.8 * 30, NORTH + 1.2 * 20 - 2.4 * 30)
    assert (end[0][0], end[1][0]) == pytest.approx(expected, abs=1e-3)


def place(frame):
    """Return longitude and latitude of the origin of a frame."""
    return frame.longitude_deg, frame.latitude_deg


def test_without_rasterio_the_extra_is_named(tmp_path, monkeypatch):
    """The error says what to install."""
    path = save_plane(tmp_path / "a.tif")
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(MissingRasterioError, match="the extra `gis`"), open_raster(path):
        pass
