"""The robot's story, one control step at a time."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health, Localizer
from andabata.machine.kinematics import SkidSteer, Twist, executed_twist
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import (
    ReadingsFilter,
    SensorReadings,
    WheelSpeeds,
    unfiltered,
)
from andabata.navigation.arrival import ArrivalConfig, ArrivalMonitor
from andabata.navigation.controller import Controller, ControllerInput, Planner, Steering
from andabata.navigation.laser_monitor import LaserMonitor, LaserMonitorConfig
from andabata.navigation.perception import Perception
from traversability.virtual_scan import VirtualScan
from worlds.world import Geofence

_STANDSTILL = Twist(0.0, 0.0)

_CREEP_SPEED = 0.1
"""Largest speed without a heading [m/s]."""


class StepResult(NamedTuple):
    """One control step, for observers, records and comparisons.

    Attributes:
        readings: Readings that came in.
        scan: Virtual scan as perceived; None before the first cloud, and where nothing needs it.
        situation: Input of the controller; None where no decision was due.
        goal: Goal in the map [m], shape (2,).
        twist: Twist that is driven, after limits and dead zone.
        wheels: Wheel speeds of it.
        has_arrived: True if the robot has declared this goal reached.
        is_overridden: True if the planner has turned the controller's command elsewhere; None where
            no decision was due.
    """

    readings: SensorReadings
    scan: VirtualScan | None
    situation: ControllerInput | None
    goal: NDArray[np.float64]
    twist: Twist
    wheels: WheelSpeeds
    has_arrived: bool = False
    is_overridden: bool | None = None


Observer = Callable[[StepResult], None]
"""Watches control steps and changes nothing: a recorder, a live view, a comparison."""


def _leads_alike(one: Twist, other: Twist) -> bool:
    """Return True for the same yaw rate and direction, at whatever speed."""
    return one.angular == other.angular and np.sign(one.linear) == np.sign(other.linear)


class Navigator:
    """Turns sensor readings into wheel speeds: in simulation, in training, on a record, on a robot.

    The robot stands still until there is a first scan, while it is lost or its laser is not usable,
    and from its arrival at a goal until there is another; without a heading it creeps.

    Attributes:
        observers: Observers, called after each step. For them the cells are classified at each
            step, also where no decision is due.
        spectators: Observers for whom nothing is computed: between decisions they get no scan.
        start: Pose in the map and stamp [s] of the last ``reset``, None before.
        geofence: Bounds of the drive in the map [m], or None.
        perceived: Virtual scan of the latest situation, as perception gave it; None before the
            first of a drive.
    """

    def __init__(
        self,
        robot: RobotModel,
        localizer: Localizer,
        perception: Perception,
        steering: Steering | None = None,
        readings_filter: ReadingsFilter = unfiltered,
        arrival: ArrivalConfig | None = None,
        laser: LaserMonitorConfig | None = None,
    ) -> None:
        """Put a navigator together.

        Args:
            robot: Steering limit, dead zone and kinematics.
            localizer: Estimator of the pose.
            perception: Source of virtual scans and layers of the ground.
            steering: Controller and planner; without a controller a learner drives from outside
                through ``update``, ``observe`` and ``execute``.
            readings_filter: Filter between the source of the readings and the navigator: faults,
                latency, perturbations.
            arrival: Rules by which a goal is declared reached.
            laser: Silence of the laser from which the robot stands still.
        """
        steering = steering or Steering()
        self._robot = robot
        self._kinematics = SkidSteer(robot)
        self._localizer = localizer
        self._perception = perception
        self._controller = steering.controller
        self._planner = steering.planner
        self._action_repeat = steering.action_repeat
        self._knows_truth = steering.knows_truth
        self._filter = readings_filter
        self._arrival = ArrivalMonitor(arrival or ArrivalConfig())
        self._laser = LaserMonitor(laser or LaserMonitorConfig())
        self._goal, self._has_goal = np.zeros(2), False
        self._command = _STANDSTILL
        self._repeats_left = 0
        self._previous_steering, self._previous_speed = (0.0, 0.0), 0.0
        self.observers: list[Observer] = []
        self.spectators: list[Observer] = []
        self.start: tuple[Pose, float] | None = None
        self.geofence: Geofence | None = None
        self.perceived: VirtualScan | None = None

    @property
    def planner(self) -> Planner:
        """Planner around the controller, for observers."""
        return self._planner

    @property
    def has_arrived(self) -> bool:
        """True from the step in which the robot declares its goal reached, until another is set."""
        return self._arrival.has_arrived

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Forget everything and start at a pose.

        Args:
            pose: Pose in the map.
            stamp: Time [s].
            rough: True if the pose comes from sensors, with their errors.
        """
        self.start = (pose, stamp)
        self._localizer.reset(pose, stamp, rough)
        self._perception.reset()
        self._laser.reset()
        self._planner.reset()
        if self._controller is not None:
            self._controller.reset()
        self._previous_steering, self._previous_speed = (0.0, 0.0), 0.0
        self._repeats_left = 0
        self._arrival.reset()
        self.perceived = None

    @property
    def steering(self) -> Steering:
        """Controller and planner."""
        return Steering(self._controller, self._planner, self._action_repeat, self._knows_truth)

    def steer(self, steering: Steering) -> None:
        """Hand over to another controller, or planner, in the middle of a drive.

        Args:
            steering: Controller, which forgets what it knew, and planner, which does not: it may
                be the one so far.
        """
        self._controller = steering.controller
        self._planner = steering.planner
        self._action_repeat = steering.action_repeat
        self._knows_truth = steering.knows_truth
        self._repeats_left = 0
        if self._controller is not None:
            self._controller.reset()

    def set_goal(self, goal: NDArray[np.float64]) -> None:
        """Head for ``goal``, map coordinates [m], shape (2,); the same goal again changes nothing.

        Until the first goal is set there is nothing to arrive at.
        """
        if not self._has_goal or not np.array_equal(goal, self._goal):
            self._goal, self._has_goal = np.array(goal, dtype=np.float64), True
            self._repeats_left = 0
            self._arrival.reset()

    def step(self, readings: SensorReadings) -> StepResult:
        """Turn the readings of one control period into wheel speeds (paper: section 4, Figure 7).

        Raises:
            ValueError: If the navigator has no controller.
        """
        controller = self._required_controller()
        # Where am I, and what is around: UKF; beams placed into the levelled cloud.
        readings = self.update(readings)
        # Am I there: from then on the robot stands still until it gets another goal.
        has_arrived = self._check_arrival(readings)
        is_due = self._repeats_left == 0 and not has_arrived
        # How far is it free: cloud to polar cells, classifier, virtual scan.
        scan = self._scan(readings.stamp) if is_due or self.observers else None
        situation = is_overridden = None
        if is_due and scan is not None:
            # Where to head for: a sub-goal on the shortest path over the occupancy grid.
            situation = self._situation(readings, scan)
            # How to steer: the policy; rollouts replace a command that leads into an obstacle.
            command = controller.act(situation)
            self._command = self._planner.select(situation, command)
            is_overridden = not _leads_alike(self._command, command)
            self._repeats_left = self._action_repeat
        # What the wheels do: limits, dead zone, inverse kinematics.
        twist, wheels = self._next_twist()
        result = StepResult(
            *(readings, scan, situation, self._goal, twist, wheels, has_arrived, is_overridden)
        )
        for observer in (*self.observers, *self.spectators):
            observer(result)
        return result

    def update(self, readings: SensorReadings) -> SensorReadings:
        """Take in readings: localise, and place the beams with the poses of their own instants.

        A live graph does so twice in a control period.

        Returns:
            Readings after the filter.
        """
        readings = self._filter(readings)
        self._localizer.update(readings)
        seen = self._laser.update(readings, self._localizer.track)
        self._localizer.report(self._laser.causes)
        self._perception.update(seen, self._localizer)
        return readings

    def observe(self, readings: SensorReadings) -> ControllerInput | None:
        """Return the situation after readings that were taken in, None before the first scan.

        For a learner that drives from outside; it counts as a scan of the planner.
        """
        scan = self._scan(readings.stamp)
        return None if scan is None else self._situation(readings, scan)

    def execute(self, command: Twist) -> tuple[Twist, WheelSpeeds]:
        """Return the twist that is driven, after limits and dead zone, and its wheel speeds.

        A robot that is lost, or whose laser is silent or not believed, stands still. One that only
        lacks a heading creeps: map and rollouts are in ``odom``, so that it hits nothing, and its
        way tells the heading.

        Args:
            command: Wanted twist.

        Raises:
            ValueError: If the command is not finite.
        """
        twist = executed_twist(command, self._robot)
        health = self._localizer.health
        if health is Health.LOST or not self._laser.is_usable:
            twist = _STANDSTILL
        elif health is Health.DISORIENTED and abs(twist.linear) > _CREEP_SPEED:
            twist = Twist(math.copysign(_CREEP_SPEED, twist.linear), twist.angular)
        self._previous_steering = (twist.angular, self._previous_steering[0])
        self._previous_speed = twist.linear
        return twist, self._kinematics.wheel_speeds(twist.linear, twist.angular)

    def _required_controller(self) -> Controller:
        """Return the controller.

        Raises:
            ValueError: If there is none.
        """
        if self._controller is None:
            raise ValueError("controller: expected one, got None; use observe and execute instead")
        return self._controller

    def _check_arrival(self, readings: SensorReadings) -> bool:
        """Return True if the goal is reached, and end the command that was driven until then."""
        if not self._has_goal:
            return False
        pose = self._localizer.pose
        if self._knows_truth and readings.truth is not None:
            pose = readings.truth.pose
        away = float(np.hypot(*(self._goal - pose.position[:2])))
        has_arrived = self._arrival.update(away, readings.stamp, self._localizer.health)
        if has_arrived:
            self._repeats_left = 0
        return has_arrived

    def _scan(self, stamp: float) -> VirtualScan | None:
        """Return the virtual scan at a stamp [s], None before the first cloud."""
        return self._perception.scan(stamp, self._localizer)

    def _situation(self, readings: SensorReadings, scan: VirtualScan) -> ControllerInput:
        """Return the input of the controller, with the planner's sub-goal in the goal's place."""
        self.perceived = scan
        pose = self._localizer.pose
        to_goal = self._goal - pose.position[:2]
        situation = ControllerInput(
            stamp=readings.stamp,
            perceived=scan,
            scan=scan,
            heading_error=wrap(float(np.arctan2(to_goal[1], to_goal[0])) - pose.yaw),
            goal_distance=float(np.hypot(*to_goal)),
            previous_steering=self._previous_steering,
            pose=pose,
            odometry=self._localizer.odometry,
            goal=self._goal,
            truth=readings.truth,
            geofence=self.geofence,
            previous_speed=self._previous_speed,
            stalled_time=self._arrival.stalled_time(readings.stamp),
        )
        return self._planner.guide(situation, self._perception.layers)

    def _next_twist(self) -> tuple[Twist, WheelSpeeds]:
        """Return what is driven in the next period; without a decision the robot stands still."""
        if self._repeats_left == 0:
            return _STANDSTILL, WheelSpeeds(0.0, 0.0)
        self._repeats_left -= 1
        return self.execute(self._command)
