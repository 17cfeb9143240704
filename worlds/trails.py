"""Trails: worn paths that people and animals have trodden, 1 to 2 m wide, and roots across them.

A trail takes the gentlest of some ways across the square. It is level enough to fill small ditches;
where the hills themselves are too steep, it is as steep as they are.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from terrain.generators import distance_to_line, winding_line
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from terrain.plants import root

_CANDIDATES = 8
"""Number of ways of which the gentlest is taken."""

_STEEP = np.tan(np.deg2rad(16.0))
"""Rise over run that a trail avoids."""

_TURN = 0.12
"""Standard deviation of the change of direction every 1.5 m [rad]."""

_EVEN = 1.5
"""Standard deviation of the filter that levels a trail [m]."""

_VERGE = 1.0
"""Width of the strip beside a trail in which level ground passes into the ground as it is [m]."""

_CLIMBED, _STRUCK = 0.045, 0.055
"""Heights up to which a wheel climbs a root and from which on it strikes one [m]: there is none in
between, where the unevenness of the ground decides."""


class Trail(NamedTuple):
    """A trail.

    Attributes:
        line: Corners of its middle line [m], shape (k, 2).
        width: Width [m].
    """

    line: NDArray[np.float64]
    width: float


def draw_trails(ground: Heightfield, count: int, rng: np.random.Generator) -> list[Trail]:
    """Return trails across the square.

    Args:
        ground: Ground without them.
        count: Number of trails.
        rng: Source of randomness; each trail has a stream of its own.
    """
    slope = steepness(ground)
    trails = []
    for stream in rng.spawn(count):
        lines = [_line(ground, stream) for _ in range(_CANDIDATES)]
        line = gentlest(ground, slope, lines)
        trails.append(Trail(line, stream.uniform(1.0, 2.0)))
    return trails


def _line(ground: Heightfield, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a line from beyond one side of the square across its middle part [m]."""
    half = ground.width / 2
    yaw = rng.uniform(-np.pi, np.pi)
    start = -1.2 * half * np.array([np.cos(yaw), np.sin(yaw)]) + rng.uniform(-0.4, 0.4, 2) * half
    return winding_line(start, yaw, 2.6 * half, _TURN, rng)


def steepness(ground: Heightfield) -> NDArray[np.float64]:
    """Return the rise over run of the ground at a trail's scale, shape (nx, ny)."""
    even = gaussian_filter(ground.heights.astype(np.float64), _EVEN / ground.cell, mode="nearest")
    return np.asarray(np.hypot(*np.gradient(even, ground.cell)))


def gentlest(
    ground: Heightfield, slope: NDArray[np.float64], lines: list[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the line of which the least part is steep; the first of equal ones.

    Args:
        ground: The ground.
        slope: Its ``steepness``.
        lines: Lines [m], shape (k, 2) each.
    """
    costs = []
    for line in lines:
        corner = np.array([ground.width, ground.depth]) / 2
        u, v = ((line + corner) / ground.cell).round().astype(int).T
        inside = (u >= 0) & (v >= 0) & (u < slope.shape[0]) & (v < slope.shape[1])
        rises = slope[u[inside], v[inside]]
        costs.append(np.inf if len(rises) < 2 else (rises > _STEEP).mean() + 0.3 * rises.mean())
    return lines[int(np.argmin(costs))]


def levelled(ground: Heightfield, trails: list[Trail]) -> Heightfield:
    """Return the ground with its trails levelled.

    Args:
        ground: Ground without them.
        trails: The trails.
    """
    if not trails:
        return ground
    heights = ground.heights.astype(np.float64)
    even = gaussian_filter(heights, _EVEN / ground.cell, mode="nearest")
    share = trodden(ground, trails, _VERGE)
    return Heightfield((heights + share * (even - heights)).astype(np.float32), ground.cell)


def trodden(ground: Heightfield, trails: list[Trail], verge: float) -> NDArray[np.float64]:
    """Return 1 on trails, falling to 0 over a verge beside them, shape (nx, ny).

    Args:
        ground: Ground, whose grid is meant.
        trails: The trails.
        verge: Width of the verge [m].
    """
    share = np.zeros(ground.heights.shape)
    for line, width in trails:
        beyond = distance_to_line(ground.x, ground.y, line, reach=width / 2 + verge) - width / 2
        np.maximum(share, np.clip(1.0 - beyond / verge, 0.0, 1.0), out=share)
    return share


def distance_to_trails(
    trails: list[Trail], points: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    """Return the distance of points from the nearest trail's edge [m].

    Args:
        trails: The trails.
        points: Map x and y [m], shape (n, 2).
        reach: Distance beyond which it is infinite [m].
    """
    distances = np.full(len(points), np.inf)
    for line, width in trails:
        tree = cKDTree(dense(line)[0])
        away, _ = tree.query(points, distance_upper_bound=width / 2 + reach)
        np.minimum(distances, np.maximum(away - width / 2, 0.0), out=distances)
    return distances


def dense(
    line: NDArray[np.float64], step: float = 0.05
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points along a polyline [m], shape (n, 2), and their distances along it [m].

    Args:
        line: Corners [m], shape (k, 2).
        step: Distance between points [m].
    """
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    along = np.linspace(0.0, lengths[-1], max(2, round(lengths[-1] / step) + 1))
    points = np.column_stack([np.interp(along, lengths, line[:, c]) for c in range(2)])
    return points, along


def draw_roots(
    ground: Heightfield, trails: list[Trail], density: float, rng: np.random.Generator
) -> list[SceneObject]:
    """Return roots of 3 to 8 cm that cross trails.

    Args:
        ground: Ground as it is, on which they lie.
        trails: The trails.
        density: Mean number of roots per metre of trail [1/m].
        rng: Source of randomness; each trail has a stream of its own.
    """
    roots: list[SceneObject] = []
    limit = np.array([ground.width, ground.depth]) / 2 - 2.0
    for (line, width), stream in zip(trails, rng.spawn(len(trails)), strict=True):
        points, along = dense(line)
        headings = np.arctan2(*np.gradient(points, axis=0).T[::-1])
        for place in stream.integers(len(points), size=stream.poisson(density * along[-1])):
            yaw = headings[place] + np.pi / 2 + stream.uniform(-0.5, 0.5)
            height = stream.uniform(0.03, 0.08)
            height = min(height, _CLIMBED) if height < _STRUCK else height
            course = _course(points[place], yaw, width / 2 + 0.2, stream)
            if (np.abs(course) < limit).all():
                roots.extend(root(ground, course, height))
    return roots


def _course(
    middle: NDArray[np.float64], yaw: float, reach: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the corners of a root through a place, which wobbles by 5 cm [m], shape (k, 2)."""
    along = np.linspace(-reach, reach, max(3, round(2 * reach / 0.35) + 1))
    aside = rng.normal(0.0, 0.05, len(along))
    c, s = np.cos(yaw), np.sin(yaw)
    return middle + np.column_stack([c * along - s * aside, s * along + c * aside])
