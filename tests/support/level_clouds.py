"""What level lasers see of fields of plants and of ground that must stay free, in closed form.

Much faster than worlds and rays, and made without them: a second opinion on both.
"""

from typing import NamedTuple

import numpy as np

VLP_32C = (
    *(-25, -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667, -4, -3.667, -3.333, -3),
    *(-2.667, -2.333, -2, -1.667, -1.333, -1, -0.667, -0.333, 0, 0.333, 0.667, 1, 1.333, 1.667),
    *(2.333, 3.333, 4.667, 7, 10.333, 15),
)
LASERS = {
    "vlp-32c": np.array(VLP_32C),
    "vlp-16": np.arange(-15.0, 16, 2),
    "os1-64": np.linspace(-22.5, 22.5, 64),
    "os0-128": np.linspace(-45, 45, 128),
    "hdl-64e": np.linspace(-24.8, 2, 64),
    "hdl-32e": np.linspace(-30.67, 10.67, 32),
    "rs-32": np.array([-25, -14.6, -10.3, -8.4, -6.7, -5.4, -4.4, *np.arange(-4, 4.4, 0.35), 15]),
    "pandar-40p": np.array([-25, -19, -14, -13, -12, -11, *np.arange(-10, 2, 0.5), 3, 5, 8, 15]),
    "xt-32": np.arange(-16.0, 16, 1),
    "os0-32": np.linspace(-45, 45, 32),
}
"""Elevations of the beams of ten lasers [deg], after their data sheets."""


class Seen(NamedTuple):
    """A cloud.

    Attributes:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3).
        plants: True for points on plants, shape (n,).
    """

    points: np.ndarray
    plants: np.ndarray


def _beams(laser: str, directions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return elevation and azimuth of each beam [rad]."""
    azimuth = np.linspace(-np.pi, np.pi, directions, endpoint=False)
    elevation, azimuth = np.meshgrid(np.radians(LASERS[laser]), azimuth)
    return elevation.ravel(), azimuth.ravel()


def plant_field(
    laser: str,
    height: float,
    plants: float,
    stopped: float,
    rng: np.random.Generator,
    edge: float = 3.0,
) -> Seen:
    """Return level ground with plants ahead of an edge.

    Args:
        laser: Name in ``LASERS``.
        height: Height of the laser [m].
        plants: Height of the plants [m].
        stopped: Share of the beams that half a metre of plants stops.
        rng: Source of where beams end, and of 1.5 cm of noise.
        edge: Distance of the edge [m].
    """
    elevation, azimuth = _beams(laser, 1024)
    down = np.sin(-elevation)
    to_ground = np.where(down > 0.01, height / np.maximum(down, 1e-6), 60.0)
    ahead = np.cos(elevation) * np.cos(azimuth)
    to_edge = np.where(ahead > 1e-6, edge / np.maximum(ahead, 1e-6), 1e9)
    to_top = (height - plants) / np.where(np.abs(down) < 1e-6, 1e-6, down)
    if height > plants:  # From above: in the plants after their top, up to the ground.
        begin, end = np.where(down > 0.01, to_top, 1e9), np.full(len(down), 1e9)
    else:  # From between them: in the plants at once, rising beams up to their top.
        begin, end = np.zeros(len(down)), np.where(down < 0, to_top, 1e9)
    enters = np.maximum(begin, to_edge)
    stop = enters + rng.exponential(-0.5 / np.log(1 - stopped), len(down))
    hit = (stop < np.minimum(to_ground, end)) & (enters < to_ground)
    distance = np.where(hit, stop, to_ground) + rng.normal(0, 0.015, len(down))
    return _seen(distance, elevation, azimuth, height, hit)


def _seen(
    distance: np.ndarray,
    elevation: np.ndarray,
    azimuth: np.ndarray,
    height: float,
    plants: np.ndarray,
) -> Seen:
    """Return the points at distances along beams up to 40 m."""
    level = distance * np.cos(elevation)
    z = height + distance * np.sin(elevation)
    points = np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), z])
    seen = distance < 40
    return Seen(points[seen].astype(np.float32), plants[seen])


class Cover(NamedTuple):
    """What covers ground that stays free.

    Attributes:
        noise: Range noise [m].
        blades: Height of grass [m].
        share: Share of the beams that grass stops.
        litter: Height of litter, root mean square, with waves of 0.6 to 1.1 m [m].
        undulation: Height of undulations, root mean square, with waves of 0.3 to 2 m [m].
    """

    noise: float = 0.015
    blades: float = 0.0
    share: float = 0.5
    litter: float = 0.0
    undulation: float = 0.0


def free_ground(laser: str, height: float, cover: Cover, rng: np.random.Generator) -> np.ndarray:
    """Return the points that a laser sees of covered level ground, float32, shape (n, 3)."""
    elevation, azimuth = _beams(laser, 1024)
    down = elevation < np.radians(-0.6)
    elevation, azimuth = elevation[down], azimuth[down]
    top = np.where(rng.random(len(elevation)) < cover.share, rng.uniform(0, 1, len(elevation)), 0)
    x, y = (height / np.tan(-elevation)) * np.stack([np.cos(azimuth), np.sin(azimuth)])
    over = cover.blades * top
    over += cover.litter * _waves(x, y, 0.6, 1.1, 0, rng)
    over += cover.undulation * _waves(x, y, 0.3, 2.0, 1, rng)
    distance = (height - over) / np.sin(-elevation) + rng.normal(0, cover.noise, len(elevation))
    return _seen(distance, elevation, azimuth, height, down[down]).points


def _waves(
    x: np.ndarray, y: np.ndarray, short: float, long: float, power: int, rng: np.random.Generator
) -> np.ndarray:
    """Return values of deviation 1 at places, sums of waves of amplitude ``length ** power``."""
    length, bearing, phase = rng.uniform(short, long, 40), *rng.uniform(0, 2 * np.pi, (2, 40))
    amplitude = length**power / np.sqrt((length ** (2 * power)).sum() / 2)
    along = np.cos(bearing)[:, None] * x + np.sin(bearing)[:, None] * y
    return amplitude @ np.cos(2 * np.pi / length[:, None] * along + phase[:, None])
