"""Footprints: what of a shape is between two heights, seen from above."""

import math
from dataclasses import dataclass, replace

import numpy as np

from worlds.sdf.outlines import Corners, convex_in_slab, oriented, surface_in_slab
from worlds.sdf.shapes import Box, Capsule, Cylinder, Heightmap, Plane, Polyline, Shape, Sphere
from worlds.sdf.solids import parts_of, placed
from worlds.sdf.values import Pose
from worlds.sdf.world import Solid

TOLERANCE = 1e-3
"""Depth at which round shapes may be cut, and lean of what is taken as upright [m]."""

_LEVEL = 1e-3
"""Sine of the slope up to which a plane is taken as level."""

_STEEP = 0.1
"""Share of up in a plane's direction below which it is a wall."""


@dataclass(frozen=True)
class Footprint:
    """What of a shape is between two heights, seen from above.

    Attributes:
        circles: x, y and radius [m].
        outlines: Outlines, counter-clockwise, holes clockwise; two corners are a wall [m].
    """

    circles: tuple[tuple[float, float, float], ...] = ()
    outlines: tuple[Corners, ...] = ()

    @property
    def bounds(self) -> tuple[float, float, float, float] | None:
        """Rectangle around it, x_min, y_min, x_max, y_max [m]; None if there is nothing."""
        corners = [corner for outline in self.outlines for corner in outline]
        corners += [(x + s * r, y + s * r) for x, y, r in self.circles for s in (-1, 1)]
        if not corners:
            return None
        x, y = np.array(corners).T
        return float(x.min()), float(y.min()), float(x.max()), float(y.max())


_NOTHING = Footprint()


def is_ground(solid: Solid) -> bool:
    """Return True for ground or a ceiling: a heightmap, or a plane that is no wall."""
    return isinstance(solid.shape, Heightmap) or (
        isinstance(solid.shape, Plane) and abs(facing(solid)[2]) >= _STEEP
    )


def is_level(solid: Solid) -> bool:
    """Return True for ground that is level and faces up."""
    if not isinstance(solid.shape, Plane):
        return False
    x, y, z = facing(solid)
    return z > 0 and math.hypot(x, y) < _LEVEL


def facing(solid: Solid) -> tuple[float, float, float]:
    """Return the direction in the world in which a plane faces, of length 1; up for others."""
    if not isinstance(solid.shape, Plane):
        return 0.0, 0.0, 1.0
    normal = solid.pose[:3, :3] @ solid.shape.normal
    x, y, z = (normal / np.linalg.norm(normal)).tolist()
    return x, y, z


def footprint(solid: Solid, low: float, high: float) -> Footprint:
    """Return what of a shape is between two heights in the world; ground has none.

    Args:
        solid: Shape.
        low: Least height [m].
        high: Largest height [m].

    Raises:
        SdfError: If a mesh cannot be read.
    """
    if is_ground(solid):
        return _NOTHING
    solid = replace(solid, pose=_straightened(solid.pose, _reach(solid.shape)))
    shape, upright = solid.shape, abs(solid.pose[2, 2]) == 1.0
    x, y, z = solid.pose[:3, 3].tolist()
    match shape:
        case Sphere():
            return _circle(solid, shape.radius, 0.0, low, high)
        case Cylinder() if upright:
            ends = z - shape.length / 2, z + shape.length / 2
            return Footprint(((x, y, shape.radius),)) if _apart(*ends, low, high) == 0 else _NOTHING
        case Capsule() if upright:
            return _circle(solid, shape.radius, shape.length / 2, low, high)
        case Polyline() if upright:
            first, last = sorted((z, z + shape.height * float(solid.pose[2, 2])))
            if _apart(first, last, low, high) > 0:
                return _NOTHING
            moved = [_moved(outline, solid.pose) for outline in shape.outlines]
            return Footprint(outlines=tuple(oriented(moved)))
    parts = parts_of(solid, TOLERANCE)
    outlines = [convex_in_slab(points, low, high) for points in parts.convex]
    for surface in parts.surfaces:
        outlines += surface_in_slab(surface, low, high)
    return Footprint(outlines=tuple(each for each in outlines if len(each) > 1))


def _circle(solid: Solid, radius: float, half: float, low: float, high: float) -> Footprint:
    """Return the widest section of a ball drawn along an upright axis, between two heights.

    Args:
        solid: Shape, for its place.
        radius: Radius of the ball [m].
        half: Half of the axis' length [m].
        low: Least height [m].
        high: Largest height [m].
    """
    x, y, z = solid.pose[:3, 3].tolist()
    apart = _apart(z - half, z + half, low, high)
    if apart >= radius:
        return _NOTHING
    return Footprint(circles=((x, y, math.sqrt(radius**2 - apart**2)),))


def _apart(low: float, high: float, other_low: float, other_high: float) -> float:
    """Return the distance between two spans of heights, 0 if they meet [m]."""
    return max(other_low - high, low - other_high, 0.0)


def _moved(outline: tuple[tuple[float, float], ...], pose: Pose) -> Corners:
    """Return an outline of a shape in the world, seen from above."""
    points = placed(np.array([(x, y, 0.0) for x, y in outline]), pose)
    return [(x, y) for x, y, _ in points.tolist()]


def _reach(shape: Shape) -> float:
    """Return the largest extent of a shape [m], infinite for those that are never straightened."""
    match shape:
        case Box():
            return max(shape.size)
        case Cylinder() | Capsule():
            return shape.length + 2 * shape.radius
        case Polyline():
            corners = np.concatenate([np.array(each) for each in shape.outlines])
            return max(shape.height, *np.abs(corners).max(axis=0).tolist())
    return math.inf


def _straightened(pose: Pose, reach: float) -> Pose:
    """Return a pose with its z axis upright, if what reaches as far leans by a millimetre at most.

    Saved simulations leave what stands a little askew.
    """
    lean = math.hypot(pose[0, 2], pose[1, 2])
    if not lean * reach < TOLERANCE:
        return pose
    c, s = pose[:2, 0] / np.hypot(*pose[:2, 0])
    sign = 1.0 if pose[2, 2] > 0 else -1.0
    upright = pose.copy()
    upright[:3, :3] = [[c, -sign * s, 0.0], [s, sign * c, 0.0], [0.0, 0.0, sign]]
    return upright
