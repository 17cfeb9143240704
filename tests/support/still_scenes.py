"""What the laser of a standing robot sees of upright cylinders, leaves and ground."""

import numpy as np

from andabata.machine.lidar import LidarConfig
from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from traversability.cloud import PointCloud

EYE = 0.72
"""Height of the laser [m]."""

PERIOD = 0.1
NOWHERE = np.zeros((0, 4))

_LASER = LidarConfig()
_COLUMNS, _ROWS = 360, 40


def standing_track(seconds, pose=(0.0, 0.0, 0.0), before=None):
    """Return a track that stands at x, y, yaw, or jumped there from another pose at a time."""
    track = PoseTrack(4096)
    for k in range(round(seconds / 0.02) + 2):
        stamp = 0.02 * k
        x, y, yaw = before[1] if before is not None and stamp < before[0] else pose
        track.append(
            stamp, np.array([x, y, 0.0]), np.array([0, 0, np.sin(yaw / 2), np.cos(yaw / 2)])
        )
    return track


def cast(directions, bodies=NOWHERE, slope=0.0, leaves=NOWHERE, rng=None):
    """Return ranges [m], infinite for none.

    Args:
        directions: Unit directions, shape (n, 3).
        bodies: x, y, radius, height of upright cylinders [m], shape (k, 4).
        slope: Rise of the ground along x.
        leaves: Cylinders that stop half of the beams, as bodies.
        rng: Source of what leaves stop.
    """
    dx, dy, dz = directions.T.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = EYE / (slope * dx - dz)
    ranges = np.where(ground > 0, ground, np.inf)
    for is_leafy, cylinders in ((False, bodies), (True, leaves)):
        for x, y, radius, height in cylinders:
            a, b, c = dx * dx + dy * dy, dx * x + dy * y, x * x + y * y - radius * radius
            with np.errstate(divide="ignore", invalid="ignore"):
                hit = (b - np.sqrt(b * b - a * c)) / a
                level = EYE + hit * dz - slope * x
            is_hit = (hit > 0) & (level > -0.5) & (level < height)
            if is_leafy:
                is_hit &= rng.random(len(hit)) < 0.5
                hit = hit + radius * rng.random(len(hit))
            ranges = np.where(is_hit & (hit < ranges), hit, ranges)
    return ranges


def turning_readings(seconds, bodies_at, **scene):
    """Yield the readings of the paper's laser, period by period; ``bodies_at`` takes a time."""
    config = _LASER
    elevations, beams = config.elevations(0, 1), np.arange(config.beams)
    for step in range(1, round(seconds / PERIOD) + 1):
        stamps = np.arange(4 * (step - 1), 4 * step) / config.sweep_hz
        heads, ranges = stamps * config.head_rate, np.empty((4, config.beams), dtype=np.float32)
        for k, stamp in enumerate(stamps):
            angles = heads[k] + config.head_rate * config.beam_period * beams
            across = np.sin(elevations)
            directions = np.stack(
                [across * np.cos(angles), across * np.sin(angles), np.cos(elevations)], axis=1
            )
            ranges[k] = cast(directions, bodies_at(stamp), **scene)
        ranges[ranges > 11.0] = np.inf
        sweeps = Sweeps(stamps, heads, config.head_rate, config.beam_period, elevations, ranges)
        yield SensorReadings(step * PERIOD, sweeps=sweeps)


def frame_readings(seconds, bodies_at, **scene):
    """Yield the readings of a 3D laser that sends a cloud each period."""
    angles = np.linspace(0, 2 * np.pi, _COLUMNS, endpoint=False).repeat(_ROWS)
    up = np.tile(np.radians(np.linspace(-22.5, 22.5, _ROWS)), _COLUMNS)
    directions = np.stack(
        [np.cos(up) * np.cos(angles), np.cos(up) * np.sin(angles), np.sin(up)], axis=1
    )
    for step in range(1, round(seconds / PERIOD) + 1):
        ranges = cast(directions, bodies_at((step - 0.5) * PERIOD), **scene)
        seen = ranges < 30.0
        points = (directions[seen] * ranges[seen, None]).astype(np.float32)
        stamps = np.full(len(points), (step - 0.5) * PERIOD)
        yield SensorReadings(step * PERIOD, frames=(PointCloud(points, "sensor", stamps),))
