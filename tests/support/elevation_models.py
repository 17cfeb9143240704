"""Elevation models for tests: planes and hills in GeoTIFF files."""

import warnings

import numpy as np
import pytest

UTM = "EPSG:32632"
"""UTM zone 32 north, whose central meridian is 9 degrees east."""

EAST, NORTH = 500_000.0, 5_100_000.0
"""A place on the central meridian, where grid north is true north [m]."""

SCALE = 0.9996
"""Metres of the projection per metre on the central meridian."""


def needs_rasterio():
    """Skip a module of tests where there is no rasterio."""
    return pytest.importorskip("rasterio", reason="rasterio is not installed (extra `gis`)")


def grid(shape=(200, 200), cell=1.0, middle=(EAST, NORTH)):
    """Return eastings and northings of the middles of cells, and the six numbers of the grid.

    The first row is in the north, as in most files.
    """
    rows, columns = shape
    west, north = middle[0] - columns * cell / 2, middle[1] + rows * cell / 2
    x = west + (np.arange(columns) + 0.5) * cell
    y = north - (np.arange(rows) + 0.5) * cell
    return *np.meshgrid(x, y), (cell, 0.0, west, 0.0, -cell, north)


def plane(x, y, rise=(0.1, -0.05), height=500.0, middle=(EAST, NORTH)):
    """Return heights that rise to the east and to the north [m/m]."""
    return height + rise[0] * (x - middle[0]) + rise[1] * (y - middle[1])


def save(path, heights, numbers, crs=UTM, nodata=None, unit=None, scale=None, **options):
    """Write a GeoTIFF and return its path; ``numbers`` None leaves out its place."""
    rasterio = needs_rasterio()
    from affine import Affine

    bands = heights if heights.ndim == 3 else heights[None]
    layout = {"count": len(bands), "height": bands.shape[1], "width": bands.shape[2]}
    place = {} if numbers is None else {"transform": Affine(*numbers)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with rasterio.open(
            *(path, "w"),
            driver="GTiff",
            dtype=bands.dtype,
            crs=crs,
            nodata=nodata,
            **layout,
            **place,
            **options,
        ) as file:
            file.write(bands)
            if unit is not None:
                file.units = (unit,) * len(bands)
            if scale is not None:
                file.scales, file.offsets = ((each,) for each in scale)
    return path


def save_plane(path, shape=(200, 200), cell=1.0, dtype=np.float32, crs=UTM, **options):
    """Write a plane that rises 0.1 to the east and falls 0.05 to the north, return its path."""
    x, y, numbers = grid(shape, cell)
    return save(path, plane(x, y).astype(dtype), numbers, crs, **options)
