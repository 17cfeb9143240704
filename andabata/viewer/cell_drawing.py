"""Drawing of what perception says of the ground: polar cells, virtual ranges, the local map."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import BLOCKED_COLOUR, FREE_COLOUR, rgb
from andabata.report.drive_frames import DriveFrame, MapFrame
from andabata.viewer.world_drawing import GroundHeight
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

if TYPE_CHECKING:
    import viser

_FREE, _BLOCKED = rgb(FREE_COLOUR), rgb(BLOCKED_COLOUR)
_RANGE, _OPEN = (21, 64, 196), _FREE

_SUBDIVISION = 2
"""Number of patches of a cell along either edge: cells are metres wide and lie on hills."""

_ARC = 4
"""Number of segments of a sector's range."""

_CELL_LIFT, _MAP_LIFT, _RANGE_LIFT = 0.06, 0.0, 0.2
"""Heights over the ground [m]: ground and cells would flicker through each other."""

_MAP_REACH = 12.0
"""Distance from the robot up to which the map is shown [m]."""


class CellDrawing:
    """Free and blocked polar cells on the ground, and the ranges of the virtual scan."""

    def __init__(
        self, scene: "viser.SceneApi", root: str, grid: PolarGrid, ground: GroundHeight | None
    ) -> None:
        """Begin without cells.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            grid: Polar grid of the scans.
            ground: Height of the ground; None takes the plane under the robot.
        """
        self._grid, self._ground = grid, ground
        self._patches, triangles = cell_patches(grid)
        nowhere = np.zeros((len(self._patches) * (_SUBDIVISION + 1) ** 2, 3), dtype=np.float32)
        self._cells = [
            scene.add_mesh_simple(
                f"{root}/cells_{name}",
                nowhere,
                triangles,
                color=colour,
                material="toon3",
                cast_shadow=False,
                receive_shadow=False,
            )
            for name, colour in (("free", _FREE), ("blocked", _BLOCKED))
        ]
        count = _ARC * grid.n_sectors
        none = np.zeros((count, 2, 3), dtype=np.float32)
        self._ranges = scene.add_line_segments(
            f"{root}/ranges", none, np.zeros((count, 2, 3), dtype=np.uint8), thickness=0.05
        )
        self._shows_cells = True
        self._drawn: VirtualScan | None = None

    def show_cells(self, visible: bool) -> None:
        """Show or hide the cells."""
        self._shows_cells, self._drawn = visible, None
        for handle in self._cells:
            handle.visible = visible

    def show_ranges(self, visible: bool) -> None:
        """Show or hide the ranges."""
        self._ranges.visible = visible

    def draw(self, frame: DriveFrame) -> None:
        """Draw the scan of a frame around its robot."""
        if frame.scan is None or frame.scan is self._drawn:
            return
        self._drawn = frame.scan
        if self._shows_cells:
            self._draw_cells(frame)
        lines, colours = range_lines(frame.scan.ranges, self._grid)
        self._ranges.points = self._placed(lines, frame, _RANGE_LIFT)
        self._ranges.colors = colours

    def _draw_cells(self, frame: DriveFrame) -> None:
        """Draw the cells that are known."""
        assert frame.scan is not None
        log_odds = frame.scan.log_odds_of(self._grid).ravel()
        placed = self._placed(self._patches, frame, _CELL_LIFT)
        with np.errstate(invalid="ignore"):
            kinds = log_odds < 0, log_odds >= 0
        for handle, chosen in zip(self._cells, kinds, strict=True):
            # Others shrink to a point: the triangles stay the same, and are sent once.
            shown = np.where(chosen[:, None, None], placed, placed[:1, :1])
            handle.vertices = shown.reshape(-1, 3)

    def _placed(
        self, places: NDArray[np.float64], frame: DriveFrame, lift: float
    ) -> NDArray[np.float32]:
        """Return places of the robot's plane as they lie on the ground, shape (..., 3).

        Args:
            places: Places ahead and to the left [m], shape (..., 2).
            frame: Frame with the robot's pose.
            lift: Height over the ground [m].
        """
        pose = frame.scan_pose or frame.pose
        c, s = np.cos(pose.yaw), np.sin(pose.yaw)
        x = pose.position[0] + c * places[..., 0] - s * places[..., 1]
        y = pose.position[1] + s * places[..., 0] + c * places[..., 1]
        z = plane_height(frame, x, y) if self._ground is None else self._ground(x, y)
        return np.stack([x, y, z + lift], axis=-1).astype(np.float32)


class MapDrawing:
    """One layer of the local map on the ground, a square a cell."""

    def __init__(self, scene: "viser.SceneApi", root: str, ground: GroundHeight | None) -> None:
        """Begin without cells.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            ground: Height of the ground; None takes the plane under the robot.
        """
        self._scene, self._name, self._ground = scene, f"{root}/map", ground
        self._is_empty = True

    def draw(self, frame: DriveFrame) -> None:
        """Draw the layer of a frame."""
        layer = None if frame.plan is None else frame.plan.map
        if layer is None:
            if not self._is_empty:
                self._scene.remove_by_name(self._name)
                self._is_empty = True
            return
        places, colours = map_squares(layer, frame.odometry.position[:2])
        c, s = np.cos(frame.turn), np.sin(frame.turn)
        ahead, left = (places - frame.odometry.position[:2]).T
        x = frame.pose.position[0] + c * ahead - s * left
        y = frame.pose.position[1] + s * ahead + c * left
        height = self._ground(x, y) if self._ground is not None else plane_height(frame, x, y)
        points = np.stack([x, y, height + _MAP_LIFT], axis=1) - frame.pose.position
        self._scene.add_point_cloud(
            self._name,
            points,
            colours,
            point_size=0.8 * layer.cell,
            point_shading="flat",
            position=frame.pose.position,
        )
        self._is_empty = False


def plane_height(
    frame: DriveFrame, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the height of the plane that the robot stands on, at places in the map [m]."""
    normal = frame.pose.matrix[:3, 2]
    px, py, pz = frame.pose.position
    return np.asarray(pz - (normal[0] * (x - px) + normal[1] * (y - py)) / max(normal[2], 0.2))


def cell_patches(grid: PolarGrid) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return the polar cells as patches of small triangles.

    Args:
        grid: Polar grid.

    Returns:
        Places ahead and to the left of the robot [m], shape (cells, (k + 1)^2, 2), sector by sector
        and ring by ring; and indices of triangles into all of them, shape (m, 3).
    """
    k = _SUBDIVISION
    half, edges = np.pi / grid.n_sectors, grid.ring_edges
    share = np.linspace(0.08, 0.92, k + 1)
    angles = grid.bearings[:, None] + half * (2 * share - 1)
    radii = edges[:-1, None] + share * np.diff(edges)[:, None]
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    # Axes: sector, ring, along the radius, along the angle, coordinate.
    places = radii[None, :, :, None, None] * directions[:, None, None, :, :]
    patches = places.reshape(grid.n_sectors * grid.n_rings, (k + 1) ** 2, 2)
    corner = (np.arange(k)[:, None] * (k + 1) + np.arange(k)).ravel()
    square = np.concatenate(
        [
            np.stack([corner, corner + k + 1, corner + 1], axis=1),
            np.stack([corner + 1, corner + k + 1, corner + k + 2], axis=1),
        ]
    )
    first = np.arange(len(patches)) * (k + 1) ** 2
    return patches, (first[:, None, None] + square).reshape(-1, 3).astype(np.uint32)


def range_lines(
    ranges: NDArray[np.float32], grid: PolarGrid
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Return the ranges of a virtual scan as arcs: blue at an obstacle, green in the open.

    Args:
        ranges: Ranges [m], shape (n_sectors,); infinite is free, NaN unknown: such have no arc.
        grid: Polar grid of the scan.

    Returns:
        Places ahead and to the left [m], shape (n, 2, 2), and colours, uint8, shape (n, 2, 3).
    """
    half = np.pi / grid.n_sectors
    reach = np.where(np.isinf(ranges), grid.outer_radius, np.nan_to_num(ranges)).astype(np.float64)
    angles = grid.bearings[:, None] + np.linspace(-half, half, _ARC + 1)
    rim = reach[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    lines = np.stack([rim[:, :-1], rim[:, 1:]], axis=2).reshape(-1, 2, 2)
    colours = np.where(np.isinf(ranges)[:, None], np.array(_OPEN), np.array(_RANGE))
    return lines, np.repeat(colours, 2 * _ARC, axis=0).reshape(-1, 2, 3).astype(np.uint8)


def map_squares(
    layer: MapFrame, here: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Return the middles of a layer's known cells around the robot, and their colours.

    Log odds go from green over white to orange, heights and costs from white to orange.

    Args:
        layer: Layer of the map.
        here: Position of the robot in ``odom`` [m], shape (2,).

    Returns:
        Places in ``odom`` [m], shape (k, 2), and colours, uint8, shape (k, 3).
    """
    signed = layer.name in ("occupancy", "ground")
    floor = 1.0 if layer.name == "cost" else 0.0
    values = (layer.values - floor) / max(layer.largest - floor, 1e-9)
    first = np.maximum(np.floor((here - layer.corner - _MAP_REACH) / layer.cell), 0).astype(int)
    size = int(2 * _MAP_REACH / layer.cell)
    window = values[first[0] : first[0] + size, first[1] : first[1] + size]
    i, j = np.nonzero(np.abs(window) > 0.05)
    chosen = window[i, j].astype(np.float64)
    places = layer.corner + (first + np.stack([i, j], axis=1) + 0.5) * layer.cell
    near = np.hypot(*(places - here).T) < _MAP_REACH
    share = chosen[near].clip(-1.0 if signed else 0.0, 1.0)[:, None]
    light = np.array([245.0, 240.0, 225.0])
    end = np.where(share < 0, np.array(_FREE), np.array(_BLOCKED))
    colours = light + np.abs(share) * (end - light)
    return places[near], colours.astype(np.uint8)
