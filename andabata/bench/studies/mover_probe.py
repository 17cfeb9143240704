"""Compares the tracks of movers with the walkers of a simulated world, step by step.

A moment is a control step at which a walker has been in sight for a second within 5 m: two of
three rays from the laser to its body meet nothing before. It is found if a track is near its place.
A track that is never near a walker is false.
"""

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.mover_perception import MoverPerception

MAX_RANGE = 5.0
"""Range within which walkers count [m]."""

_IN_SIGHT = 1.0
"""Time for which a walker has to be in sight before it counts [s]."""

_REACH = 6.0
"""Range up to which looks at a walker count [m]."""

_NEAR = 0.8
"""Distance of a track from a walker up to which it is that walker's [m]."""

_FALSE = 1.2
"""Distance from all walkers from which on a track is nobody's [m]."""

_HEIGHTS = (0.5, 0.9, 1.3)
"""Heights over a walker's foot at which rays look for it [m]."""

_SLACK = 0.1
"""Distance before a walker's front that a ray may end at [m]."""

_DEPTH = 0.7
"""Optical depth of vegetation at which a ray ends: the median of standard exponential draws."""

Case = tuple[str, str, int]
"""Laser, world preset and seed of a drive."""


@dataclass(frozen=True)
class Moment:
    """A walker in sight at one control step.

    Attributes:
        distance: Distance from the robot [m].
        looks: Number of times that the laser has looked at it since it came into sight.
        found: True if a track is near.
        place_error: Distance of the track from the walker [m]; NaN if not found.
        velocity_error: Difference of their velocities [m/s]; NaN if not found.
    """

    distance: float
    looks: int
    found: bool
    place_error: float = np.nan
    velocity_error: float = np.nan


@dataclass
class MoverDrive:
    """Measures of a drive.

    Attributes:
        case: Laser, preset and seed.
        moments: Walkers in sight.
        duration: Duration of the drive [s].
        false_tracks: Number of tracks that were never near a walker.
        tracks: Number of tracks.
        encounters: Number of times that a walker came into sight for long enough.
        met: Number of them in which it was found at some moment.
        cost: Median processor time of the perception of movers a control step [s].
        jumps: Number of times that everything moved.
    """

    case: Case
    moments: list[Moment] = field(default_factory=list)
    duration: float = 0.0
    false_tracks: int = 0
    tracks: int = 0
    encounters: int = 0
    met: int = 0
    cost: float = 0.0
    jumps: int = 0


@dataclass
class _Sighting:
    """A walker that is in sight.

    Attributes:
        place: Place at the last step [m], shape (2,).
        looks: Number of times that the laser has looked at it.
        duration: Time for which it has been in sight within the range [s].
        is_counted: True if it counts as an encounter.
        is_met: True if it was found since.
    """

    place: NDArray[np.float64] = field(default_factory=lambda: np.full(2, np.nan))
    looks: int = 0
    duration: float = 0.0
    is_counted: bool = False
    is_met: bool = False


class MoverProbe:
    """Compares tracks with the walkers of a world, step by step.

    Attributes:
        drive: Measures so far.
    """

    def __init__(self, case: Case, robot: SimulatedRobot, movers: MoverPerception) -> None:
        """Begin a drive.

        Args:
            case: Laser, preset and seed.
            robot: Robot that drives.
            movers: Tracks.
        """
        self.drive = MoverDrive(case)
        self._rays, self._localizer, self._movers = robot.scene.rays, robot.localizer, movers
        self._eye = np.array([0.0, 0.0, robot.config.robot.lidar_height])
        self._walkers: dict[int, _Sighting] = {}
        self._nearest: dict[int, float] = {}
        self._head, self._stamp = 0.0, 0.0
        self._costs: list[float] = []

    def __call__(self, readings: SensorReadings) -> None:
        """Follow the movers, and compare."""
        begin = time.thread_time()
        self._movers.update(readings, self._localizer.track)
        self._costs.append(time.thread_time() - begin)
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        self._compare(readings, readings.truth.pose)
        self._stamp = readings.stamp
        if readings.sweeps is not None and len(readings.sweeps.head_angles):
            self._head = float(readings.sweeps.head_angles[-1])

    def _compare(self, readings: SensorReadings, pose: Pose) -> None:
        """Compare the tracks with the walkers, at the true pose."""
        tracks = self._movers.movers
        places, velocities = self._in_map(pose, tracks.places, tracks.velocities)
        rows = np.empty((0, 5)) if readings.walkers is None else readings.walkers
        there = rows[:, 3] > 0
        away = np.hypot(*(places[:, None] - rows[None, :, :2]).transpose(2, 0, 1))
        nearest = np.where(there, away, np.inf).min(axis=1, initial=np.inf)
        for number, gap in zip(tracks.numbers.astype(int).tolist(), nearest, strict=True):
            self._nearest[number] = min(self._nearest.get(number, np.inf), float(gap))
        before, self._walkers = self._walkers, {}
        for m in np.flatnonzero(there).tolist():
            distance = float(np.hypot(*(rows[m, :2] - pose.position[:2])))
            if distance > _REACH or not self._sees(pose, rows[m]):
                continue
            sighting = self._walkers[m] = before.get(m, _Sighting())
            velocity = (rows[m, :2] - sighting.place) / (readings.stamp - self._stamp)
            sighting.place = rows[m, :2]
            sighting.looks += self._is_looked_at(readings, pose, rows[m])
            sighting.duration += readings.stamp - self._stamp
            if distance > MAX_RANGE:
                sighting.duration = 0.0
            elif sighting.duration >= _IN_SIGHT:
                self._moment(sighting, distance, away[:, m], velocities - velocity)

    def _is_looked_at(
        self, readings: SensorReadings, pose: Pose, walker: NDArray[np.float64]
    ) -> bool:
        """Return True if a cloud came, or a turning laser's plane has passed a walker."""
        if readings.sweeps is None or not len(readings.sweeps.head_angles):
            return bool(readings.frames)
        offset = walker[:2] - pose.position[:2]
        bearing = float(np.arctan2(offset[1], offset[0])) - pose.yaw
        head = float(readings.sweeps.head_angles[-1])
        return math.floor((head - bearing) / math.pi) != math.floor(
            (self._head - bearing) / math.pi
        )

    def _moment(
        self,
        sighting: "_Sighting",
        distance: float,
        away: NDArray[np.float64],
        errors: NDArray[np.float64],
    ) -> None:
        """Note a walker in sight.

        Args:
            sighting: Sighting of the walker.
            distance: Distance from the robot [m].
            away: Distances of the tracks from the walker [m], shape (k,).
            errors: Differences of their velocities from the walker's [m/s], shape (k, 2).
        """
        found = bool(away.min(initial=np.inf) < _NEAR)
        self.drive.encounters += not sighting.is_counted
        self.drive.met += found and not sighting.is_met
        sighting.is_counted, sighting.is_met = True, sighting.is_met or found
        moment = Moment(distance, sighting.looks, found)
        if found:
            best = int(away.argmin())
            error = float(np.hypot(*errors[best]))
            moment = replace(moment, place_error=float(away[best]), velocity_error=error)
        self.drive.moments.append(moment)

    def _in_map(
        self, pose: Pose, places: NDArray[np.float64], velocities: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places and velocities of ``odom`` as they are seen from the true pose."""
        odometry = self._localizer.odometry
        turn = pose.yaw - odometry.yaw
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, s], [-s, c]])
        return (
            (places - odometry.position[:2]) @ rotation + pose.position[:2],
            velocities @ rotation,
        )

    def _sees(self, pose: Pose, walker: NDArray[np.float64]) -> bool:
        """Return True if two of three rays to a walker meet nothing before it."""
        eye = pose.position + self._eye
        targets = walker[:3] + np.array([[0.0, 0.0, height] for height in _HEIGHTS]) - eye
        lengths = np.linalg.norm(targets, axis=1)
        rays = np.column_stack([np.tile(eye, (3, 1)), targets / lengths[:, None]])
        depths = np.full(3, _DEPTH, dtype=np.float32)
        ranges, _ = self._rays.cast(rays.astype(np.float32), depths)
        return int((ranges > lengths - walker[3] - _SLACK).sum()) >= 2

    def finish(self, duration: float) -> MoverDrive:
        """Return the measures of the whole drive of a duration [s]."""
        drive, gaps = self.drive, np.array(list(self._nearest.values()))
        drive.duration, drive.tracks = duration, len(gaps)
        drive.false_tracks = int((gaps > _FALSE).sum())
        # The first steps compile.
        drive.cost = float(np.median(self._costs))
        drive.jumps = self._movers.jumps
        return drive
