"""Movers of one drive with a robot that has dynamics: where each is after every sub-step."""

from collections.abc import Sequence

import numpy as np

from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from worlds.rooms.courses import Courses, Solids, follow, pass_period
from worlds.rooms.mover_motion import Movers, Schedules, come_and_go, put_down
from worlds.rooms.movers import Mover
from worlds.rooms.room import Room


class PlanarMovers:
    """Movers of a room, from the moment that the robot is put down.

    Those that go straight follow the law of ``worlds.rooms.mover_motion``, those on a course that
    of ``worlds.rooms.courses``.

    Attributes:
        state: Movers now, those that go straight first; their first axis has one row.
    """

    def __init__(self, room: Room, movers: Sequence[Mover], vehicle: PlanarVehicleConfig) -> None:
        """Put the movers down.

        Args:
            room: Room.
            movers: Its moving obstacles.
            vehicle: Robot that drives among them.

        Raises:
            ValueError: If one that goes straight is too fast for its size.
        """
        straight = [each for each in movers if not each.plan.course]
        courses = [each for each in movers if each.plan.course]
        self._dt, self._period = vehicle.period / vehicle.substeps, vehicle.period
        self._solids, self._straight = Solids.of(room), len(straight)
        self._courses = Courses.of(courses)
        self.state = Movers.none(1, len(movers))
        self._schedules = Schedules.none(1, len(movers))
        put_down(0, straight, self.state, self._schedules, self._dt)
        follow(self._courses, 0.0, self.state, self._straight)
        self._rows, self._periods = Movers.none(vehicle.substeps, len(movers)), 0

    def step(self, robot: PlanarPose, radius: float) -> Movers:
        """Move on for a control period; return the movers after each sub-step, the first axis.

        Args:
            robot: True pose of the robot at the begin.
            radius: Radius around it in which nobody appears [m].
        """
        now = self._periods * self._period
        place, one = np.array([robot[:2]], dtype=np.float64), np.ones(1, dtype=np.bool_)
        if self._straight:
            # Movers on courses have no schedule: they are always there.
            come_and_go(place, one, np.array([now]), self.state, self._schedules, radius)
        moving = self.state, self._straight, self._courses, self._solids
        pass_period(*moving, now, self._dt, self._rows)
        self._periods += 1
        return self._rows
