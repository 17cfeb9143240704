"""Where a ray meets the ground within a block: from cell to cell of the heightfield.

Between two lines of the ground's grid, diagonals among them, both ray and ground are straight: a
hit is where the ray's height above the ground changes sign, so no ray slips through an edge.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel
from worlds.rays.geometry import Ray, Span, clip
from worlds.rays.layout import GridFrame, Lattice, Lid

_MARGIN = 1e-6
"""Range by which a walk begins before a ray comes down to the highest ground [m], for rounding."""


class GridRay(NamedTuple):
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


class CellRange(NamedTuple):
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


class GroundHit(NamedTuple):
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


@inlined_kernel
def to_grid(ray: Ray, frame: GridFrame) -> GridRay:
    """Return a ray in coordinates of the ground's grid."""
    return GridRay(
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
def over_ground(ray: Ray, frame: GridFrame, nx: int, ny: int, span: Span) -> Span:
    """Return the part of a span above or below the heightfield: objects may overhang it."""
    x_max, y_max = frame.x_min + nx * frame.cell, frame.y_min + ny * frame.cell
    begin, end = clip(ray.x, ray.ix, frame.x_min, x_max, span.begin, span.end)
    begin, end = clip(ray.y, ray.iy, frame.y_min, y_max, begin, end)
    return Span(begin, end)


@inlined_kernel
def block_cells(lattice: Lattice, i: int, j: int, nx: int, ny: int) -> CellRange:
    """Return the grid cells of a block, of which the last ones may reach beyond the ground."""
    first_a = lattice.first_i + i * lattice.cells
    first_b = lattice.first_j + j * lattice.cells
    return CellRange(
        first_a,
        min(first_a + lattice.cells, nx) - 1,
        first_b,
        min(first_b + lattice.cells, ny) - 1,
    )


@inlined_kernel
def start_of_walk(ray: Ray, lid: Lid, begin: float, stop: float, side: int) -> tuple[float, int]:
    """Return the range at which a ray may first meet the ground of a block [m], and its side.

    A ray that begins above the ground is above all of it until it comes down to the lid.

    Args:
        ray: The ray.
        lid: Plane above the ground of the block.
        begin: Range at which the ray enters the block [m].
        stop: Range at which it leaves the block [m]; returned if it does not come down to the lid.
        side: Side of the ground the ray began on, 0 if unknown yet.
    """
    if side < 0:
        return begin, side
    above = ray.z - lid.z - lid.dx * ray.x - lid.dy * ray.y
    fall = lid.dx * ray.dx + lid.dy * ray.dy - ray.dz
    if above - fall * begin <= 0:
        return begin, side
    if above - fall * stop > 0:
        return stop, 1
    return max(begin, above / fall - _MARGIN), 1


@inlined_kernel
def cell_height(h00: float, h10: float, h01: float, h11: float, u: float, v: float) -> float:
    """Return the height of the two triangles of a grid cell [m]; ``u`` and ``v`` from 0 to 1."""
    # Which one is a matter of chance: to compute both is faster than to guess.
    near = h00 + u * (h10 - h00) + v * (h01 - h00)
    far = h11 + (1.0 - u) * (h01 - h11) + (1.0 - v) * (h10 - h11)
    return near if u + v <= 1.0 else far


@inlined_kernel
def hit_ground(
    heights: NDArray[np.float32],
    ray: GridRay,
    begin: float,
    stop: float,
    cells: CellRange,
    side: int,
) -> GroundHit:
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
    range_of_hit, t, above, known = np.inf, begin, 0.0, False
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
                    range_of_hit = t
                    break
            # The diagonal parts the cell into two triangles: the sign is tested there, too.
            middle = t + (1.0 - u - v) / (ray.du + ray.dv)
            if t < middle < after:
                u = ray.u + middle * ray.du - a
                at: float = ray.z + middle * ray.dz - (h10 * u + h01 * (1.0 - u))
                if at * side < 0:
                    range_of_hit = t + above / (above - at) * (middle - t)
                    break
                t, above = middle, at
            u, v = ray.u + after * ray.du - a, ray.v + after * ray.dv - b
            at = ray.z + after * ray.dz - cell_height(h00, h10, h01, h11, u, v)
            if at * side < 0:
                range_of_hit = t + above / (above - at) * (after - t)
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
    return GroundHit(range_of_hit, a, b, side)
