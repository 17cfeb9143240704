"""Tracks of round movers in the scans of a planar laser.

Each scan is cut where neighbouring hits lie apart; a piece that a circle of a mover's size fits is
one that may move. Circles are followed from scan to scan; see ``navigation.mover_tracks``.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.navigation.mover_tracks import MoverTracks, TrackedMovers, TrackLaw
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.scan_memory import (
    COLUMNS,
    PROBES,
    RADIUS,
    PassLaw,
    ScanMemory,
    X,
    Y,
)
from terrain.kernel import kernel


class CircleTracksConfig(BaseModel):
    """Settings of ``CircleTracks``, all of them assumptions.

    Attributes:
        max_range: Largest range of a hit that counts [m].
        cluster_gap: Distance of neighbouring hits from which on they belong to two things [m], for
            beams that are close together.
        cluster_spacings: Number of times that the distance of neighbouring beams at the range of a
            hit is added to it.
        corner_depth: Least distance of a hit behind nearer ones on both sides [m] at which a piece
            that no circle fits is cut in two.
        min_hits: Fewest hits of a circle.
        radius_range: Smallest and largest radius [m].
        max_residual: Largest root mean square distance of the hits from their circle [m].
        gate: Largest distance of a circle from where its track expects it [m].
        radius_gate: Largest difference of their radii [m].
        velocity_gain: Share of the velocity between the last two scans in the mean; in the first
            scans all velocities count alike.
        confirmation_scans: Number of scans after which a track counts.
        coasting_scans: Number of scans that it goes on without being seen.
        min_speed: Speed from which on it moves [m/s].
        min_travel: Distance from where it was first seen that a track has to have been at [m].
        memory: Time for which scans are remembered [s].
        passes: Duration of those of them that have to show that a track moves, by beams that pass
            its hits [s]; 0 believes each track that is fast enough. It is believed until all that
            showed it are forgotten.
        probe_depth: Distance behind a hit, towards the middle of its circle, of the place that
            beams pass [m]: from aside what is hit lies at the edge of what stands.
        pass_margin: Distance behind that place that they have to reach [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_range: float = Field(default=6.0, gt=0)
    cluster_gap: float = Field(default=0.06, gt=0)
    cluster_spacings: float = Field(default=1.0, ge=0)
    corner_depth: float = Field(default=0.03, gt=0)
    min_hits: int = Field(default=5, ge=3)
    radius_range: tuple[float, float] = (0.1, 0.8)
    max_residual: float = Field(default=0.03, gt=0)
    gate: float = Field(default=0.25, gt=0)
    radius_gate: float = Field(default=0.15, gt=0)
    velocity_gain: float = Field(default=0.5, gt=0, le=1)
    confirmation_scans: int = Field(default=4, ge=2)
    coasting_scans: int = Field(default=5, ge=0)
    min_speed: float = Field(default=0.1, ge=0)
    min_travel: float = Field(default=0.2, ge=0)
    memory: float = Field(default=1.5, gt=0)
    passes: float = Field(default=0.3, ge=0)
    probe_depth: float = Field(default=0.05, ge=0)
    pass_margin: float = Field(default=0.1, gt=0)


class _Fit(NamedTuple):
    """Numbers of ``CircleTracksConfig`` that the compiled search for circles depends on."""

    max_range: float
    cluster_gap: float
    cluster_angle: float
    min_hits: int
    smallest: float
    largest: float
    max_residual: float
    probe_depth: float
    corner_depth: float


class CircleTracks:
    """Follows the circles in the scans of one robot.

    Attributes:
        config: Settings.
    """

    def __init__(
        self, lidar: PlanarLidarConfig, period: float, config: CircleTracksConfig | None = None
    ) -> None:
        """Begin without tracks.

        Args:
            lidar: Laser.
            period: Time between two scans [s].
            config: Settings.
        """
        self.config = config = config or CircleTracksConfig()
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        self._bearings = lidar.bearings
        max_range = min(config.max_range, lidar.max_range * _NEARLY)
        self._fit = _Fit(
            max_range,
            config.cluster_gap,
            config.cluster_spacings * math.radians(lidar.resolution_deg),
            config.min_hits,
            *config.radius_range,
            config.max_residual,
            config.probe_depth,
            config.corner_depth,
        )
        law = TrackLaw(
            config.gate, config.radius_gate, config.velocity_gain, config.coasting_scans, period
        )
        self._tracks = MoverTracks(
            law, config.confirmation_scans, config.min_speed, config.min_travel
        )
        passes = PassLaw(config.pass_margin, config.gate, max_range)
        self._remembered = max(2, round(config.memory / period))
        self._least = math.ceil(config.passes / period - _ROUNDING)
        self._memory = ScanMemory(self._bearings, self._remembered, period, passes)
        self._trusts: dict[float, int] = {}

    def reset(self) -> None:
        """Forget all tracks."""
        self._tracks.reset()
        self._memory.reset()
        self._trusts = {}

    def update(self, pose: LaserPose, ranges: NDArray[np.float64]) -> TrackedMovers:
        """Take a scan, and return what moves.

        Args:
            pose: Pose of the robot.
            ranges: Range of each beam [m], shape (b,); what met nothing is the largest range or
                more, or no number.
        """
        eye, ranges = self._mount.on(pose), np.asarray(ranges, dtype=np.float64)
        circles = circles_of(ranges, self._bearings, eye, self._fit)
        tracks = self._tracks.update(circles[:, :PROBES])
        self._memory.take(eye, ranges, circles)
        return tracks.select(self._are_shown(tracks))

    def _are_shown(self, tracks: TrackedMovers) -> NDArray[np.bool_]:
        """Return True for each track that scans of late show to move, shape (k,)."""
        passes = self._memory.count_passes(tracks.places, tracks.velocities)
        trusts = {number: trust - 1 for number, trust in self._trusts.items() if trust > 1}
        for number, count in zip(tracks.numbers.tolist(), passes.tolist(), strict=True):
            if count >= self._least:
                trusts[number] = self._remembered
        self._trusts = trusts
        return np.array([number in trusts for number in tracks.numbers.tolist()], dtype=np.bool_)


_ROUNDING = 1e-6
"""Share of a period that counts as none."""

_NEARLY = 1 - 1e-4
"""Share of the largest range from which on a beam has met nothing, in single precision."""


@kernel
def circles_of(
    ranges: NDArray[np.float64], bearings: NDArray[np.float64], eye: LaserPose, fit: _Fit
) -> NDArray[np.float64]:
    """Return the circles in a scan with their probes, see ``scan_memory``, shape (k, 9).

    Args:
        ranges: Range of each beam [m], shape (b,).
        bearings: Bearing of each beam from the laser's heading, in their order [rad], shape (b,).
        eye: Pose of the laser.
        fit: Limits of what counts as a circle.
    """
    count = len(ranges)
    points = np.empty((count, 2))
    for i in range(count):
        points[i, 0] = eye.x + ranges[i] * np.cos(eye.yaw + bearings[i])
        points[i, 1] = eye.y + ranges[i] * np.sin(eye.yaw + bearings[i])
    # The scan begins anew at a cut, so that nothing is cut where a full turn closes. The first
    # beam of a laser that sees less lies far from the last one, which is a cut, too.
    first = 0
    while first < count and not _is_cut(first, points, ranges, fit):
        first += 1
    circles, pieces = np.empty((count, COLUMNS)), np.empty((count, 2), dtype=np.int64)
    size, begin = 0, first
    for i in range(first + 1, first + count + 1):
        if i < first + count and not _is_cut(i % count, points, ranges, fit):
            continue
        pieces[0, 0], pieces[0, 1], left = begin, i, 1
        begin = i
        if not 0.0 < ranges[pieces[0, 0] % count] < fit.max_range:
            continue
        while left > 0:
            left -= 1
            start, end = pieces[left]
            if end - start < fit.min_hits:
                continue
            x, y, radius = _circle(start, end, points, eye, fit)
            if radius > 0.0:
                circles[size, X], circles[size, Y], circles[size, RADIUS] = x, y, radius
                _add_probes(circles[size], start, end, points, fit.probe_depth)
                size += 1
                continue
            corner = _corner(start, end, ranges, fit.corner_depth)
            if corner > start:
                pieces[left, 0], pieces[left, 1] = start, corner
                pieces[left + 1, 0], pieces[left + 1, 1] = corner, end
                left += 2
    return circles[:size].copy()


@kernel
def _add_probes(
    circle: NDArray[np.float64], begin: int, end: int, points: NDArray[np.float64], depth: float
) -> None:
    """Fill in the probes of a circle, a distance inwards from three of its hits.

    Those at the ends are left out: what a beam grazes there another one misses.

    Args:
        circle: Circle, changed in place, shape (``COLUMNS``,).
        begin: First beam.
        end: Beam after the last one.
        points: Places of the hits [m], shape (b, 2).
        depth: Distance [m].
    """
    inwards = min(depth / circle[RADIUS], 1.0)
    for quarter in (1, 2, 3):
        hit = points[(begin + quarter * (end - begin) // 4) % len(points)]
        probe = PROBES + 2 * (quarter - 1)
        circle[probe] = hit[0] + inwards * (circle[X] - hit[0])
        circle[probe + 1] = hit[1] + inwards * (circle[Y] - hit[1])


@kernel
def _corner(begin: int, end: int, ranges: NDArray[np.float64], depth: float) -> int:
    """Return the hit that lies farthest behind nearer ones on both sides, -1 for none.

    Two round things that touch, or of which one hides a part of the other, meet there.

    Args:
        begin: First beam.
        end: Beam after the last one.
        ranges: Range of each beam [m], shape (b,).
        depth: Least distance behind the nearest hits on both sides [m].
    """
    count, n, which = len(ranges), end - begin, -1
    after = np.empty(n)
    nearest = np.inf
    for k in range(n - 1, -1, -1):
        nearest = min(nearest, ranges[(begin + k) % count])
        after[k] = nearest
    nearest = np.inf
    for k in range(n):
        here = ranges[(begin + k) % count]
        nearest = min(nearest, here)
        behind = here - max(nearest, after[k])
        if behind > depth:
            depth, which = behind, begin + k
    return which


@kernel
def _is_cut(i: int, points: NDArray[np.float64], ranges: NDArray[np.float64], fit: _Fit) -> bool:
    """Return True if a beam does not belong to what the beam before it met."""
    if not (0.0 < ranges[i] < fit.max_range and 0.0 < ranges[i - 1] < fit.max_range):
        return True
    dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
    gap = fit.cluster_gap + fit.cluster_angle * min(ranges[i], ranges[i - 1])
    return bool(dx * dx + dy * dy > gap * gap)


@kernel
def _circle(
    begin: int, end: int, points: NDArray[np.float64], eye: LaserPose, fit: _Fit
) -> tuple[float, float, float]:
    """Return the circle of least algebraic squares through hits (Kasa 1976), radius 0 for none.

    Args:
        begin: First beam.
        end: Beam after the last one; both count on after the last beam of a turn.
        points: Places of the hits [m], shape (b, 2).
        eye: Pose of the laser.
        fit: Limits of what counts as a circle.
    """
    count, n = len(points), end - begin
    mx = my = 0.0
    for i in range(begin, end):
        mx += points[i % count, 0] / n
        my += points[i % count, 1] / n
    uu = uv = vv = u3 = v3 = 0.0
    for i in range(begin, end):
        u, v = points[i % count, 0] - mx, points[i % count, 1] - my
        square = u * u + v * v
        uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
        u3, v3 = u3 + u * square, v3 + v * square
    det = uu * vv - uv * uv
    if det <= 1e-12:
        return 0.0, 0.0, 0.0
    u, v = 0.5 * (u3 * vv - v3 * uv) / det, 0.5 * (v3 * uu - u3 * uv) / det
    radius = np.sqrt(u * u + v * v + (uu + vv) / n)
    # What bulges away from the laser is a hollow.
    is_hollow = u * (mx - eye.x) + v * (my - eye.y) <= 0.0
    if is_hollow or not fit.smallest <= radius <= fit.largest:
        return 0.0, 0.0, 0.0
    squares = 0.0
    for i in range(begin, end):
        away = np.hypot(points[i % count, 0] - mx - u, points[i % count, 1] - my - v) - radius
        squares += away * away
    if squares > n * fit.max_residual * fit.max_residual:
        return 0.0, 0.0, 0.0
    return mx + u, my + v, radius
