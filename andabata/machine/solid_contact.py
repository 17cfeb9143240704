"""Contact of boxes and discs with the solid objects of a world, which are convex.

A box is apart from an object if a plane along one of the box's sides or of the object's faces parts
them; the plane that parts them most, or that they overlap least, gives distance and normal. Planes
along an edge of each are left out: two edges that cross may count as touching up to a centimetre
early (assumption). A disc meets an object at the point that is nearest to its centre, as a wheel
meets a stone.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.vectors import Axes, Vector, added, dot, to_map
from terrain.classes import TRAITS
from terrain.kernel import kernel
from worlds.rays.layout import Blocks, ConvexObjects, build_layout
from worlds.world import World

_SAME_DEPTH = 0.01
"""Difference of depth up to which vertices touch a side of a box together [m]."""

_PARALLEL = 1e-9
"""Sine of an angle, and distance [m], that count as none."""

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
    """Point of an object that is nearest to the centre of a disc, in the disc's plane.

    Attributes:
        distance: Distance of the point [m], infinite if the disc is apart.
        way: Unit vector from the centre to the point.
    """

    distance: float
    way: Vector


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
    apart = False
    for c in range(3):
        apart |= box[c] > place[c] + reach or box[3 + c] < place[c] - reach
    return not apart


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
    low, high = _extent(centre, axes, solids, k, axes.up, -np.inf)
    gap, normal = -np.inf, axes.up
    for c in range(3):
        if low[c] - half[c] > gap:
            gap, normal = low[c] - half[c], (-axes[c][0], -axes[c][1], -axes[c][2])
        if -half[c] - high[c] > gap:
            gap, normal = -half[c] - high[c], axes[c]
    side_gap, planes = gap, solids.objects.planes
    for p in range(solids.objects.starts[k], solids.objects.starts[k + 1]):
        plane = (planes[p, 0], planes[p, 1], planes[p, 2])
        distance = dot(plane, centre) - planes[p, 3] - _span(plane, axes, half)
        if distance > gap:
            gap, normal = distance, plane
    if gap == side_gap:
        # A side of the box touches what is nearest to it; a face of the object, all of the box.
        nearest = dot(normal, centre) - _span(normal, axes, half) - gap - _SAME_DEPTH
        low, high = _extent(centre, axes, solids, k, normal, nearest)
    x = _along(dot(normal, axes.forward), max(low[0], -half[0]), min(high[0], half[0]))
    y = _along(dot(normal, axes.left), max(low[1], -half[1]), min(high[1], half[1]))
    # Wheels that push lift the front: an upright side leans on its lowest point.
    bottom, top = max(low[2], -half[2]), min(high[2], half[2])
    z = top if dot(normal, axes.up) < -0.5 else bottom
    return BoxContact(gap, normal, added(centre, to_map(axes, x, y, z), 1.0))


@kernel
def _span(way: Vector, axes: Axes, half: Vector) -> float:
    """Return how far a box reaches from its middle in a direction [m]."""
    reach: float = abs(dot(way, axes.forward)) * half[0] + abs(dot(way, axes.left)) * half[1]
    return reach + abs(dot(way, axes.up)) * half[2]


@kernel
def _extent(
    centre: Vector, axes: Axes, solids: Solids, k: int, way: Vector, least: float
) -> tuple[Vector, Vector]:
    """Return the extent along the axes of a box of the vertices that reach far enough [m].

    Args:
        centre: Middle of the box in the map [m].
        axes: Axes of the box.
        solids: Solid objects.
        k: Index of the object.
        way: Direction in the map.
        least: Coordinate along it up to which vertices are left out [m].
    """
    low_x, low_y, low_z = np.inf, np.inf, np.inf
    high_x, high_y, high_z = -np.inf, -np.inf, -np.inf
    vertices = solids.vertices
    for v in range(solids.starts[k], solids.starts[k + 1]):
        vertex = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        if dot(vertex, way) < least:
            continue
        away = added(vertex, centre, -1.0)
        x, y, z = dot(away, axes.forward), dot(away, axes.left), dot(away, axes.up)
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        low_z, high_z = min(low_z, z), max(high_z, z)
    return (low_x, low_y, low_z), (high_x, high_y, high_z)


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
def meet_disc(centre: Vector, axes: Axes, reach: float, solids: Solids, k: int) -> DiscContact:
    """Return the point of an object that is nearest to the centre of a disc, in the disc's plane.

    The plane cuts a convex polygon out of the object, each face a line. The nearest point is on a
    line that has the centre outside, within the part of it that the other lines leave.

    Args:
        centre: Centre of the disc in the map [m].
        axes: Axes of the body; the disc's own axis is the body's y axis.
        reach: Distance up to which a point counts [m].
        solids: Solid objects.
        k: Index of the object.
    """
    nearest, ahead, above, outside = np.inf, 0.0, -1.0, False
    for p in range(solids.objects.starts[k], solids.objects.starts[k + 1]):
        a, b, room = _line(solids.objects.planes[p], centre, axes)
        if room < -reach:
            return DiscContact(np.inf, axes.up)
        if room >= 0.0 or (a == 0.0 and b == 0.0):
            outside |= room < 0.0
            continue
        outside, low, high = True, -np.inf, np.inf
        for q in range(solids.objects.starts[k], solids.objects.starts[k + 1]):
            c, d, left = _line(solids.objects.planes[q], centre, axes)
            # Along line p, which begins at the foot of the perpendicular from the centre.
            slope, left = a * d - b * c, left - room * (a * c + b * d)
            if slope > _PARALLEL:
                high = min(high, left / slope)
            elif slope < -_PARALLEL:
                low = max(low, left / slope)
            elif left < -_PARALLEL:
                high = -np.inf
        at = min(max(0.0, low), high)
        if low <= high and np.hypot(room, at) < nearest:
            nearest = np.hypot(room, at)
            ahead, above = (a * room - b * at) / nearest, (b * room + a * at) / nearest
    # A disc whose centre is inside is pushed up.
    return DiscContact(nearest if outside else 0.0, to_map(axes, ahead, 0.0, above))


@kernel
def _line(plane: NDArray[np.float64], centre: Vector, axes: Axes) -> tuple[float, float, float]:
    """Return the line in which a plane cuts a disc's plane.

    Returns:
        Unit normal along the body's x and z axis, and how far the disc's centre is inside of the
        line [m]; for a plane that is parallel to the disc, a normal of zero and how far the centre
        is inside of the plane.
    """
    normal = plane[0], plane[1], plane[2]
    a, b, room = dot(normal, axes.forward), dot(normal, axes.up), plane[3] - dot(normal, centre)
    size = np.hypot(a, b)
    if size < _PARALLEL:
        return 0.0, 0.0, room
    return a / size, b / size, room / size
