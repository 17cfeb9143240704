"""Rays of the vertical sweeps that the simulated laser casts, from each instant's own pose."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.beams import COS, SIN, BeamTables, beam_ray
from andabata.machine.pose import Interval, PoseTrack, interval_of, next_stretch, pose_within
from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import kernel


def beam_rays(
    sweeps: Sweeps, track: PoseTrack, lidar_height: float, tables: BeamTables
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return origin and direction of each beam, from the pose of its own instant, and its time.

    Args:
        sweeps: Sweeps to cast; their ranges are not read.
        track: Poses of the robot over time.
        lidar_height: Height of the optical centre above ``base_footprint`` [m].
        tables: Cache of the laser.

    Returns:
        Rows of origin in the map [m] and unit direction, float32, shape (s * b, 6), and times [s],
        shape (s * b,), both in buffers that the next call overwrites.
    """
    times, rays = tables.buffers(sweeps.ranges.size)
    _fill_rays(
        sweeps.stamps,
        sweeps.head_angles,
        sweeps.beam_period,
        *track.table,
        *tables.sin_cos(sweeps),
        lidar_height,
        times,
        rays,
    )
    return rays.T, times


@kernel
def _fill_rays(
    stamps: NDArray[np.float64],
    heads: NDArray[np.float64],
    period: float,
    known: NDArray[np.float64],
    poses: NDArray[np.float64],
    steps: NDArray[np.float64],
    tilts: NDArray[np.float64],
    height: float,
    times: NDArray[np.float64],
    rays: NDArray[np.float32],
) -> None:
    """Fill time, origin and direction of every beam, in the map.

    Args:
        stamps: Time of each sweep's first beam [s], increasing, shape (s,).
        heads: Head angle of each sweep's first beam [rad], shape (s,).
        period: Time from beam to beam [s].
        known: Stamps of the track [s], increasing, shape (k,).
        poses: Poses of the track, shape (k or more, 7).
        steps: Sine and cosine of the head's rotation to each beam, shape (2, b).
        tilts: Sine and cosine of the elevation from the zenith, shape (1 or s, 2, b).
        height: Height of the optical centre above the poses' origin [m].
        times: Times that are filled [s], shape (s * b,).
        rays: Components of the rays, filled, shape (6, s * b).
    """
    beams, after = steps.shape[1], 1
    for sweep in range(len(stamps)):
        first, tilt = sweep * beams, tilts[sweep % len(tilts)]
        head = np.sin(heads[sweep]), np.cos(heads[sweep])
        for beam in range(beams):
            times[first + beam] = stamps[sweep] + beam * period
        # Beams between the same two poses of the track: a loop that the compiler can pack.
        beam = 0
        while beam < beams:
            after, until = next_stretch(known, times[first : first + beams], beam, after)
            _fill_stretch(
                times[first + beam : first + until],
                interval_of(known, poses, after),
                head,
                (steps[SIN, beam:until], steps[COS, beam:until]),
                (tilt[SIN, beam:until], tilt[COS, beam:until]),
                height,
                rays,
                first + beam,
            )
            beam = until


@kernel
def _fill_stretch(
    times: NDArray[np.float64],
    interval: Interval,
    head: tuple[float, float],
    steps: tuple[NDArray[np.float64], NDArray[np.float64]],
    tilts: tuple[NDArray[np.float64], NDArray[np.float64]],
    height: float,
    rays: NDArray[np.float32],
    first: int,
) -> None:
    """Fill the rays of beams of a sweep whose times lie between the same two poses.

    Args:
        times: Times of the beams [s], shape (n,).
        interval: The two poses.
        head: Sine and cosine of the head angle of the sweep's first beam.
        steps: Sines and cosines of the head's rotation to each of the beams, shape (n,) each.
        tilts: Sines and cosines of their elevations from the zenith, shape (n,) each.
        height: Height of the optical centre above the poses' origin [m].
        rays: Components of all rays, those of the beams filled, shape (6, s * b).
        first: Number of the first of these beams.
    """
    # Views that begin at zero: an index that might be negative would keep the loop from packing.
    end = first + len(times)
    x, y, z = rays[0, first:end], rays[1, first:end], rays[2, first:end]
    u, v, w = rays[3, first:end], rays[4, first:end], rays[5, first:end]
    step_sine, step_cosine, tilt_sine, tilt_cosine = *steps, *tilts
    for k in range(len(times)):
        pose = pose_within(interval, times[k])
        step, tilt = (step_sine[k], step_cosine[k]), (tilt_sine[k], tilt_cosine[k])
        origin, direction = beam_ray(pose, head, step, tilt, height)
        x[k], y[k], z[k] = origin
        u[k], v[k], w[k] = direction
