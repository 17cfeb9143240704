"""The geometry of the vertical sweeps, used both to cast beams and to place what they measured."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from andabata.machine.pose import PoseTrack, pose_at
from andabata.machine.senses import Sweeps
from traversability.cloud import PointCloud


class BeamTables:
    """Sines and cosines of a laser's beams, kept while these stay the same, and room for rays.

    A beam's direction is a sum of angles, and needs no sine of its own: that is three quarters of
    the work.
    """

    def __init__(self) -> None:
        """Begin without beams."""
        self._elevations: NDArray[np.float32] | None = None
        self._step = np.nan
        self._rays = np.empty((0, 6), dtype=np.float32)

    def room(self, count: int) -> NDArray[np.float32]:
        """Return memory for some rays, the same at each call, float32, shape (count, 6)."""
        if len(self._rays) < count:
            self._rays = np.empty((count, 6), dtype=np.float32)
        return self._rays[:count]

    def of(self, sweeps: Sweeps) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return sine and cosine of the head's turn from beam to beam, and of the elevations.

        Shapes (b, 2) and (1 or s, b, 2).
        """
        step = sweeps.head_rate * sweeps.beam_period
        if sweeps.elevations is not self._elevations or step != self._step:
            self._elevations, self._step = sweeps.elevations, step
            turns = np.arange(sweeps.elevations.shape[-1], dtype=np.float64) * step
            self._steps = _sines(turns)
            self._tilts = _sines(np.atleast_2d(sweeps.elevations).astype(np.float64))
        return self._steps, self._tilts


def _sines(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sine and cosine in a last axis of two."""
    return np.stack([np.sin(angles), np.cos(angles)], axis=-1)


def beam_rays(
    sweeps: Sweeps, track: PoseTrack, lidar_height: float, tables: BeamTables
) -> NDArray[np.float32]:
    """Return where each beam leaves and where it points, from the pose of its own instant.

    Args:
        sweeps: The sweeps; their ranges are not looked at.
        track: Where the robot is when.
        lidar_height: Optical centre above ``base_footprint`` [m].
        tables: The caller's.

    Returns:
        Origin in the map [m] and unit direction of each, float32, shape (s * b, 6), in memory that
        the next call writes to.
    """
    count = sweeps.ranges.size
    rays = tables.room(count)
    heads = _sines(sweeps.head_angles)
    steps, tilts = tables.of(sweeps)
    _rays(sweeps.stamps, sweeps.beam_period, *track.table, heads, steps, tilts, lidar_height, rays)
    return rays


@njit(cache=True, nogil=True, error_model="numpy")
def _rays(stamps, period, known, poses, heads, steps, tilts, height, rays):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Turn each beam from the head's plane into the base and into the map."""
    beams, after = tilts.shape[1], 1
    for sweep in range(len(stamps)):
        for beam in range(beams):
            pose, after = pose_at(known, poses, stamps[sweep] + beam * period, after)
            origin, direction = _ray(sweep, beam, pose, heads, steps, tilts, height)
            k = sweep * beams + beam
            for c in range(3):
                rays[k, c], rays[k, 3 + c] = origin[c], direction[c]


@njit(cache=True, nogil=True, error_model="numpy")
def _places(rows, stamps, period, known, poses, heads, steps, tilts, height, ranges):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where some beams ended, float32, shape (k, 3), and when they left."""
    beams, after = tilts.shape[1], 1
    points, times = np.empty((len(rows), 3), dtype=np.float32), np.empty(len(rows))
    for place in range(len(rows)):
        k = rows[place]
        sweep, beam = k // beams, k % beams
        times[place] = stamps[sweep] + beam * period
        pose, after = pose_at(known, poses, times[place], after)
        origin, direction = _ray(sweep, beam, pose, heads, steps, tilts, height)
        for c in range(3):
            points[place, c] = origin[c] + ranges[k] * direction[c]
    return points, times


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _ray(sweep, beam, pose, heads, steps, tilts, height):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where a beam leaves at a pose, and where it points, in the map."""
    plane = sweep % len(tilts)
    outward, c = tilts[plane, beam, 0], tilts[plane, beam, 1]
    a = outward * (heads[sweep, 1] * steps[beam, 1] - heads[sweep, 0] * steps[beam, 0])
    b = outward * (heads[sweep, 0] * steps[beam, 1] + heads[sweep, 1] * steps[beam, 0])
    px, py, pz, x, y, z, w = pose
    r02, r12 = 2 * (x * z + y * w), 2 * (y * z - x * w)
    r22 = 1 - 2 * (x * x + y * y)
    direction = (
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + r02 * c,
        2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + r12 * c,
        2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + r22 * c,
    )
    return (px + r02 * height, py + r12 * height, pz + r22 * height), direction


def place_beams(
    sweeps: Sweeps,
    track: PoseTrack,
    lidar_height: float,
    tables: BeamTables,
    rows: NDArray[np.int64] | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Place what the beams measured, each with the pose of its own instant.

    Args:
        sweeps: The sweeps.
        track: Where the robot believes it was when.
        lidar_height: Optical centre above ``base_footprint`` [m].
        tables: The caller's.
        rows: Which beams, counted through all sweeps; None for those that returned.

    Returns:
        Points in the map [m], float32, shape (m, 3), and their times [s], shape (m,).
    """
    if rows is None:
        rows = np.flatnonzero(np.isfinite(sweeps.ranges))
    heads, ranges = _sines(sweeps.head_angles), sweeps.ranges.ravel()
    steps, tilts = tables.of(sweeps)
    stamps, period = sweeps.stamps, sweeps.beam_period
    placed: tuple[NDArray[np.float32], NDArray[np.float64]] = _places(
        rows, stamps, period, *track.table, heads, steps, tilts, lidar_height, ranges
    )
    return placed


_STILL = PoseTrack(1)
_STILL.append(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def cloud_of_sweeps(sweeps: Sweeps, tables: BeamTables) -> PointCloud:
    """Return what a laser of several beams sends of its sweeps: points with times in ``sensor``.

    Times count whole nanoseconds, as a message holds them.
    """
    rows = np.flatnonzero(np.isfinite(sweeps.ranges))
    points, times = place_beams(sweeps, _STILL, 0.0, tables, rows)
    times = np.round(times * 1e9) / 1e9
    classes = None if sweeps.classes is None else sweeps.classes.ravel()[rows]
    return PointCloud(points, "sensor", times, classes)


def place_points(cloud: PointCloud, track: PoseTrack, lidar_height: float) -> NDArray[np.float32]:
    """Place a 3D laser's points, each with the pose of its own instant.

    Args:
        cloud: Points with times, in ``sensor`` (mounted level at ``lidar_height``), ``base_link``
            (its origin where ``base_footprint``'s is) or the levelled ``base_footprint``.
        track: Where the robot believes it was when.
        lidar_height: Optical centre above ``base_footprint`` [m].

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
    return _moved(cloud.points, track.at(cloud.stamps), height, level)


@njit(cache=True, nogil=True)
def _moved(points, poses, height, level):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return points turned and shifted by a pose each, by its heading alone where ``level``."""
    found = np.empty((len(points), 3), dtype=np.float32)
    for k in range(len(points)):
        x, y, z, w = poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6]
        if level:
            size = np.sqrt(z * z + w * w)
            x, y, z, w = 0.0, 0.0, z / size, w / size
        a, b, c = points[k, 0], points[k, 1], points[k, 2] + height
        found[k, 0] = poses[k, 0] + (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + 2 * (x * z + y * w) * c
        )
        found[k, 1] = poses[k, 1] + (
            2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - x * w) * c
        )
        found[k, 2] = poses[k, 2] + (
            2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + (1 - 2 * (x * x + y * y)) * c
        )
    return found
