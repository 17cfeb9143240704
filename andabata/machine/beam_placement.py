"""Placement of what a laser measured: points from ranges, each by the pose of its own instant."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.beams import QW, QX, QY, QZ, SIN, BeamTables, beam_ray, sin_cos_of
from andabata.machine.pose import PoseTrack, interpolate
from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import kernel
from traversability.cloud import PointCloud


class BeamLimits(NamedTuple):
    """Beams that are placed.

    Attributes:
        max_range: Range from which on returns are left out [m].
        body_radius: Distance from the vertical axis up to which returns are left out [m].
        dense_range: Range up to which one beam in ``dense_stride`` is placed [m].
        dense_stride: Number of beams of which one is placed there.
    """

    max_range: float = np.inf
    body_radius: float = -np.inf
    dense_range: float = -np.inf
    dense_stride: int = 1


EVERY_RETURN = BeamLimits()
"""Limits that leave out beams without a return alone."""


class PlacedBeams(NamedTuple):
    """End points of beams.

    Attributes:
        points: Points in the map [m], float32, shape (k, 3).
        times: Their times [s], float64, shape (k,).
        rows: Numbers of the beams, counted through all sweeps, int64, shape (k,).
        newest: Time of the newest of them [s]; minus infinity for none.
    """

    points: NDArray[np.float32]
    times: NDArray[np.float64]
    rows: NDArray[np.int64]
    newest: float


def place_beams(
    sweeps: Sweeps,
    track: PoseTrack,
    lidar_height: float,
    tables: BeamTables,
    limits: BeamLimits = EVERY_RETURN,
) -> PlacedBeams:
    """Return the end points of beams, each placed with the pose of its own instant.

    Args:
        sweeps: Sweeps that were measured.
        track: Estimated poses of the robot over time.
        lidar_height: Height of the optical centre above ``base_footprint`` [m], for sweeps without
            a mounting in ``base_link``.
        tables: Cache of the laser.
        limits: Beams that are placed.
    """
    is_in_base = sweeps.mounting is not None and sweeps.frame != "sensor"
    return PlacedBeams(
        *_place_beams(
            *(sweeps.stamps, sweeps.beam_period, sweeps.ranges, sweeps.mounting),
            *(sin_cos_of(sweeps.head_angles), *tables.sin_cos(sweeps), limits),
            *(*track.table, 0.0 if is_in_base else lidar_height),
            tables.buffers(sweeps.ranges.size)[1],
        )
    )


@kernel
def _place_beams(
    stamps: NDArray[np.float64],
    period: float,
    ranges: NDArray[np.float32],
    mounting: NDArray[np.float64] | None,
    heads: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    limits: BeamLimits,
    known: NDArray[np.float64],
    track: NDArray[np.float64],
    height: float,
    poses: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.int64], float]:
    """Return points, times and numbers of the beams that are placed, and the newest time.

    Args:
        stamps: Time of each sweep's first beam [s], shape (s,).
        period: Time from beam to beam [s].
        ranges: Ranges of the sweeps [m], shape (s, b).
        mounting: Pose of the head in the base, shape (7,), or None.
        heads: Sine and cosine of the head angle of each sweep's first beam, shape (s, 2).
        steps: Sine and cosine of the head's rotation to each beam, shape (b, 2).
        tilts: Sine and cosine of the elevation from the zenith, shape (1 or s, b, 2).
        limits: Beams that are placed.
        known: Stamps of the poses of the track [s], shape (m,).
        track: Poses of the track, shape (m or more, 7).
        height: Height of the optical centre, or of its mounting, above the base [m].
        poses: Memory for a pose of each beam, shape (s * b or more, 7).
    """
    rows, times = _select_beams(stamps, period, ranges, tilts, limits)
    interpolate(known, track, times, poses)
    if mounting is not None:
        _apply_mounting(poses, mounting, height, len(rows))
    above = height if mounting is None else 0.0
    points = np.empty((len(rows), 3), dtype=np.float32)
    _fill_points(rows, poses, heads, steps, tilts, above, ranges, points)
    newest = -np.inf
    for time in times:
        newest = max(newest, time)
    return points, times, rows, newest


@kernel
def _select_beams(
    stamps: NDArray[np.float64],
    period: float,
    ranges: NDArray[np.float32],
    tilts: NDArray[np.float64],
    limits: BeamLimits,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the numbers of the beams within limits, counted through all sweeps, and their times.

    Args:
        stamps: Time of each sweep's first beam [s], shape (s,).
        period: Time from beam to beam [s].
        ranges: Ranges of the sweeps [m], shape (s, b).
        tilts: Sine and cosine of the beams' elevations, shape (1 or s, b, 2).
        limits: Beams that are placed.
    """
    beams, count = ranges.shape[1], 0
    rows, times = np.empty(ranges.size, dtype=np.int64), np.empty(ranges.size)
    for i in range(ranges.shape[0]):
        plane = i % len(tilts)
        for j in range(beams):
            distance = ranges[i, j]
            outward = distance * abs(tilts[plane, j, SIN])
            # NaN and what is infinitely far is no return.
            near = distance < limits.max_range and outward > limits.body_radius
            # The turning head measures the ground beside the robot again and again.
            if near and (distance > limits.dense_range or j % limits.dense_stride == 0):
                rows[count], times[count] = i * beams + j, stamps[i] + j * period
                count += 1
    return rows[:count].copy(), times[:count].copy()


@kernel
def _fill_points(
    rows: NDArray[np.int64],
    poses: NDArray[np.float64],
    heads: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    height: float,
    ranges: NDArray[np.float32],
    points: NDArray[np.float32],
) -> None:
    """Fill the end points of some beams.

    Args:
        rows: Numbers of the beams, counted through all sweeps, in order, shape (k,).
        poses: Pose of each of these beams' instants, shape (k or more, 7).
        heads: Sine and cosine of head angles, as in ``_place_beams``.
        steps: Sine and cosine of the head's rotation, as in ``_place_beams``.
        tilts: Sine and cosine of elevations, as in ``_place_beams``.
        height: Height of the optical centre above the poses' origin [m].
        ranges: Ranges of the sweeps [m], shape (s, b).
        points: Points that are filled [m], shape (k, 3).
    """
    sweep, beams = 0, ranges.shape[1]
    for place, k in enumerate(rows):
        while k >= (sweep + 1) * beams:
            sweep += 1
        beam = k - sweep * beams
        origin, direction = beam_ray(sweep, beam, place, poses, heads, steps, tilts, height)
        for c in range(3):
            points[place, c] = origin[c] + ranges[sweep, beam] * direction[c]


@kernel
def _apply_mounting(
    poses: NDArray[np.float64], mounting: NDArray[np.float64], lift: float, count: int
) -> None:
    """Replace poses of the base by those of a head that is mounted on it, in place.

    Args:
        poses: Poses of the base, shape (count or more, 7).
        mounting: Pose of the head in the base, shape (7,).
        lift: Height added to the mounting [m].
        count: Number of poses.
    """
    a, b, c = mounting[0], mounting[1], mounting[2] + lift
    u, v, s, t = mounting[QX], mounting[QY], mounting[QZ], mounting[QW]
    for k in range(count):
        # Position: that of the base plus the rotated offset.
        x, y, z, w = poses[k, QX], poses[k, QY], poses[k, QZ], poses[k, QW]
        poses[k, 0] += (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + 2 * (x * z + y * w) * c
        )
        poses[k, 1] += (
            2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - x * w) * c
        )
        poses[k, 2] += (
            2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + (1 - 2 * (x * x + y * y)) * c
        )
        # Rotation: product of the two quaternions.
        poses[k, QX] = w * u + x * t + y * s - z * v
        poses[k, QY] = w * v - x * s + y * t + z * u
        poses[k, QZ] = w * s + x * v - y * u + z * t
        poses[k, QW] = w * t - x * u - y * v - z * s


_STILL = PoseTrack(1)
_STILL.append(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def sweeps_to_cloud(sweeps: Sweeps, tables: BeamTables) -> PointCloud:
    """Return the message of a multi-beam laser: points with times, in ``sensor``.

    The points are not motion compensated. Times are whole nanoseconds, as a message holds them.

    Args:
        sweeps: Sweeps that were measured.
        tables: Cache of the laser.
    """
    points, times, rows, _ = place_beams(sweeps, _STILL, 0.0, tables)
    times = np.round(times * 1e9) / 1e9
    classes = None if sweeps.classes is None else sweeps.classes.take(rows)
    return PointCloud(points, "sensor", times, classes)


def place_points(cloud: PointCloud, track: PoseTrack, lidar_height: float) -> NDArray[np.float32]:
    """Return a 3D laser's points, each placed with the pose of its own instant.

    Args:
        cloud: Points with times, in ``sensor`` (mounted level at ``lidar_height``), ``base_link``
            (its origin where ``base_footprint``'s is) or the levelled ``base_footprint``.
        track: Estimated poses of the robot over time.
        lidar_height: Height of the optical centre above ``base_footprint`` [m].

    Returns:
        Points in the map [m], float32, shape (n, 3).

    Raises:
        ValueError: If the frame is another, or the points have no times.
    """
    if cloud.frame not in ("sensor", "base_link", "base_footprint"):
        raise ValueError(
            f"frame: expected sensor, base_link or base_footprint, got {cloud.frame!r}"
        )
    if cloud.stamps is None:
        raise ValueError("stamps: expected a time of each point, got none")
    height = lidar_height if cloud.frame == "sensor" else 0.0
    level = cloud.frame == "base_footprint"
    return _transformed(cloud.points, track.at(cloud.stamps), height, level)


@kernel
def _transformed(
    points: NDArray[np.float32], poses: NDArray[np.float64], height: float, level: bool
) -> NDArray[np.float32]:
    """Return points transformed by a pose each [m], float32, shape (n, 3).

    Args:
        points: Points [m], shape (n, 3).
        poses: Pose of each point's instant, shape (n, 7).
        height: Height added to the points [m].
        level: True to rotate by the heading alone: the points are levelled already.
    """
    out = np.empty((len(points), 3), dtype=np.float32)
    for k in range(len(points)):
        x, y, z, w = poses[k, QX], poses[k, QY], poses[k, QZ], poses[k, QW]
        if level:
            # The twist about z of a quaternion (swing-twist decomposition).
            size = np.sqrt(z * z + w * w)
            x, y, z, w = 0.0, 0.0, z / size, w / size
        a, b, c = points[k, 0], points[k, 1], points[k, 2] + height
        out[k, 0] = poses[k, 0] + (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + 2 * (x * z + y * w) * c
        )
        out[k, 1] = poses[k, 1] + (
            2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - x * w) * c
        )
        out[k, 2] = poses[k, 2] + (
            2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + (1 - 2 * (x * x + y * y)) * c
        )
    return out
