"""Outlines in the plane: hulls, triangles that fill outlines, what a slab of heights cuts out."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, Delaunay, QhullError

from worlds.sdf.meshes import Surface, is_closed, normals

Corner = tuple[float, float]

Corners = list[Corner]
"""Corners of a closed outline [m]."""

_SAME = 6
"""Number of decimals by which corners are told apart [m]."""

_THIN = 1e-6
"""Distance from a line up to which a corner is on it [m]."""

_FEW = 16
"""Number of corners up to which lines between all of them are taken for the edges."""

_SHORTEST = 1e-4
"""Length of an edge from which on triangles keep to it, unless another one crosses it [m]."""


def area(corners: Sequence[Corner]) -> float:
    """Return the area that an outline encloses [m2], negative if it runs clockwise."""
    x, y = np.array(corners).T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def hull(points: NDArray[np.float64]) -> Corners:
    """Return the convex hull of points, counter-clockwise; two corners if they are on a line.

    Args:
        points: Points [m], shape (k, 2), at least one.

    Source: Andrew's monotone chain.
    """
    ordered = sorted(set(map(tuple, np.round(points, _SAME).tolist())))
    chains: list[Corners] = []
    for line in (ordered, ordered[::-1]):
        chain: Corners = []
        for x, y in line:
            # By the corner's own distance from the new side: short sides would magnify rounding.
            while len(chain) > 1 and _offset(chain[-2], (x, y), chain[-1]) >= -_THIN:
                chain.pop()
            chain.append((x, y))
        chains.append(chain[:-1])
    return chains[0] + chains[1] or ordered


def oriented(outlines: Sequence[Corners]) -> list[Corners]:
    """Return outlines counter-clockwise, those inside of an odd number of others clockwise."""
    outlines_in_order = []
    for k, outline in enumerate(outlines):
        around = [each for j, each in enumerate(outlines) if j != k]
        hole = bool(enclosed(np.array(outline[:1]), around)[0])
        outlines_in_order.append(outline[::-1] if (area(outline) < 0) != hole else list(outline))
    return outlines_in_order


def enclosed(points: NDArray[np.float64], outlines: Iterable[Corners]) -> NDArray[np.bool_]:
    """Return True for points inside of an odd number of outlines, shape (k,).

    Args:
        points: Points [m], shape (k, 2).
        outlines: Outlines.
    """
    inside = np.zeros(len(points), dtype=np.bool_)
    x, y = points.T
    for outline in outlines:
        for (ax, ay), (bx, by) in zip(outline, [*outline[1:], outline[0]], strict=True):
            if ay != by:
                east = ax + (y - ay) / (by - ay) * (bx - ax) > x
                inside ^= ((ay <= y) != (by <= y)) & east
    return inside


def triangulated(outlines: Sequence[Corners]) -> NDArray[np.float64] | None:
    """Return triangles that fill what is inside an odd number of outlines [m], shape (t, 3, 2).

    A Delaunay triangulation whose missing edges are halved until they are there.

    Returns:
        Triangles, or None if outlines cross or enclose nothing.
    """
    numbers: dict[Corner, int] = {}
    edges = []
    for outline in outlines:
        ring = [numbers.setdefault(corner, len(numbers)) for corner in outline]
        edges += list(zip(ring, ring[1:] + ring[:1], strict=True))
    points = [np.array(corner) for corner in numbers]
    while True:
        try:
            triangles = Delaunay(np.array(points)).simplices
        except QhullError:
            return None
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        present = set(map(tuple, sides.tolist()))
        missing = [edge for edge in edges if (min(edge), max(edge)) not in present]
        if not missing:
            triangles_of_points = np.array(points)[triangles]
            return triangles_of_points[enclosed(triangles_of_points.mean(axis=1), outlines)]
        edges = [edge for edge in edges if edge not in missing]
        for a, b in missing:
            if np.hypot(*(points[b] - points[a])) < _SHORTEST:
                return None
            edges += [(a, len(points)), (len(points), b)]
            points.append((points[a] + points[b]) / 2)


def convex_in_slab(points: NDArray[np.float64], low: float, high: float) -> Corners:
    """Return the outline of what of a convex part is between two heights, seen from above.

    Args:
        points: Corners of the part [m], shape (k, 3).
        low: Least height [m].
        high: Largest height [m].

    Returns:
        Corners, counter-clockwise; fewer than three if nothing or no area is there.
    """
    z = points[:, 2]
    begins, ends = points[_lines(points).T]
    pieces = [points[(z >= low) & (z <= high)]]
    for level in (low, high):
        # From a corner below to one above, whichever comes first.
        crosses = (begins[:, 2] < level) != (ends[:, 2] < level)
        p, q = begins[crosses], ends[crosses]
        share = (level - p[:, 2:]) / (q[:, 2:] - p[:, 2:])
        pieces.append(p + share * (q - p))
    met = np.concatenate(pieces)[:, :2]
    return hull(met) if len(met) else []


def _lines(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return pairs of corners whose lines hold all edges of a convex part, shape (e, 2).

    Lines through the part's inside do no harm: of few corners all are taken.
    """
    if len(points) > _FEW:
        # Joggled, so that flat parts have a hull, too.
        triangles = ConvexHull(points, qhull_options="QJ").simplices
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        return np.unique(sides, axis=0)
    return np.stack(np.triu_indices(len(points), 1), axis=1)


def surface_in_slab(surface: Surface, low: float, high: float) -> list[Corners]:
    """Return the outlines of what of a surface is between two heights, seen from above.

    A place is solid if the upright line over it meets the solid between the heights: at the lower
    one, or on a face that looks down. So a closed surface is its section at the lower height and
    its faces that look down. A surface that is not closed has no inside: all of its faces count,
    upright ones as walls without thickness.

    Args:
        surface: Surface; a closed one has its inside behind its faces.
        low: Least height [m].
        high: Largest height [m].

    Returns:
        Outlines, counter-clockwise, holes clockwise. Those of two corners are walls.
    """
    closed = is_closed(surface.triangles)
    edges: Counter[tuple[Corner, Corner]] = Counter()
    walls: dict[tuple[Corner, Corner], None] = {}
    heights = surface.vertices[:, 2][surface.triangles]
    near = (heights.min(axis=1) <= high) & (heights.max(axis=1) >= low)
    corners = surface.vertices[surface.triangles[near]]
    for triangle, normal in zip(corners.tolist(), normals(surface)[near].tolist(), strict=True):
        points = [(x, y, z) for x, y, z in triangle]
        if closed:
            edges.update(_section(points, low, normal))
        cut = _cut(_cut(points, low, 1.0), high, -1.0)
        flat = [_rounded(corner) for corner in cut]
        ring = [corner for k, corner in enumerate(flat) if corner != flat[k - 1]]
        if len(ring) < 3 or abs(area(ring)) < _THIN**2:
            if not closed and len(set(ring)) > 1:
                walls[min(ring), max(ring)] = None
        elif not closed or normal[2] < 0:
            ring = ring if area(ring) > 0 else ring[::-1]
            edges.update(zip(ring, ring[1:] + ring[:1], strict=True))
    return [*_loops(edges), *_merged(walls)]


_Point = tuple[float, float, float]


def _crossings(points: list[_Point], level: float) -> list[tuple[int, _Point]]:
    """Return where a polygon in space crosses a height, each with the index of the corner before.

    Corners at the height count as above it.
    """
    crossings = []
    for k, (a, b) in enumerate(zip(points, points[1:] + points[:1], strict=True)):
        if (a[2] >= level) != (b[2] >= level):
            # In one order for both faces of an edge, so that rounding gives one corner.
            p, q = min(a, b), max(a, b)
            share = (level - p[2]) / (q[2] - p[2])
            met = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]), level
            crossings.append((k, met))
    return crossings


def _cut(points: list[_Point], level: float, sign: float) -> list[_Point]:
    """Return the part of a polygon in space above a height; below it, if the sign is negative."""
    met = dict(_crossings(points, level))
    corners = []
    for k, point in enumerate(points):
        if (point[2] >= level) == (sign > 0):
            corners.append(point)
        if k in met:
            corners.append(met[k])
    return corners


def _section(
    points: list[_Point], level: float, normal: Sequence[float]
) -> list[tuple[Corner, Corner]]:
    """Return the edge in which a triangle crosses a height, with the inside on the left."""
    met = [_rounded(point) for _, point in _crossings(points, level)]
    if len(set(met)) < 2:
        return []
    (ax, ay), (bx, by) = met
    outside = (by - ay) * normal[0] - (bx - ax) * normal[1]
    return [(met[0], met[1]) if outside > 0 else (met[1], met[0])]


def _loops(edges: Counter[tuple[Corner, Corner]]) -> list[Corners]:
    """Return edges as closed outlines; an edge and one back are none, what stays open is walls."""
    following: dict[Corner, list[Corner]] = defaultdict(list)
    for (a, b), count in edges.items():
        following[a] += [b] * max(count - edges.get((b, a), 0), 0)
    loops = []
    for first in list(following):
        while following[first]:
            ring = [first]
            while following[ring[-1]] and (len(ring) == 1 or ring[-1] != first):
                ring.append(following[ring[-1]].pop())
            if ring[-1] == first:
                loops.append(_straightened(ring[:-1]))
            else:
                loops += [list(edge) for edge in pairwise(ring)]
    return loops


def _merged(walls: Iterable[tuple[Corner, Corner]]) -> list[Corners]:
    """Return walls with those that overlap or touch on one line put together."""
    lines: dict[tuple[float, ...], list[tuple[float, float]]] = defaultdict(list)
    for (ax, ay), (bx, by) in walls:
        # Corners are ordered: lines point east, upright ones north.
        dx, dy = bx - ax, by - ay
        size = float(np.hypot(dx, dy))
        dx, dy = dx / size, dy / size
        line = round(dx, _SAME), round(dy, _SAME), round(dx * ay - dy * ax, _SAME - 1)
        lines[line].append((dx * ax + dy * ay, dx * bx + dy * by))
    merged = []
    for (dx, dy, aside), spans in lines.items():
        whole: list[list[float]] = []
        for begin, end in sorted(spans):
            if whole and begin <= whole[-1][1] + _THIN:
                whole[-1][1] = max(whole[-1][1], end)
            else:
                whole.append([begin, end])
        merged += [
            [_rounded((dx * along - dy * aside, dy * along + dx * aside)) for along in span]
            for span in whole
        ]
    return merged


def _straightened(ring: Corners) -> Corners:
    """Return an outline without the corners on straight lines."""
    kept: Corners = []
    for k, corner in enumerate(ring):
        before, after = kept[-1] if kept else ring[-1], ring[(k + 1) % len(ring)]
        if abs(_offset(before, after, corner)) > _THIN:
            kept.append(corner)
    return kept if len(kept) > 2 else ring


def _rounded(point: Sequence[float]) -> Corner:
    """Return x and y of a point, so rounded that equal corners are equal [m]."""
    return round(point[0], _SAME), round(point[1], _SAME)


def _offset(a: Corner, b: Corner, point: Corner) -> float:
    """Return the distance of a point from the line from a to b [m], positive to its left."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    size = float(np.hypot(dx, dy))
    if size == 0.0:
        return float(np.hypot(point[0] - a[0], point[1] - a[1]))
    return (dx * (point[1] - a[1]) - dy * (point[0] - a[0])) / size
