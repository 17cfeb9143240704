"""Compiled ray casting: block by block along each ray, against ground and convex objects.

A ray crosses the blocks of a coarse grid in order (Amanatides and Woo 1987, "A fast voxel traversal
algorithm"). A block's ground is tested only where the ray descends to its highest point, and its
objects only where the ray is between their lowest and highest point. Between two lines of the
ground's grid, diagonals among them, both ray and ground are straight: a hit is where the ray's
height above the ground changes sign, so no ray slips through an edge. Objects are convex: a ray is
inside from the last plane that it enters through to the first that it leaves through (Cyrus and
Beck 1978).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from terrain.kernel import inlined_kernel, kernel
from worlds.ray_layout import (
    GROUND_TOP,
    OBJECTS_BOTTOM,
    OBJECTS_TOP,
    GridFrame,
    Lattice,
    Layout,
)

NO_CLASS = 255
"""Class of a ray without a hit."""

_RATES = np.full(256, np.inf)
"""Expected hits per metre inside of each semantic class [1/m]; infinite where opaque."""
for _semantic, _traits in TRAITS.items():
    _RATES[_semantic] = _traits.hits_per_metre

_POROUS = np.array([int(kind) for kind in SemanticClass if np.isfinite(_RATES[kind])])
"""Semantic classes that let rays through."""


class Ray(NamedTuple):
    """A ray in the map frame.

    Attributes:
        x: Map x of the origin [m].
        y: Map y of the origin [m].
        z: Map z of the origin [m].
        dx: Component of the unit direction along x.
        dy: Component of the unit direction along y.
        dz: Component of the unit direction along z.
        ix: Inverse of ``dx``, infinite for a ray across x.
        iy: Inverse of ``dy``.
        iz: Inverse of ``dz``.
    """

    x: float
    y: float
    z: float
    dx: float
    dy: float
    dz: float
    ix: float
    iy: float
    iz: float


class _GridRay(NamedTuple):
    """A ray in coordinates of the ground's grid; its parameter stays the range [m].

    Attributes:
        u: Grid coordinate of the origin along x [cells].
        v: Grid coordinate of the origin along y [cells].
        z: Map z of the origin [m].
        du: Change of ``u`` per metre of range [cells/m].
        dv: Change of ``v`` per metre of range [cells/m].
        dz: Change of ``z`` per metre of range.
        iu: Inverse of ``du`` [m/cell].
        iv: Inverse of ``dv`` [m/cell].
    """

    u: float
    v: float
    z: float
    du: float
    dv: float
    dz: float
    iu: float
    iv: float


class _Span(NamedTuple):
    """A part of a ray; empty if it ends before it begins.

    Attributes:
        begin: Range at which it begins [m].
        end: Range at which it ends [m].
    """

    begin: float
    end: float


class _CellRange(NamedTuple):
    """Grid cells of a block, both ends included.

    Attributes:
        first_a: First cell along x.
        last_a: Last cell along x.
        first_b: First cell along y.
        last_b: Last cell along y.
    """

    first_a: int
    last_a: int
    first_b: int
    last_b: int


class _GroundHit(NamedTuple):
    """The first crossing of the ground within a block.

    Attributes:
        range: Range [m], infinite without a crossing.
        a: Grid cell along x.
        b: Grid cell along y.
        side: Side of the ground the ray began on: 1 above, -1 below, 0 unknown yet.
    """

    range: float
    a: int
    b: int
    side: int


class _Hit(NamedTuple):
    """The nearest hit of a ray so far.

    Attributes:
        range: Range [m], infinite without a hit.
        kind: Semantic class, ``NO_CLASS`` without a hit.
    """

    range: float
    kind: np.int64


class _Crossings(NamedTuple):
    """Porous objects that one ray crosses, in the order in which they were found.

    Attributes:
        enters: Range at which the ray enters each [m], shape (n,).
        leaves: Range at which the ray leaves each [m], shape (n,).
        kinds: Semantic class of each, uint8, shape (n,).
    """

    enters: NDArray[np.float64]
    leaves: NDArray[np.float64]
    kinds: NDArray[np.uint8]


@kernel
def cast_rays(
    rays: NDArray[np.float32],
    optical_depths: NDArray[np.float32],
    max_range: float,
    layout: Layout,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Write range and class of each ray's first hit; see ``RayScene.cast``.

    Args:
        rays: Origin in the map [m] and unit direction of each ray, float32, shape (n, 6).
        optical_depths: Depth in porous objects at which each ray ends, float32, shape (n,).
        max_range: Largest range [m].
        layout: The world.
        ranges: Output: ranges [m], float32, shape (n,).
        classes: Output: semantic classes, uint8, shape (n,).
    """
    # numba counts references to arrays: to unpack them for each ray, or to pass them to a function
    # for each block, would double the time. Hence one loop here, with steps on numbers.
    heights, surface, frame = layout.ground
    kinds, boxes, starts, planes = layout.objects
    lattice, tops, firsts, members = layout.blocks
    columns, rows = tops.shape[0], tops.shape[1]
    nx, ny = surface.shape
    # Index of the last ray tested against each object: one that spans many blocks is tested once.
    tested_by = np.full(len(kinds), -1, dtype=np.int64)
    # Porous objects that the ray crosses; the first ``n_porous`` of each are valid.
    enters, leaves = np.empty(len(kinds)), np.empty(len(kinds))
    porous = np.empty(len(kinds), dtype=np.uint8)
    for number in range(len(rays)):
        ray = _ray(rays, number)
        grid_ray = _to_grid(ray, frame)
        span = _span(ray, lattice, columns, rows, max_range)
        over = _over_ground(ray, frame, nx, ny, span)
        i, j = _first_block(ray, lattice, columns, rows, span.begin)
        # Ranges at which the ray reaches the next block along x and along y.
        to_i = _distance(ray.x, ray.dx, ray.ix, lattice.x_min, lattice.edge, i)
        to_j = _distance(ray.y, ray.dy, ray.iy, lattice.y_min, lattice.edge, j)
        hit, n_porous, side = _Hit(np.inf, np.int64(NO_CLASS)), 0, 0
        here, z_there = span.begin, ray.z + span.begin * ray.dz
        while here < span.end:
            there = min(to_i, to_j, span.end)
            z_here, z_there = z_there, ray.z + there * ray.dz
            low, high = min(z_here, z_there), max(z_here, z_there)
            # Ground of the block, where the ray comes down to it.
            if low <= tops[i, j, GROUND_TOP]:
                begin, until = max(here, over.begin), min(there, over.end, hit.range)
                if begin < until:
                    cells = _cells(lattice, i, j, nx, ny)
                    found = _hit_ground(heights, grid_ray, begin, until, cells, side)
                    side = found.side
                    if found.range < hit.range:
                        hit = _Hit(found.range, np.int64(surface[found.a, found.b]))
            # Objects of the block, where the ray is at their height.
            if low <= tops[i, j, OBJECTS_TOP] and high >= tops[i, j, OBJECTS_BOTTOM]:
                block = i * rows + j
                for m in range(firsts[block], firsts[block + 1]):
                    k = members[m]
                    if tested_by[k] == number:
                        continue
                    tested_by[k] = number
                    # Most objects of a block are missed: the box is the cheap test.
                    if _misses_box(ray, boxes, k, hit.range):
                        continue
                    enter, leave = _cross(planes, starts[k], starts[k + 1], ray)
                    if enter >= leave or leave <= 0:
                        continue
                    # A porous object may stop the ray anywhere inside: decided when all are known.
                    if np.isfinite(_RATES[kinds[k]]):
                        enters[n_porous], leaves[n_porous] = enter, leave
                        porous[n_porous] = kinds[k]
                        n_porous += 1
                        continue
                    distance = enter if enter > 0 else leave  # From inside, the far face is hit.
                    if distance < hit.range:
                        hit = _Hit(distance, np.int64(kinds[k]))
            if hit.range <= there:  # Nothing in the blocks to come can be nearer.
                break
            # On to the neighbour across the nearer border.
            here = there
            if to_i <= to_j:
                i += 1 if ray.dx > 0 else -1
                to_i += lattice.edge * abs(ray.ix)
            else:
                j += 1 if ray.dy > 0 else -1
                to_j += lattice.edge * abs(ray.iy)
            if i < 0 or i >= columns or j < 0 or j >= rows:
                break
        if n_porous and np.isfinite(optical_depths[number]):
            hit = _absorb(
                hit,
                optical_depths[number],
                _Crossings(enters[:n_porous], leaves[:n_porous], porous[:n_porous]),
            )
        # Objects are hit wherever the ray leaves the block: a hit beyond the range is none.
        beyond = hit.range > max_range
        ranges[number] = np.inf if beyond else hit.range
        classes[number] = NO_CLASS if beyond else hit.kind


@inlined_kernel
def _ray(rays: NDArray[np.float32], k: int) -> Ray:
    """Return one ray in double precision."""
    dx, dy, dz = np.float64(rays[k, 3]), np.float64(rays[k, 4]), np.float64(rays[k, 5])
    x, y, z = np.float64(rays[k, 0]), np.float64(rays[k, 1]), np.float64(rays[k, 2])
    return Ray(x, y, z, dx, dy, dz, 1.0 / dx, 1.0 / dy, 1.0 / dz)


@inlined_kernel
def _to_grid(ray: Ray, frame: GridFrame) -> _GridRay:
    """Return a ray in coordinates of the ground's grid."""
    return _GridRay(
        (ray.x - frame.x_min) / frame.cell,
        (ray.y - frame.y_min) / frame.cell,
        ray.z,
        ray.dx / frame.cell,
        ray.dy / frame.cell,
        ray.dz,
        frame.cell * ray.ix,
        frame.cell * ray.iy,
    )


@inlined_kernel
def _span(ray: Ray, lattice: Lattice, columns: int, rows: int, max_range: float) -> _Span:
    """Return the part of a ray inside the bounding box of all blocks."""
    x_max, y_max = lattice.x_min + columns * lattice.edge, lattice.y_min + rows * lattice.edge
    begin, end = _clip(ray.x, ray.ix, lattice.x_min, x_max, 0.0, max_range)
    begin, end = _clip(ray.y, ray.iy, lattice.y_min, y_max, begin, end)
    begin, end = _clip(ray.z, ray.iz, lattice.z_min, lattice.z_max, begin, end)
    return _Span(begin, end)


@inlined_kernel
def _over_ground(ray: Ray, frame: GridFrame, nx: int, ny: int, span: _Span) -> _Span:
    """Return the part of a span above or below the heightfield: objects may overhang it."""
    x_max, y_max = frame.x_min + nx * frame.cell, frame.y_min + ny * frame.cell
    begin, end = _clip(ray.x, ray.ix, frame.x_min, x_max, span.begin, span.end)
    begin, end = _clip(ray.y, ray.iy, frame.y_min, y_max, begin, end)
    return _Span(begin, end)


@inlined_kernel
def _first_block(
    ray: Ray, lattice: Lattice, columns: int, rows: int, begin: float
) -> tuple[int, int]:
    """Return row and column of the block at a range [m]."""
    i = int(np.floor((ray.x + begin * ray.dx - lattice.x_min) / lattice.edge))
    j = int(np.floor((ray.y + begin * ray.dy - lattice.y_min) / lattice.edge))
    # A ray that enters on the far border would begin one block too far, by rounding.
    return min(max(i, 0), columns - 1), min(max(j, 0), rows - 1)


@inlined_kernel
def _distance(
    origin: float, direction: float, inverse: float, low: float, edge: float, i: int
) -> float:
    """Return the range at which a ray leaves block ``i`` along one axis [m], infinite across it."""
    if direction == 0:
        return np.inf
    return (low + (i + (direction > 0)) * edge - origin) * inverse


@inlined_kernel
def _cells(lattice: Lattice, i: int, j: int, nx: int, ny: int) -> _CellRange:
    """Return the grid cells of a block, of which the last ones may reach beyond the ground."""
    first_a = lattice.first_i + i * lattice.cells
    first_b = lattice.first_j + j * lattice.cells
    return _CellRange(
        first_a,
        min(first_a + lattice.cells, nx) - 1,
        first_b,
        min(first_b + lattice.cells, ny) - 1,
    )


@inlined_kernel
def _misses_box(ray: Ray, boxes: NDArray[np.float64], k: int, max_range: float) -> bool:
    """Return True if a ray does not cross the bounding box of object ``k`` within a range [m]."""
    begin, end = _clip(ray.x, ray.ix, boxes[k, 0], boxes[k, 3], 0.0, max_range)
    begin, end = _clip(ray.y, ray.iy, boxes[k, 1], boxes[k, 4], begin, end)
    begin, end = _clip(ray.z, ray.iz, boxes[k, 2], boxes[k, 5], begin, end)
    return begin > end


@inlined_kernel
def _clip(
    origin: float, inverse: float, low: float, high: float, begin: float, stop: float
) -> tuple[float, float]:
    """Return the part of ``begin`` to ``stop`` [m] in which one coordinate is between two bounds.

    Source: Kay and Kajiya 1986, "Ray tracing complex scenes" (slabs).
    """
    if np.isinf(inverse):  # The ray runs along the slab: it is inside all the way, or never.
        if origin < low or origin > high:
            stop = -1.0
    else:
        a, b = (low - origin) * inverse, (high - origin) * inverse
        begin, stop = max(begin, min(a, b)), min(stop, max(a, b))
    return begin, stop


@inlined_kernel
def cell_height(h00: float, h10: float, h01: float, h11: float, u: float, v: float) -> float:
    """Return the height of the two triangles of a grid cell [m]; ``u`` and ``v`` from 0 to 1."""
    if u + v <= 1.0:
        return h00 + u * (h10 - h00) + v * (h01 - h00)
    return h11 + (1.0 - u) * (h01 - h11) + (1.0 - v) * (h10 - h11)


@inlined_kernel
def _hit_ground(
    heights: NDArray[np.float32],
    ray: _GridRay,
    begin: float,
    stop: float,
    cells: _CellRange,
    side: int,
) -> _GroundHit:
    """Return the first crossing of the ground between two ranges, by a walk from cell to cell.

    Args:
        heights: Heights at the grid's corners [m], shape (nx, ny).
        ray: The ray in grid coordinates.
        begin: Range at which the walk begins [m].
        stop: Range at which the walk ends [m].
        cells: Cells of the block.
        side: Side of the ground the ray began on, 0 if unknown yet.
    """
    a = min(max(int(np.floor(ray.u + begin * ray.du)), cells.first_a), cells.last_a)
    b = min(max(int(np.floor(ray.v + begin * ray.dv)), cells.first_b), cells.last_b)
    found, t, above, known = np.inf, begin, 0.0, False
    while True:
        to_a = (a + (ray.du > 0) - ray.u) * ray.iu if ray.du != 0 else np.inf
        to_b = (b + (ray.dv > 0) - ray.v) * ray.iv if ray.dv != 0 else np.inf
        after = min(to_a, to_b, stop)
        h00, h10 = np.float64(heights[a, b]), np.float64(heights[a + 1, b])
        h01, h11 = np.float64(heights[a, b + 1]), np.float64(heights[a + 1, b + 1])
        if min(ray.z + t * ray.dz, ray.z + after * ray.dz) > max(max(h00, h10), max(h01, h11)):
            # Most cells are passed high above: no height needs to be interpolated.
            side, known = 1, False
        else:
            u, v = ray.u + t * ray.du - a, ray.v + t * ray.dv - b
            if not known:
                above, known = ray.z + t * ray.dz - cell_height(h00, h10, h01, h11, u, v), True
                if side == 0:
                    side = 1 if above >= 0 else -1
                if above * side < 0:  # The sign changed on the line between two blocks.
                    found = t
                    break
            # The diagonal parts the cell into two triangles: the sign is tested there, too.
            middle = t + (1.0 - u - v) / (ray.du + ray.dv)
            if t < middle < after:
                u = ray.u + middle * ray.du - a
                at: float = ray.z + middle * ray.dz - (h10 * u + h01 * (1.0 - u))
                if at * side < 0:
                    found = t + above / (above - at) * (middle - t)
                    break
                t, above = middle, at
            u, v = ray.u + after * ray.du - a, ray.v + after * ray.dv - b
            at = ray.z + after * ray.dz - cell_height(h00, h10, h01, h11, u, v)
            if at * side < 0:
                found = t + above / (above - at) * (after - t)
                break
            above = at
        if after >= stop:
            break
        t = after
        if to_a <= to_b:
            a += 1 if ray.du > 0 else -1
        else:
            b += 1 if ray.dv > 0 else -1
        if a < cells.first_a or a > cells.last_a or b < cells.first_b or b > cells.last_b:
            break
    return _GroundHit(found, a, b, side)


@kernel
def _cross(planes: NDArray[np.float64], first: int, last: int, ray: Ray) -> tuple[float, float]:
    """Return the ranges [m] at which a ray enters and leaves a convex object.

    The ray misses the object if it leaves before it enters.
    """
    enter, leave = -np.inf, np.inf
    for p in range(first, last):
        nx, ny, nz = planes[p, 0], planes[p, 1], planes[p, 2]
        rate = nx * ray.dx + ny * ray.dy + nz * ray.dz
        depth = planes[p, 3] - (nx * ray.x + ny * ray.y + nz * ray.z)
        if rate < 0:
            enter = max(enter, depth / rate)
        elif rate > 0:
            leave = min(leave, depth / rate)
        elif depth < 0:  # Parallel to the face, and outside of it.
            leave = -np.inf
        if enter > leave:
            break
    return enter, leave


@kernel
def _absorb(hit: _Hit, optical_depth: float, crossings: _Crossings) -> _Hit:
    """Return the hit of a ray that porous objects stop at an optical depth.

    Between two borders of the objects that the ray is in, its depth grows by the sum of the rates
    of their classes, each class once: two overlapping bushes are one bush.

    Args:
        hit: Hit without the porous objects.
        optical_depth: Depth at which the ray ends.
        crossings: Porous objects that the ray crosses.
    """
    here = 0.0
    while here < hit.range:
        density, fastest, densest, border = 0.0, 0.0, NO_CLASS, hit.range
        for kind in _POROUS:
            inside = False
            for n in range(len(crossings.kinds)):
                if crossings.kinds[n] == kind and crossings.enters[n] <= here < crossings.leaves[n]:
                    inside, border = True, min(border, crossings.leaves[n])
                elif crossings.enters[n] > here:
                    border = min(border, crossings.enters[n])
            if inside:
                density += _RATES[kind]
                # The densest class is the most likely to have stopped the ray.
                if _RATES[kind] > fastest:
                    fastest, densest = _RATES[kind], kind
        if density > 0:
            if density * (border - here) > optical_depth:
                return _Hit(here + optical_depth / density, np.int64(densest))
            optical_depth -= density * (border - here)
        here = border
    return hit
