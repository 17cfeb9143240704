"""What the clouds of another robot have: a tilted laser, cover on the ground, hidden parts."""

import math
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
"""Number of waves that litter and undulations are made of."""

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
        undulation: Height of undulations of the ground, root mean square [m].
        tufted: True if grass grows in tufts, with bare ground between them.
        verge: True if paths are bare, whatever covers the ground beside them.
    """

    tilt: Rotation | None = None
    kept: float = 1.0
    hidden: int = 0
    grass: float = 0.0
    litter: float = 0.0
    undulation: float = 0.0
    tufted: bool = False
    verge: bool = False

    @property
    def covered(self) -> bool:
        """True if anything changes the ground."""
        return max(self.grass, self.litter, self.undulation) > 0

    def limited(self, scatter: float) -> "CloudVariation":
        """Return the variation with its cover scaled down to a scatter, root mean square [m]."""
        blades = self.grass / math.sqrt(12)  # Ends of blades lie evenly between ground and top.
        share = min(1.0, scatter / max(math.hypot(blades, self.litter, self.undulation), 1e-9))
        cover = {name: share * getattr(self, name) for name in ("grass", "litter", "undulation")}
        return self._replace(**cover)


def varied_cloud(
    cloud: PointCloud,
    variation: CloudVariation,
    laser: NDArray[np.float64],
    rng: np.random.Generator,
    slopes: NDArray[np.float64] | None = None,
) -> PointCloud:
    """Return a cloud with cover on its ground, without what is hidden and what is not kept.

    Args:
        cloud: Cloud in ``base_footprint``; without classes no ground is covered.
        variation: Cover, hidden directions and share of points.
        laser: Optical centre in the middle of the cloud's time [m], shape (3,).
        rng: Source of cover, directions and lost points.
        slopes: Rise of the ground under each point along x and y, shape (n, 2); None where it is
            level.
    """
    if cloud.classes is not None and variation.covered:
        bare = np.isin(cloud.classes, _BARE)
        if variation.verge:
            bare &= cloud.classes != SemanticClass.PATH
        cloud = replace(cloud, points=_covered(cloud.points, bare, laser, variation, rng, slopes))
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
    cover: CloudVariation,
    rng: np.random.Generator,
    slopes: NDArray[np.float64] | None = None,
) -> NDArray[np.float32]:
    """Return the points where their beams end on what covers the ground.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        bare: Which of them lie on ground that can be covered, shape (n,).
        laser: Optical centre in the middle of the cloud's time [m], shape (3,).
        cover: Grass, litter and undulations.
        rng: Share of beams that grass stops, blades, tufts, litter and undulations.
        slopes: Rise of the ground under each point along x and y, shape (n, 2).
    """
    top = np.zeros(len(points))
    if cover.grass > 0:
        stopping = rng.uniform(0.1, 0.7)
        height = np.full(len(points), cover.grass)
        if cover.tufted:
            # Tufts of a few decimetres, with ground between them.
            growth = _waves(points, (0.3, 1.2), 0.0, rng)
            height *= np.clip(0.6 + 0.6 * growth, 0.0, 1.0)
        stopped = rng.random(len(points)) < stopping
        top += np.where(stopped, rng.uniform(0, 1, len(points)) * height, 0.0)
    if cover.litter > 0:
        top += cover.litter * _waves(points, (0.3, 1.5), 0.0, rng)
    if cover.undulation > 0:
        # Waves are as steep as each other: long ones are higher.
        top += cover.undulation * _waves(points, (0.3, 2.0), 1.0, rng)
    # A blade stops the beam before it reaches the ground: the point moves back along the beam, to
    # where that is as high over the slope of the ground as the blade.
    over = laser[2] - points[:, 2].astype(np.float64)
    if slopes is not None:
        over -= ((laser[:2] - points[:, :2]) * slopes).sum(axis=1)
    below = np.maximum(over, 0.1)
    share = np.where(bare, np.clip(top / below, -0.5, 0.5), 0.0)[:, None]
    return (points + share * (laser - points)).astype(np.float32)


def _waves(
    points: NDArray[np.float32],
    lengths: tuple[float, float],
    power: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return smooth random values of mean 0 and deviation 1 at the places of points, shape (n,).

    Args:
        points: Points [m], shape (n, 3); heights do not matter.
        lengths: Span of the wavelengths [m].
        power: Power of the wavelength that a wave's amplitude is proportional to.
        rng: Directions, phases and wavelengths.
    """
    bearing, phase = rng.uniform(0, 2 * np.pi, (2, _WAVES))
    wavelength = rng.uniform(*lengths, _WAVES)
    amplitude = wavelength**power
    amplitude *= np.sqrt(2 / (amplitude**2).sum())
    number = 2 * np.pi / wavelength
    x, y = points[:, 0].astype(np.float64), points[:, 1].astype(np.float64)
    value = np.zeros(len(points))
    for k in range(_WAVES):
        along = number[k] * (np.cos(bearing[k]) * x + np.sin(bearing[k]) * y)
        value += amplitude[k] * np.cos(along + phase[k])
    return value


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
