"""Movers around an off-road robot: beams to free space to detections to tracks.

The paper's laser turns a vertical plane about the vertical axis: it sees a direction once in
seconds, and a mover has gone on by metres when it is seen again. A 3D laser sees all of it ten
times a second. Both feed the same grid and the same tracks, with gates of their own.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.free_space_grid import (
    CAME,
    KIND,
    STANDS,
    FreeSpaceConfig,
    FreeSpaceGrid,
    Rays,
)
from andabata.navigation.look_rays import LookConfig, LookRays
from andabata.navigation.mover_detector import (
    DetectorLaw,
    MoverDetectorConfig,
    detect_movers,
)
from andabata.navigation.mover_tracks import MoverTracks, TrackedMovers, TrackLaw

_ANY_TIME = (-np.inf, np.inf)
"""Times of complete clusters in a cloud: all of them."""


class TrackConfig(BaseModel):
    """What a laser's tracks begin with, their gains and gates, all of them assumptions.

    Attributes:
        detector: Settings of the detector.
        gate: Largest distance of a detection from where its track expects it [m].
        radius_gate: Largest difference of their radii [m].
        velocity_gain: Share of the velocity between the last two looks in the mean.
        coasting_time: Time for which a track goes on without being seen [s].
        first_speed: Speed by which the gate of a track that was seen once grows [m/s].
        drift_speed: Speed by which that of others grows [m/s].
        least_interval: Least time between two looks at the same mover [s].
        turn_time: Time in which the laser sees all around [s].
        confirmation_looks: Number of looks that have to see a track before it counts.
        min_speed: Speed from which on it moves [m/s].
        min_travel: Distance from where it was first seen that a track has to have been at [m]: of
            what is half hidden, or full of gaps, another part is seen each time.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    detector: MoverDetectorConfig = Field(default_factory=MoverDetectorConfig)
    gate: float = Field(default=0.3, gt=0)
    radius_gate: float = Field(default=0.35, gt=0)
    velocity_gain: float = Field(default=0.5, gt=0, le=1)
    coasting_time: float = Field(default=5.0, ge=0)
    first_speed: float = Field(default=1.2, ge=0)
    drift_speed: float = Field(default=0.3, ge=0)
    least_interval: float = Field(default=1.2, ge=0)
    turn_time: float = Field(default=3.4, ge=0)
    confirmation_looks: int = Field(default=2, ge=1)
    min_speed: float = Field(default=0.3, ge=0)
    min_travel: float = Field(default=0.0, ge=0)


def _frame_tracks() -> TrackConfig:
    """Return the settings for a laser that sees all around many times a second."""
    return TrackConfig(
        detector=MoverDetectorConfig(min_top=0.7, min_extent=0.4),
        velocity_gain=0.15,
        coasting_time=1.0,
        least_interval=0.0,
        turn_time=0.0,
        confirmation_looks=4,
        min_travel=0.3,
    )


class MoverPerceptionConfig(BaseModel):
    """Settings of the perception of movers, all of them assumptions.

    Attributes:
        free_space: Settings of the free space grid.
        turning: Settings of the tracks of a turning laser.
        frames: Settings of the tracks of a 3D laser.
        look: Beams that count.
        look_time: Time that a turning laser needs to pass a mover [s].
        settling_time: Time after which it has passed one [s].
        guard_movers: Fewest detections in a turn of the laser for everything to move.
        guard_share: Share of what came in the returns above which everything moves: the pose has
            jumped, and nothing is believed.
        max_reach: Largest doubt within which what came belongs to a mover, and not to the map [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    free_space: FreeSpaceConfig = Field(default_factory=FreeSpaceConfig)
    turning: TrackConfig = Field(default_factory=TrackConfig)
    frames: TrackConfig = Field(default_factory=_frame_tracks)
    look: LookConfig = Field(default_factory=LookConfig)
    look_time: float = Field(default=0.8, gt=0)
    settling_time: float = Field(default=0.06, ge=0)
    guard_movers: int = Field(default=6, ge=1)
    guard_share: float = Field(default=0.5, gt=0, lt=1)
    max_reach: float = Field(default=0.5, ge=0)


class _Follower(NamedTuple):
    """What finds movers in the returns of a kind of laser, and follows them.

    Attributes:
        law: Numbers of the detector.
        tracks: Tracks of what it finds.
        turn_time: Time in which the laser sees all around [s].
    """

    law: DetectorLaw
    tracks: MoverTracks
    turn_time: float


class _Look(NamedTuple):
    """Returns of one control period.

    Attributes:
        stamp: Its end [s].
        returns: Returns at body height, shape (k, 5).
        came: Number of returns of what came.
        known: Number of them and of those of what stands.
        movers: Number of detections.
    """

    stamp: float
    returns: NDArray[np.float64]
    came: int
    known: int
    movers: int = 0


class MoverPerception:
    """Follows what moves around an off-road robot, in ``odom``.

    Attributes:
        config: Settings.
        movers: Movers after the last update.
        jumps: Number of times that everything moved, and all was forgotten.
    """

    def __init__(
        self,
        config: MoverPerceptionConfig,
        lidar_height: float,
        period: float = 0.1,
        rows_deg: tuple[float, ...] = (),
    ) -> None:
        """Begin without movers.

        Args:
            config: Settings.
            lidar_height: Height of the optical centre above ``base_footprint`` [m].
            period: Control period [s].
            rows_deg: Elevations of a 3D laser's rows, increasing [deg]; none if they are unknown.
        """
        self.config = config
        self._height, self._period = lidar_height, period
        self._grid = FreeSpaceGrid(config.free_space)
        self._turning = self._follower(config.turning)
        self._frames = self._follower(config.frames)
        self._rays = LookRays(config.look, lidar_height, rows_deg)
        self._memory = max(config.look_time, config.turning.turn_time, config.frames.turn_time)
        self.reset()

    def _follower(self, config: TrackConfig) -> _Follower:
        """Return a detector and its tracks of some settings."""
        law = TrackLaw(
            config.gate,
            config.radius_gate,
            config.velocity_gain,
            round(config.coasting_time / self._period),
            self._period,
            config.first_speed,
            config.drift_speed,
            config.least_interval,
        )
        return _Follower(
            DetectorLaw.of(config.detector, self.config.free_space.cell),
            MoverTracks(law, config.confirmation_looks, config.min_speed, config.min_travel),
            config.turn_time,
        )

    def reset(self) -> None:
        """Forget everything."""
        self.jumps = 0
        self._stamp, self._is_turning = -np.inf, False
        self._forget()

    def _forget(self) -> None:
        """Forget what was seen."""
        self._grid.reset()
        self._turning.tracks.reset()
        self._frames.tracks.reset()
        self._looks: deque[_Look] = deque()
        self.movers = TrackedMovers.none()

    def update(self, readings: SensorReadings, track: PoseTrack) -> None:
        """Take in what the laser sent in a control period.

        Args:
            readings: Readings.
            track: Estimated poses in ``odom`` by stamp.
        """
        stamp, config = readings.stamp, self.config
        scans = (stamp - self._stamp) / self._period if np.isfinite(self._stamp) else 1.0
        self._stamp = stamp
        self._is_turning = readings.sweeps is not None
        if readings.sweeps is not None:
            self._take(self._rays.of_sweeps(readings.sweeps, track), stamp)
            # What the plane has passed by now, and had not at the last step.
            end = stamp - config.settling_time
            passed = (end - scans * self._period, end)
            self._follow(self._turning, config.look_time, passed, scans)
        for frame in readings.frames:
            self._take(self._rays.of_frame(frame, track), stamp)
            self._follow(self._frames, 0.0, _ANY_TIME, scans / len(readings.frames))

    @property
    def transient_places(self) -> NDArray[np.float64]:
        """Middles of the cells that no map is to keep [m], shape (k, 2).

        They are those of free space that something has left, and those to which a believed mover
        came: where it is and, with a laser that looks again after seconds only, where it was since.
        Rollouts pay for the mover itself.
        """
        movers, config = self.movers, self.config
        span = config.turning.turn_time if self._is_turning else config.frames.turn_time
        begins = movers.places - span * movers.velocities
        reach = movers.radii + config.free_space.cell + np.minimum(movers.doubts, config.max_reach)
        trails = np.column_stack([begins, movers.places, reach])
        came = self._grid.cells_that_came(np.ascontiguousarray(trails))
        return np.concatenate([self._grid.left_places(), came])

    def _take(self, rays: Rays | None, stamp: float) -> None:
        """Take beams into the grid, and keep their returns."""
        returns = np.empty((0, 5))
        if rays is not None:
            self._origin = rays.origin
            base = rays.origin - [0.0, 0.0, self._height]
            returns = self._grid.update(rays, base)
        came = int(np.count_nonzero(returns[:, KIND] == CAME))
        stands = int(np.count_nonzero(returns[:, KIND] == STANDS))
        self._looks.append(_Look(stamp, returns, came, came + stands))
        while self._looks[0].stamp < stamp - self._memory:
            self._looks.popleft()

    def _follow(
        self,
        follower: _Follower,
        span: float,
        complete: tuple[float, float],
        scans: float,
    ) -> None:
        """Detect movers in the returns of a span [s], and follow them.

        Args:
            follower: Detector and tracks.
            span: Span before the last returns from which a cluster is put together [s].
            complete: Times of the newest return of a cluster that is complete [s].
            scans: Time since the last call in control periods.
        """
        last = self._looks[-1]
        recent = [look for look in self._looks if look.stamp > last.stamp - span]
        recent = recent or [last]
        discs = np.empty((0, 3))
        if any(look.came for look in recent):
            returns = np.concatenate([look.returns for look in recent])
            discs = detect_movers(returns, self._origin, complete, follower.law)
        self._looks[-1] = last._replace(movers=len(discs))
        if self._everything_moves(follower.turn_time):
            self.jumps += 1
            self._forget()
            return
        self.movers = follower.tracks.update(discs, scans)

    def _everything_moves(self, turn_time: float) -> bool:
        """Return True if so much came in a turn of the laser [s] that the pose must have jumped."""
        turn = [look for look in self._looks if look.stamp >= self._stamp - turn_time]
        if sum(look.movers for look in turn) < self.config.guard_movers:
            return False
        came, known = sum(look.came for look in turn), sum(look.known for look in turn)
        return came > self.config.guard_share * known
