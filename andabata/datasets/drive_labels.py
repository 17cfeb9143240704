"""Labels of polar cells from a drive: ground that was driven over is free, what stopped it is not.

The robot's own way labels what its laser saw: self-supervision (Wellhausen et al. 2019, "Where
should I walk?"; Frey et al. 2023, "Fast traversability estimation for wild visual navigation").
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.datasets.drive_path import (
    DriveLabelsConfig,
    DrivePath,
    Trouble,
    find_troubles,
    runs_of,
)
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from terrain.kernel import kernel
from traversability.binning import cells_of_quarters, fill_quarters
from traversability.grid import PolarGrid
from traversability.labels import MIN_OBJECT_POINTS, MIN_SHARE, OBJECT_RANGE, CellState

_IGNORED, _CROSSING, _CONTACT, _TILTED = range(4)
"""Kinds of footprints that are laid on a cloud."""


class _Footprints(NamedTuple):
    """Footprints in the levelled base of a cloud.

    Attributes:
        rows: Position [m], heading (cosine, sine), up axis of the body, direction, kind: float64,
            shape (k, 10).
        half_length: Half of the robot's length [m].
        half_width: Half of its width [m].
        reach: Length of the ground that stopped it [m].
    """

    rows: NDArray[np.float64]
    half_length: float
    half_width: float
    reach: float


def label_driven_cells(
    points: NDArray[np.float32],
    pose: Pose,
    stamp: float,
    path: DrivePath,
    robot: RobotModel,
    grid: PolarGrid,
    config: DriveLabelsConfig,
) -> NDArray[np.uint8]:
    """Return what a drive says of the cells of one of its clouds.

    A cell is free if footprints cover enough of its points and the rest stands neither higher nor
    lower than what was crossed. It is blocked if the paper's share of its points lies where the
    robot was stopped, slipped or tilted. All others are unknown.

    Args:
        points: Points in the levelled ``base_footprint`` [m], float32, shape (n, 3).
        pose: Pose of that frame in ``odom``.
        stamp: Time of that pose [s].
        path: Way of the drive around the cloud's time.
        robot: Body of the robot.
        grid: Polar grid of cells.
        config: Settings.

    Returns:
        ``CellState`` of each cell, ``EMPTY`` where it is unknown, uint8, shape
        (n_sectors, n_rings).
    """
    states = np.zeros(grid.n_sectors * grid.n_rings, dtype=np.uint8)
    quarters = fill_quarters(points, grid).bins[: len(points)]
    inside = quarters >= 0
    cell = cells_of_quarters(grid)[quarters[inside]]
    footprints = _lay_footprints(path, pose, stamp, robot, config)
    crossed, blocked, height = _compare(points[inside], footprints)
    total = np.bincount(cell, minlength=len(states))
    seen = total >= grid.min_points
    count = np.bincount(cell[crossed], minlength=len(states))
    enough = seen & (count >= np.maximum(config.crossed_share * total, grid.min_points))
    doubtful = _doubtful(cell, crossed, height, enough, config)
    doubts = np.bincount(cell[doubtful], minlength=len(states))
    near = np.tile(grid.ring_edges[:-1] < OBJECT_RANGE, grid.n_sectors)
    vouched = (doubts <= config.doubt_share * total) & ~(near & (doubts >= MIN_OBJECT_POINTS))
    states[enough & vouched] = CellState.TRAVERSABLE
    hits = np.bincount(cell[blocked], minlength=len(states))
    states[seen & (hits > 0) & (hits >= MIN_SHARE * total)] = CellState.NON_TRAVERSABLE
    return states.reshape(grid.n_sectors, grid.n_rings)


def _lay_footprints(
    path: DrivePath,
    pose: Pose,
    stamp: float,
    robot: RobotModel,
    config: DriveLabelsConfig,
) -> _Footprints:
    """Return the footprints of a way in the levelled base of a pose in ``odom`` at a time [s]."""
    kinds = _kinds(path, stamp, config)
    chosen = np.flatnonzero((kinds != _IGNORED) & _apart(path, kinds, config.path_step))
    level = Rotation.from_euler("z", -pose.yaw)
    rotations = level * Rotation.from_quat(path.odometry[chosen, 3:])
    places = level.apply(path.odometry[chosen, :3] - pose.position)
    ahead, up = rotations.apply([1.0, 0.0, 0.0]), rotations.apply([0.0, 0.0, 1.0])
    heading = ahead[:, :2] / np.linalg.norm(ahead[:, :2], axis=1, keepdims=True)
    columns = (places, heading, up, path.direction[chosen], kinds[chosen])
    return _Footprints(
        np.column_stack(columns), robot.length / 2, robot.width / 2, config.contact_reach
    )


def _kinds(path: DrivePath, stamp: float, config: DriveLabelsConfig) -> NDArray[np.int64]:
    """Return the kind of footprint of each period for a cloud of a time [s], shape (m,)."""
    troubles = find_troubles(path, config)
    kinds = np.where(path.trusted, _CROSSING, _IGNORED)
    kinds[_near_trouble(path.stamps, troubles, config.doubt_time)] = _IGNORED
    kinds[(troubles == Trouble.STOPPED) & path.trusted] = _CONTACT
    kinds[(troubles == Trouble.TILTED) & path.trusted] = _TILTED
    for begin, end in runs_of(troubles == Trouble.SLIPPED):
        # While the wheels slip, dead reckoning goes on: places before and after do not compare.
        if stamp < path.stamps[begin]:
            kinds[begin:] = _IGNORED
            kinds[begin] = _CONTACT
            break
        kinds[:end] = _IGNORED
    return kinds


def _near_trouble(
    stamps: NDArray[np.float64], troubles: NDArray[np.uint8], time: float
) -> NDArray[np.bool_]:
    """Return which periods are within a time [s] of one with trouble, bool, shape (m,)."""
    bad = stamps[troubles != Trouble.NONE]
    if not len(bad):
        return np.zeros(len(stamps), dtype=np.bool_)
    after = np.searchsorted(bad, stamps)
    before = np.abs(stamps - bad[np.maximum(after - 1, 0)])
    behind = np.abs(stamps - bad[np.minimum(after, len(bad) - 1)])
    return np.asarray(np.minimum(before, behind) <= time)


def _apart(path: DrivePath, kinds: NDArray[np.int64], step: float) -> NDArray[np.bool_]:
    """Return periods a step of the way apart, and where the kind changes, bool, shape (m,).

    A turn by as much as the robot's corners move a step counts, too.
    """
    moved = np.linalg.norm(np.diff(path.odometry[:, :2], axis=0), axis=1)
    dots = np.abs((path.odometry[1:, 3:] * path.odometry[:-1, 3:]).sum(axis=1))
    turned = 2 * np.arccos(np.clip(dots, 0.0, 1.0))
    way = np.concatenate([[0.0], np.cumsum(moved + 0.5 * turned)])
    places = np.floor(way / step)
    return np.concatenate([[True], (np.diff(places) > 0) | (np.diff(kinds) != 0)])


def _doubtful(
    cell: NDArray[np.int64],
    crossed: NDArray[np.bool_],
    height: NDArray[np.float64],
    enough: NDArray[np.bool_],
    config: DriveLabelsConfig,
) -> NDArray[np.bool_]:
    """Return which points beside the footprints may be of an obstacle, bool, shape (n,).

    Heights are compared with those of the points under the footprints in the same cell, so that a
    drift of the estimated height between cloud and crossing does not matter.

    Args:
        cell: Cell of each point, shape (n,).
        crossed: True for points under footprints, shape (n,).
        height: Height of each point over the plane of the nearest footprint's wheels [m], shape
            (n,).
        enough: True for cells that are crossed, shape (n_cells,).
        config: Settings.
    """
    low, top = np.full(len(enough), np.inf), np.full(len(enough), -np.inf)
    order = np.lexsort((height[crossed], cell[crossed]))
    cells, heights = cell[crossed][order], height[crossed][order]
    first = np.searchsorted(cells, np.arange(len(enough)))
    count = np.searchsorted(cells, np.arange(len(enough)), side="right") - first
    chosen = np.flatnonzero(enough & (count > 0))
    low[chosen], ground, high = (
        heights[first[chosen] + np.floor(share * (count[chosen] - 1)).astype(np.int64)]
        for share in (0.05, 0.25, 0.95)
    )
    top[chosen] = np.minimum(high, ground + config.ground_clearance)
    beside = ~crossed & enough[cell]
    return beside & (
        (height > top[cell] + config.max_step) | (height < low[cell] - config.max_step)
    )


def _compare(
    points: NDArray[np.float32], footprints: _Footprints
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64]]:
    """Return which points were crossed, which stopped the robot, and their heights.

    Args:
        points: Points in the base of the footprints [m], shape (n, 3).
        footprints: Footprints.

    Returns:
        True for points under a footprint, shape (n,), True for points at trouble, shape (n,), and
        the height of each over the wheels' plane of the nearest crossing [m], infinite without
        one, shape (n,).
    """
    n = len(points)
    crossed, blocked = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    height = np.full(n, np.inf)
    _lay_on(np.ascontiguousarray(points), footprints, crossed, blocked, height)
    return crossed, blocked, height


@kernel
def _lay_on(
    points: NDArray[np.float32],
    footprints: _Footprints,
    crossed: NDArray[np.bool_],
    blocked: NDArray[np.bool_],
    height: NDArray[np.float64],
) -> None:
    """Lay footprints on points; see ``_compare``."""
    rows = footprints.rows
    length, width, reach = footprints.half_length, footprints.half_width, footprints.reach
    for i in range(len(points)):
        nearest = np.inf
        for k in range(len(rows)):
            dx, dy = points[i, 0] - rows[k, 0], points[i, 1] - rows[k, 1]
            along = rows[k, 3] * dx + rows[k, 4] * dy
            across = rows[k, 3] * dy - rows[k, 4] * dx
            beside, inside = abs(across) <= width, abs(along) <= length
            kind = int(rows[k, 9])
            if kind == _CROSSING:
                crossed[i] |= beside & inside
                square = dx * dx + dy * dy
                if square < nearest:
                    # The wheels' plane of the nearest crossing is the ground there.
                    nearest = square
                    dz = points[i, 2] - rows[k, 2]
                    height[i] = rows[k, 5] * dx + rows[k, 6] * dy + rows[k, 7] * dz
            elif kind == _CONTACT:
                # What stopped the robot lies ahead of it, or behind it where it backs up.
                ahead = rows[k, 8] * along - length
                blocked[i] |= beside & (ahead >= 0.0) & (ahead <= reach)
            elif kind == _TILTED:
                blocked[i] |= beside & inside
