"""Batch simulator of disc robots in rooms, each with a planar laser."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.odometry import DeadReckoning, OdometryErrors
from andabata.tasks.planar import PlanarState
from andabata.tasks.rooms.kernel import Lasers, Rooms, V, X, cast, drive
from worlds.agents import Agents, check_movers
from worlds.rooms.mover_motion import Movers, Schedules, come_and_go, put_down
from worlds.rooms.movers import Mover
from worlds.rooms.room import Room
from worlds.world import Start


class DiscRobotConfig(BaseModel):
    """A round robot that follows each command exactly (assumption; SPN names its radius alone).

    Attributes:
        radius: Radius [m] (paper: 0.2).
        max_speed: Largest speed; it does not drive backwards [m/s].
        max_yaw_rate: Largest yaw rate [rad/s].
        period: Control period [s].
        substeps: Number of checks for contact in a period.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    radius: float = Field(default=0.2, gt=0, le=2)
    max_speed: float = Field(default=0.5, gt=0, le=5)
    max_yaw_rate: float = Field(default=np.pi / 3, gt=0, le=10)
    period: float = Field(default=0.2, gt=0, le=1)
    substeps: int = Field(default=2, ge=1, le=100)


class RoomBatch:
    """Many disc robots in several rooms: motion, contact, beams.

    Attributes:
        motions: State of each robot: x, y [m], yaw [rad], speed [m/s], yaw rate [rad/s], float64,
            shape (n, 5).
        places: Index of each robot's room, shape (n,).
        movers: Moving obstacles of each robot's room; see ``worlds.rooms.mover_motion``.
        contacts: ``Contact`` of each robot since its last step, int64, shape (n,).
        lasers: Lasers that robots can have.
        mounted: Index of each robot's laser, shape (n,).
        reciprocals: Reciprocal distances of the beams from the laser [1/m], float32, shape (n, b).
        odometry: Poses by odometry, which drift; None where robots know the truth.
    """

    def __init__(
        self,
        count: int,
        rooms: Sequence[Room],
        robot: DiscRobotConfig,
        lidar: PlanarLidarConfig,
        movers: int = 0,
        errors: OdometryErrors | None = None,
    ) -> None:
        """Prepare for a number of robots.

        Args:
            count: Number of robots.
            rooms: Rooms that they can be in.
            robot: Body of all of them.
            lidar: Laser of all of them.
            movers: Number of moving obstacles of each that may come.
            errors: Errors of their odometry for a control period; None for none.
        """
        self._robot = robot
        self._rooms = room_arrays(rooms)
        self.motions = np.zeros((count, 5))
        self.places = np.zeros(count, dtype=np.int64)
        self.movers = Movers.none(count, movers)
        self._schedules = Schedules.none(count, movers)
        has_people = any(room.has_people for room in rooms)
        self._people = Agents.none(count, movers) if has_people else None
        self.contacts = np.zeros(count, dtype=np.int64)
        self.lasers = laser_arrays([lidar])
        self.mounted = np.zeros(count, dtype=np.int64)
        self.reciprocals = np.zeros((count, lidar.count), dtype=np.float32)
        self._tipped = np.zeros(count, dtype=np.bool_)
        self._steps = np.zeros(count, dtype=np.int64)
        self.odometry: DeadReckoning | None = None
        if errors is not None:
            self.odometry = DeadReckoning(count, errors, robot.period)

    @property
    def rooms(self) -> Rooms:
        """Rooms as the compiled pass takes them."""
        return self._rooms

    @property
    def poses(self) -> NDArray[np.float64]:
        """True x, y [m] and yaw [rad], shape (n, 3)."""
        return self.motions[:, X:V]

    @property
    def believed(self) -> NDArray[np.float64]:
        """Poses that the robots believe in: x, y [m] and yaw [rad], shape (n, 3)."""
        return self.poses if self.odometry is None else self.odometry.poses

    @property
    def stamps(self) -> NDArray[np.float64]:
        """Time since each robot was put down [s], shape (n,)."""
        return np.asarray(self._steps * self._robot.period)

    def place(self, k: int, room: int, start: Start, movers: Sequence[Mover] = ()) -> None:
        """Put a robot down at rest, with moving obstacles of its own.

        Args:
            k: Index of the robot.
            room: Index of its room.
            start: Pose.
            movers: Its moving obstacles. Those that wait for nothing are there at once.

        Raises:
            ValueError: If there are too many, or one is too fast for its size.
        """
        self.places[k] = room
        self.motions[k] = start.x, start.y, start.yaw, 0.0, 0.0
        self.contacts[k] = 0
        self._steps[k] = 0
        dt = self._robot.period / self._robot.substeps
        put_down(k, movers, self.movers, self._schedules, dt)
        if self._people is not None:
            check_movers(movers)
            self._people.put_down(k, movers)

    def step(self, twists: NDArray[np.float64], chosen: NDArray[np.bool_]) -> PlanarState:
        """Drive robots for one control period.

        Args:
            twists: Speed [m/s] and yaw rate [rad/s] of each, shape (n, 2).
            chosen: True for robots that move; the others stand still, shape (n,).
        """
        robot = self._robot
        np.copyto(self.motions[:, V:], twists, where=chosen[:, None])
        if self.movers.radii.size:
            movers = self.movers, self._schedules
            come_and_go(self.motions, chosen, self.stamps, *movers, robot.radius)
        people = None if self._people is None else (self._people, self.stamps)
        self._steps += chosen
        if self.odometry is not None:
            self.odometry.step(twists, chosen)
        drive(
            self.motions,
            chosen,
            self.places,
            self._rooms,
            self.movers,
            robot.radius,
            robot.period,
            robot.substeps,
            self.contacts,
            people,
        )
        return self.observe(chosen)

    def observe(self, chosen: NDArray[np.bool_]) -> PlanarState:
        """Measure the beams of some robots and return the state of all.

        Lasers and movers are where situations keep them to be; see ``as_kept``.
        """
        movers = self.movers
        if movers.radii.size:
            movers = Movers(as_kept(movers.places), movers.velocities, as_kept(movers.radii))
        cast(
            as_kept(self.motions),
            chosen,
            self.places,
            self._rooms,
            movers,
            self.lasers,
            self.mounted,
            self.reciprocals,
        )
        return PlanarState(self.poses, self.contacts > 0, self._tipped)


def as_kept(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return numbers as situations keep them, rounded to float32.

    What is observed is computed from these, so that a situation gives the same bits again.
    """
    return values.astype(np.float32).astype(np.float64)


def room_arrays(rooms: Sequence[Room]) -> Rooms:
    """Return rooms padded to the obstacles of the fullest."""
    boxes = np.zeros((len(rooms), max((len(room.boxes) for room in rooms), default=0), 4))
    circles = np.zeros((len(rooms), max((len(room.circles) for room in rooms), default=0), 3))
    edges = np.zeros((len(rooms), max((len(room.edges) for room in rooms), default=0), 4))
    for k, room in enumerate(rooms):
        boxes[k, : len(room.boxes)] = room.boxes
        circles[k, : len(room.circles)] = room.circles
        edges[k, : len(room.edges)] = room.edges
    return Rooms(
        boxes,
        np.array([len(room.boxes) for room in rooms]),
        circles,
        np.array([len(room.circles) for room in rooms]),
        edges,
        np.array([len(room.edges) for room in rooms]),
        np.array([room.half for room in rooms], dtype=np.float64).reshape(-1, 2),
    )


def laser_arrays(lidars: Sequence[PlanarLidarConfig]) -> Lasers:
    """Return lasers padded to the beams of the finest."""
    counts = np.array([lidar.count for lidar in lidars])
    turns = np.radians([lidar.yaw_deg for lidar in lidars])
    directions = np.zeros((len(lidars), 2, counts.max()), dtype=np.float32)
    firsts = np.zeros(len(lidars))
    for k, lidar in enumerate(lidars):
        bearings = lidar.bearings + turns[k]
        firsts[k] = bearings[0]
        directions[k, :, : lidar.count] = np.cos(bearings), np.sin(bearings)
    return Lasers(
        counts=counts,
        firsts=firsts,
        steps=np.radians([lidar.resolution_deg for lidar in lidars]),
        directions=directions,
        offsets=np.array([(lidar.x, lidar.y) for lidar in lidars]),
        max_ranges=np.array([lidar.max_range for lidar in lidars]),
    )
