"""Compiled ray casting: block by block along each ray, against ground and convex objects.

A ray crosses the blocks of a coarse grid in order (Amanatides and Woo 1987, "A fast voxel traversal
algorithm"). A block's ground (``worlds.rays.ground``) is tested only where the ray descends to its
highest point, and its objects (``worlds.rays.objects``) only where the ray is between their lowest
and highest point.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.kernel import borrowing_kernel, inlined_kernel, kernel
from worlds.rays.cover import stop_in_cover
from worlds.rays.geometry import NO_CLASS, Hit, Ray, Span, clip, read_ray
from worlds.rays.ground import block_cells, hit_ground, over_ground, start_of_walk, to_grid
from worlds.rays.layout import GROUND_TOP, OBJECTS_BOTTOM, OBJECTS_TOP, Lattice, Layout, Lid
from worlds.rays.objects import RATES, Crossings, absorb, cross, misses_box
from worlds.rays.packet import PACKET, packet_span

NO_TIMES = np.empty(0)
"""Times of rays of which none has one."""


@kernel
def cast_rays(
    rays: NDArray[np.float32],
    optical_depths: NDArray[np.float32],
    times: NDArray[np.float64],
    max_range: float,
    layout: Layout,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Write range and class of each ray's first hit; see ``RayScene.cast``.

    Args:
        rays: Origin in the map [m] and unit direction of each ray, float32, shape (n, 6).
        optical_depths: Depth in porous objects at which each ray ends, float32, shape (n,).
        times: Time of each ray [s], shape (n,), or ``NO_TIMES`` for time 0.
        max_range: Largest range [m].
        layout: The world.
        ranges: Output: ranges [m], float32, shape (n,).
        classes: Output: semantic classes, uint8, shape (n,).
    """
    count = len(layout.objects.kinds)
    tested_by = np.full(count, -1, dtype=np.int64)
    crossings = Crossings(np.empty(count), np.empty(count), np.empty(count, dtype=np.uint8))
    _cast_rays(
        rays, optical_depths, times, max_range, layout, tested_by, crossings, ranges, classes
    )


@borrowing_kernel
def _cast_rays(
    rays: NDArray[np.float32],
    optical_depths: NDArray[np.float32],
    times: NDArray[np.float64],
    max_range: float,
    layout: Layout,
    tested_by: NDArray[np.int64],
    crossings: Crossings,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Write range and class of each ray's first hit, as ``cast_rays``.

    It creates no arrays, so that it need not count references to those of the world, for each ray
    and each object: that took 6 % of the time.

    Args:
        rays: Rays as in ``cast_rays``.
        optical_depths: Depths as in ``cast_rays``.
        times: Times as in ``cast_rays``.
        max_range: Largest range [m].
        layout: The world.
        tested_by: Index of the last ray tested against each object, -1 before the first: one that
            spans many blocks is tested once; shape (n,).
        crossings: Memory for the porous objects that a ray crosses, shape (n,) each.
        ranges: Output: ranges [m].
        classes: Output: semantic classes.
    """
    heights, surface, cover, frame = layout.ground
    kinds, boxes, starts, planes = layout.objects
    lattice, tops, lids, firsts, members = layout.blocks
    columns, rows = tops.shape[0], tops.shape[1]
    nx, ny = surface.shape
    enters, leaves, porous = crossings  # The first ``n_porous`` of each are valid.
    reach = Span(0.0, max_range)
    for number in range(len(rays)):
        if number % PACKET == 0:
            begin, end = packet_span(rays[number : number + PACKET], lattice, tops, max_range)
            reach = Span(begin, end)
        if not reach.begin < reach.end:
            ranges[number], classes[number] = np.inf, NO_CLASS
            continue
        ray = read_ray(rays, number)
        grid_ray = to_grid(ray, frame)
        span = _span(ray, lattice, columns, rows, reach)
        over = over_ground(ray, frame, nx, ny, span)
        i, j = _first_block(ray, lattice, columns, rows, span.begin)
        # Ranges at which the ray reaches the next block along x and along y.
        to_i = _distance(ray.x, ray.dx, ray.ix, lattice.x_min, lattice.edge, i)
        to_j = _distance(ray.y, ray.dy, ray.iy, lattice.y_min, lattice.edge, j)
        hit, n_porous, side = Hit(np.inf, np.int64(NO_CLASS)), 0, 0
        here, z_there = span.begin, ray.z + span.begin * ray.dz
        while here < span.end:
            there = min(to_i, to_j, span.end)
            z_here, z_there = z_there, ray.z + there * ray.dz
            low, high = min(z_here, z_there), max(z_here, z_there)
            # Ground of the block, where the ray comes down to it.
            if low <= tops[i, j, GROUND_TOP]:
                begin, until = max(here, over.begin), min(there, over.end, hit.range)
                lid = Lid(lids[i, j, 0], lids[i, j, 1], lids[i, j, 2])
                begin, side = start_of_walk(ray, lid, begin, until, side)
                if begin < until:
                    cells = block_cells(lattice, i, j, nx, ny)
                    ground_hit = hit_ground(heights, grid_ray, begin, until, cells, side)
                    side = ground_hit.side
                    if ground_hit.range < hit.range:
                        hit = Hit(ground_hit.range, np.int64(surface[ground_hit.a, ground_hit.b]))
            # Objects of the block, where the ray is at their height.
            if low <= tops[i, j, OBJECTS_TOP] and high >= tops[i, j, OBJECTS_BOTTOM]:
                block = i * rows + j
                for m in range(firsts[block], firsts[block + 1]):
                    k = members[m]
                    if tested_by[k] == number:
                        continue
                    tested_by[k] = number
                    # Most objects of a block are missed: the box is the cheap test.
                    if misses_box(ray, boxes, k, hit.range):
                        continue
                    enter, leave = cross(planes, starts[k], starts[k + 1], ray)
                    if enter >= leave or leave <= 0:
                        continue
                    # A porous object may stop the ray anywhere inside: decided when all are known.
                    if np.isfinite(RATES[kinds[k]]):
                        enters[n_porous], leaves[n_porous] = enter, leave
                        porous[n_porous] = kinds[k]
                        n_porous += 1
                        continue
                    distance = enter if enter > 0 else leave  # From inside, the far face is hit.
                    if distance < hit.range:
                        hit = Hit(distance, np.int64(kinds[k]))
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
        if cover.size and np.isfinite(hit.range):
            stop = stop_in_cover(layout.ground, grid_ray, hit.range)
            if stop < hit.range:
                hit = Hit(stop, np.int64(SemanticClass.SHORT_GRASS))
        if n_porous and np.isfinite(optical_depths[number]):
            hit = absorb(
                ray,
                hit,
                optical_depths[number],
                Crossings(enters[:n_porous], leaves[:n_porous], porous[:n_porous]),
                layout.wind,
                times[number] if len(times) else 0.0,
            )
        # Objects are hit wherever the ray leaves the block: a hit beyond the range is none.
        beyond = hit.range > max_range
        ranges[number] = np.inf if beyond else hit.range
        classes[number] = NO_CLASS if beyond else hit.kind


@inlined_kernel
def _span(ray: Ray, lattice: Lattice, columns: int, rows: int, reach: Span) -> Span:
    """Return the part of a ray's reach inside the bounding box of all blocks."""
    x_max, y_max = lattice.x_min + columns * lattice.edge, lattice.y_min + rows * lattice.edge
    begin, end = clip(ray.x, ray.ix, lattice.x_min, x_max, reach.begin, reach.end)
    begin, end = clip(ray.y, ray.iy, lattice.y_min, y_max, begin, end)
    begin, end = clip(ray.z, ray.iz, lattice.z_min, lattice.z_max, begin, end)
    return Span(begin, end)


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
