"""Geometry of the vertical sweeps: beams in the map, and points from measured ranges.

Each beam has the pose of its own instant (motion compensation, "deskewing"). The same formula
serves the simulated laser, which casts the rays, and the cloud assembly, which places the returns.

A beam's direction in the head's plane is its elevation, the plane's direction in the base is the
head's angle: both are rotations about an axis, so that the direction follows from sines of sums.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import PoseRow, PoseTrack, interpolate
from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import inlined_kernel, kernel
from traversability.cloud import PointCloud

SIN, COS = range(2)
"""Rows of a table of sines and cosines."""

_QX, _QY, _QZ, _QW = 3, 4, 5, 6
"""Components of a pose's quaternion; x, y, z [m] come before."""

_BLOCK = 256
"""Number of beams whose poses are found at once: they stay in the processor's fastest memory."""

_NOT_MOUNTED = np.empty(0)
"""Pose in the base of a head whose poses are tracked themselves."""


class BeamTables:
    """Cache of a laser's sines and cosines, and buffers for its rays.

    The tables are computed again only if the beams change. The sine of a sum of angles then takes
    two products: calls of sine and cosine would be three quarters of the work.
    """

    def __init__(self) -> None:
        """Begin without beams."""
        self._elevations: NDArray[np.float32] | None = None
        self._step = np.nan
        self._times, self._rays = np.empty(0), np.empty((6, 0), dtype=np.float32)

    def buffers(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """Return buffers for times (count,) and rays (6, count), the same for the same count.

        A component's numbers lie together, so that the compiler can pack the loop that fills them.

        Args:
            count: Number of beams.
        """
        if len(self._times) != count:
            self._times, self._rays = np.empty(count), np.empty((6, count), dtype=np.float32)
        return self._times, self._rays

    def sin_cos(self, sweeps: Sweeps) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return sine and cosine of the head's rotation to each beam, and of the elevations.

        Args:
            sweeps: Sweeps whose beams are cast or placed.

        Returns:
            Rotations, shape (2, b), and elevations from the zenith, shape (1 or s, 2, b).
        """
        step = sweeps.head_rate * sweeps.beam_period
        if sweeps.elevations is not self._elevations or step != self._step:
            self._elevations, self._step = sweeps.elevations, step
            turns = np.arange(sweeps.elevations.shape[-1], dtype=np.float64) * step
            self._steps = _sin_cos(turns)
            self._tilts = _sin_cos(np.atleast_2d(sweeps.elevations).astype(np.float64))
        return self._steps, self._tilts


def _sin_cos(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sines and cosines as two rows in the place of each row of angles."""
    return np.stack([np.sin(angles), np.cos(angles)], axis=-2)


def beam_bearings(sweeps: Sweeps, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the bearings of beams in the laser's frame [rad], shape (k,).

    Args:
        sweeps: Sweeps that hold the beams.
        rows: Numbers of the beams, counted through all sweeps, shape (k,).
    """
    sweep, beam = np.divmod(rows, sweeps.ranges.shape[1])
    elevations = np.atleast_2d(sweeps.elevations)
    tilts = elevations[sweep % len(elevations), beam]
    heads = sweeps.head_angles[sweep] + sweeps.head_rate * sweeps.beam_period * beam
    # A plane's other half has negative elevations: it points the other way.
    return np.asarray(heads + np.where(np.sin(tilts) < 0, np.pi, 0.0))


@kernel
def _place_returns(
    rows: NDArray[np.int64],
    known: NDArray[np.float64],
    track: NDArray[np.float64],
    mounting: NDArray[np.float64],
    stamps: NDArray[np.float64],
    period: float,
    heads: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    height: float,
    ranges: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return end points [m], float32, shape (k, 3), and times [s], shape (k,), of some beams.

    Args:
        rows: Numbers of the beams, counted through all sweeps, shape (k,).
        known: Stamps of the track [s], shape (k,).
        track: Poses of the track, shape (k or more, 7).
        mounting: Pose of the head in the base, shape (7,), or ``_NOT_MOUNTED``.
        stamps: Time of each sweep's first beam [s], shape (s,).
        period: Time from beam to beam [s].
        heads: Sine and cosine of the head angle of each sweep's first beam, shape (2, s).
        steps: Sine and cosine of the head's rotation to each beam, shape (2, b).
        tilts: Sine and cosine of the elevation from the zenith, shape (1 or s, 2, b).
        height: Height of the optical centre above the poses' origin [m].
        ranges: Range of every beam of the sweeps [m], shape (s * b,).
    """
    beams = tilts.shape[2]
    points, times = np.empty((len(rows), 3), dtype=np.float32), np.empty(len(rows))
    poses, sweeps = np.empty((7, _BLOCK)), np.empty(_BLOCK, dtype=np.int64)
    x, y, z, i, j, k, w = poses
    sweep, after = 0, 1
    for begin in range(0, len(rows), _BLOCK):
        end = min(begin + _BLOCK, len(rows))
        for place in range(begin, end):
            # The sweep is searched from the last one's on, without a division for each beam.
            while rows[place] < sweep * beams:
                sweep -= 1
            while rows[place] >= (sweep + 1) * beams:
                sweep += 1
            sweeps[place - begin] = sweep
            times[place] = stamps[sweep] + (rows[place] - sweep * beams) * period
        after = interpolate(known, track, times[begin:end], poses, after)
        if len(mounting):
            _apply_mounting(poses, mounting, end - begin)
        for place in range(begin, end):
            n, column = rows[place], place - begin
            beam, tilt = n - sweeps[column] * beams, tilts[sweeps[column] % len(tilts)]
            origin, direction = beam_ray(
                (x[column], y[column], z[column], i[column], j[column], k[column], w[column]),
                (heads[SIN, sweeps[column]], heads[COS, sweeps[column]]),
                (steps[SIN, beam], steps[COS, beam]),
                (tilt[SIN, beam], tilt[COS, beam]),
                height,
            )
            for c in range(3):
                points[place, c] = origin[c] + ranges[n] * direction[c]
    return points, times


@inlined_kernel
def beam_ray(
    pose: PoseRow,
    head: tuple[float, float],
    step: tuple[float, float],
    tilt: tuple[float, float],
    height: float,
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return origin [m] and unit direction of a beam in the map; angles as sine and cosine."""
    # Direction in the base: (sin(tilt) cos(h), sin(tilt) sin(h), cos(tilt)) at the head angle
    # h = head + step, by the addition theorems.
    a = tilt[SIN] * (head[COS] * step[COS] - head[SIN] * step[SIN])
    b = tilt[SIN] * (head[SIN] * step[COS] + head[COS] * step[SIN])
    c = tilt[COS]
    # Rotation matrix of the pose times that direction; its third column also carries the height.
    x, y, z, w = pose[_QX], pose[_QY], pose[_QZ], pose[_QW]
    r02, r12 = 2 * (x * z + y * w), 2 * (y * z - x * w)
    r22 = 1 - 2 * (x * x + y * y)
    direction = (
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + r02 * c,
        2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + r12 * c,
        2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + r22 * c,
    )
    origin = pose[0] + r02 * height, pose[1] + r12 * height, pose[2] + r22 * height
    return origin, direction


def place_beams(
    sweeps: Sweeps,
    track: PoseTrack,
    lidar_height: float,
    tables: BeamTables,
    rows: NDArray[np.int64] | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return the end points of beams, each placed with the pose of its own instant.

    Args:
        sweeps: Sweeps that were measured.
        track: Estimated poses of the robot over time.
        lidar_height: Height of the optical centre above ``base_footprint`` [m], for sweeps without
            a mounting in ``base_link``.
        tables: Cache of the laser.
        rows: Numbers of the beams, counted through all sweeps; None for those with a return.

    Returns:
        Points in the map [m], float32, shape (m, 3), and their times [s], shape (m,).
    """
    if rows is None:
        rows = np.flatnonzero(np.isfinite(sweeps.ranges))
    mounting = _NOT_MOUNTED
    if sweeps.mounting is not None:
        mounting = sweeps.mounting.astype(np.float64)
        mounting[2] += lidar_height if sweeps.frame == "sensor" else 0.0
        lidar_height = 0.0
    heads, (steps, tilts) = _sin_cos(sweeps.head_angles), tables.sin_cos(sweeps)
    return _place_returns(
        rows,
        *track.table,
        mounting,
        sweeps.stamps,
        sweeps.beam_period,
        heads,
        steps,
        tilts,
        lidar_height,
        sweeps.ranges.ravel(),
    )


@kernel
def _apply_mounting(poses: NDArray[np.float64], mounting: NDArray[np.float64], count: int) -> None:
    """Replace poses of the base by those of a head that is mounted on it, in place.

    Args:
        poses: Poses of the base, component by component, shape (7, count or more).
        mounting: Pose of the head in the base, shape (7,).
        count: Number of poses.
    """
    a, b, c = mounting[0], mounting[1], mounting[2]
    u, v, s, t = mounting[_QX], mounting[_QY], mounting[_QZ], mounting[_QW]
    for k in range(count):
        # Position: that of the base plus the rotated offset.
        x, y, z, w = poses[_QX, k], poses[_QY, k], poses[_QZ, k], poses[_QW, k]
        poses[0, k] += (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + 2 * (x * z + y * w) * c
        )
        poses[1, k] += (
            2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - x * w) * c
        )
        poses[2, k] += (
            2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + (1 - 2 * (x * x + y * y)) * c
        )
        # Rotation: product of the two quaternions.
        poses[_QX, k] = w * u + x * t + y * s - z * v
        poses[_QY, k] = w * v - x * s + y * t + z * u
        poses[_QZ, k] = w * s + x * v - y * u + z * t
        poses[_QW, k] = w * t - x * u - y * v - z * s


_STILL = PoseTrack(1)
_STILL.append(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def sweeps_to_cloud(sweeps: Sweeps, tables: BeamTables) -> PointCloud:
    """Return the message of a multi-beam laser: points with times, in ``sensor``.

    The points are not motion compensated. Times are whole nanoseconds, as a message holds them.

    Args:
        sweeps: Sweeps that were measured.
        tables: Cache of the laser.
    """
    rows = np.flatnonzero(np.isfinite(sweeps.ranges))
    points, times = place_beams(sweeps, _STILL, 0.0, tables, rows)
    times = np.round(times * 1e9) / 1e9
    classes = None if sweeps.classes is None else sweeps.classes.ravel()[rows]
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
        x, y, z, w = poses[k, _QX], poses[k, _QY], poses[k, _QZ], poses[k, _QW]
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
