"""Shapes in the world as convex parts and surfaces, of which rooms and worlds are made."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from worlds.sdf.elements import SdfError
from worlds.sdf.meshes import Surface, load_mesh, parts
from worlds.sdf.outlines import triangulated
from worlds.sdf.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Heightmap,
    Mesh,
    Plane,
    Polyline,
    Sphere,
)
from worlds.sdf.values import Pose
from worlds.sdf.world import Solid

Points = NDArray[np.float64]
"""Points [m], float64, shape (k, 3)."""

_SIDES = (12, 96)
"""Fewest and most sides of a circle."""

_WALL = 0.1
"""Thickness of upright planes, which have only a front [m]."""


class Parts(NamedTuple):
    """A solid in the world's frame.

    Attributes:
        convex: Corners of its convex parts.
        surfaces: Surfaces that are in no convex part.
    """

    convex: list[Points]
    surfaces: list[Surface]


def parts_of(solid: Solid, tolerance: float) -> Parts:
    """Return a solid's parts; nothing for a heightmap.

    Args:
        solid: Solid.
        tolerance: Largest depth at which round shapes are cut by the sides of their parts [m], as
            far as 96 sides of a circle go.

    Raises:
        SdfError: If a mesh cannot be read, or outlines cross each other.
    """
    shape = solid.shape
    surfaces: list[Surface] = []
    match shape:
        case Box():
            convex = [_CUBE * shape.size]
        case Cylinder():
            ring = shape.radius * _circle(_sides(shape.radius, tolerance))
            convex = [np.concatenate([ring + np.array([0, 0, z]) for z in _ends(shape.length)])]
        case Capsule():
            ball = _ball((shape.radius,) * 3, tolerance)
            convex = [np.concatenate([ball + np.array([0, 0, z]) for z in _ends(shape.length)])]
        case Sphere():
            convex = [_ball((shape.radius,) * 3, tolerance)]
        case Ellipsoid():
            convex = [_ball(shape.radii, tolerance)]
        case Plane():
            slab = _CUBE * (*shape.size, _WALL) - (0, 0, _WALL / 2)
            convex = [slab @ _facing(shape.normal).T]
        case Polyline():
            convex = _prisms(shape, solid.where)
        case Mesh():
            mesh = load_mesh(shape.path, solid.where)
            x, y, z = shape.scale
            triangles = mesh.triangles if x * y * z > 0 else mesh.triangles[:, ::-1]
            mesh_parts, surfaces = parts(Surface(mesh.vertices * shape.scale, triangles))
            convex = [part.vertices for part in mesh_parts]
        case Heightmap():
            convex = []
    return Parts(
        [placed(points, solid.pose) for points in convex],
        [each._replace(vertices=placed(each.vertices, solid.pose)) for each in surfaces],
    )


def placed(points: Points, pose: Pose) -> Points:
    """Return points of a frame in the frame that its pose is given in [m]."""
    return points @ pose[:3, :3].T + pose[:3, 3]


_CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def _ends(length: float) -> tuple[float, float]:
    """Return the z of both ends of an axis about the origin [m]."""
    return -length / 2, length / 2


def _sides(radius: float, tolerance: float) -> int:
    """Return the number of sides with which a circle is cut by no more than a tolerance.

    It is one of fours, so that corners lie on both axes.
    """
    share = min(tolerance / radius, 1.0)
    sides = 4 * math.ceil(math.pi / math.acos(1 - share) / 4)
    return min(max(sides, _SIDES[0]), _SIDES[1])


def _circle(count: int) -> Points:
    """Return corners on the circle of radius 1 about z."""
    angles = np.arange(count) * 2 * np.pi / count
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)


def _ball(radii: tuple[float, float, float], tolerance: float) -> Points:
    """Return corners on an ellipsoid [m]."""
    # Faces are cut along both directions.
    count = _sides(max(radii), tolerance / 2)
    tilts = (np.arange(1, count // 2) / (count // 2) - 0.5) * np.pi
    unit = _circle(count)
    rings = [unit * math.cos(tilt) + np.array([0, 0, math.sin(tilt)]) for tilt in tilts]
    return np.concatenate([*rings, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]) * radii


def _facing(normal: tuple[float, float, float]) -> Points:
    """Return the shortest rotation that takes z to a direction, shape (3, 3)."""
    x, y, z = np.array(normal) / np.linalg.norm(normal)
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])
    return np.eye(3) + cross + cross @ cross / (1 + z)


def _prisms(shape: Polyline, where: str) -> list[Points]:
    """Return upright prisms over triangles of what is inside an odd number of outlines.

    Raises:
        SdfError: If the outlines cross themselves or each other.
    """
    corners = triangulated([list(outline) for outline in shape.outlines])
    if corners is None:
        raise SdfError(f"{where}: expected outlines that do not cross, got a polyline that does")
    levels = np.repeat([[0.0], [shape.height]], 3, axis=0)
    return [np.hstack([np.tile(each, (2, 1)), levels]) for each in corners]
