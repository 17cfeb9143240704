"""Frames of a drive: all that a picture of one moment shows, live, in replay and in a clip.

A frame holds references to what perception has placed already, and copies of what changes under
the reader; whoever draws it does the arithmetic. So taking one costs a drive next to nothing.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Localizer
from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose, wrap
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.navigation.hand_driving import led_by
from andabata.navigation.navigator import Navigator, StepResult
from andabata.navigation.perception import Perception, assembler_of
from andabata.navigation.planning.local_planner import LocalPlanner
from traversability.cloud import PointCloud, joined
from traversability.virtual_scan import VirtualScan
from worlds.walking import Walkers, WalkerTrack

MAP_LAYERS = ("none", "occupancy", "ground", "low obstacles", "cost")
"""Names of the map's layers: log odds of the occupancy grid and of ground cells, heights of low
obstacles, and costs of a metre."""

_STANDSTILL = Twist(0.0, 0.0)

_HIGH_COST = 20.0
"""Cost of a metre from which on all are drawn alike."""

_HIGH_OBSTACLE = 0.3
"""Height of low obstacles from which on all are drawn alike [m]."""


def _level() -> Pose:
    """Return a level pose at the origin."""
    return Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MapFrame:
    """One layer of the local map at one moment, in ``odom``.

    Attributes:
        name: Name of the layer, one of ``MAP_LAYERS``.
        values: Value of each cell, the square's corner first, float32, shape (n, n).
        corner: Place of the first cell's corner [m], shape (2,).
        cell: Edge of a cell [m].
        largest: Largest value that counts.
    """

    name: str
    values: NDArray[np.float32]
    corner: NDArray[np.float64]
    cell: float
    largest: float


@dataclass(frozen=True)
class PlanFrame:
    """What the local planner knows at one moment, in ``odom``.

    Attributes:
        target: Sub-goal, or goal [m], shape (2,).
        way: Places of the planned way from the robot on [m], shape (k, 2).
        map: Layer of the map that is shown; None for none.
    """

    target: NDArray[np.float64]
    way: NDArray[np.float64]
    map: MapFrame | None = None


@dataclass(frozen=True)
class DriveFrame:
    """State of a drive at one moment.

    Attributes:
        pose: Pose at which the robot is drawn: the true one, or the estimated one where no other
            is known.
        scan: Last virtual scan; None before the first cloud.
        parts: Laser points of the last half turn of the head, in ``odom``, with stamps.
        n_positions: Number of positions of the path up to this moment.
        walkers: Walkers at this moment; None where there are none.
        stamp: Time since the robot was put down [s].
        odometry: Estimated pose in ``odom``.
        estimate: Estimated pose in the map.
        status: Health, causes and uncertainty of the estimate; None where no estimator is known.
        is_true: True if ``pose`` is the true one.
        goal: Goal in the map [m], shape (2,); None without one.
        heading_error: Bearing of the goal, or sub-goal, from the heading [rad]; None without one.
        twist: Twist that is driven.
        wheels: Wheel speeds.
        head: Azimuth of the laser's head from straight ahead [rad]; None where it does not turn.
        plan: Knowledge of the planner; None without a planner.
        scan_pose: Pose at which the robot was drawn then; None for the present one.
        has_arrived: True if the robot has declared the goal reached.
    """

    pose: Pose
    scan: VirtualScan | None = None
    parts: tuple[PointCloud, ...] = ()
    n_positions: int = 1
    walkers: WalkerTrack | None = None
    stamp: float = 0.0
    odometry: Pose = field(default_factory=_level)
    estimate: Pose = field(default_factory=_level)
    status: EstimatorStatus | None = None
    is_true: bool = True
    goal: NDArray[np.float64] | None = None
    heading_error: float | None = None
    twist: Twist = _STANDSTILL
    wheels: WheelSpeeds = field(default_factory=lambda: WheelSpeeds(0.0, 0.0))
    head: float | None = None
    plan: PlanFrame | None = None
    scan_pose: Pose | None = None
    has_arrived: bool = False

    def points(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the laser points in the map [m], shape (n, 3), and their ages [s], shape (n,)."""
        if not self.parts:
            return np.empty((0, 3), dtype=np.float32), np.empty(0, dtype=np.float32)
        points = np.concatenate([part.points for part in self.parts]).astype(np.float64)
        stamps = np.concatenate([part.stamps for part in self.parts if part.stamps is not None])
        c, s = np.cos(self.turn), np.sin(self.turn)
        x, y, z = (points - self.odometry.position).T
        moved = np.stack([c * x - s * y, s * x + c * y, z], axis=1) + self.pose.position
        return moved.astype(np.float32), (stamps.max() - stamps).astype(np.float32)

    @property
    def turn(self) -> float:
        """Angle by which what lies in ``odom`` is turned to lie around the drawn robot [rad]."""
        return self.pose.yaw - self.odometry.yaw

    def thinned(self, most: int) -> Self:
        """Return the frame with some of its points in one part, which keeps nothing else alive.

        Args:
            most: Largest number of points.
        """
        if not self.parts:
            return self
        whole = joined(self.parts)
        every = max(-(-len(whole) // most), 1)
        chosen = np.zeros(len(whole), dtype=np.bool_)
        chosen[::every] = True
        return replace(self, parts=(whole.select(chosen),))


class FrameSource:
    """Takes frames from a navigator, in simulation, on a recording or on a robot.

    Attributes:
        positions: Positions at which the robot was drawn so far [m], each of shape (3,).
        layer: Name of the map's layer in frames, one of ``MAP_LAYERS``.
    """

    def __init__(
        self,
        navigator: Navigator,
        localizer: Localizer,
        perception: Perception,
        walkers: Walkers | None = None,
    ) -> None:
        """Take what a frame is made of.

        Args:
            navigator: Navigator of the robot.
            localizer: Estimator of its pose.
            perception: Perception of the navigator.
            walkers: Walkers of its world; None without any.
        """
        self._navigator, self._localizer = navigator, localizer
        self._assembler, self._walkers = assembler_of(perception), walkers
        self._layers = perception.layers
        self.positions: list[NDArray[np.float64]] = []
        self.layer = "none"
        self._scan: tuple[VirtualScan, Pose] | None = None

    def advance(self, result: StepResult) -> None:
        """Take in a step: its position and its scan, if it has one; to be called for each step."""
        pose = self._pose(result)
        self.positions.append(pose.position)
        if result.scan is not None:
            self._scan = result.scan, pose

    def frame(self, result: StepResult, with_plan: bool = True) -> DriveFrame:
        """Return the frame of a step.

        Args:
            result: The step.
            with_plan: True to copy what the planner knows.
        """
        localizer, truth = self._localizer, result.readings.truth
        window = None if self._assembler is None else self._assembler.window
        return DriveFrame(
            pose=self._pose(result),
            scan=None if self._scan is None else self._scan[0],
            parts=() if window is None else tuple(part.cloud for part in window.parts),
            n_positions=len(self.positions),
            walkers=None if self._walkers is None else self._walkers.track.last(1).copy(),
            stamp=result.readings.stamp,
            odometry=localizer.odometry,
            estimate=localizer.pose,
            status=localizer.status,
            is_true=truth is not None,
            goal=result.goal.copy(),
            heading_error=self._heading_error(result),
            twist=result.twist,
            wheels=result.wheels,
            head=_head(result),
            plan=self._plan() if with_plan else None,
            scan_pose=None if self._scan is None else self._scan[1],
            has_arrived=result.has_arrived,
        )

    def _pose(self, result: StepResult) -> Pose:
        """Return the true pose of a step, the estimated one where no other is known."""
        truth = result.readings.truth
        return self._localizer.pose if truth is None else truth.pose

    def _heading_error(self, result: StepResult) -> float | None:
        """Return the heading error that was decided by last [rad]."""
        if result.situation is not None:
            return result.situation.heading_error
        pose = self._localizer.pose
        planner = self._navigator.planner
        if isinstance(planner, LocalPlanner):
            pose, goal = self._localizer.odometry, planner.target
        else:
            goal = result.goal
        ahead = goal - pose.position[:2]
        return wrap(float(np.arctan2(ahead[1], ahead[0])) - pose.yaw)

    def _plan(self) -> PlanFrame | None:
        """Return what the planner knows now."""
        planner = led_by(self._navigator.planner)
        if not isinstance(planner, LocalPlanner):
            return None
        return PlanFrame(
            target=planner.target.copy(),
            way=planner.plan.way(self._localizer.odometry.position[:2]),
            map=self._map(planner),
        )

    def _map(self, planner: LocalPlanner) -> MapFrame | None:
        """Return a copy of the layer that is shown; None for none."""
        name, layers, occupancy = self.layer, self._layers, planner.occupancy
        cell = occupancy.config.cell
        if name == "occupancy":
            largest = occupancy.config.max_log_odds
            values = occupancy.log_odds
            return _unwrapped(name, values, occupancy.centre, cell, largest)
        if name == "cost":
            plan = planner.plan
            return MapFrame(name, plan.costs.copy(), plan.corner.copy(), cell, _HIGH_COST)
        if name == "ground" and layers is not None and layers.ground is not None:
            ground = layers.ground
            return _unwrapped(
                name, ground.log_odds, ground.centre, ground.cell, ground.max_log_odds
            )
        if name == "low obstacles" and layers is not None:
            low = layers.low_obstacles
            return _unwrapped(name, low.heights, low.centre, cell / 2, _HIGH_OBSTACLE)
        return None


def _head(result: StepResult) -> float | None:
    """Return the azimuth of the laser's head at a step [rad]; None where it sent no sweep."""
    sweeps = result.readings.sweeps
    return None if sweeps is None or not len(sweeps.stamps) else float(sweeps.head_angles[-1])


def _unwrapped(
    name: str,
    values: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    largest: float,
) -> MapFrame:
    """Return a layer of a circular grid with the square's corner first; see ``RollingGrid``."""
    corner = centre - len(values) // 2
    low0, low1 = corner.tolist()
    # A roll is a copy: the grid goes on while the frame is drawn.
    rolled = np.roll(values, (-low0, -low1), axis=(0, 1))
    origin = np.asarray(corner * cell, dtype=np.float64)
    return MapFrame(name, rolled, origin, cell, largest)
