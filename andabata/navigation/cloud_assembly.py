"""Levelled 3D clouds from what a laser measured in motion (section 4.2)."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from andabata.machine.beams import BeamTables, beam_bearings, place_beams, place_points
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import Sweeps
from andabata.navigation.beam_selection import RangeLimits, is_hidden, useful_beams
from andabata.navigation.sweep_window import Part, SweepBuffer, SweepWindow
from terrain.kernel import kernel
from traversability.cloud import PointCloud, joined

_SLACK = 1.0
"""Time before the first pose or after the last within which measurements are still placed [s]."""


class CloudAssemblyConfig(BaseModel):
    """Settings of the cloud assembly.

    Attributes:
        turn: Turn of the head that makes a cloud [rad]: half a one for a vertical plane, which sees
            both sides; a whole one for a laser that sees one.
        settling_angle: Turn of the head after which a place was measured with what lies beside it
            [rad]; 0 for a head that turns faster than clouds are asked for.
        accumulation_time: Time for which a 3D laser's clouds are gathered before they replace the
            last one [s]; 0 takes each by itself, as for a laser that sends whole turns.
        max_range: Range beyond which returns are dropped [m]: the 10 m grid and what the robot
            drives until the next cloud.
        dense_range: Range below which only one beam in ``dense_stride`` is kept [m]: neighbouring
            beams fall within millimetres there.
        dense_stride: Number of beams of which one is kept below ``dense_range``. 1 keeps every
            beam: low rocks are seen by few; 3 brings the paper's 32,000 points (assumption), and
            the classifier learns with both.
        body_radius: Distance from the vertical axis within which returns are the robot's body [m].
        blind_deg: Bearings from the laser's own heading, from one to the other counter-clockwise,
            that a mast or a load hides: returns there are dropped [deg].
        max_age: Age from which the robot no longer drives by a cloud [s]: one and a half times what
            the paper's laser takes for a cloud (assumption).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    turn: float = Field(default=np.pi, gt=0, le=200)
    settling_angle: float = Field(default=0.5, ge=0)
    accumulation_time: float = Field(default=0.0, ge=0, le=60)
    max_range: float = Field(default=11.5, gt=0)
    dense_range: float = Field(default=2.5, ge=0)
    dense_stride: int = Field(default=1, ge=1)
    body_radius: float = Field(default=0.4, ge=0)
    blind_deg: tuple[tuple[FiniteFloat, FiniteFloat], ...] = ()
    max_age: float = Field(default=5.0, gt=0)

    @property
    def sight(self) -> float:
        """Range that a simulation has to cover [m]: noise moves returns across ``max_range``."""
        return self.max_range + 0.5


class CloudAssembler:
    """Gathers placed beams for a (half) turn of the head; the complete cloud replaces the last one.

    There is no cloud before the first half turn is complete: the robot stands still until then.

    Attributes:
        cloud: Latest complete cloud, in ``odom``, None before the first.
        refused: Number of parts that were left out because no pose is known at their stamps.
    """

    def __init__(self, config: CloudAssemblyConfig, lidar_height: float) -> None:
        """Begin without a cloud.

        Args:
            config: Settings.
            lidar_height: Height of the optical centre above ``base_footprint`` [m].
        """
        self._config = config
        self._height = lidar_height
        self._tables = BeamTables()
        self._moved = np.empty(0, dtype=np.float32)
        self._window = SweepBuffer()
        self.reset()

    def reset(self) -> None:
        """Forget the cloud and what was gathered."""
        self.cloud: PointCloud | None = None
        self.refused = 0
        self._newest = -np.inf
        self._parts: list[PointCloud] = []
        self._window.clear()
        self._settled = -np.inf
        self._turn: int | None = None
        self._begin = 0.0

    def add(self, sweeps: Sweeps, track: PoseTrack) -> None:
        """Place the beams of sweeps with the poses of their own instants.

        Args:
            sweeps: New sweeps, oldest first.
            track: Estimated poses by stamp.
        """
        for k, angle in enumerate(sweeps.head_angles.tolist()):
            turn = math.floor(angle / self._config.turn + 1e-9)
            if self._turn is None:
                self._turn, self._begin = turn, angle
            elif turn != self._turn:
                self._gather(_slice(sweeps, 0, k), track)
                self._complete()
                self._turn, self._begin = turn, turn * self._config.turn
                self.add(_slice(sweeps, k, len(sweeps.stamps)), track)
                return
        self._gather(sweeps, track)

    def _gather(self, sweeps: Sweeps, track: PoseTrack) -> None:
        """Keep the useful beams of some sweeps of one half turn."""
        stamps = sweeps.stamps
        if not len(stamps) or not self._placeable(float(stamps[0]), float(stamps[-1]), track):
            return
        rows = _rows_kept(sweeps, self._config, self._tables)
        points, times = place_beams(sweeps, track, self._height, self._tables, rows)
        classes = None if sweeps.classes is None else sweeps.classes.ravel()[rows]
        cloud = PointCloud(points, "odom", times, classes)
        self._parts.append(cloud)
        if len(rows):
            self._keep(Part(cloud, cloud.newest, float(sweeps.head_angles[-1])))

    def _keep(self, part: Part) -> None:
        """Keep a part of the last half turn of the head."""
        window, config = self._window, self._config
        window.append(part)
        while abs(part.angle - window.parts[0].angle) > config.turn:
            window.remove_oldest()
        for past in reversed(window.parts):
            if abs(part.angle - past.angle) >= config.settling_angle:
                self._settled = past.newest
                break

    def add_frame(self, frame: PointCloud, track: PoseTrack) -> None:
        """Place the points of a 3D laser's cloud with the poses of their own instants.

        Args:
            frame: Points with times, in the laser's or the base's frame.
            track: Estimated poses by stamp.

        Raises:
            ValueError: If the frame is neither, or the points have no times.
        """
        config = self._config
        above = self._height if frame.frame == "sensor" else 0.0
        x, y, z = frame.points.T
        outward = np.hypot(x, y)
        distance = np.hypot(outward, z + np.float32(above - self._height))
        seen = (distance < config.max_range) & (outward > config.body_radius)
        if config.blind_deg:
            seen &= ~is_hidden(np.arctan2(y, x), config.blind_deg)
        kept = frame.select(seen)
        points = place_points(kept, track, self._height)
        if kept.stamps is None or not len(points):
            return
        first, last = float(kept.stamps.min()), float(kept.stamps.max())
        if not self._placeable(first, last, track):
            return
        if not self._parts or first - self._begin > config.accumulation_time + config.max_age:
            self._parts, self._begin = [], first
        self._parts.append(PointCloud(points, "odom", kept.stamps))
        if last - self._begin >= config.accumulation_time:
            self._window.clear()
            for cloud in self._parts:
                self._window.append(Part(cloud, cloud.newest))
            self._settled = last
            self._replace()

    def _placeable(self, first: float, last: float, track: PoseTrack) -> bool:
        """Return True if poses are known from one stamp to another [s]; count it if not."""
        good = first >= track.earliest - _SLACK and last <= track.latest + _SLACK
        self.refused += not good
        return good

    def _complete(self) -> None:
        """Make the gathered parts the cloud, unless they began in the middle of a half turn."""
        began_whole = self._turn is not None and self._begin - self._turn * self._config.turn < 0.05
        if self._parts and began_whole:
            self._replace()
        self._parts = []

    def _replace(self) -> None:
        """Make the gathered parts the cloud."""
        self.cloud = joined(self._parts)
        assert self.cloud.stamps is not None
        self._newest = float(self.cloud.stamps.max(initial=-np.inf))
        self._parts = []

    @property
    def window(self) -> SweepWindow:
        """Swath of the last half turn of the head, or of a 3D laser's last clouds."""
        return self._window.window(self._settled)

    def relative(self, pose: Pose) -> PointCloud:
        """Return the cloud moved into the levelled ``base_footprint`` of a pose.

        Raises:
            ValueError: If no cloud is complete yet.
        """
        if self.cloud is None:
            raise ValueError("cloud: expected a complete one, got none; wait for half a turn")
        return _relative_to(pose, self.cloud)

    def around(self, pose: Pose) -> NDArray[np.float32]:
        """Return the points of ``relative`` in memory that the next call writes to.

        All x lie together in memory, then all y, then all z, as in ``PointCloud.xyz``.

        Raises:
            ValueError: If no cloud is complete yet.
        """
        if self.cloud is None:
            raise ValueError("cloud: expected a complete one, got none; wait for half a turn")
        xyz = self.cloud.xyz
        if len(self._moved) < xyz.size:
            self._moved = np.empty(xyz.size, dtype=np.float32)
        moved = self._moved[: xyz.size].reshape(xyz.shape)
        _move_to_base(xyz, pose.position, pose.yaw, moved)
        return moved.T

    def is_stale(self, stamp: float) -> bool:
        """Return True if there is no cloud at ``stamp`` [s] to drive by."""
        return self.cloud_age(stamp) > self._config.max_age

    def cloud_age(self, stamp: float) -> float:
        """Return the age of the cloud's newest point at ``stamp`` [s]; infinity without a cloud."""
        return stamp - self._newest


def assembled_turn(
    config: CloudAssemblyConfig,
    lidar_height: float,
    sweeps: Sweeps,
    tracks: Sequence[PoseTrack],
    pose: Pose,
) -> tuple[PointCloud, list[NDArray[np.float32]]]:
    """Return what ``CloudAssembler`` gathers in a head's first (half) turn, by several tracks.

    Which beams are kept does not depend on the poses: they are chosen once.

    Args:
        config: Settings of the assembly.
        lidar_height: Height of the optical centre above ``base_footprint`` [m].
        sweeps: Sweeps from the begin of a (half) turn on; those of the next one are left out.
        tracks: Poses by stamp, of which the first track places the cloud.
        pose: Pose into whose levelled ``base_footprint`` the cloud is moved.

    Returns:
        The cloud as ``CloudAssembler.relative`` returns it, and its points in the frame of each
        track [m], float32, shape (n, 3).
    """
    turns = np.floor(sweeps.head_angles / config.turn + 1e-9)
    sweeps = _slice(sweeps, 0, int(np.searchsorted(turns, turns[0], side="right")))
    tables = BeamTables()
    rows = _rows_kept(sweeps, config, tables)
    classes = None if sweeps.classes is None else sweeps.classes.ravel()[rows]
    placed = [place_beams(sweeps, track, lidar_height, tables, rows) for track in tracks]
    points, times = placed[0]
    cloud = _relative_to(pose, PointCloud(points, "odom", times, classes))
    return cloud, [points for points, _ in placed]


def _rows_kept(
    sweeps: Sweeps, config: CloudAssemblyConfig, tables: BeamTables
) -> NDArray[np.int64]:
    """Return the numbers of the beams that a cloud keeps, counted through all sweeps."""
    limits = RangeLimits(
        config.max_range, config.body_radius, config.dense_range, config.dense_stride
    )
    rows = useful_beams(sweeps.ranges, tables.sin_cos(sweeps)[1], limits)
    if config.blind_deg:
        rows = rows[~is_hidden(beam_bearings(sweeps, rows), config.blind_deg)]
    return rows


def _relative_to(pose: Pose, cloud: PointCloud) -> PointCloud:
    """Return a cloud of ``odom`` moved into the levelled ``base_footprint`` of a pose."""
    points = np.empty_like(cloud.points)
    _move_to_base(cloud.points.T, pose.position, pose.yaw, points.T)
    return PointCloud(points, "base_footprint", cloud.stamps, cloud.classes)


@kernel
def _move_to_base(
    xyz: NDArray[np.float32],
    position: NDArray[np.float64],
    yaw: float,
    moved: NDArray[np.float32],
) -> None:
    """Write points of ``odom`` as they lie in the levelled base at a pose.

    Args:
        xyz: x, y and z of the points [m], shape (3, n).
        position: Position of the base in ``odom`` [m], shape (3,).
        yaw: Heading there [rad].
        moved: Output, x, y and z in the base [m], shape (3, n).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    for k in range(xyz.shape[1]):
        x, y = xyz[0, k] - position[0], xyz[1, k] - position[1]
        moved[0, k], moved[1, k] = c * x + s * y, c * y - s * x
        moved[2, k] = xyz[2, k] - position[2]


def _slice(sweeps: Sweeps, start: int, stop: int) -> Sweeps:
    """Return some of the sweeps."""
    return Sweeps(
        sweeps.stamps[start:stop],
        sweeps.head_angles[start:stop],
        sweeps.head_rate,
        sweeps.beam_period,
        sweeps.elevations if sweeps.elevations.ndim == 1 else sweeps.elevations[start:stop],
        sweeps.ranges[start:stop],
        None if sweeps.classes is None else sweeps.classes[start:stop],
        sweeps.mounting,
        sweeps.frame,
    )
