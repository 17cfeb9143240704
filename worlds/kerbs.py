"""Kerbs: raised strips, as pavements and roads, whose edges are upright steps of 6 to 12 cm.

A strip is part of the ground of which the true map is made; its ends ramp down, and it is lowered
where a trail crosses it. The grid has no upright faces: a row of kerbstones along each edge, which
is flush with the strip, has them, for beams, wheels and the true map, whose rule of the step takes
0.7 to 1.3 times the height of an edge of the grid, by its direction.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from terrain.classes import SemanticClass
from terrain.generators import distance_to_line, winding_line
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, hull
from worlds.trails import Trail, dense, distance_to_trails, gentlest, steepness

_CANDIDATES = 8
"""Number of places of which the gentlest is taken."""

_RAMP = 1.5
"""Length of the ramp at each end of a strip, and where a trail crosses it [m]."""

_STONES = 3
"""Number of kerbstones between two corners of a strip's line, which are 1.5 m apart."""

_LEAST = 0.05
"""Height up to which an edge has no stones [m]: a wheel climbs it."""

_DEPTH = 0.05
"""Depth of a stone under the ground [m]."""


class Strip(NamedTuple):
    """A raised strip.

    Attributes:
        line: Corners of its middle line [m], shape (k, 2).
        half: Half of its width [m].
        height: Height between its ramps [m].
    """

    line: NDArray[np.float64]
    half: float
    height: float


def draw_strips(ground: Heightfield, count: int, rng: np.random.Generator) -> list[Strip]:
    """Return raised strips of 9 to 24 m, 1.6 to 4 m wide and 6 to 12 cm high.

    Args:
        ground: Ground without them.
        count: Number of strips.
        rng: Source of randomness; each strip has a stream of its own.
    """
    slope, half = steepness(ground), ground.width / 2
    strips = []
    for stream in rng.spawn(count):
        length = stream.uniform(9.0, 24.0)
        lines = [
            winding_line(
                stream.uniform(-0.8 * half, 0.8 * half, 2),
                stream.uniform(-np.pi, np.pi),
                length,
                0.06,
                stream,
            )
            for _ in range(_CANDIDATES)
        ]
        line = gentlest(ground, slope, lines)
        strips.append(Strip(line, stream.uniform(0.8, 2.0), stream.uniform(0.06, 0.12)))
    return strips


def _rise(
    strip: Strip, trails: list[Trail], points: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the height of a strip over the ground [m], shape (n,).

    Args:
        strip: The strip.
        trails: Trails that cross it.
        points: Map x and y of places on it [m], shape (n, 2).
        along: Distances of the places along the strip's line [m], shape (n,).
    """
    length = np.hypot(*np.diff(strip.line, axis=0).T).sum()
    end = np.clip(np.minimum(along, length - along) / _RAMP, 0.0, 1.0)
    return strip.height * end * np.clip(distance_to_trails(trails, points, _RAMP) / _RAMP, 0.0, 1.0)


def raised(ground: Heightfield, strips: list[Strip], trails: list[Trail]) -> NDArray[np.float64]:
    """Return what strips add to the ground's heights [m], shape (nx, ny).

    Args:
        ground: Ground without them, on the grid that wheels feel.
        strips: The strips.
        trails: Trails that cross them.
    """
    rises = np.zeros(ground.heights.shape)
    for strip in strips:
        inside = distance_to_line(ground.x, ground.y, strip.line, reach=strip.half) < strip.half
        i, j = np.nonzero(inside)
        places = np.column_stack([ground.x[i], ground.y[j]])
        points, along = dense(strip.line)
        nearest = cKDTree(points).query(places)[1] if len(places) else []
        rise = _rise(strip, trails, places, along[nearest])
        rises[i, j] = np.maximum(rises[i, j], rise)
    return rises


def kerbstones(
    ground: Heightfield, strips: list[Strip], trails: list[Trail], cell: float
) -> list[SceneObject]:
    """Return the stones along the edges of strips, wide enough to hold the grid's own edge.

    Args:
        ground: Ground without the strips.
        strips: The strips.
        trails: Trails that cross them.
        cell: Cell of the grid that wheels feel [m].
    """
    return [
        stone
        for strip in strips
        for side in (-1.0, 1.0)
        for stone in _edge(ground, strip, trails, side, cell)
    ]


def _edge(
    ground: Heightfield, strip: Strip, trails: list[Trail], side: float, cell: float
) -> list[SceneObject]:
    """Return the stones along one edge of a strip, to the left (1) or to the right (-1) of it."""
    points, along, normals = _stations(strip.line)
    # Between a node inside and one outside the grid climbs: the stone is over all of that.
    faces = [points + side * (strip.half + off * cell) * normals for off in (-1.2, 1.0)]
    rises = [_rise(strip, trails, face, along) for face in faces]
    levels = [ground.height_at(*face.T) for face in faces]
    limit = np.array([ground.width, ground.depth]) / 2
    stones = []
    for k in range(len(points) - 1):
        ends = [k, k + 1]
        corners = np.concatenate([face[ends] for face in faces])
        if min(rise[ends].min() for rise in rises) <= _LEAST or (np.abs(corners) > limit).any():
            continue
        tops = np.concatenate([lv[ends] + r[ends] for lv, r in zip(levels, rises, strict=True)])
        feet = np.concatenate([level[ends] for level in levels]) - _DEPTH
        block = np.concatenate([np.column_stack([corners, z]) for z in (tops, feet)])
        stones.append(hull(SemanticClass.KERB, block))
    return stones


def _stations(
    line: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the stones along a line.

    Returns:
        Points on the line [m], shape (n, 2), their distances along it [m], shape (n,), and normals
        to its left, at corners so long that they reach to the corner of both sides, shape (n, 2).
    """
    moves = np.diff(line, axis=0)
    lengths = np.hypot(*moves.T)
    lefts = np.column_stack([-moves[:, 1], moves[:, 0]]) / lengths[:, None]
    shares = np.arange(_STONES) / _STONES
    points = (line[:-1, None] + shares[:, None] * moves[:, None]).reshape(-1, 2)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    along = (starts[:-1, None] + shares * lengths[:, None]).ravel()
    normals = lefts.repeat(_STONES, axis=0)
    mitres = (lefts[1:] + lefts[:-1]) / (1.0 + (lefts[1:] * lefts[:-1]).sum(axis=1))[:, None]
    normals[_STONES::_STONES] = mitres
    return (
        np.concatenate([points, line[-1:]]),
        np.append(along, starts[-1]),
        np.concatenate([normals, lefts[-1:]]),
    )
