"""Labelled cells of a drive, cloud by cloud, as soon as the robot has driven on."""

from bisect import bisect_left, bisect_right
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.datasets.drive_labels import label_driven_cells
from andabata.datasets.drive_path import (
    DriveLabelsConfig,
    DrivePath,
    DrivePeriod,
    Trouble,
    find_troubles,
)
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from traversability.dataset import CellSamples
from traversability.features import cell_features
from traversability.grid import PolarGrid
from traversability.labels import CellState

_ROUNDING = 1e-6
"""Rounding error of the difference of two times [s]."""


class DriveSamples(NamedTuple):
    """Cells that a drive has labelled.

    Attributes:
        cells: Labelled cells; ``world`` is the number of the cloud.
        stamps: Time of each cloud with a labelled cell [s], shape (c,), by ``cells.cloud``.
        troubles: Number of separate troubles by name.
        clouds: Number of clouds that were compared with the way.
    """

    cells: CellSamples
    stamps: NDArray[np.float64]
    troubles: dict[str, int]
    clouds: int


class _Waiting(NamedTuple):
    """Cloud that waits until the robot has driven on: time [s], points [m] and pose in ``odom``."""

    stamp: float
    points: NDArray[np.float32]
    pose: Pose


class DriveLabeller:
    """Labels the cells of a drive's clouds as soon as the drive has gone on for the horizon.

    A drive may have several pieces, each with times and poses of its own.
    """

    def __init__(self, robot: RobotModel, grid: PolarGrid, config: DriveLabelsConfig) -> None:
        """Begin without a drive.

        Args:
            robot: Body of the robot.
            grid: Polar grid of cells.
            config: Settings.
        """
        self._robot, self._grid, self._config = robot, grid, config
        self._periods: list[DrivePeriod] = []
        self._ends: list[float] = []
        self._waiting: deque[_Waiting] = deque()
        self._last, self._elapsed = -np.inf, 0.0
        self._troubles = {kind.name.lower(): 0 for kind in Trouble if kind is not Trouble.NONE}
        self._stamps: list[float] = []
        self._parts: list[tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.int64]]] = []
        self._clouds = self._unknown = 0

    def wants_cloud(self, stamp: float) -> bool:
        """Return True if a cloud is due at ``stamp`` [s]."""
        return stamp - self._last >= self._config.interval - _ROUNDING

    def add(self, period: DrivePeriod, points: NDArray[np.float32] | None = None) -> None:
        """Add a control period.

        Args:
            period: Stamp, pose, commands and speeds of the period.
            points: Cloud in the levelled ``base_footprint`` of its pose [m], float32, shape (n, 3),
                copied; None without one.
        """
        self._periods.append(period)
        self._ends.append(period.stamp)
        if points is not None and period.trusted:
            near = np.hypot(points[:, 0], points[:, 1]) < self._grid.outer_radius
            self._waiting.append(_Waiting(period.stamp, points[near], period.odometry))
            self._last = period.stamp
        while self._waiting and self._waiting[0].stamp + self._config.horizon < period.stamp:
            self._label(self._waiting.popleft())

    def end_piece(self) -> None:
        """Label what waits: the drive is over, or goes on with other times and poses."""
        while self._waiting:
            self._label(self._waiting.popleft())
        if self._periods:
            self._count_troubles()
            self._elapsed += self._ends[-1] + self._config.horizon
        self._periods, self._ends, self._last = [], [], -np.inf

    def samples(self) -> DriveSamples:
        """Return the labelled cells of all pieces that have ended.

        Raises:
            ValueError: If the drive has labelled no cell.
        """
        if not self._parts:
            raise ValueError(
                f"drive: expected cells that the robot has crossed, got none in {self._clouds} "
                "clouds; record a drive of a minute or more with its laser"
            )
        features, blocked, ring = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        cloud = np.repeat(np.arange(len(self._parts)), [len(part[1]) for part in self._parts])
        cells = CellSamples(
            features=features,
            blocked=blocked,
            clear=np.ones(len(blocked), dtype=np.bool_),
            n_empty=self._unknown,
            ring=ring.astype(np.int32),
            cloud=cloud.astype(np.int32),
            world=cloud.astype(np.int64),
        )
        return DriveSamples(cells, np.array(self._stamps), dict(self._troubles), self._clouds)

    def _label(self, cloud: _Waiting) -> None:
        """Label the cells of a cloud by the way around its time."""
        horizon, grid = self._config.horizon, self._grid
        first = bisect_left(self._ends, cloud.stamp - horizon)
        last = bisect_right(self._ends, cloud.stamp + horizon)
        path = DrivePath.of(self._periods[first:last])
        states = label_driven_cells(
            cloud.points, cloud.pose, cloud.stamp, path, self._robot, grid, self._config
        )
        self._clouds += 1
        known = states != CellState.EMPTY
        cells = cell_features(cloud.points, grid)
        self._unknown += int(((cells.counts >= grid.min_points) & ~known).sum())
        if known.any():
            # Times of later pieces go on after those of earlier ones.
            self._stamps.append(self._elapsed + cloud.stamp)
            blocked = states[known] == CellState.NON_TRAVERSABLE
            self._parts.append((cells.values[known], blocked, np.nonzero(known)[1]))

    def _count_troubles(self) -> None:
        """Count the separate troubles of a piece."""
        troubles = find_troubles(DrivePath.of(self._periods), self._config)
        begins = troubles[np.diff(troubles, prepend=np.uint8(0)) != 0]
        for kind in Trouble:
            if kind is not Trouble.NONE:
                self._troubles[kind.name.lower()] += int((begins == kind).sum())
