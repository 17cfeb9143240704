"""Short drive of stand-ins before a wall, with the real planner and the real recorder."""

from dataclasses import dataclass

import numpy as np

from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, VehicleState, WheelSpeeds
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.navigation.controller import Steering
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import CloudPerception
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.records.bag_writers import open_writer
from andabata.records.messages import MessageBuilder
from andabata.records.planner_recorder import PlannerRecorder
from andabata.records.recorder import MessageQueue, Recorder
from tests.support.situations import GRID, ROBOT, StubController, StubLocalizer, pose_at, scan_of
from traversability.cloud import PointCloud

GOAL = np.array([8.0, 0.0])
START = pose_at(0.5, -0.25, 0.2)
"""First pose in ``odom``."""

T_MAP_ODOM = (100.0, 50.0, 0.5)
"""Shift [m] and turn [rad] from ``odom`` to the map."""

SETTINGS = {"simulated_robot": {"sensing": {"geo_reference": {"altitude": 60.0}}}}


def in_map(odometry):
    """Return the pose in the map of a level pose in ``odom``."""
    x, y, turn = T_MAP_ODOM
    c, s = np.cos(turn), np.sin(turn)
    px, py, pz = odometry.position
    place = np.array([x + c * px - s * py, y + s * px + c * py, pz])
    return Pose.from_euler(place, 0.0, 0.0, odometry.yaw + turn)


def wall_ranges(distance=3.0):
    """Return ranges of a wall ahead, 4 m to either side [m], shape (n_sectors,)."""
    ahead = np.maximum(np.cos(GRID.bearings), 0.05)
    reach = distance / ahead
    return np.where(np.abs(reach * np.sin(GRID.bearings)) < 4.0, reach, np.inf)


class WallPerception(CloudPerception):
    """Perception that always sees the wall, and a level cloud at height 0.25 m."""

    def __init__(self):
        self.assembler = CloudAssembler(CloudAssemblyConfig(), 0.7)
        self._layers = None
        self.movers = None

    def reset(self):
        """Gather a cloud anew."""
        grid = np.mgrid[-3:3:40j, -3:3:40j].reshape(2, -1).T
        points = np.column_stack([grid, np.full(len(grid), 0.25)]).astype(np.float32)
        self.assembler.reset()
        self.assembler.cloud = PointCloud(points, "odom")

    def scan(self, stamp, localizer):
        """Return the wall as a scan."""
        return scan_of(wall_ranges())


@dataclass
class PlannedDrive:
    """Navigator of stand-ins that drives straight on at 0.5 m/s; its step is 0.1 s."""

    has_planner: bool = True
    speed: float = 0.5

    def __post_init__(self):
        self.localizer = StubLocalizer(in_map(START), START)
        self.localizer.track.append(0.0, START.position, START.quaternion)
        self.perception = WallPerception()
        self.planner = LocalPlanner(GRID, LocalPlannerConfig())
        controller = StubController(Twist(self.speed, 0.2))
        steering = Steering(controller, self.planner) if self.has_planner else Steering(controller)
        self.navigator = Navigator(ROBOT, self.localizer, self.perception, steering)
        self.navigator.reset(in_map(START), 0.0)
        x, y, turn = T_MAP_ODOM
        c, s = np.cos(turn), np.sin(turn)
        self.navigator.set_goal(np.array([x + c * GOAL[0], y + s * GOAL[0]]))

    def record(self, writer, seconds=2.0, local_map=True, clouds=True):
        """Drive and write all messages."""
        builder, planner = MessageBuilder(writer.ros), None
        if local_map:
            planner = PlannerRecorder(self.localizer, self.perception, self.navigator.planner)
        recorder = Recorder(
            MessageQueue(writer, builder),
            self.localizer,
            self.perception.assembler,
            GRID.bearings,
            clouds,
            planner,
        )
        recorder.begin(in_map(START), 0.0, SETTINGS)
        self.navigator.observers.append(recorder.record)
        for k in range(1, round(seconds * 10) + 1):
            self._move(k / 10)
            self.navigator.step(self._readings(k / 10))

    def _move(self, seconds):
        """Move the estimate on."""
        way = self.speed * seconds * np.array([np.cos(0.2), np.sin(0.2), 0.0])
        odometry = Pose(START.position + way, START.quaternion)
        self.localizer.odometry, self.localizer.pose = odometry, in_map(odometry)
        self.localizer.track.append(seconds, odometry.position, odometry.quaternion)

    def _readings(self, seconds):
        """Return readings of the truth, and a fix of the origin."""
        zero = np.zeros(3)
        fix = np.array([[seconds, 36.715, -4.478, 60.0, 0.5]])
        return SensorReadings(
            seconds,
            truth=VehicleState(seconds, self.localizer.pose, zero, zero, WheelSpeeds(0.0, 0.0)),
            gnss=fix,
        )


def record_drive(path, seconds=2.0, **options):
    """Write a recording of the drive and return its path."""
    writer = open_writer(path)
    PlannedDrive().record(writer, seconds, **options)
    writer.close()
    return path
