"""A robot with dynamics in a room, with a laser that sees the room: readings for navigators."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles, reach_of
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.readings import PlanarNavigator, PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicle, PlanarVehicleConfig
from andabata.tasks.rooms.batch import laser_arrays, room_arrays
from andabata.tasks.rooms.kernel import MIN_RANGE, cast
from andabata.tasks.rooms.planar_movers import PlanarMovers
from andabata.tasks.terminations import Outcome
from worlds.rooms.mover_motion import Movers
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.room import Room, RoomTask

BARN_LIDAR = PlanarLidarConfig(fov_deg=270, resolution_deg=270 / 719, max_range=30, x=0.055)
"""The laser of the BARN benchmark: 720 beams of 270 degrees, 0.055 m ahead of the robot's middle.

The mount at the front of its robot, a Jackal, is 0.120 m ahead (``mount_spacing`` of the robot's
description), and the benchmark puts the laser 0.065 m behind it (``JACKAL_LASER_OFFSET``).
"""


class DriveRules(BaseModel):
    """Rules of a drive to one goal (those of the BARN benchmark).

    Attributes:
        goal_radius: Distance below which the goal is reached [m].
        clock_distance: Distance from the start beyond which the clock runs [m].
        time_limit: Longest time by the clock, and longest wait for it [s] (assumption for the
            wait).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    goal_radius: float = Field(default=1.0, gt=0)
    clock_distance: float = Field(default=0.1, ge=0)
    time_limit: float = Field(default=100.0, gt=0)


class DriveResult(NamedTuple):
    """How a drive ended.

    Attributes:
        outcome: Goal, collision or time-out.
        contact: Contact at the end: with what, and who drove into whom.
        time: Time by the clock [s], 0 if it never ran.
        goal_distance: Distance from the goal at the end [m].
        speed: Speed at the end [m/s].
        path: True pose after each control period, the start first: x, y [m], yaw [rad], shape
            (t, 3).
        movers: Movers at the same times: x, y and radius of each [m], shape (t, m, 3).
    """

    outcome: Outcome
    contact: Contact
    time: float
    goal_distance: float
    speed: float
    path: NDArray[np.float64]
    movers: NDArray[np.float64]


class SimulatedPlanarRobot:
    """A robot with dynamics in a room.

    Attributes:
        vehicle: Dynamics, with the true pose.
        lidar: Laser.
    """

    def __init__(
        self,
        room: Room,
        task: RoomTask,
        vehicle: PlanarVehicleConfig,
        lidar: PlanarLidarConfig,
        rng: np.random.Generator,
    ) -> None:
        """Put the robot down at the start of a task, at rest.

        Args:
            room: Room with what moves in it.
            task: Start and goal.
            vehicle: Settings of the dynamics.
            lidar: Laser.
            rng: Source of randomness of the drive; each period takes as many numbers.

        Raises:
            ValueError: If a mover is too fast for its size.
        """
        start = PlanarPose(task.start.x, task.start.y, task.start.yaw)
        self.vehicle = PlanarVehicle(
            vehicle, start, Obstacles(room.boxes, room.circles, room.edges), rng
        )
        self.lidar = lidar
        self._rng, self._periods = rng, 0
        # Sources of their own: what the laser and the ground draw does not depend on them.
        self._speed_rng, mover_rng = rng.spawn(2)
        self._rooms, self._lasers = room_arrays([room]), laser_arrays([lidar])
        self._reach = reach_of(vehicle.footprint)
        movers = draw_movers(room, mover_rng, task, self._reach)
        self._movers = PlanarMovers(room, movers, vehicle)
        self._found = np.zeros((1, lidar.count), dtype=np.float32)

    def read(self) -> PlanarReadings:
        """Return the measurements of this period; each call draws noise."""
        config = self.vehicle.config
        one = np.ones(1, dtype=np.bool_)
        motion = np.zeros((1, 5))
        motion[0, :3] = self.vehicle.pose
        none = np.zeros(1, dtype=np.int64)
        movers = self._movers.state
        cast(motion, one, none, self._rooms, movers, self._lasers, none, self._found)
        ranges = 1.0 / self._found[0]
        noise = self._rng.standard_normal(len(ranges), dtype=np.float32)
        met = ranges < self.lidar.max_range * (1 - 1e-6)
        noisy = np.maximum(ranges + np.float32(config.range_noise) * noise, np.float32(MIN_RANGE))
        return PlanarReadings(
            stamp=self._periods * config.period,
            odometry=self.vehicle.odometry,
            velocity=self._measured_velocity(),
            ranges=np.where(met, noisy, np.float32(np.inf)),
            movers=self._true_movers(),
        )

    def _true_movers(self) -> NDArray[np.float64]:
        """Return what moves now in the frame of the odometry; see ``PlanarReadings``."""
        movers, true, believed = self._movers.state, self.vehicle.pose, self.vehicle.odometry
        is_there = movers.radii[0] > 0.0
        turn = believed.yaw - true.yaw
        c, s = math.cos(turn), math.sin(turn)
        rotation = np.array([[c, -s], [s, c]])
        places = (movers.places[0, is_there] - true[:2]) @ rotation.T + believed[:2]
        velocities = movers.velocities[0, is_there] @ rotation.T
        return np.hstack((places, velocities, movers.radii[0, is_there, None]))

    @property
    def movers(self) -> Movers:
        """Movers now, in the room; the first axis has one row."""
        return self._movers.state

    def _measured_velocity(self) -> Twist:
        """Return speed and yaw rate of the wheels with the noise of their measurement."""
        config, true = self.vehicle.config, self.vehicle.velocity
        noise = self._speed_rng.standard_normal(2) * (config.speed_noise, config.yaw_rate_noise)
        return Twist(true.linear + float(noise[0]), true.angular + float(noise[1]))

    def step(self, command: Twist) -> None:
        """Drive for one control period.

        Raises:
            ValueError: If the command is not finite.
        """
        pose, speed = self.vehicle.pose, self.vehicle.velocity.linear
        self.vehicle.step(command, self._movers.step(pose, speed, self._reach))
        self._periods += 1


def goal_in_odometry(task: RoomTask) -> tuple[float, float]:
    """Return a task's goal in the frame of the odometry, which begins at the start [m]."""
    dx, dy = task.goal[0] - task.start.x, task.goal[1] - task.start.y
    c, s = math.cos(task.start.yaw), math.sin(task.start.yaw)
    return c * dx + s * dy, c * dy - s * dx


def drive_to_goal(
    navigator: PlanarNavigator,
    robot: SimulatedPlanarRobot,
    task: RoomTask,
    rules: DriveRules,
    on_readings: Callable[[PlanarReadings, Twist], None] | None = None,
) -> DriveResult:
    """Drive to the goal of a task, until it is reached, something is touched or time is up.

    Args:
        navigator: Navigator, which is reset before.
        robot: Robot at the start of the task.
        task: Start and goal.
        rules: Rules.
        on_readings: Function that sees the readings and the command of each period.
    """
    navigator.reset(robot.lidar, goal_in_odometry(task))
    vehicle, period = robot.vehicle, robot.vehicle.config.period
    path, movers, begun, waited = [vehicle.pose], [_movers_of(robot)], None, 0
    most = round(rules.time_limit / period)
    outcome = Outcome.COLLISION if vehicle.has_contact else None
    goal_distance = math.dist(path[0][:2], task.goal)
    while outcome is None:
        readings = robot.read()
        command = navigator.act(readings)
        if on_readings is not None:
            on_readings(readings, command)
        robot.step(command)
        path.append(vehicle.pose)
        movers.append(_movers_of(robot))
        goal_distance = math.dist(path[-1][:2], task.goal)
        # The period in which the robot leaves its start is the first one of the clock.
        if begun is None and math.dist(path[-1][:2], path[0][:2]) > rules.clock_distance:
            begun = waited
        waited += 1
        if vehicle.has_contact:
            outcome = Outcome.COLLISION
        elif goal_distance < rules.goal_radius:
            outcome = Outcome.GOAL
        elif waited - (begun or 0) >= most:
            outcome = Outcome.TIMEOUT
    time = 0.0 if begun is None else (waited - begun) * period
    return DriveResult(
        outcome,
        vehicle.contact,
        time,
        goal_distance,
        vehicle.velocity.linear,
        np.array(path),
        np.array(movers),
    )


def _movers_of(robot: SimulatedPlanarRobot) -> NDArray[np.float64]:
    """Return x, y and radius of what moves around a robot [m], shape (m, 3)."""
    return np.column_stack((robot.movers.places[0], robot.movers.radii[0]))
