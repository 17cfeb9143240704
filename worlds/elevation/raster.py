"""Elevation models: GeoTIFF files of one band of heights with a place on Earth."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worlds.elevation.errors import ElevationError, MissingRasterioError
from worlds.elevation.height_units import metres_of
from worlds.elevation.local_frame import WGS_84, LocalFrame, crs_of, transformed

SUFFIXES = (".tif", ".tiff")
"""Ends of the names of elevation models."""

LOWEST, HIGHEST = -1000.0, 9000.0
"""Limits of a height on land [m]; beyond them are marks of voids that no file declares."""

_MOST_CELLS = 8193**2
"""Largest number of cells that are read at once, and that a block of a file may have."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Raster:
    """An open elevation model.

    Attributes:
        path: File.
        dataset: rasterio's open dataset.
        crs: Coordinate reference system, rasterio's.
        metres: Metres of a unit of the file's numbers.
        offset: Height of the file's zero [m].
        remarks: Sentences about its heights.
    """

    path: Path
    dataset: Any
    crs: Any
    metres: float
    offset: float
    remarks: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return self.dataset.height, self.dataset.width

    def middle(self) -> LocalFrame:
        """Return the frame about the middle of the raster."""
        rows, columns = self.shape
        return self._frames([rows / 2], [columns / 2])[0]

    def corners(self) -> tuple[LocalFrame, ...]:
        """Return the frames about the four corners."""
        rows, columns = self.shape
        return tuple(self._frames([0, 0, rows, rows], [0, columns, 0, columns]))

    def cells_at(self, frame: LocalFrame, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return rows and columns of places, whole in the middles of cells, not finite far off.

        Args:
            frame: Frame of the places.
            x: Metres to the east, any shape.
            y: Metres to the north, same shape.
        """
        along, across = frame.to(self.crs, x, y)
        inverse = ~self.dataset.transform
        with np.errstate(invalid="ignore"):  # Zero times infinity.
            columns = inverse.a * along + inverse.b * across + inverse.c
            rows = inverse.d * along + inverse.e * across + inverse.f
        return rows - 0.5, columns - 0.5

    def read(self, low: tuple[int, int], high: tuple[int, int]) -> Floats:
        """Return the heights of a window [m], NaN where there is none.

        Args:
            low: First row and column.
            high: Row and column behind the last ones.

        Raises:
            ElevationError: If the window is too large, or the file is damaged.
        """
        rows, columns = (end - begin for begin, end in zip(low, high, strict=True))
        if rows * columns > _MOST_CELLS:
            raise ElevationError(
                f"{self.path}: expected at most {_MOST_CELLS:,} cells in the square, got "
                f"{rows * columns:,}; take a smaller one, or a coarser model (gdalwarp -tr)"
            )
        try:
            values = self.dataset.read(
                1, window=((low[0], high[0]), (low[1], high[1])), masked=True
            )
        except OSError as error:  # rasterio's own is one.
            raise ElevationError(
                f"{self.path}: expected a whole GeoTIFF, got a damaged one ({error})"
            ) from error
        heights = values.data.astype(np.float64) * self.metres + self.offset
        is_known = ~np.ma.getmaskarray(values) & (heights >= LOWEST) & (heights <= HIGHEST)
        return np.where(is_known, heights, np.nan)

    def _frames(self, rows: list[float], columns: list[float]) -> list[LocalFrame]:
        """Return the frames about corners of cells."""
        to, (row, column) = self.dataset.transform, np.array([rows, columns], dtype=np.float64)
        x, y = to.a * column + to.b * row + to.c, to.d * column + to.e * row + to.f
        longitudes, latitudes = transformed(self.crs, WGS_84, x, y)
        both = zip(latitudes.tolist(), longitudes.tolist(), strict=True)
        return [LocalFrame(latitude, longitude) for latitude, longitude in both]


@contextmanager
def open_raster(path: Path, crs: str | None = None) -> Iterator[Raster]:
    """Yield an elevation model.

    Args:
        path: GeoTIFF.
        crs: Coordinate reference system of a file that has none, such as ``EPSG:32632``.

    Raises:
        ElevationError: If it is no GeoTIFF with one band of real heights and a place on Earth.
        MissingRasterioError: If rasterio is not installed.
        OSError: If it cannot be read.
    """
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioIOError
    except ImportError as error:
        raise MissingRasterioError from error
    with path.open("rb"):
        pass  # For the plain error of a file that is not there.
    with rasterio.Env(), warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            dataset = rasterio.open(path, driver="GTiff")
        except (RasterioIOError, UnicodeDecodeError) as error:
            raise ElevationError(f"{path}: expected a GeoTIFF, got {error}") from error
        with dataset:
            yield _raster(path, dataset, crs)


def _raster(path: Path, dataset: Any, crs: str | None) -> Raster:  # noqa: ANN401 - rasterio's.
    """Return an elevation model; arguments and errors as those of ``open_raster``."""
    try:
        _check(path, dataset)
        system = _system(path, dataset, crs)
        return Raster(path, dataset, system, *_heights(path, dataset, system))
    except UnicodeDecodeError as error:
        raise ElevationError(
            f"{path}: expected a whole GeoTIFF, got a damaged one ({error})"
        ) from error


def _check(path: Path, dataset: Any) -> None:  # noqa: ANN401 - rasterio's.
    """Refuse what is no raster of heights in a regular grid.

    Raises:
        ElevationError: If it has several bands, complex numbers, no grid, or too large blocks.
    """
    if dataset.count != 1:
        raise ElevationError(
            f"{path}: expected one band of heights, got {dataset.count}; take one of them: "
            f"gdal_translate -b 1 {path.name} heights.tif"
        )
    if np.dtype(dataset.dtypes[0]).kind not in "iuf":
        raise ElevationError(f"{path}: expected real heights, got {dataset.dtypes[0]}")
    if dataset.transform.is_identity or dataset.transform.is_degenerate:
        raise ElevationError(
            f"{path}: expected a grid with a place on Earth (a geotransform), got none; "
            f"give it one with gdal_edit.py -a_ullr, or gdalwarp where it has ground control points"
        )
    rows, columns = dataset.block_shapes[0]
    if min(dataset.shape) < 2 or rows * columns > _MOST_CELLS:
        raise ElevationError(
            f"{path}: expected 2 x 2 cells or more in blocks of at most {_MOST_CELLS:,}, got "
            f"{dataset.height} x {dataset.width} in blocks of {rows} x {columns}; lay it out anew: "
            f"gdal_translate -co TILED=YES"
        )


def _system(path: Path, dataset: Any, given: str | None) -> Any:  # noqa: ANN401 - rasterio's.
    """Return the coordinate reference system of the file, or the given one if it has none.

    Raises:
        ElevationError: If there is none, or both, or it is not one of the Earth.
    """
    if dataset.crs and given is not None:
        raise ElevationError(
            f"{path}: expected no other CRS beside the file's own, {_name(dataset.crs)}, got "
            f"{given}; leave it out, or correct the file: gdal_edit.py -a_srs {given} {path.name}"
        )
    if not dataset.crs and given is None:
        raise ElevationError(
            f"{path}: expected a coordinate reference system (CRS), got none; give it: "
            f"--crs EPSG:..., or gdal_edit.py -a_srs EPSG:... {path.name}"
        )
    try:
        crs = dataset.crs or crs_of(str(given))
    except ValueError as error:
        raise ElevationError(f"--crs: expected one such as EPSG:32632, got {given!r}") from error
    if not (crs.is_geographic or crs.is_projected):
        raise ElevationError(
            f"{path}: expected a geographic or projected CRS, got {_name(crs)}; state the right "
            f"one: gdal_edit.py -a_srs EPSG:... {path.name}"
        )
    return crs


def _heights(path: Path, dataset: Any, crs: Any) -> tuple[float, float, tuple[str, ...]]:  # noqa: ANN401
    """Return metres of a unit of a file's numbers, height of its zero [m], and remarks.

    Raises:
        ElevationError: If the unit of the heights is not known.
    """
    remarks = []
    try:
        metres, name = metres_of(dataset.units[0], crs)
    except ValueError as error:
        raise ElevationError(
            f"{path}: {error}; state the right one: gdal_edit.py -units m {path.name}"
        ) from error
    if metres is None:
        metres = 1.0
        remarks.append(
            "no unit of height in the file: metres are assumed; if they are feet, state it: "
            f"gdal_edit.py -units ft {path.name}"
        )
    elif metres != 1.0:
        remarks.append(f"heights in {name} (x {metres:.10g} m) are converted to metres")
    step = dataset.scales[0] * metres
    if np.dtype(dataset.dtypes[0]).kind in "iu":
        remarks.append(
            f"heights are whole numbers ({dataset.dtypes[0]}): slopes come in terraces of "
            f"{step:g} m, which are not smoothed; a model of floating-point heights has none"
        )
    return step, dataset.offsets[0] * metres, tuple(remarks)


def crs_name(raster: Raster) -> str:
    """Return the short name of a raster's coordinate reference system."""
    return _name(raster.crs)


def _name(crs: Any) -> str:  # noqa: ANN401 - rasterio's.
    """Return the authority's name of a system, or the first name of its text."""
    authority = crs.to_authority()
    return ":".join(authority) if authority else crs.to_wkt().split('"')[1]
