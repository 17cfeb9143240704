"""The geometry of the vertical sweeps, used both to cast beams and to place what they measured."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from andabata.machine.pose import PoseTrack
from andabata.machine.senses import Sweeps
from traversability.cloud import PointCloud


def beam_times(sweeps: Sweeps) -> NDArray[np.float64]:
    """Return when each beam leaves [s], float64, shape (s * b,)."""
    offsets = np.arange(sweeps.elevations.shape[-1]) * sweeps.beam_period
    return (sweeps.stamps[:, None] + offsets).ravel()


def beam_rays(
    sweeps: Sweeps, poses: NDArray[np.float64], lidar_height: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where each beam leaves and where it points.

    Args:
        sweeps: The sweeps; their ranges are not looked at.
        poses: Pose of ``base_footprint`` at each beam's time: x, y, z [m], quaternion x, y, z, w,
            shape (s * b, 7).
        lidar_height: Optical centre above ``base_footprint`` [m].

    Returns:
        Origins in the map [m] and unit directions, float32, shape (s * b, 3) each.
    """
    return _rays(
        poses,
        sweeps.head_angles,
        sweeps.head_rate * sweeps.beam_period,
        np.atleast_2d(sweeps.elevations).astype(np.float64),
        lidar_height,
    )


@njit(cache=True, nogil=True)
def _rays(poses, head_angles, head_step, elevations, height):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Turn each beam from the head's plane into the base and into the map."""
    origins = np.empty((len(poses), 3), dtype=np.float32)
    directions = np.empty((len(poses), 3), dtype=np.float32)
    for k in range(len(poses)):
        origin, direction = _ray(k, poses, head_angles, head_step, elevations, height)
        for c in range(3):
            origins[k, c], directions[k, c] = origin[c], direction[c]
    return origins, directions


@njit(cache=True, nogil=True)
def _places(rows, poses, head_angles, head_step, elevations, height, ranges):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where some of the beams ended, float32, shape (k, 3)."""
    points = np.empty((len(rows), 3), dtype=np.float32)
    for place, k in enumerate(rows):
        origin, direction = _ray(k, poses, head_angles, head_step, elevations, height)
        for c in range(3):
            points[place, c] = origin[c] + ranges[k] * direction[c]
    return points


@njit(cache=True, nogil=True, inline="always")
def _ray(k, poses, head_angles, head_step, elevations, height):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where beam ``k`` leaves and where it points, in the map."""
    sweep, beam = divmod(k, elevations.shape[1])
    angle, elevation = (
        head_angles[sweep] + head_step * beam,
        elevations[sweep % len(elevations), beam],
    )
    outward = np.sin(elevation)
    a, b, c = outward * np.cos(angle), outward * np.sin(angle), np.cos(elevation)
    x, y, z, w = poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6]
    r02, r12 = 2 * (x * z + y * w), 2 * (y * z - x * w)
    r22 = 1 - 2 * (x * x + y * y)
    direction = (
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - z * w) * b + r02 * c,
        2 * (x * y + z * w) * a + (1 - 2 * (x * x + z * z)) * b + r12 * c,
        2 * (x * z - y * w) * a + 2 * (y * z + x * w) * b + r22 * c,
    )
    origin = (
        poses[k, 0] + r02 * height,
        poses[k, 1] + r12 * height,
        poses[k, 2] + r22 * height,
    )
    return origin, direction


def place_beams(
    sweeps: Sweeps, track: PoseTrack, lidar_height: float
) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_]]:
    """Place what the beams measured, each with the pose of its own instant.

    Args:
        sweeps: The sweeps.
        track: Where the robot believes it was when.
        lidar_height: Optical centre above ``base_footprint`` [m].

    Returns:
        Points in the map [m], float32, shape (m, 3), their times [s], shape (m,), and which beams
        returned, bool, shape (s * b,).
    """
    returned = np.isfinite(sweeps.ranges.ravel())
    times = beam_times(sweeps)
    points = _places(
        np.flatnonzero(returned),
        track.at(times),
        sweeps.head_angles,
        sweeps.head_rate * sweeps.beam_period,
        np.atleast_2d(sweeps.elevations).astype(np.float64),
        lidar_height,
        sweeps.ranges.ravel(),
    )
    return points, times[returned], returned


def cloud_of_sweeps(sweeps: Sweeps) -> PointCloud:
    """Return what a laser of several beams sends of its sweeps: points with times in ``sensor``.

    Times count whole nanoseconds, as a message holds them.
    """
    returned = np.isfinite(sweeps.ranges.ravel())
    still = np.zeros((returned.size, 7))
    still[:, 6] = 1.0
    elevations = np.atleast_2d(sweeps.elevations).astype(np.float64)
    step = sweeps.head_rate * sweeps.beam_period
    points = _places(
        np.flatnonzero(returned),
        still,
        sweeps.head_angles,
        step,
        elevations,
        0.0,
        sweeps.ranges.ravel(),
    )
    times = np.round(beam_times(sweeps)[returned] * 1e9) / 1e9
    classes = None if sweeps.classes is None else sweeps.classes.ravel()[returned]
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
