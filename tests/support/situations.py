"""Situations of a robot and stand-ins for its parts, for tests of controllers and planners."""

import numpy as np

from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayerConfig
from andabata.navigation.sweep_window import Part, SweepBuffer
from traversability.cartesian.classifier import BoostedStage, GroundClassifier
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.features import GROUND_FEATURES
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.trees.flat import COLUMNS, Trees
from traversability.virtual_scan import VirtualScan

GRID, ROBOT = PolarGrid(), RobotModel()
ORIGIN = np.zeros(2)


def pose_at(x=0.0, y=0.0, yaw=0.0):
    """Return a level pose."""
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw)


def scan_of(ranges=np.inf, odds=None):
    """Return a virtual scan of one range, or of one range a sector [m]."""
    full = np.broadcast_to(np.asarray(ranges, dtype=np.float32), GRID.n_sectors)
    return VirtualScan(full.copy(), GRID.outer_radius, odds)


def odds_of(ranges):
    """Return the log odds of a scan whose sectors are free up to their ranges [m]."""
    return scan_of(ranges).log_odds_of(GRID)


def nothing_seen():
    """Return the log odds of a scan whose cells are all empty."""
    return np.full((GRID.n_sectors, GRID.n_rings), np.nan, dtype=np.float32)


def between(low, high, distance):
    """Return ranges of a wall at a distance [m] between two bearings [deg]."""
    bearings = np.rad2deg(GRID.bearings)
    return np.where((bearings > low) & (bearings < high), distance, np.inf)


def sector_of(bearing):
    """Return the sector of a bearing [rad]."""
    return int((bearing + np.pi) / (2 * np.pi) * GRID.n_sectors) % GRID.n_sectors


def situation(scan=None, heading_error=0.0, goal_distance=8.0, **changes):
    """Return a situation, by default at the origin with free ground all around."""
    scan = scan_of() if scan is None else scan
    pose = changes.pop("pose", pose_at())
    bearing = pose.yaw + heading_error
    goal = pose.position[:2] + goal_distance * np.array([np.cos(bearing), np.sin(bearing)])
    given = {
        "stamp": 0.0,
        "perceived": scan,
        "scan": scan,
        "heading_error": heading_error,
        "goal_distance": goal_distance,
        "previous_steering": (0.0, 0.0),
        "pose": pose,
        "odometry": pose,
        "goal": goal,
    }
    return ControllerInput(**(given | changes))


class StubAssembler:
    """Assembler of which layers read the window alone."""

    def __init__(self):
        self._buffer = SweepBuffer()
        self.window = self._buffer.window(-np.inf)

    def show(self, points, stamp=0.0):
        """Replace the window by one cloud, all of it measured and settled at one time."""
        self.show_parts([PointCloud(points, "odom", np.full(len(points), stamp))], stamp)

    def show_parts(self, parts, settled):
        """Replace the window by some parts, settled up to a stamp."""
        self._buffer.clear()
        for cloud in parts:
            self._buffer.append(Part(cloud, cloud.newest))
        self.window = self._buffer.window(settled)


def layers_of(assembler, classifier=None, ground=None, low_obstacles=None):
    """Return layers of the default size that an assembler feeds."""
    return CartesianLayers(
        assembler,
        256,
        0.2,
        ground or GroundLayerConfig(),
        low_obstacles or LowObstacleLayerConfig(),
        classifier,
    )


def constant_classifier(log_odds):
    """Return a ground classifier that gives every cell the same log odds."""
    zeros = {name: np.zeros(1, dtype) for name, dtype in COLUMNS.items()}
    leaf = {**zeros, "feature": np.full(1, -1, np.int16)}
    stages = (
        BoostedStage(Trees(("spread",), "logistic", log_odds, **leaf), names)
        for names in (GROUND_FEATURES, CONTEXT_FEATURES)
    )
    return GroundClassifier(*stages, 0.1)


class StubLocalizer:
    """Localizer whose poses are set by hand."""

    def __init__(self, pose=None, odometry=None):
        self.pose = pose or pose_at()
        self.odometry = odometry or self.pose
        self.health = Health.OK
        self.causes, self.unused = (), {}
        self.track = PoseTrack()
        self.readings = []
        self.resets = []

    @property
    def status(self):
        """Status with the health and causes that are set."""
        covariance = np.diag([0.09, 0.04, 0.01, 0.0, 0.0, 0.01])
        return EstimatorStatus(self.health, self.causes, covariance, {}, self.unused)

    def reset(self, pose, stamp, rough=False):
        """Note the call."""
        self.resets.append((pose, stamp, rough))

    def update(self, readings):
        """Note the readings."""
        self.readings.append(readings)

    def report(self, causes):
        """Note the causes."""
        self.causes = causes


class StubPerception:
    """Perception whose scan is set by hand; counts its calls."""

    def __init__(self, scan=None):
        self.result = scan_of() if scan is None else scan
        self.layers = None
        self.readings, self.scans, self.resets = [], 0, 0

    def reset(self):
        """Note the call."""
        self.resets += 1

    def update(self, readings, localizer):
        """Note the readings."""
        self.readings.append(readings)

    def scan(self, stamp, localizer):
        """Return the scan."""
        self.scans += 1
        return self.result


class StubController:
    """Controller that returns one twist, or one after the other; keeps what it was given."""

    def __init__(self, *twists):
        self.twists, self.situations, self.resets = twists, [], 0

    def reset(self):
        """Note the call."""
        self.resets += 1

    def act(self, situation):
        """Return the next twist; the last one again and again."""
        self.situations.append(situation)
        return self.twists[min(len(self.situations), len(self.twists)) - 1]
