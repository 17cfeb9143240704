"""The way of a ray through a world, compiled.

A ray walks from block to block of the map. It looks at the ground only where it comes down to the
block's highest, and at the things that stand in the block. Between two lines of the ground's grid,
its diagonals among them, ray and ground are straight: where the ray's height over the ground
changes sign, there it meets it, and none slips through an edge. Things are convex: a ray is inside
from the last plane that it enters by to the first that it leaves by.
"""

import numpy as np

from terrain.classes import TRAITS, SemanticClass
from terrain.kernel import inlined_kernel, kernel

NO_CLASS = 255
"""Class of a ray that meets nothing."""

_RATES = np.full(256, np.inf)
for _semantic, _traits in TRAITS.items():
    _RATES[_semantic] = _traits.hits_per_metre

_KINDS = np.array([int(kind) for kind in SemanticClass if np.isfinite(_RATES[kind])])


@inlined_kernel
def _within(origin, inverse, low, high, begin, stop):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the part of ``begin`` to ``stop`` in which a coordinate is between two bounds."""
    if np.isinf(inverse):
        if origin < low or origin > high:
            stop = -1.0
    else:
        a, b = (low - origin) * inverse, (high - origin) * inverse
        begin, stop = max(begin, min(a, b)), min(stop, max(a, b))
    return begin, stop


@inlined_kernel
def _height(h00, h10, h01, h11, u, v):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the height in a square of the ground; ``u`` and ``v`` from 0 to 1."""
    if u + v <= 1.0:
        return h00 + u * (h10 - h00) + v * (h01 - h00)
    return h11 + (1.0 - u) * (h01 - h11) + (1.0 - v) * (h10 - h11)


@inlined_kernel
def _meet_ground(  # type: ignore[no-untyped-def]  # noqa: ANN202
    heights,  # noqa: ANN001
    u0,  # noqa: ANN001
    v0,  # noqa: ANN001
    z0,  # noqa: ANN001
    du,  # noqa: ANN001
    dv,  # noqa: ANN001
    dz,  # noqa: ANN001
    iu,  # noqa: ANN001
    iv,  # noqa: ANN001
    begin,  # noqa: ANN001
    stop,  # noqa: ANN001
    bounds,  # noqa: ANN001
    side,  # noqa: ANN001
):
    """Return where a ray meets the ground between ``begin`` and ``stop``, and in which square.

    Places and directions are in squares along x and y. ``side`` is 1 above the ground, -1 below and
    0 while nobody has looked; it comes back last.
    """
    first_a, last_a, first_b, last_b = bounds
    a = min(max(int(np.floor(u0 + begin * du)), first_a), last_a)
    b = min(max(int(np.floor(v0 + begin * dv)), first_b), last_b)
    met, t, above, known = np.inf, begin, 0.0, False
    while True:
        to_a = (a + (du > 0) - u0) * iu if du != 0 else np.inf
        to_b = (b + (dv > 0) - v0) * iv if dv != 0 else np.inf
        after = min(to_a, to_b, stop)
        h00, h10 = np.float64(heights[a, b]), np.float64(heights[a + 1, b])
        h01, h11 = np.float64(heights[a, b + 1]), np.float64(heights[a + 1, b + 1])
        if min(z0 + t * dz, z0 + after * dz) > max(max(h00, h10), max(h01, h11)):
            side, known = 1, False
        else:
            u, v = u0 + t * du - a, v0 + t * dv - b
            if not known:
                above, known = z0 + t * dz - _height(h00, h10, h01, h11, u, v), True
                if side == 0:
                    side = 1 if above >= 0 else -1
                if above * side < 0:  # It met the line between two blocks.
                    met = t
                    break
            # The diagonal parts the square; the ground is straight on both sides.
            middle = t + (1.0 - u - v) / (du + dv)
            if t < middle < after:
                u = u0 + middle * du - a
                at = z0 + middle * dz - (h10 * u + h01 * (1.0 - u))
                if at * side < 0:
                    met = t + above / (above - at) * (middle - t)
                    break
                t, above = middle, at
            u, v = u0 + after * du - a, v0 + after * dv - b
            at = z0 + after * dz - _height(h00, h10, h01, h11, u, v)
            if at * side < 0:
                met = t + above / (above - at) * (after - t)
                break
            above = at
        if after >= stop:
            break
        t = after
        if to_a <= to_b:
            a += 1 if du > 0 else -1
        else:
            b += 1 if dv > 0 else -1
        if a < first_a or a > last_a or b < first_b or b > last_b:
            break
    return met, a, b, side


@kernel
def _cross_thing(planes, first, last, ox, oy, oz, dx, dy, dz):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where a ray enters and leaves a convex thing; it misses where it leaves first."""
    enter, leave = -np.inf, np.inf
    for p in range(first, last):
        nx, ny, nz = planes[p, 0], planes[p, 1], planes[p, 2]
        rate = nx * dx + ny * dy + nz * dz
        gap = planes[p, 3] - (nx * ox + ny * oy + nz * oz)
        if rate < 0:
            enter = max(enter, gap / rate)
        elif rate > 0:
            leave = min(leave, gap / rate)
        elif gap < 0:
            leave = -np.inf
        if enter > leave:
            break
    return enter, leave


@kernel
def cast_rays(  # type: ignore[no-untyped-def]  # noqa: ANN201
    rays,  # noqa: ANN001
    budgets,  # noqa: ANN001
    reach,  # noqa: ANN001
    heights,  # noqa: ANN001
    surface,  # noqa: ANN001
    frame,  # noqa: ANN001
    kinds,  # noqa: ANN001
    boxes,  # noqa: ANN001
    starts,  # noqa: ANN001
    planes,  # noqa: ANN001
    lattice,  # noqa: ANN001
    squares,  # noqa: ANN001
    tops,  # noqa: ANN001
    firsts,  # noqa: ANN001
    members,  # noqa: ANN001
    ranges,  # noqa: ANN001
    classes,  # noqa: ANN001
):
    """Walk each ray from block to block until it ends."""
    x_min, y_min, cell = frame[0], frame[1], frame[2]
    left, below, edge = lattice[0], lattice[1], lattice[2]
    per_block, first_square_x, first_square_y = squares[0], squares[1], squares[2]
    columns, rows = tops.shape[0], tops.shape[1]
    squares_x, squares_y = surface.shape
    asked = np.full(len(kinds), -1, dtype=np.int64)
    enters, leaves = np.empty(len(kinds)), np.empty(len(kinds))
    natures = np.empty(len(kinds), dtype=np.uint8)
    for ray in range(len(rays)):
        ox, oy, oz = np.float64(rays[ray, 0]), np.float64(rays[ray, 1]), np.float64(rays[ray, 2])
        dx, dy, dz = np.float64(rays[ray, 3]), np.float64(rays[ray, 4]), np.float64(rays[ray, 5])
        ix, iy, iz = 1.0 / dx, 1.0 / dy, 1.0 / dz  # Infinite for rays along an axis.
        end, kind, porous, side = np.inf, NO_CLASS, 0, 0
        # Where the ray is over the blocks, and where over the ground.
        here, stop = _within(ox, ix, left, left + columns * edge, 0.0, reach)
        here, stop = _within(oy, iy, below, below + rows * edge, here, stop)
        here, stop = _within(oz, iz, lattice[3], lattice[4], here, stop)
        over, past = _within(ox, ix, x_min, x_min + squares_x * cell, here, stop)
        over, past = _within(oy, iy, y_min, y_min + squares_y * cell, over, past)
        i = min(max(int(np.floor((ox + here * dx - left) / edge)), 0), columns - 1)
        j = min(max(int(np.floor((oy + here * dy - below) / edge)), 0), rows - 1)
        to_i = (left + (i + (dx > 0)) * edge - ox) * ix if dx != 0 else np.inf
        to_j = (below + (j + (dy > 0)) * edge - oy) * iy if dy != 0 else np.inf
        z_there = oz + here * dz
        while here < stop:
            there = min(to_i, to_j, stop)
            z_here, z_there = z_there, oz + there * dz
            low, high = min(z_here, z_there), max(z_here, z_there)
            begin, until = 0.0, -1.0
            if low <= tops[i, j, 0]:
                begin, until = max(here, over), min(there, past, end)
            if begin < until:
                first_a, first_b = first_square_x + i * per_block, first_square_y + j * per_block
                met, a, b, side = _meet_ground(
                    heights,
                    (ox - x_min) / cell,
                    (oy - y_min) / cell,
                    oz,
                    dx / cell,
                    dy / cell,
                    dz,
                    cell * ix,
                    cell * iy,
                    begin,
                    until,
                    (
                        first_a,
                        min(first_a + per_block, squares_x) - 1,
                        first_b,
                        min(first_b + per_block, squares_y) - 1,
                    ),
                    side,
                )
                if met < end:
                    end, kind = met, surface[a, b]
            if low <= tops[i, j, 1] and high >= tops[i, j, 2]:
                for n in range(firsts[i * rows + j], firsts[i * rows + j + 1]):
                    k = members[n]
                    if asked[k] == ray:
                        continue
                    asked[k] = ray
                    begin, until = _within(ox, ix, boxes[k, 0], boxes[k, 3], 0.0, end)
                    begin, until = _within(oy, iy, boxes[k, 1], boxes[k, 4], begin, until)
                    begin, until = _within(oz, iz, boxes[k, 2], boxes[k, 5], begin, until)
                    if begin > until:
                        continue
                    enter, leave = _cross_thing(
                        planes, starts[k], starts[k + 1], ox, oy, oz, dx, dy, dz
                    )
                    if enter >= leave or leave <= 0:
                        continue
                    if np.isfinite(_RATES[kinds[k]]):
                        enters[porous], leaves[porous], natures[porous] = enter, leave, kinds[k]
                        porous += 1
                        continue
                    met = enter if enter > 0 else leave
                    if met < end:
                        end, kind = met, kinds[k]
            if end <= there:
                break
            here = there
            if to_i <= to_j:
                i += 1 if dx > 0 else -1
                to_i += edge * abs(ix)
            else:
                j += 1 if dy > 0 else -1
                to_j += edge * abs(iy)
            if i < 0 or i >= columns or j < 0 or j >= rows:
                break
        if porous and np.isfinite(budgets[ray]):
            end, kind = _end_in(end, kind, budgets[ray], porous, enters, leaves, natures)
        if end > reach:
            end, kind = np.inf, NO_CLASS
        ranges[ray], classes[ray] = end, kind


@kernel
def _end_in(end, kind, budget, count, enters, leaves, natures):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return where a ray ends that crosses porous things before ``end`` [m], and in what.

    From border to border of the things that it is in, it is stopped at the sum of the rates of
    their classes, each class once: two overlapping bushes are one bush.
    """
    here = 0.0
    while here < end:
        density, fastest, densest, border = 0.0, 0.0, NO_CLASS, end
        for kind_ in _KINDS:
            inside = False
            for n in range(count):
                if natures[n] == kind_ and enters[n] <= here < leaves[n]:
                    inside, border = True, min(border, leaves[n])
                elif enters[n] > here:
                    border = min(border, enters[n])
            if inside:
                density += _RATES[kind_]
                if _RATES[kind_] > fastest:
                    fastest, densest = _RATES[kind_], kind_
        if density > 0:
            if density * (border - here) > budget:
                return here + budget / density, densest
            budget -= density * (border - here)
        here = border
    return end, kind
