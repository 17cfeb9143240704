"""Geometry of the vertical sweeps: the ray of each beam.

Each beam has the pose of its own instant (motion compensation, "deskewing"). The same formula
serves the simulated laser, which casts the rays, and the cloud assembly, which places the returns.

A beam's direction in the head's plane is its elevation, the plane's direction in the base is the
head's angle: both are rotations about an axis, so that the direction follows from sines of sums.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import PoseTrack, interpolate
from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import inlined_kernel, kernel

SIN, COS = range(2)
"""Last axis of a table of sines and cosines."""

QX, QY, QZ, QW = 3, 4, 5, 6
"""Columns of a pose's quaternion; x, y, z [m] come before."""


class BeamTables:
    """Cache of a laser's sines and cosines, and buffers for its rays.

    The tables are computed again only if the beams change. The sine of a sum of angles then takes
    two products: calls of sine and cosine would be three quarters of the work.
    """

    def __init__(self) -> None:
        """Begin without beams."""
        self._elevations: NDArray[np.float32] | None = None
        self._step = np.nan
        self._rays = np.empty((0, 6), dtype=np.float32)
        self._poses = np.empty((0, 7))
        self._times = np.empty(0)

    def buffers(
        self, count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
        """Return buffers for times (count,), poses (count, 7) and rays (count, 6).

        The memory is the same at each call.

        Args:
            count: Number of beams.
        """
        if len(self._rays) < count:
            self._times, self._poses = np.empty(count), np.empty((count, 7))
            self._rays = np.empty((count, 6), dtype=np.float32)
        return self._times[:count], self._poses[:count], self._rays[:count]

    def sin_cos(self, sweeps: Sweeps) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return sine and cosine of the head's rotation to each beam, and of the elevations.

        Args:
            sweeps: Sweeps whose beams are cast or placed.

        Returns:
            Rotations, shape (b, 2), and elevations from the zenith, shape (1 or s, b, 2).
        """
        step = sweeps.head_rate * sweeps.beam_period
        if sweeps.elevations is not self._elevations or step != self._step:
            self._elevations, self._step = sweeps.elevations, step
            turns = np.arange(sweeps.elevations.shape[-1], dtype=np.float64) * step
            self._steps = sin_cos_of(turns)
            self._tilts = sin_cos_of(np.atleast_2d(sweeps.elevations).astype(np.float64))
        return self._steps, self._tilts


def sin_cos_of(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sine and cosine in a last axis of two."""
    found = np.empty((*angles.shape, 2))
    found[..., SIN], found[..., COS] = np.sin(angles), np.cos(angles)
    return found


def beam_rays(
    sweeps: Sweeps, track: PoseTrack, lidar_height: float, tables: BeamTables
) -> NDArray[np.float32]:
    """Return origin and direction of each beam, from the pose of its own instant.

    Args:
        sweeps: Sweeps to cast; their ranges are not read.
        track: Poses of the robot over time.
        lidar_height: Height of the optical centre above ``base_footprint`` [m].
        tables: Cache of the laser.

    Returns:
        Rows of origin in the map [m] and unit direction, float32, shape (s * b, 6), in a buffer
        that the next call overwrites.
    """
    times, poses, rays = tables.buffers(sweeps.ranges.size)
    heads, (steps, tilts) = sin_cos_of(sweeps.head_angles), tables.sin_cos(sweeps)
    offsets = np.arange(sweeps.ranges.shape[1]) * sweeps.beam_period
    np.add.outer(sweeps.stamps, offsets, out=times.reshape(sweeps.ranges.shape))
    interpolate(*track.table, times, poses)
    _fill_rays(poses, heads, steps, tilts, lidar_height, rays)
    return rays


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
def _fill_rays(
    poses: NDArray[np.float64],
    heads: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    height: float,
    rays: NDArray[np.float32],
) -> None:
    """Fill origin and direction of every beam, in the map.

    Args:
        poses: Pose of each beam's instant, shape (s * b, 7).
        heads: Sine and cosine of the head angle of each sweep's first beam, shape (s, 2).
        steps: Sine and cosine of the head's rotation to each beam, shape (b, 2).
        tilts: Sine and cosine of the elevation from the zenith, shape (1 or s, b, 2).
        height: Height of the optical centre above the poses' origin [m].
        rays: Rays that are filled, shape (s * b, 6).
    """
    beams = tilts.shape[1]
    for sweep in range(len(heads)):
        for beam in range(beams):
            k = sweep * beams + beam
            origin, direction = beam_ray(sweep, beam, k, poses, heads, steps, tilts, height)
            for c in range(3):
                rays[k, c], rays[k, 3 + c] = origin[c], direction[c]


@inlined_kernel
def beam_ray(
    sweep: int,
    beam: int,
    row: int,
    poses: NDArray[np.float64],
    heads: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    height: float,
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return origin [m] and unit direction of a beam in the map, at the pose of a row."""
    # Direction in the base: (sin(tilt) cos(h), sin(tilt) sin(h), cos(tilt)) at the head angle
    # h = head + step, by the addition theorems.
    plane = sweep % len(tilts)
    outward, c = tilts[plane, beam, SIN], tilts[plane, beam, COS]
    a = outward * (heads[sweep, COS] * steps[beam, COS] - heads[sweep, SIN] * steps[beam, SIN])
    b = outward * (heads[sweep, SIN] * steps[beam, COS] + heads[sweep, COS] * steps[beam, SIN])
    # Rotation matrix of the pose times that direction; its third column also carries the height.
    x, y, z, w = poses[row, QX], poses[row, QY], poses[row, QZ], poses[row, QW]
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
