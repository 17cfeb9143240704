"""Drives BARN's robot in rooms with movers, and compares the tracks of its laser with the truth.

A mover is in sight while two of three beams to its front, in its middle and at half of its width
either way, end there; see ``bench.mover_tally`` for what counts.
"""

import math
import time

import numpy as np
from numpy.typing import NDArray

from andabata.bench.mover_tally import Case, MoverDrive, MoverTally, Tracks, TrueMovers
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.catalogue import planar_navigator
from andabata.navigation.planar.circle_tracks import CircleTracks, CircleTracksConfig
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.tasks.rooms.planar_drive import BARN_LIDAR, SimulatedPlanarRobot, goal_in_odometry
from worlds.rooms.catalogue import make_room
from worlds.rooms.crowds import SIZES
from worlds.rooms.moving_fields import LEVELS, moving_field
from worlds.rooms.room import Room, RoomTask, random_task

PLANAR = "planar"
"""Name of the planar laser, BARN's."""

ROOM_KINDS = (
    "clutter-movers",
    "clutter",
    *(f"barn-moving-{level}" for level in LEVELS),
    *(f"crowd-{people}" for people in SIZES),
)
"""Kinds of rooms that it drives in."""

_DRIVER = "mpc"
"""Navigator that drives; what it does with movers does not matter here."""

_GOAL_RADIUS = 1.0
"""Distance below which a goal is reached [m]."""

_TASK_TIME = 40.0
"""Time after which another task is begun [s]."""

_CLEAR = 0.5
"""Smallest distance of random starts and goals from what stands [m]."""

_FAR = 4.0
"""Smallest distance of a random goal from its start [m]."""

_SLACK = 0.1
"""Largest difference of a beam's range from that to a mover's front [m]."""


def drive_among_planar_movers(config: CircleTracksConfig, seconds: float, case: Case) -> MoverDrive:
    """Drive one task after the other for a while, and follow the movers.

    Args:
        config: Settings of the tracks.
        seconds: Duration [s].
        case: Laser, kind of room and seed.
    """
    _, kind, seed = case
    room = _room(kind, seed)
    rng = np.random.default_rng([seed, 2])
    probe = PlanarMoverProbe(case, config)
    duration = 0.0
    while duration < seconds:
        task = _task(room, rng)
        duration += _drive_task(room, task, rng, probe, seconds - duration)
    return probe.finish(duration)


def _room(kind: str, seed: int) -> Room:
    """Return the room of a kind and a seed."""
    for level in LEVELS:
        if kind == f"barn-moving-{level}":
            return moving_field(seed, level).room
    return make_room(f"{kind}-{seed}")


def _task(room: Room, rng: np.random.Generator) -> RoomTask:
    """Return the task of a field, or a random one of another room."""
    return room.tasks[0] if room.tasks else random_task(room, rng, _CLEAR, _CLEAR, _FAR)


def _drive_task(
    room: Room, task: RoomTask, rng: np.random.Generator, probe: "PlanarMoverProbe", most: float
) -> float:
    """Drive to one goal, to the first contact or for some time [s]; return the duration [s]."""
    vehicle = PLANAR_VEHICLES["barn"]
    robot_rng, draws = rng.spawn(2)
    robot = SimulatedPlanarRobot(room, task, vehicle, BARN_LIDAR, robot_rng)
    navigator = planar_navigator(_DRIVER, vehicle, draws)
    navigator.reset(BARN_LIDAR, goal_in_odometry(task))
    probe.restart()
    duration = 0.0
    while duration < min(most, _TASK_TIME):
        readings = robot.read()
        probe(readings, robot)
        robot.step(navigator.act(readings))
        duration += vehicle.period
        here = robot.vehicle.pose
        if robot.vehicle.has_contact or math.dist(here[:2], task.goal) < _GOAL_RADIUS:
            break
    return duration


class PlanarMoverProbe:
    """Compares the tracks of a planar laser with the movers of a room, step by step."""

    def __init__(
        self, case: Case, config: CircleTracksConfig, lidar: PlanarLidarConfig = BARN_LIDAR
    ) -> None:
        """Begin.

        Args:
            case: Laser, kind of room and seed.
            config: Settings of the tracks.
            lidar: Laser.
        """
        self._period = PLANAR_VEHICLES["barn"].period
        self._tracks, self._tally = CircleTracks(lidar, self._period, config), MoverTally(case)
        self._lidar, self._bearings = lidar, lidar.bearings
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))

    def restart(self) -> None:
        """Begin another task: the odometry begins anew, and the tracks with it."""
        self._tracks.reset()
        self._tally.restart()

    def __call__(self, readings: PlanarReadings, robot: SimulatedPlanarRobot) -> None:
        """Follow the movers, and compare."""
        own, ranges = readings.odometry, np.asarray(readings.ranges, dtype=np.float64)
        begin = time.thread_time()
        tracks = self._tracks.update(LaserPose(*own), ranges)
        cost = time.thread_time() - begin
        true, state = robot.vehicle.pose, robot.movers
        places, radii = state.places[0].copy(), state.radii[0].copy()
        movers = TrueMovers(
            places,
            radii > 0,
            lambda m: self._sees(true, ranges, places[m], float(radii[m])),
            lambda _: True,
        )
        known = tracks.places, tracks.velocities, tracks.numbers
        self._tally.compare(
            Tracks.seen_from(true, own, *known), movers, np.array(true[:2]), self._period, cost
        )

    def _sees(
        self,
        robot: PlanarPose,
        ranges: NDArray[np.float64],
        place: NDArray[np.float64],
        radius: float,
    ) -> bool:
        """Return True if two of three beams to the front of a mover end there."""
        eye = self._mount.on(LaserPose(*robot))
        dx, dy = place[0] - eye.x, place[1] - eye.y
        away = math.hypot(dx, dy)
        if away <= radius:
            return False
        middle = math.remainder(math.atan2(dy, dx) - eye.yaw, 2 * math.pi)
        aside = math.asin(radius / away) / 2
        ends = 0
        for bearing in (middle - aside, middle, middle + aside):
            beam = int(np.abs(self._bearings - bearing).argmin())
            if abs(self._bearings[beam] - bearing) > math.radians(self._lidar.resolution_deg):
                continue
            off = away * math.sin(self._bearings[beam] - middle)
            if abs(off) < radius:
                front = math.sqrt(away**2 - off**2) - math.sqrt(radius**2 - off**2)
                ends += abs(ranges[beam] - front) < _SLACK
        return ends >= 2

    def finish(self, duration: float) -> MoverDrive:
        """Return the measures of all tasks of a duration [s]."""
        return self._tally.finish(duration)
