"""Square of ground from an elevation model, in metres to the east and north of its middle.

Heights between the model's cells are those of a cubic spline through their middles, so that creases
of a coarse model are no steps. Every cell of the square has to have a height.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates, maximum_filter, uniform_filter

from terrain.heightfield import Heightfield
from worlds.elevation.errors import ElevationError
from worlds.elevation.local_frame import MAX_LATITUDE, LocalFrame
from worlds.elevation.raster import HIGHEST, LOWEST, Raster, crs_name, open_raster
from worlds.world import MapDatum

LEAST_EDGE, LARGEST_EDGE = 40.0, 300.0
"""Limits of the edge of a square [m]."""

_MARGIN = 6
"""Number of cells around the square that the spline takes into account: what lies farther off
changes it by less than a thousandth."""

_COARSE = 10.0
"""Edge of a model's cell from which on its ground is smoother than any world [m] (assumption)."""

_EDGE = 0.5 + 1e-6
"""Distance from the middle of a cell to its edge, with some rounding [cells]."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class GroundSquare:
    """Square of real ground.

    Attributes:
        ground: Heights above the middle's, x to the east and y to the north.
        datum: Place of the middle on Earth.
        crs: Name of the model's coordinate reference system.
        resolution: Edges of the model's cells, the shorter first [m].
        remarks: Sentences about the model that change what the ground means.
    """

    ground: Heightfield
    datum: MapDatum
    crs: str
    resolution: tuple[float, float]
    remarks: tuple[str, ...]

    @property
    def frame(self) -> LocalFrame:
        """Frame of the world on Earth."""
        return LocalFrame(self.datum.latitude_deg, self.datum.longitude_deg)


def read_square(
    path: Path,
    at: tuple[float, float] | None = None,
    size: float = 120.0,
    cell: float = 0.25,
    crs: str | None = None,
) -> GroundSquare:
    """Return a square of ground from an elevation model.

    Args:
        path: GeoTIFF of one band of heights.
        at: Latitude and longitude of its middle [deg], WGS 84; None for the model's middle.
        size: Edge of the square [m], 40 to 300.
        cell: Distance between the ground's grid lines [m].
        crs: Coordinate reference system of a file that has none, such as ``EPSG:32632``.

    Raises:
        ElevationError: If the file is no elevation model, or the square is not whole in it.
        MissingRasterioError: If rasterio is not installed.
        OSError: If the file cannot be read.
        ValueError: If size or cell are out of bounds.
    """
    if not LEAST_EDGE <= size <= LARGEST_EDGE:
        raise ValueError(f"size: expected {LEAST_EDGE:g} to {LARGEST_EDGE:g} m, got {size:g}")
    if not 0 < cell <= 0.5:
        raise ValueError(f"cell: expected up to 0.5 m, got {cell:g}")
    with open_raster(path, crs) as raster:
        frame = raster.middle() if at is None else LocalFrame(*at)
        if abs(frame.latitude_deg) > MAX_LATITUDE:
            raise ElevationError(f"{path}: expected a latitude within 89 degrees, got {frame.text}")
        return _square(raster, frame, round(size / cell) + 1, cell)


def _square(raster: Raster, frame: LocalFrame, n: int, cell: float) -> GroundSquare:
    """Return the square of ``n`` grid lines about the origin of a frame."""
    lines = (np.arange(n) - (n - 1) / 2) * cell
    x, y = np.meshgrid(lines, lines, indexing="ij")
    places = np.stack(raster.cells_at(frame, x, y))
    middle = np.stack(raster.cells_at(frame, np.zeros(1), np.zeros(1)))
    _check_inside(raster, frame, places, middle, (n - 1) * cell)
    resolution = _resolution(places, cell)
    # The mean over a cell of the grid: what is finer than the grid must not alias into it.
    share = max(round(cell / resolution[0]), 1)
    values, low = _window(raster, places, _MARGIN + share)
    values = _whole(raster, frame, values, places - low[:, None, None], share, (x, y))
    spline = [places - low[:, None, None], middle - low[:, None]]
    heights, altitude = (map_coordinates(values, each, order=3, mode="mirror") for each in spline)
    datum = MapDatum(
        latitude_deg=frame.latitude_deg,
        longitude_deg=frame.longitude_deg,
        altitude=float(altitude[0]),
    )
    ground = Heightfield((heights - altitude[0]).astype(np.float32), cell)
    remarks = (*raster.remarks, *_remarks(resolution, cell, share))
    return GroundSquare(ground, datum, crs_name(raster), resolution, remarks)


def _check_inside(
    raster: Raster, frame: LocalFrame, places: Floats, middle: Floats, size: float
) -> None:
    """Refuse a square that is not in the raster.

    Args:
        raster: Elevation model.
        frame: Frame about the square's middle.
        places: Rows and columns of the grid's nodes, shape (2, n, n).
        middle: Row and column of the middle, shape (2, 1).
        size: Edge of the square [m].

    Raises:
        ElevationError: If part of it, or all, is outside.
    """
    last = np.array(raster.shape, dtype=np.float64)[:, None, None] - 1
    is_inside = np.isfinite(places) & (places >= -_EDGE) & (places <= last + _EDGE)
    outside = 1.0 - is_inside.all(axis=0).mean()
    if not outside:
        return
    wrong = (
        f"{raster.path}: expected the square of {size:g} m about {frame.text} in the file, got "
        f"{max(outside, 0.001):.1%} of it outside"
    )
    fitting = 0.0
    if np.isfinite(places).all():
        room = np.concatenate([middle + _EDGE, last[:, 0] + _EDGE - middle]).reshape(2, 2)
        reach = np.abs(places - middle[:, None]).max(axis=(1, 2))
        fitting = float(np.floor(size * (room / reach).min() - 0.5))
    smaller = f"take an edge of {fitting:g} m or less, or " if fitting >= LEAST_EDGE else ""
    raise ElevationError(
        f"{wrong}: the file covers {_extent(raster, frame)}; {smaller}choose a place inside"
    )


def _extent(raster: Raster, frame: LocalFrame) -> str:
    """Return the latitudes and longitudes of a raster, and a hint if they were given swapped."""
    corners = raster.corners()
    south, north, west, east = (
        end(getattr(each, name) for each in corners)
        for name in ("latitude_deg", "longitude_deg")
        for end in (min, max)
    )
    text = f"latitude {south:.5f} to {north:.5f}, longitude {west:.5f} to {east:.5f}"
    if south <= frame.longitude_deg <= north and west <= frame.latitude_deg <= east:
        text += "; latitude comes first"
    return text


def _resolution(places: Floats, cell: float) -> tuple[float, float]:
    """Return the edges of the raster's cells, the shorter first [m]."""
    along = np.abs(places[:, -1, :] - places[:, 0, :]).mean(axis=1)
    across = np.abs(places[:, :, -1] - places[:, :, 0]).mean(axis=1)
    edge = (places.shape[1] - 1) * cell
    short, long = sorted((edge / np.hypot(along, across)).tolist())
    return short, long


def _window(raster: Raster, places: Floats, margin: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return the heights around places [m], NaN where there is none, and the first row and column.

    Beyond the raster's border its slope goes on.
    """
    low = np.floor(places.min(axis=(1, 2))).astype(np.int64) - margin
    high = np.ceil(places.max(axis=(1, 2))).astype(np.int64) + margin + 1
    first, last = np.maximum(low, 0), np.minimum(high, raster.shape)
    values = raster.read((int(first[0]), int(first[1])), (int(last[0]), int(last[1])))
    beyond = [(int(a), int(b)) for a, b in zip(first - low, high - last, strict=True)]
    return np.pad(values, beyond, mode="reflect", reflect_type="odd"), low


def _whole(
    raster: Raster,
    frame: LocalFrame,
    values: Floats,
    places: Floats,
    share: int,
    grid: tuple[Floats, Floats],
) -> Floats:
    """Return heights without voids [m], averaged over ``share`` cells.

    Args:
        raster: Elevation model, for the error.
        frame: Frame about the square's middle.
        values: Heights around the square [m], NaN where there is none.
        places: Rows and columns of the grid's nodes in it, shape (2, n, n).
        share: Number of cells along an edge of the grid's cell, at least 1.
        grid: Map x and y of the nodes [m], shape (n, n) each.

    Raises:
        ElevationError: If a cell that belongs to the square has no height.
    """
    is_void = np.isnan(values)
    if is_void.any():
        _check_whole(raster, frame, is_void, places, share, grid)
        # Those left are beyond the square: the spline goes on as at the nearest that is known.
        nearest = distance_transform_edt(is_void, return_distances=False, return_indices=True)
        values = values[tuple(nearest)]
    return values if share == 1 else uniform_filter(values, share, mode="nearest")


def _check_whole(
    raster: Raster,
    frame: LocalFrame,
    is_void: NDArray[np.bool_],
    places: Floats,
    share: int,
    grid: tuple[Floats, Floats],
) -> None:
    """Refuse a square with voids; arguments as those of ``_whole``.

    Raises:
        ElevationError: If one of the four cells around a node has no height.
    """
    row, column = np.floor(places).astype(np.int64)
    near = maximum_filter(is_void, share) if share > 1 else is_void
    is_used = np.zeros_like(is_void)
    is_bad = np.zeros(row.shape, dtype=np.bool_)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        is_used[row + i, column + j] = True
        is_bad |= near[row + i, column + j]
    if not is_bad.any():
        return
    is_used = maximum_filter(is_used, share) if share > 1 else is_used
    x, y = grid[0][is_bad], grid[1][is_bad]
    reach = np.maximum(abs(x), abs(y))
    first = int(np.argmin(reach))
    clear = float(np.floor(2 * reach[first] - 0.5))
    smaller = f"--size {clear:g}, " if clear >= LEAST_EDGE else ""
    raise ElevationError(
        f"{raster.path}: expected a height of {LOWEST:g} to {HIGHEST:g} m in every cell of the "
        f"square about {frame.text}, got none in {int((is_void & is_used).sum())} of them, the "
        f"nearest at x {x[first]:.1f}, y {y[first]:.1f} m; take {smaller}another place, or fill "
        f"them: gdal_fillnodata.py {raster.path.name} filled.tif"
    )


def _remarks(resolution: tuple[float, float], cell: float, share: int) -> list[str]:
    """Return what the size of a model's cells means for the ground."""
    if share > 1:
        return [
            f"cells of {resolution[0]:.2g} m are finer than the grid of {cell:g} m, over which "
            f"they are averaged; --cell {max(resolution[0], 0.02):.2g} keeps them"
        ]
    if resolution[1] > _COARSE:
        return [
            f"cells of {resolution[1]:.0f} m: ditches, banks and steps are not in the model, and "
            f"the ground is smooth between its points"
        ]
    return []
