"""Contact of boxes and discs with the solid objects of a world, which are convex.

A box is apart from an object if a plane along one of the box's sides or of the object's faces parts
them; the plane that parts them most, or that they overlap least, gives distance and normal. Planes
along an edge of each are left out: two edges that cross may count as touching up to a centimetre
early (assumption). A disc meets an object along rays from its centre, as a wheel meets a stone.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.vectors import Axes, Vector, added, dot, to_map
from terrain.classes import TRAITS
from terrain.kernel import kernel
from worlds.ray_layout import Blocks, ConvexObjects, build_layout
from worlds.ray_walk import Ray, cross_convex
from worlds.world import World

_FLAT = 0.05
"""Sine of the angle between a side and a plane up to which a contact lies inside of the side."""


class Solids(NamedTuple):
    """Solid objects of a world as compiled code reads them.

    Attributes:
        objects: Bounding boxes and planes.
        vertices: Vertices of all objects in the map [m], shape (v, 3).
        starts: Index ranges of the objects' vertices, shape (n + 1,).
        blocks: Index of the objects by place.
    """

    objects: ConvexObjects
    vertices: NDArray[np.float64]
    starts: NDArray[np.int64]
    blocks: Blocks


class BoxContact(NamedTuple):
    """Place where a box and an object touch, or are nearest.

    Attributes:
        gap: Distance between them [m], negative if they overlap; a lower bound if they are apart.
        normal: Unit vector from the object to the box.
        place: Place in the map [m].
    """

    gap: float
    normal: Vector
    place: Vector


class DiscContact(NamedTuple):
    """Ray of a disc that an object stops first.

    Attributes:
        range: Range at which it does [m], infinite if no ray meets the object.
        ray: Unit vector of the ray.
    """

    range: float
    ray: Vector


def build_solids(world: World) -> Solids:
    """Return the solid objects of a world; wheels pass through the others.

    Raises:
        ValueError: If an object is not convex.
    """
    solids = tuple(each for each in world.objects if TRAITS[each.semantic].solid)
    layout = build_layout(replace(world, objects=solids))
    vertices = np.concatenate([np.zeros((0, 3)), *(each.vertices for each in solids)])
    starts = np.cumsum([0] + [len(each.vertices) for each in solids])
    return Solids(layout.objects, vertices, starts, layout.blocks)


@kernel
def find_near(place: Vector, reach: float, solids: Solids, near: NDArray[np.int64]) -> int:
    """Write the indices of the objects whose bounding box is near a place, and return their number.

    Args:
        place: Place in the map [m].
        reach: Largest distance along each axis [m].
        solids: Solid objects.
        near: Indices, written in place; those that do not fit are left out.
    """
    lattice, blocks = solids.blocks.lattice, solids.blocks
    rows, columns = blocks.tops.shape[:2]
    first_row = max(int(np.floor((place[0] - reach - lattice.x_min) / lattice.edge)), 0)
    last_row = min(int(np.floor((place[0] + reach - lattice.x_min) / lattice.edge)), rows - 1)
    first = max(int(np.floor((place[1] - reach - lattice.y_min) / lattice.edge)), 0)
    last = min(int(np.floor((place[1] + reach - lattice.y_min) / lattice.edge)), columns - 1)
    count = 0
    for row in range(first_row, last_row + 1):
        for block in range(row * columns + first, row * columns + last + 1):
            for member in range(blocks.firsts[block], blocks.firsts[block + 1]):
                k = blocks.members[member]
                if count == len(near) or not overlaps(solids.objects.boxes[k], place, reach):
                    continue
                # An object is in each block that it overlaps.
                known = False
                for other in range(count):
                    known |= near[other] == k
                if not known:
                    near[count] = k
                    count += 1
    return count


@kernel
def overlaps(box: NDArray[np.float64], place: Vector, reach: float) -> bool:
    """Return True if a bounding box overlaps a cube around a place.

    Args:
        box: Least x, y, z, then greatest [m], shape (6,).
        place: Middle of the cube in the map [m].
        reach: Half of the cube's edge [m].
    """
    for c in range(3):
        if box[c] > place[c] + reach or box[3 + c] < place[c] - reach:
            return False
    return True


@kernel
def meet_box(centre: Vector, axes: Axes, half: Vector, solids: Solids, k: int) -> BoxContact:
    """Return where a box and an object touch, or are nearest.

    Args:
        centre: Middle of the box in the map [m].
        axes: Axes of the box.
        half: Half of its edges [m].
        solids: Solid objects.
        k: Index of the object.
    """
    # Extent of the object along the axes of the box.
    low_x, low_y, low_z = np.inf, np.inf, np.inf
    high_x, high_y, high_z = -np.inf, -np.inf, -np.inf
    vertices = solids.vertices
    for v in range(solids.starts[k], solids.starts[k + 1]):
        away = added((vertices[v, 0], vertices[v, 1], vertices[v, 2]), centre, -1.0)
        x, y, z = dot(away, axes.forward), dot(away, axes.left), dot(away, axes.up)
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        low_z, high_z = min(low_z, z), max(high_z, z)
    gap, normal = -np.inf, axes.up
    gap, normal = _apart(gap, normal, axes.forward, low_x, high_x, half[0])
    gap, normal = _apart(gap, normal, axes.left, low_y, high_y, half[1])
    gap, normal = _apart(gap, normal, axes.up, low_z, high_z, half[2])
    planes = solids.objects.planes
    for p in range(solids.objects.starts[k], solids.objects.starts[k + 1]):
        plane = (planes[p, 0], planes[p, 1], planes[p, 2])
        span = abs(dot(plane, axes.forward)) * half[0] + abs(dot(plane, axes.left)) * half[1]
        span += abs(dot(plane, axes.up)) * half[2]
        distance = dot(plane, centre) - planes[p, 3] - span
        if distance > gap:
            gap, normal = distance, plane
    x = _along(dot(normal, axes.forward), max(low_x, -half[0]), min(high_x, half[0]))
    y = _along(dot(normal, axes.left), max(low_y, -half[1]), min(high_y, half[1]))
    z = _along(dot(normal, axes.up), max(low_z, -half[2]), min(high_z, half[2]))
    return BoxContact(gap, normal, added(centre, to_map(axes, x, y, z), 1.0))


@kernel
def _apart(
    gap: float, normal: Vector, axis: Vector, low: float, high: float, half: float
) -> tuple[float, Vector]:
    """Return the larger distance along an axis of the box, and the normal that goes with it."""
    if low - half > gap:
        gap, normal = low - half, (-axis[0], -axis[1], -axis[2])
    if -half - high > gap:
        gap, normal = -half - high, axis
    return gap, normal


@kernel
def _along(component: float, low: float, high: float) -> float:
    """Return the contact's coordinate along an axis of the box [m].

    It is at the end of the overlap that faces the object, and goes over to the overlap's middle
    where the plane of contact is parallel to the axis: a side against a wall touches in its middle.

    Args:
        component: Component of the normal along the axis.
        low: Begin of the overlap of box and object along it [m].
        high: End of the overlap [m].
    """
    side = min(max(-component / _FLAT, -1.0), 1.0)
    return (low + high) / 2 + side * (high - low) / 2


@kernel
def meet_disc(
    centre: Vector, axes: Axes, fan: NDArray[np.float64], solids: Solids, k: int
) -> DiscContact:
    """Return the ray of a disc that an object stops first.

    Args:
        centre: Centre of the disc in the map [m].
        axes: Axes of the body; the disc's own axis is the body's y axis.
        fan: Directions of the rays along the body's x and z axis, shape (k, 2).
        solids: Solid objects.
        k: Index of the object.
    """
    nearest, ray = np.inf, axes.up
    first, last = solids.objects.starts[k], solids.objects.starts[k + 1]
    for f in range(len(fan)):
        way = to_map(axes, fan[f, 0], 0.0, fan[f, 1])
        enter, leave = cross_convex(solids.objects.planes, first, last, Ray(*centre, *way, 0, 0, 0))
        if leave >= max(enter, 0.0) and enter < nearest:
            nearest, ray = max(enter, 0.0), way
    return DiscContact(nearest, ray)
