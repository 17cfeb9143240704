"""The geometry of the vertical sweeps, used both to cast beams and to place what they measured."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import PoseTrack, interpolate
from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import inlined_kernel, kernel
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
        self._poses = np.empty((0, 7))
        self._times = np.empty(0)

    def room(
        self, count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
        """Return memory for times, poses (count, 7) and rays (count, 6), the same at each call."""
        if len(self._rays) < count:
            self._times, self._poses = np.empty(count), np.empty((count, 7))
            self._rays = np.empty((count, 6), dtype=np.float32)
        return self._times[:count], self._poses[:count], self._rays[:count]

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
    times, poses, rays = tables.room(sweeps.ranges.size)
    heads = _sines(sweeps.head_angles)
    steps, tilts = tables.of(sweeps)
    offsets = np.arange(sweeps.ranges.shape[1]) * sweeps.beam_period
    np.add.outer(sweeps.stamps, offsets, out=times.reshape(sweeps.ranges.shape))
    interpolate(*track.table, times, poses)
    _rays(poses, heads, steps, tilts, lidar_height, rays)
    return rays


@kernel
def _leave(rows, stamps, period, beams, times):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write when some beams leave."""
    for place, k in enumerate(rows):
        times[place] = stamps[k // beams] + (k % beams) * period


@kernel
def _rays(poses, heads, steps, tilts, height, rays):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Turn each beam from the head's plane into the base and into the map."""
    beams = tilts.shape[1]
    for sweep in range(len(heads)):
        for beam in range(beams):
            k = sweep * beams + beam
            origin, direction = _ray(sweep, beam, k, poses, heads, steps, tilts, height)
            for c in range(3):
                rays[k, c], rays[k, 3 + c] = origin[c], direction[c]


@kernel
def _places(rows, poses, heads, steps, tilts, height, ranges):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where some beams ended, float32, shape (k, 3); ``poses`` are those of the rows."""
    points = np.empty((len(rows), 3), dtype=np.float32)
    for place, k in enumerate(rows):
        sweep, beam = divmod(k, tilts.shape[1])
        origin, direction = _ray(sweep, beam, place, poses, heads, steps, tilts, height)
        for c in range(3):
            points[place, c] = origin[c] + ranges[k] * direction[c]
    return points


@inlined_kernel
def _ray(sweep, beam, row, poses, heads, steps, tilts, height):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where a beam leaves at the pose of a row, and where it points, in the map."""
    plane = sweep % len(tilts)
    outward, c = tilts[plane, beam, 0], tilts[plane, beam, 1]
    a = outward * (heads[sweep, 1] * steps[beam, 1] - heads[sweep, 0] * steps[beam, 0])
    b = outward * (heads[sweep, 0] * steps[beam, 1] + heads[sweep, 1] * steps[beam, 0])
    x, y, z, w = poses[row, 3], poses[row, 4], poses[row, 5], poses[row, 6]
    r02, r12 = 2 * (x * z + y * w), 2 * (y * z - x * w)
    r22 = 1 - 2 * (x * x + y * y)
    direction = (
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + r02 * c,
        2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + r12 * c,
        2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + r22 * c,
    )
    origin = (
        poses[row, 0] + r02 * height,
        poses[row, 1] + r12 * height,
        poses[row, 2] + r22 * height,
    )
    return origin, direction


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
        lidar_height: Optical centre above ``base_footprint`` [m], where the sweeps tell no mounting
            in ``base_link``.
        tables: The caller's.
        rows: Which beams, counted through all sweeps; None for those that returned.

    Returns:
        Points in the map [m], float32, shape (m, 3), and their times [s], shape (m,).
    """
    if rows is None:
        rows = np.flatnonzero(np.isfinite(sweeps.ranges))
    heads, ranges = _sines(sweeps.head_angles), sweeps.ranges.ravel()
    _, poses, _ = tables.room(len(rows))
    times = np.empty(len(rows))
    _leave(rows, sweeps.stamps, sweeps.beam_period, sweeps.ranges.shape[1], times)
    interpolate(*track.table, times, poses)
    if sweeps.mounting is not None:
        lift = lidar_height if sweeps.frame == "sensor" else 0.0
        _mount(poses, sweeps.mounting, lift, len(rows))
        lidar_height = 0.0
    return _places(rows, poses, heads, *tables.of(sweeps), lidar_height, ranges), times


@kernel
def _mount(poses, mounting, lift, count):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Turn poses of the base into those of a head that is mounted on it, in place."""
    a, b, c = mounting[0], mounting[1], mounting[2] + lift
    u, v, s, t = mounting[3], mounting[4], mounting[5], mounting[6]
    for k in range(count):
        x, y, z, w = poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6]
        poses[k, 0] += (
            (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + 2 * (x * z + y * w) * c
        )
        poses[k, 1] += (
            2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - x * w) * c
        )
        poses[k, 2] += (
            2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + (1 - 2 * (x * x + y * y)) * c
        )
        poses[k, 3] = w * u + x * t + y * s - z * v
        poses[k, 4] = w * v - x * s + y * t + z * u
        poses[k, 5] = w * s + x * v - y * u + z * t
        poses[k, 6] = w * t - x * u - y * v - z * s


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


@kernel
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
