"""Rooms from worlds of Gazebo: what a planar laser and a low robot meet, seen from above.

A room holds what is between two heights above the ground, the *slab*. Boxes along the axes, upright
cylinders, capsules and spheres become boxes and circles; boxes at any other angle, polylines and
meshes become outlines. All of these are exact. Cylinders and capsules that lie, and ellipsoids,
become outlines whose sides cut them by a millimetre at most; what leans by less than a millimetre
over its length is taken as upright.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from worlds.rooms.room import RoomPlan
from worlds.sdf.elements import SdfError
from worlds.sdf.footprints import Footprint, footprint, is_ground, is_level
from worlds.sdf.outlines import Corners, area
from worlds.sdf.world import SdfWorld, Solid

SLAB = (0.05, 0.5)
"""Heights above the ground between which obstacles count [m]: from what wheels cannot pass to the
top of a low robot (assumption)."""

_MARGIN = 1.0
"""Distance of the room's walls from the obstacles, unless bounds are given [m] (assumption)."""

_EMPTY = 5.0
"""Half of the edge of a room without obstacles [m] (assumption)."""

_MAX_EDGE = 200.0
"""Longest edge of a room [m]."""

_EXACT = 1e-6
"""Difference of coordinates that are the same [m]."""

_DECIMALS = 6
"""Number of decimals of coordinates in a plan [m]."""

Bounds = tuple[float, float, float, float]
"""Rectangle in the world: x_min, y_min, x_max, y_max [m]."""


@dataclass(frozen=True)
class ImportedRoom:
    """A room made from a world.

    Attributes:
        plan: Room; its middle is that of the bounds, which ``plan.origin`` tells.
        ground: Height of the ground in the world [m].
        outside: Number of shapes of which nothing is in the slab and in the bounds.
    """

    plan: RoomPlan
    ground: float
    outside: int


def is_flat(world: SdfWorld) -> bool:
    """Return True if a world's ground is level everywhere."""
    return all(is_level(solid) for solid in world.solids if is_ground(solid))


def room_of(
    world: SdfWorld, slab: tuple[float, float] = SLAB, bounds: Bounds | None = None
) -> ImportedRoom:
    """Return the room of a flat world.

    Args:
        world: World.
        slab: Least and largest height above the ground of what counts [m].
        bounds: Rectangle of the world that becomes the room, with walls around it; None for the one
            that holds all obstacles and a metre around them.

    Raises:
        SdfError: If the ground is not level, or a mesh cannot be read.
        ValueError: If slab or bounds are none, or the room would be larger than 200 m.
    """
    if not slab[0] < slab[1]:
        raise ValueError(f"slab: expected the least height before the largest, got {slab}")
    ground = _ground(world.solids)
    low, high = ground + slab[0], ground + slab[1]
    shapes = [solid for solid in world.solids if not is_ground(solid)]
    prints = [footprint(solid, low, high) for solid in shapes]
    bounds = _around(prints) if bounds is None else bounds
    x_min, y_min, x_max, y_max = bounds
    if not (0 < x_max - x_min <= _MAX_EDGE and 0 < y_max - y_min <= _MAX_EDGE):
        raise ValueError(
            f"bounds: expected x_min, y_min, x_max, y_max of 0 to {_MAX_EDGE:.0f} m, got {bounds}"
        )
    kept = [each for each in prints if _is_in(each, bounds)]
    return ImportedRoom(_plan(world.name, kept, bounds), ground, len(shapes) - len(kept))


def _ground(solids: Iterable[Solid]) -> float:
    """Return the height of the highest level plane, 0 without any [m].

    Raises:
        SdfError: If there is ground that is not level.
    """
    grounds = [solid for solid in solids if is_ground(solid)]
    for solid in grounds:
        if not is_level(solid):
            raise SdfError(
                f"{solid.where}: expected level ground for a room, got hills or a slope; make a "
                f"world of it"
            )
    return max((float(solid.pose[2, 3]) for solid in grounds), default=0.0)


def _around(prints: Iterable[Footprint]) -> Bounds:
    """Return the rectangle that holds footprints, with a margin."""
    rectangles = [bounds for each in prints if (bounds := each.bounds) is not None]
    if not rectangles:
        return -_EMPTY, -_EMPTY, _EMPTY, _EMPTY
    return (
        min(each[0] for each in rectangles) - _MARGIN,
        min(each[1] for each in rectangles) - _MARGIN,
        max(each[2] for each in rectangles) + _MARGIN,
        max(each[3] for each in rectangles) + _MARGIN,
    )


def _is_in(each: Footprint, bounds: Bounds) -> bool:
    """Return True if something of a footprint is in a rectangle, as far as its own tells."""
    own = each.bounds
    return own is not None and all(
        own[k] < bounds[k + 2] and own[k + 2] > bounds[k] for k in range(2)
    )


def _plan(name: str, prints: Iterable[Footprint], bounds: Bounds) -> RoomPlan:
    """Return the plan of footprints, with the middle of the bounds as its origin."""
    x_min, y_min, x_max, y_max = bounds
    x, y = (x_min + x_max) / 2, (y_min + y_max) / 2
    boxes, circles, outlines = [], [], []
    for each in prints:
        circles += [_rounded(a - x, b - y, radius) for a, b, radius in each.circles]
        whole = all(area(outline) >= 0 for outline in each.outlines)
        for outline in each.outlines:
            corners = [(a - x, b - y) for a, b in outline]
            # A box has no holes: where there are any, they need the outline around them.
            box = _as_box(corners) if whole else None
            if box is None:
                outlines.append(tuple(_rounded(*corner) for corner in corners))
            else:
                boxes.append(_rounded(*box))
    return RoomPlan.model_validate(
        {
            "about": f"from the world {''.join(filter(str.isprintable, name))}",
            "half": _rounded((x_max - x_min) / 2, (y_max - y_min) / 2),
            "boxes": boxes,
            "circles": circles,
            "outlines": outlines,
            "origin": _rounded(x, y),
        }
    )


def _as_box(corners: Corners) -> Bounds | None:
    """Return an outline as a box, None if it is no rectangle along the axes."""
    if len(corners) != 4:
        return None
    xs, ys = sorted(x for x, _ in corners), sorted(y for _, y in corners)
    box = xs[0], ys[0], xs[3], ys[3]
    # Counter-clockwise from the corner of the least x and y.
    wanted = [(box[0], box[1]), (box[2], box[1]), (box[2], box[3]), (box[0], box[3])]
    first = min(range(4), key=lambda k: corners[k][0] + corners[k][1])
    turned = corners[first:] + corners[:first]
    fits = all(
        abs(a - c) < _EXACT and abs(b - d) < _EXACT
        for (a, b), (c, d) in zip(turned, wanted, strict=True)
    )
    return box if fits else None


def _rounded(*values: float) -> tuple[float, ...]:
    """Return coordinates with as many decimals as count."""
    return tuple(round(value, _DECIMALS) + 0.0 for value in values)
