"""What the clouds of another robot have: a tilted laser, cover on the ground, hidden parts."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from terrain.classes import SemanticClass
from traversability.cloud import PointCloud

_BARE = (SemanticClass.GROUND, SemanticClass.PATH)
"""Classes on which low grass grows and litter lies."""

_WAVES = 60
"""Number of waves that litter is made of."""

_WEDGES = (0.02, 0.25)
"""Span of the width of a direction in which something is hidden [rad]."""


class CloudVariation(NamedTuple):
    """How a cloud differs from one that the robot itself would take.

    Attributes:
        tilt: Rotation of a laser that leans; None if it stands upright.
        kept: Share of points that are kept.
        hidden: Number of directions in which part of the view is hidden.
        grass: Height of low grass [m].
        litter: Height of litter, root mean square [m].
    """

    tilt: Rotation | None = None
    kept: float = 1.0
    hidden: int = 0
    grass: float = 0.0
    litter: float = 0.0


def varied_cloud(
    cloud: PointCloud,
    variation: CloudVariation,
    laser: NDArray[np.float64],
    rng: np.random.Generator,
) -> PointCloud:
    """Return a cloud with cover on its ground, without what is hidden and what is not kept.

    Args:
        cloud: Cloud in ``base_footprint``; without classes no ground is covered.
        variation: Cover, hidden directions and share of points.
        laser: Optical centre in the middle of the cloud's time [m], shape (3,).
        rng: Source of cover, directions and lost points.
    """
    if cloud.classes is not None and (variation.grass or variation.litter):
        bare = np.isin(cloud.classes, _BARE)
        points = _covered(cloud.points, bare, laser, variation.grass, variation.litter, rng)
        cloud = replace(cloud, points=points)
    seen = np.ones(len(cloud), dtype=np.bool_)
    if variation.kept < 1.0:
        seen &= rng.random(len(cloud)) < variation.kept
    if variation.hidden:
        seen &= ~_hidden(cloud.points, variation.hidden, rng)
    return cloud if seen.all() else cloud.select(seen)


def _covered(
    points: NDArray[np.float32],
    bare: NDArray[np.bool_],
    laser: NDArray[np.float64],
    grass: float,
    litter: float,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return the points where their beams end on what covers the ground.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        bare: Which of them lie on ground that can be covered, shape (n,).
        laser: Optical centre in the middle of the cloud's time [m], shape (3,).
        grass: Height of grass [m].
        litter: Height of litter, root mean square [m].
        rng: Share of beams that grass stops, blades and litter.
    """
    top = np.zeros(len(points))
    if grass > 0:
        stopped = rng.random(len(points)) < rng.uniform(0.1, 0.7)
        top += np.where(stopped, rng.uniform(0, grass, len(points)), 0.0)
    if litter > 0:
        bearing, phase = rng.uniform(0, 2 * np.pi, (2, _WAVES))
        number = 2 * np.pi / rng.uniform(0.3, 1.5, _WAVES)  # Wavelengths of 0.3 to 1.5 m.
        along = points[:, :1] * (number * np.cos(bearing)) + points[:, 1:2] * (
            number * np.sin(bearing)
        )
        top += litter * np.sqrt(2 / _WAVES) * np.cos(along + phase).sum(axis=1)
    below = np.maximum(laser[2] - points[:, 2], 0.1)
    # A blade stops the beam before it reaches the ground: the point moves back along the beam.
    share = np.where(bare, np.clip(top / below, -0.5, 0.5), 0.0)[:, None]
    return (points + share * (laser - points)).astype(np.float32)


def _hidden(points: NDArray[np.float32], most: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return which points something hides, shape (n,).

    In each direction either a stretch of the ground is hidden or all of it but a stretch.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        most: Number of directions.
        rng: Directions, widths and stretches.
    """
    bearing = np.arctan2(points[:, 1], points[:, 0])
    distance = np.hypot(points[:, 0], points[:, 1])
    hidden = np.zeros(len(points), dtype=np.bool_)
    for _ in range(most):
        middle, width = rng.uniform(-np.pi, np.pi), rng.uniform(*_WEDGES)
        begin = rng.uniform(0.0, 8.0)
        end = begin + rng.exponential(3.0) + 0.3
        wedge = np.abs((bearing - middle + np.pi) % (2 * np.pi) - np.pi) < width / 2
        stretch = (distance >= begin) & (distance < end)
        hidden |= wedge & (stretch if rng.random() < 0.5 else ~stretch)
    return hidden
