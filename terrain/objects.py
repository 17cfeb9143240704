"""Objects on the ground: closed convex meshes, each with a semantic class."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from terrain.classes import SemanticClass
from terrain.kernel import kernel

Vector = NDArray[np.floating] | tuple[float, float, float]
"""Three coordinates x, y, z [m]."""


@dataclass(frozen=True)
class SceneObject:
    """A closed convex solid or porous volume in the map frame.

    Attributes:
        semantic: Semantic class.
        vertices: Vertices in the map frame [m], float32, shape (n, 3).
        triangles: Vertex indices, uint32, shape (m, 3), counter-clockwise seen from outside.
    """

    semantic: SemanticClass
    vertices: NDArray[np.float32]
    triangles: NDArray[np.uint32]


def bounds(
    objects: Sequence[SceneObject],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the least and the greatest coordinates of each object [m], shape (n, 3) each."""
    if not objects:
        return np.empty((0, 3), dtype=np.float32), np.empty((0, 3), dtype=np.float32)
    vertices = np.concatenate([each.vertices for each in objects])
    begins = np.cumsum([0] + [len(each.vertices) for each in objects[:-1]])
    return np.minimum.reduceat(vertices, begins), np.maximum.reduceat(vertices, begins)


def hull(semantic: SemanticClass, points: NDArray[np.floating]) -> SceneObject:
    """Return the convex hull of points as an object.

    Args:
        semantic: Semantic class.
        points: Points in the map frame [m], shape (n, 3).
    """
    convex_hull = ConvexHull(points)
    renumber = np.zeros(len(points), dtype=np.uint32)
    renumber[convex_hull.vertices] = np.arange(len(convex_hull.vertices))
    # scipy's simplices have no consistent orientation.
    _turn_outwards(points, convex_hull.simplices, convex_hull.equations)
    return SceneObject(
        semantic, points[convex_hull.vertices].astype(np.float32), renumber[convex_hull.simplices]
    )


@kernel
def _turn_outwards(
    points: NDArray[np.floating], triangles: NDArray[np.int32], normals: NDArray[np.float64]
) -> None:
    """Turn the triangles that face inwards.

    Args:
        points: Points [m], shape (n, 3).
        triangles: Point indices, changed in place, shape (m, 3).
        normals: Outward normal of each triangle, shape (m, 3 or more).
    """
    for k in range(len(triangles)):
        a, b, c = triangles[k]
        ux, uy, uz = points[b] - points[a]
        vx, vy, vz = points[c] - points[a]
        # The cross product of two sides looks along the normal, or against it.
        along = (uy * vz - uz * vy) * normals[k, 0] + (uz * vx - ux * vz) * normals[k, 1]
        along += (ux * vy - uy * vx) * normals[k, 2]
        if along < 0:
            triangles[k, 1], triangles[k, 2] = c, b


def frustum(
    semantic: SemanticClass,
    base: Vector,
    radii: tuple[float, float],
    height: float,
    sides: int = 10,
) -> SceneObject:
    """Return an upright cylinder or cone.

    Args:
        semantic: Semantic class.
        base: Centre of its lower face [m].
        radii: Radius of the lower and of the upper face [m].
        height: Height [m].
        sides: Number of corners of each face.
    """
    ring, triangles = _prism(sides)
    top = radii[1] * ring + [0.0, 0.0, height]
    vertices = np.concatenate([radii[0] * ring, top]) + np.asarray(base, dtype=np.float64)
    return SceneObject(semantic, vertices.astype(np.float32), triangles)


@cache
def _prism(sides: int) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return corners of a face of radius 1, shape (sides, 3), and triangles, read-only."""
    angles = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(sides)], axis=1)
    k = np.arange(sides)
    nxt = (k + 1) % sides
    walls = [np.stack([k, nxt, nxt + sides], 1), np.stack([k, nxt + sides, k + sides], 1)]
    fan = np.arange(1, sides - 1)
    floor = np.stack([np.zeros_like(fan), fan + 1, fan], 1)
    roof = np.stack([np.zeros_like(fan), fan, fan + 1], 1) + sides
    triangles = np.concatenate([*walls, floor, roof]).astype(np.uint32)
    ring.setflags(write=False)
    triangles.setflags(write=False)
    return ring, triangles


_CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
"""Corners of a box with edges of 1."""

_OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
_SPHERE = np.concatenate(
    [
        _OCTAHEDRON,
        np.array([a + b for i, a in enumerate(_OCTAHEDRON) for b in _OCTAHEDRON[:i] if a @ b == 0])
        / np.sqrt(2),
    ]
)
"""Points on a sphere of radius 1: the corners of an octahedron, and its edges' middles."""


def box(semantic: SemanticClass, centre: Vector, size: Vector, yaw: float = 0.0) -> SceneObject:
    """Return an upright box.

    Args:
        semantic: Semantic class.
        centre: Centre [m].
        size: Edges along its own x, y and z [m].
        yaw: Rotation about z [rad], counter-clockwise.
    """
    corners = _CUBE * np.asarray(size, dtype=np.float64)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners[:, :2] = corners[:, :2] @ turn.T
    return hull(semantic, corners + np.asarray(centre, dtype=np.float64))


def ellipsoid(semantic: SemanticClass, centre: Vector, radii: Vector) -> SceneObject:
    """Return an ellipsoid of 32 triangles.

    Args:
        semantic: Semantic class.
        centre: Centre [m].
        radii: Half-axes along x, y and z [m].
    """
    return hull(semantic, _SPHERE * np.asarray(radii) + np.asarray(centre, dtype=np.float64))


def rock(base: Vector, radii: Vector, rng: np.random.Generator) -> SceneObject:
    """Return an irregular rock, the hull of 14 random points.

    Args:
        base: Centre [m]; on the ground, half of the rock is buried.
        radii: Mean half-axes along x, y and z [m].
        rng: Source of randomness.
    """
    directions = rng.standard_normal((14, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions * rng.uniform(0.8, 1.1, (14, 1)) * np.asarray(radii)
    return hull(SemanticClass.ROCK, points + np.asarray(base, dtype=np.float64))


def log(start: Vector, end: Vector, radius: float, sides: int = 8) -> SceneObject:
    """Return a fallen trunk.

    Args:
        start: One end of its axis [m].
        end: The other end [m]; the trunk must not be vertical.
        radius: Radius [m].
        sides: Number of corners of its cross-section.
    """
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    angles = np.arange(sides)[:, None] * 2 * np.pi / sides
    ring = radius * (np.cos(angles) * side + np.sin(angles) * up)
    return hull(SemanticClass.TRUNK, np.concatenate([a + ring, b + ring]))


def rod(
    semantic: SemanticClass, start: Vector, end: Vector, radius: float, sides: int = 6
) -> SceneObject:
    """Return a round rod in any direction, as a stem, a branch or a root.

    Args:
        semantic: Semantic class.
        start: One end of its axis [m].
        end: The other end [m].
        radius: Radius [m].
        sides: Number of corners of its cross-section.
    """
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    # Level across the axis, so that one of 4 k corners is the highest; any way if it is upright.
    level = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.999 else [1.0, 0.0, 0.0])
    level /= np.linalg.norm(level)
    ring, triangles = _prism(sides)
    # A rotation of the upright prism: its triangles keep facing outwards.
    around = radius * (ring[:, :1] * level + ring[:, 1:2] * np.cross(axis, level))
    return SceneObject(
        semantic, np.concatenate([a + around, b + around]).astype(np.float32), triangles
    )
