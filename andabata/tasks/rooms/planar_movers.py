"""Movers of one drive with a robot that has dynamics: where each is after every sub-step."""

import math
from collections.abc import Sequence

import numpy as np

from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from worlds.agent_motion import RobotMotion, decide
from worlds.agent_surroundings import Nearby
from worlds.agents import Agents, check_movers
from worlds.rooms.courses import Courses, follow, pass_period
from worlds.rooms.mover_motion import Movers, Schedules, come_and_go, put_down
from worlds.rooms.movers import Mover
from worlds.rooms.room import Room


class PlanarMovers:
    """Movers of a room, from the moment that the robot is put down.

    Those that go straight follow the law of ``worlds.rooms.mover_motion``, those on a course that
    of ``worlds.rooms.courses``, people that of ``worlds.agent_motion``.

    Attributes:
        state: Movers now, those on courses last; their first axis has one row.
    """

    def __init__(self, room: Room, movers: Sequence[Mover], vehicle: PlanarVehicleConfig) -> None:
        """Put the movers down.

        Args:
            room: Room.
            movers: Its moving obstacles.
            vehicle: Robot that drives among them.

        Raises:
            ValueError: If one that goes straight, or a person, is too fast for its size.
        """
        free = [each for each in movers if not each.plan.course]
        courses = [each for each in movers if each.plan.course]
        self._dt, self._period = vehicle.period / vehicle.substeps, vehicle.period
        self._room, self._free = room, len(free)
        self._courses = Courses.of(courses)
        self._agents: Agents | None = None
        if any(each.behaviour for each in free):
            check_movers(free)
            self._agents = Agents.of([*free, *courses])
        self.state = Movers.none(1, len(movers))
        self._schedules = Schedules.none(1, len(movers))
        put_down(0, free, self.state, self._schedules, self._dt)
        follow(self._courses, 0.0, self.state, self._free)
        self._rows, self._periods = Movers.none(vehicle.substeps, len(movers)), 0

    def step(self, robot: PlanarPose, speed: float, radius: float) -> Movers:
        """Move on for a control period; return the movers after each sub-step, the first axis.

        Args:
            robot: True pose of the robot at the begin.
            speed: True speed of the robot at the begin [m/s].
            radius: Radius of its circle, in which nobody appears [m].
        """
        now = self._periods * self._period
        place, one = np.array([robot[:2]], dtype=np.float64), np.ones(1, dtype=np.bool_)
        if self._free:
            # Movers on courses have no schedule: they are always there.
            come_and_go(place, one, np.array([now]), self.state, self._schedules, radius)
        people = None
        if self._agents is not None:
            people = self._agents, self._decided(self._agents, robot, speed, radius, now)
        moving = self.state, self._free, self._courses, self._room.solids
        pass_period(*moving, now, self._dt, self._rows, people)
        self._periods += 1
        return self._rows

    def _decided(
        self, agents: Agents, robot: PlanarPose, speed: float, radius: float, now: float
    ) -> Nearby:
        """Let people decide where they go in this period; return the solids near each."""
        vx, vy = speed * math.cos(robot.yaw), speed * math.sin(robot.yaw)
        motion = RobotMotion(robot.x, robot.y, vx, vy, radius)
        around = self._room.solids, self._room.half
        return decide(self.state, agents, *around, motion, now, self._period)
