"""Footprints of robots on flat ground: convex outlines, and whether they touch anything.

Contact is exact: a circle touches where the distance of its centre from the outline is less than
its radius, a box or a wall where no line parallel to one of the sides of both separates them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

Corners = tuple[tuple[float, float], ...]
"""Corners of a convex outline around the robot's centre, counter-clockwise, x ahead [m]."""


class Obstacles(NamedTuple):
    """What stands in the plane.

    Attributes:
        boxes: x_min, y_min, x_max, y_max [m], shape (n, 4).
        circles: x, y, radius [m], shape (m, 3).
        walls: Straight walls without thickness: x, y at both ends [m], shape (k, 4).
    """

    boxes: NDArray[np.float64]
    circles: NDArray[np.float64]
    walls: NDArray[np.float64]


def box_footprint(length: float, width: float) -> Corners:
    """Return the footprint of a box with the robot's centre in its middle.

    Args:
        length: Extent along the heading [m].
        width: Extent across it [m].
    """
    x, y = length / 2, width / 2
    return (x, -y), (x, y), (-x, y), (-x, -y)


def check_convex(corners: Corners) -> Corners:
    """Return a footprint after a check of its shape.

    Raises:
        ValueError: If it is not convex and counter-clockwise around the robot's centre.
    """
    sides = list(zip(corners, corners[1:] + corners[:1], strict=True))
    around = [a[0] * b[1] - a[1] * b[0] for a, b in sides]
    turns = [
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        for (a, b), (_, c) in zip(sides, sides[1:] + sides[:1], strict=True)
    ]
    if len(corners) < 3 or min(around) <= 0 or min(turns) <= 0:
        raise ValueError(
            "footprint: expected three or more corners of a convex outline, counter-clockwise "
            f"around (0, 0), got {corners}"
        )
    return corners


def reach_of(corners: Corners) -> float:
    """Return the distance of the farthest corner from the robot's centre [m]."""
    return max(math.hypot(x, y) for x, y in corners)


def inner_radius_of(corners: Corners) -> float:
    """Return the distance of the nearest side's line from the robot's centre [m]."""
    sides = zip(corners, corners[1:] + corners[:1], strict=True)
    return min((a[0] * b[1] - a[1] * b[0]) / math.dist(a, b) for a, b in sides)


@kernel
def touches(
    x: float, y: float, yaw: float, corners: NDArray[np.float64], reach: float, around: Obstacles
) -> bool:
    """Return True if a footprint touches an obstacle.

    Args:
        x: Position of the robot [m].
        y: Position of the robot [m].
        yaw: Heading [rad].
        corners: Corners of the footprint in the robot's frame [m], shape (c, 2).
        reach: Distance of the farthest corner from the robot's centre [m].
        around: Obstacles.
    """
    cosine, sine = np.cos(yaw), np.sin(yaw)
    for k in range(len(around.circles)):
        dx, dy = around.circles[k, 0] - x, around.circles[k, 1] - y
        radius = around.circles[k, 2]
        # Most circles are far: their distance from the robot's centre tells.
        if dx * dx + dy * dy >= (reach + radius) ** 2:
            continue
        ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
        if outline_distance(ahead, left, corners) < radius:
            return True
    for k in range(len(around.boxes)):
        west, south, east, north = around.boxes[k]
        dx, dy = max(west - x, 0.0, x - east), max(south - y, 0.0, y - north)
        if dx * dx + dy * dy < reach * reach and _meets_box(
            x, y, cosine, sine, corners, around.boxes[k]
        ):
            return True
    for k in range(len(around.walls)):
        if _meets_wall(x, y, cosine, sine, corners, around.walls[k]):
            return True
    return False


@kernel
def outline_distance(x: float, y: float, corners: NDArray[np.float64]) -> float:
    """Return the distance of a point from a convex outline [m], 0 inside.

    Args:
        x: Place in the outline's frame [m].
        y: Place in the outline's frame [m].
        corners: Corners, counter-clockwise [m], shape (c, 2).
    """
    squared, inside = np.inf, True
    last = len(corners) - 1
    for k in range(len(corners)):
        ax, ay = corners[last]
        dx, dy = corners[k, 0] - ax, corners[k, 1] - ay
        px, py = x - ax, y - ay
        inside = inside and dx * py - dy * px >= 0.0
        share = min(max((px * dx + py * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        px, py = px - share * dx, py - share * dy
        squared = min(squared, px * px + py * py)
        last = k
    return 0.0 if inside else np.sqrt(squared)


@kernel
def _meets_box(
    x: float,
    y: float,
    cosine: float,
    sine: float,
    corners: NDArray[np.float64],
    box: NDArray[np.float64],
) -> bool:
    """Return True if no side of a footprint or of a box along the axes separates both."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for k in range(len(corners)):
        px = x + cosine * corners[k, 0] - sine * corners[k, 1]
        py = y + sine * corners[k, 0] + cosine * corners[k, 1]
        low_x, high_x = min(low_x, px), max(high_x, px)
        low_y, high_y = min(low_y, py), max(high_y, py)
    if low_x >= box[2] or high_x <= box[0] or low_y >= box[3] or high_y <= box[1]:
        return False
    # The box's corners in the robot's frame, from which the sides of the footprint are seen.
    found = np.empty((4, 2))
    for k in range(4):
        dx, dy = box[2 * (k % 2)] - x, box[1 + 2 * (k // 2)] - y
        found[k, 0], found[k, 1] = cosine * dx + sine * dy, cosine * dy - sine * dx
    return not _is_beyond_a_side(corners, found)


@kernel
def _meets_wall(
    x: float,
    y: float,
    cosine: float,
    sine: float,
    corners: NDArray[np.float64],
    wall: NDArray[np.float64],
) -> bool:
    """Return True if neither a wall's line nor a side of a footprint separates both."""
    ends = np.empty((2, 2))
    for k in range(2):
        dx, dy = wall[2 * k] - x, wall[2 * k + 1] - y
        ends[k, 0], ends[k, 1] = cosine * dx + sine * dy, cosine * dy - sine * dx
    dx, dy = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1]
    low, high = np.inf, -np.inf
    for k in range(len(corners)):
        side = dx * (corners[k, 1] - ends[0, 1]) - dy * (corners[k, 0] - ends[0, 0])
        low, high = min(low, side), max(high, side)
    if low >= 0.0 or high <= 0.0:
        return False
    return not _is_beyond_a_side(corners, ends)


@kernel
def _is_beyond_a_side(corners: NDArray[np.float64], points: NDArray[np.float64]) -> bool:
    """Return True if all points are outside of one side of an outline, in the outline's frame."""
    last = len(corners) - 1
    for k in range(len(corners)):
        ax, ay = corners[last]
        dx, dy = corners[k, 0] - ax, corners[k, 1] - ay
        apart = True
        for p in range(len(points)):
            apart = apart and dx * (points[p, 1] - ay) - dy * (points[p, 0] - ax) <= 0.0
        if apart:
            return True
        last = k
    return False
