"""Way of a drive, period by period, and the troubles on it: stops, slip and tilt."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from worlds.truth import TruthConfig

_LIMITS = TruthConfig()


class DriveLabelsConfig(BaseModel):
    """Settings of labels from a drive.

    Attributes:
        interval: Time between two labelled clouds [s].
        horizon: Longest time between a cloud and the crossing of its ground [s], over which dead
            reckoning holds.
        path_step: Way between two footprints that are laid on a cloud [m].
        crossed_share: Least share of a cell's points under the footprints of a free cell.
        doubt_share: Share of a cell's points from which on the rest beside the footprints may hold
            an obstacle.
        max_step: Height over and depth under the crossed ground from which on a point beside the
            footprints may be an obstacle [m].
        ground_clearance: Height of the crossed cover, grass or litter, above which nothing vouches
            for the ground beside the footprints [m].
        contact_reach: Length of the ground ahead of the robot that stopped it [m].
        stop_time: Shortest time of a stop, commanded to drive and with still wheels [s].
        slip_time: Time over which the wheels' way is compared with the estimated one [s].
        slip_share: Share of the wheels' way below which the robot has slipped.
        slip_shortfall: Difference of the two ways that is no error of the estimate, whose fixes are
            wrong by decimetres [m].
        least_speed: Speed from which on a command is one to drive [m/s].
        max_tilt: Tilt of the body from which on the ground is blocked [rad].
        doubt_time: Time before and after trouble in which nothing is taken for free [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    interval: float = Field(default=1.0, gt=0)
    horizon: float = Field(default=30.0, gt=0)
    path_step: float = Field(default=0.05, gt=0, le=0.5)
    crossed_share: float = Field(default=0.3, gt=0, le=1)
    doubt_share: float = Field(default=0.03, ge=0, le=1)
    max_step: float = Field(default=_LIMITS.max_step, gt=0)
    ground_clearance: float = Field(default=_LIMITS.ground_clearance, gt=0)
    contact_reach: float = Field(default=0.3, gt=0, le=2)
    stop_time: float = Field(default=1.0, gt=0)
    slip_time: float = Field(default=10.0, gt=0)
    slip_share: float = Field(default=0.5, gt=0, lt=1)
    slip_shortfall: float = Field(default=1.0, ge=0)
    least_speed: float = Field(default=0.1, gt=0)
    max_tilt: float = Field(default=_LIMITS.max_slope, gt=0, lt=1.5)
    doubt_time: float = Field(default=1.0, ge=0)


class Trouble(IntEnum):
    """Trouble of a robot in a control period."""

    NONE = 0
    STOPPED = 1
    SLIPPED = 2
    TILTED = 3


@dataclass(frozen=True)
class DrivePath:
    """Way of a drive, period by period.

    Attributes:
        stamps: End of each period [s], increasing, shape (m,).
        odometry: Poses in ``odom``, x, y, z [m], quaternion x, y, z, w, shape (m, 7).
        positions: Estimated positions in the map [m], shape (m, 2).
        commanded: Commanded forward speed [m/s], NaN where none is recorded, shape (m,).
        wheels: Forward speed of the wheels [m/s], NaN where it is unknown, shape (m,).
        trusted: True where the estimate of the pose is healthy, bool, shape (m,).
    """

    stamps: NDArray[np.float64]
    odometry: NDArray[np.float64]
    positions: NDArray[np.float64]
    commanded: NDArray[np.float64]
    wheels: NDArray[np.float64]
    trusted: NDArray[np.bool_]

    @classmethod
    def of(cls, periods: Sequence["DrivePeriod"]) -> "DrivePath":
        """Return the way of some periods, at least one."""
        return cls(
            np.array([period.stamp for period in periods]),
            np.array([_row(period.odometry) for period in periods]),
            np.array([period.position for period in periods]),
            np.array([period.commanded for period in periods]),
            np.array([period.wheels for period in periods]),
            np.array([period.trusted for period in periods]),
        )

    @property
    def direction(self) -> NDArray[np.float64]:
        """Direction of each period, 1 forward and -1 backward, shape (m,)."""
        speed = np.where(np.isnan(self.commanded), self.wheels, self.commanded)
        return np.where(speed < 0, -1.0, 1.0)


class DrivePeriod(NamedTuple):
    """What is known of a control period of a drive; see ``DrivePath``.

    Attributes:
        stamp: End of the period [s].
        odometry: Pose in ``odom``.
        position: Estimated position in the map [m], shape (2,).
        commanded: Commanded forward speed [m/s], NaN for none.
        wheels: Forward speed of the wheels [m/s], NaN if unknown.
        trusted: True if the estimate of the pose is healthy.
    """

    stamp: float
    odometry: Pose
    position: NDArray[np.float64]
    commanded: float
    wheels: float
    trusted: bool


def find_troubles(path: DrivePath, config: DriveLabelsConfig) -> NDArray[np.uint8]:
    """Return the ``Trouble`` of each period, uint8, shape (m,).

    The robot is stopped when it is commanded to drive and its wheels stand still, has slipped when
    the wheels' way is longer than the estimated one, and is tilted beyond the limit.

    Args:
        path: Way of the drive.
        config: Limits.
    """
    troubles = np.zeros(len(path.stamps), dtype=np.uint8)
    with np.errstate(invalid="ignore"):
        driven = np.abs(path.commanded) >= config.least_speed
        still = np.abs(path.wheels) < config.slip_share * np.abs(path.commanded)
    troubles[_lasting(driven & still, path.stamps, config.stop_time)] = Trouble.STOPPED
    troubles[_slipped(path, config)] = Trouble.SLIPPED
    upright = Rotation.from_quat(path.odometry[:, 3:]).apply([0.0, 0.0, 1.0])[:, 2]
    troubles[upright < np.cos(config.max_tilt)] = Trouble.TILTED
    return troubles


def runs_of(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the runs of marked periods, each as its first and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _lasting(
    marked: NDArray[np.bool_], stamps: NDArray[np.float64], duration: float
) -> NDArray[np.bool_]:
    """Return the periods that belong to a run of marked ones of at least a duration [s]."""
    is_lasting = np.zeros(len(marked), dtype=np.bool_)
    for begin, end in runs_of(marked):
        is_lasting[begin:end] = stamps[end - 1] - stamps[begin] >= duration
    return is_lasting


def _slipped(path: DrivePath, config: DriveLabelsConfig) -> NDArray[np.bool_]:
    """Return the periods in which the wheels turned and the robot did not move on, shape (m,)."""
    steps = np.diff(path.stamps, prepend=path.stamps[0])
    way = np.cumsum(np.nan_to_num(path.wheels) * steps)
    first = np.searchsorted(path.stamps, path.stamps - config.slip_time)
    turned = np.abs(way - way[first])
    moved = np.linalg.norm(path.positions - path.positions[first], axis=1)
    slipped = (moved < config.slip_share * turned) & (turned - moved > config.slip_shortfall)
    windows = np.zeros(len(slipped) + 1, dtype=np.int64)
    np.add.at(windows, first[slipped], 1)
    np.add.at(windows, np.flatnonzero(slipped) + 1, -1)
    is_marked = np.zeros(len(slipped), dtype=np.bool_)
    for begin, end in runs_of(np.cumsum(windows[:-1]) > 0):
        # A window begins while the robot still drives: it is stuck where it came furthest.
        away = np.linalg.norm(path.positions[begin:end] - path.positions[begin], axis=1)
        is_marked[begin + int(np.argmax(away >= 0.9 * away.max())) : end] = True
    return is_marked


def _row(pose: Pose) -> NDArray[np.float64]:
    """Return a pose as x, y, z [m] and quaternion x, y, z, w, shape (7,)."""
    return np.concatenate([pose.position, pose.quaternion])
