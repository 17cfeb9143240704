"""Shapes of perception and map as rerun draws them: polar cells, scan, heights, grid map."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.records.topics import RosMessage
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

CELL_COLOURS = np.array([[70, 180, 80, 150], [215, 65, 55, 190]], dtype=np.uint8)
"""Colours of a traversable and a non-traversable cell: red, green, blue, opacity."""

_GROUND = 0.03
"""Height of the cells over the plane of ``base_footprint`` [m]."""

_MAP_OPACITY = 0.75
"""Opacity of the known cells of the map."""

_LOW, _HIGH = np.array([60, 80, 140], dtype=np.float64), np.array([250, 220, 90], dtype=np.float64)
"""Colours of the lowest and the highest points."""


class Mesh(NamedTuple):
    """Coloured triangles.

    Attributes:
        vertices: Corners [m], float32, shape (k, 3).
        triangles: Corners of each triangle, uint32, shape (m, 3).
        colours: Colour of each corner, uint8, shape (k, 4).
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    colours: NDArray[np.uint8]


def polar_mesh(scan: VirtualScan, grid: PolarGrid) -> Mesh:
    """Return the classified cells of a scan as two triangles each, in ``base_footprint``.

    Args:
        scan: Virtual scan with its cells.
        grid: Polar grid of the cells.
    """
    odds = scan.log_odds_of(grid)
    sectors, rings = np.nonzero(~np.isnan(odds))
    half = np.pi / grid.n_sectors
    bearings = grid.bearings[sectors]
    near, far = grid.ring_edges[rings], grid.ring_edges[rings + 1]
    corners = [(bearings + turn, reach) for turn in (-half, half) for reach in (near, far)]
    places = np.stack([[r * np.cos(b), r * np.sin(b), 0.0 * r + _GROUND] for b, r in corners])
    vertices = places.transpose(2, 0, 1).reshape(-1, 3).astype(np.float32)
    # Corners of a cell: right near, right far, left near, left far; both triangles face upwards.
    pattern = np.array([[0, 1, 3], [0, 3, 2]])
    first = 4 * np.arange(len(sectors))[:, None, None]
    triangles = (first + pattern).reshape(-1, 3).astype(np.uint32)
    is_blocked = (odds[sectors, rings] >= 0.0).astype(np.int64)
    return Mesh(vertices, triangles, np.repeat(CELL_COLOURS[is_blocked], 4, axis=0))


def scan_points(ranges: NDArray[np.float32], angles: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the ends of the ranges that something limits [m], shape (k, 3).

    Args:
        ranges: Ranges [m], shape (n,); ``inf`` is free, NaN unknown.
        angles: Angle of each [rad], shape (n,).
    """
    ends = np.isfinite(ranges)
    r, angle = ranges[ends], angles[ends]
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(len(r))]).astype("f4")


def height_colours(heights: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return a colour of each height, from the cloud's lowest to its highest, shape (k, 3)."""
    if not len(heights):
        return np.empty((0, 3), dtype=np.uint8)
    low, high = np.percentile(heights, (2, 98))
    share = np.clip((heights - low) / max(float(high - low), 1e-6), 0.0, 1.0)[:, None]
    return (_LOW + share * (_HIGH - _LOW)).astype(np.uint8)


def map_archetype(rerun: Any, grid: RosMessage) -> Any:  # noqa: ANN401 - an optional package.
    """Return an occupancy grid as rerun's ``GridMap``; as points where the SDK is too old for it.

    Args:
        rerun: The SDK.
        grid: The ``nav_msgs/OccupancyGrid``.
    """
    width, height, cell = int(grid.info.width), int(grid.info.height), float(grid.info.resolution)
    corner = grid.info.origin.position
    values = np.asarray(grid.data, dtype=np.int8).reshape(height, width)
    if not hasattr(rerun, "GridMap"):
        return _map_points(rerun, values, cell, np.array([corner.x, corner.y, corner.z]))
    # An image begins at its upper row: the largest y.
    pixels = map_pixels(values)[::-1]
    return rerun.GridMap(
        data=np.ascontiguousarray(pixels).tobytes(),
        format=rerun.components.ImageFormat(
            width=width, height=height, color_model="RGBA", channel_datatype="U8"
        ),
        cell_size=cell,
        translation=[corner.x, corner.y, corner.z],
        # Without an opacity of its own the viewer draws transparent pixels black.
        opacity=_MAP_OPACITY,
    )


def map_pixels(values: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Return the colours of cells, green to red by occupancy; unknown ones are transparent.

    Args:
        values: Occupancy [percent], -1 where unknown, int8, shape (rows, columns).

    Returns:
        Red, green, blue and opacity, uint8, shape (rows, columns, 4).
    """
    share = np.clip(values, 0, 100)[..., None] / 100.0
    free, blocked = CELL_COLOURS[0].astype(np.float64), CELL_COLOURS[1].astype(np.float64)
    pixels = (free + share * (blocked - free)).astype(np.uint8)
    pixels[values < 0] = 0
    return pixels


def _map_points(
    rerun: Any,  # noqa: ANN401 - an optional package.
    values: NDArray[np.int8],
    cell: float,
    corner: NDArray[np.float64],
) -> Any:  # noqa: ANN401
    """Return the known cells as points, green to red."""
    rows, columns = np.nonzero(values >= 0)
    places = np.column_stack([columns + 0.5, rows + 0.5, np.zeros(len(rows))]) * cell + corner
    return rerun.Points3D(places, colors=map_pixels(values)[rows, columns, :3], radii=cell / 2)
