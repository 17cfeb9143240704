"""The arrays that rays are cast against: a heightfield, convex objects, and blocks that index both.

``build_layout`` makes them once per world; ``worlds.rays.walk`` reads them for each ray. All are
named tuples, which compiled code takes as they are.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from terrain.objects import SceneObject, bounds
from worlds.rays.wind import STILL_AIR, WIND_PERIOD, Wind
from worlds.world import World

BLOCK = 1.0
"""Approximate edge of a block [m]: a whole number of grid cells."""

GROUND_TOP, OBJECTS_TOP, OBJECTS_BOTTOM = range(3)
"""Columns of ``Blocks.tops``."""

_LIFT = 1e-6
"""Height of a lid above the highest ground that it covers [m], for rounding."""

_SAME_PLANE = 1e-4
"""Largest difference between the planes of two triangles of one face; margin of the boxes [m]."""

_NO_COVER = np.zeros((0, 0), dtype=np.uint8)
"""``Ground.cover`` of a world without low plants."""

_MAX_DENT = 0.005
"""Largest height of a vertex above another face's plane in a convex object [m]."""


class GridFrame(NamedTuple):
    """Position and resolution of the heightfield's grid.

    Attributes:
        x_min: Map x of the first grid line [m].
        y_min: Map y of the first grid line [m].
        cell: Distance between grid lines [m].
    """

    x_min: float
    y_min: float
    cell: float


class Ground(NamedTuple):
    """The heightfield.

    Attributes:
        heights: Heights at the grid's corners [m], float32, shape (nx, ny).
        surface: Semantic class of each grid cell, uint8, shape (nx - 1, ny - 1).
        cover: Height of the low plants on each grid cell [cm], uint8, shape (nx - 1, ny - 1);
            (0, 0) where there are none.
        frame: Position and resolution of the grid.
    """

    heights: NDArray[np.float32]
    surface: NDArray[np.uint8]
    cover: NDArray[np.uint8]
    frame: GridFrame


class ConvexObjects(NamedTuple):
    """Convex objects as the planes of their faces.

    Attributes:
        kinds: Semantic class of each object, uint8, shape (n,).
        boxes: Bounding box of each object, least x, y, z, then greatest [m], shape (n, 6).
        starts: Index ranges, shape (n + 1,): planes ``starts[k]`` to ``starts[k + 1]`` are those of
            object ``k``.
        planes: Outward unit normal of each plane and its distance from the map's origin [m], shape
            (p, 4).
    """

    kinds: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    starts: NDArray[np.int64]
    planes: NDArray[np.float64]


class Lattice(NamedTuple):
    """Position and resolution of the grid of blocks, and the world's range of heights.

    Attributes:
        x_min: Map x of the first block's edge [m].
        y_min: Map y of the first block's edge [m].
        edge: Edge of a block [m].
        z_min: Height below everything in the world [m].
        z_max: Height above everything in the world [m].
        cells: Number of grid cells along a block's edge.
        first_i: Grid cell along x at the first block's corner; negative if objects overhang.
        first_j: Grid cell along y at the first block's corner.
    """

    x_min: float
    y_min: float
    edge: float
    z_min: float
    z_max: float
    cells: int
    first_i: int
    first_j: int


class Lid(NamedTuple):
    """A plane above all ground of a block: ``z + dx * x + dy * y`` at a place in the map.

    Attributes:
        z: Its height at the map's origin [m].
        dx: Its rise along x.
        dy: Its rise along y.
    """

    z: float
    dx: float
    dy: float


class Blocks(NamedTuple):
    """Square blocks of the map, each with the range of heights of what it holds.

    Attributes:
        lattice: Position and resolution of the blocks.
        tops: Highest ground, highest and lowest point of the objects of each block [m], shape
            (bx, by, 3), columns ``GROUND_TOP``, ``OBJECTS_TOP``, ``OBJECTS_BOTTOM``.
        lids: ``Lid`` of each block's ground, shape (bx, by, 3).
        firsts: Index ranges, shape (bx * by + 1,): ``members[firsts[b]]`` to
            ``members[firsts[b + 1]]`` are the objects of block ``b``, counted row by row.
        members: Indices of objects.
    """

    lattice: Lattice
    tops: NDArray[np.float64]
    lids: NDArray[np.float64]
    firsts: NDArray[np.int64]
    members: NDArray[np.int64]


class Layout(NamedTuple):
    """A world as compiled code reads it.

    Attributes:
        ground: The heightfield.
        objects: Convex objects on it.
        blocks: Index of ground and objects by place.
        wind: Wind that moves leaves.
    """

    ground: Ground
    objects: ConvexObjects
    blocks: Blocks
    wind: Wind


def build_layout(world: World) -> Layout:
    """Return a world's arrays.

    Raises:
        ValueError: If an object is not convex.
    """
    field = world.ground
    ground = Ground(
        np.ascontiguousarray(field.heights),
        np.ascontiguousarray(world.surface),
        _NO_COVER if world.cover is None else np.ascontiguousarray(world.cover),
        GridFrame(-field.width / 2, -field.depth / 2, field.cell),
    )
    wind = Wind(world.wind, WIND_PERIOD, np.uint64(world.seed)) if world.wind else STILL_AIR
    return Layout(ground, _convex_objects(world.objects), _blocks(ground, world.objects), wind)


def _convex_objects(objects: tuple[SceneObject, ...]) -> ConvexObjects:
    """Return the planes of objects.

    Raises:
        ValueError: If an object is not convex.
    """
    vertices = np.concatenate([np.zeros((0, 3)), *(each.vertices for each in objects)])
    triangles = np.concatenate(
        [np.zeros((0, 3), dtype=np.int64), *(each.triangles.astype(np.int64) for each in objects)]
    )
    vertex_starts = np.cumsum([0] + [len(each.vertices) for each in objects])
    face_starts = np.cumsum([0] + [len(each.triangles) for each in objects])
    boxes, starts, planes, dents = _planes(vertices, triangles, vertex_starts, face_starts)
    if dents.max(initial=0.0) > _MAX_DENT:
        k = int(np.argmax(dents))
        place = ", ".join(f"{value:.1f}" for value in boxes[k, :3])
        raise ValueError(
            f"objects: expected convex objects, got a {objects[k].semantic.name.lower()} at "
            f"({place}) with a dent of {dents[k]:.2f} m; compose it of convex parts"
        )
    kinds = np.array([each.semantic for each in objects], dtype=np.uint8)
    return ConvexObjects(kinds, boxes, starts, planes)


@kernel
def _planes(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    vertex_starts: NDArray[np.int64],
    face_starts: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return bounding boxes, ``starts``, distinct planes and dents of convex meshes.

    Args:
        vertices: Vertices of all meshes [m], shape (v, 3).
        triangles: Vertex indices within each mesh, shape (t, 3).
        vertex_starts: Index ranges of the meshes' vertices, shape (n + 1,).
        face_starts: Index ranges of the meshes' triangles, shape (n + 1,).

    Returns:
        ``boxes``, ``starts`` and ``planes`` as in ``ConvexObjects``, and the height of the highest
        vertex above one of its mesh's faces [m], shape (n,).
    """
    count = len(vertex_starts) - 1
    boxes, starts = np.empty((count, 6)), np.zeros(count + 1, dtype=np.int64)
    planes, dents = np.empty((len(triangles), 4)), np.zeros(count)
    n = 0
    for k in range(count):
        corners = vertices[vertex_starts[k] : vertex_starts[k + 1]]
        _write_box(corners, boxes[k])
        for face in range(face_starts[k], face_starts[k + 1]):
            dent = _write_plane(corners, triangles[face], planes[n])
            if dent < 0:  # A triangle without area has no plane.
                continue
            dents[k] = max(dents[k], dent)
            # A flat face of many triangles is one plane: the next one overwrites a duplicate.
            n += not _is_known(planes, starts[k], n)
        starts[k + 1] = n
    return boxes, starts, planes[:n].copy(), dents


@kernel
def _write_box(corners: NDArray[np.float64], box: NDArray[np.float64]) -> None:
    """Write the bounding box of a mesh, least x, y, z, then greatest [m], with a small margin."""
    for c in range(3):
        low, high = np.inf, -np.inf
        for v in range(len(corners)):
            low, high = min(low, corners[v, c]), max(high, corners[v, c])
        box[c], box[3 + c] = low - _SAME_PLANE, high + _SAME_PLANE


@kernel
def _write_plane(
    corners: NDArray[np.float64], triangle: NDArray[np.int64], plane: NDArray[np.float64]
) -> float:
    """Write the supporting plane of a mesh along a triangle, and return its dent.

    Returns:
        Height of the mesh's highest vertex above the triangle [m]; -1 if the triangle has no area.
    """
    a, b, c = corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]
    ax, bx = b[0] - a[0], c[0] - a[0]
    ay, by = b[1] - a[1], c[1] - a[1]
    az, bz = b[2] - a[2], c[2] - a[2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    if size < 1e-12:
        return -1.0
    nx, ny, nz, offset = nx / size, ny / size, nz / size, -np.inf
    # The offset is that of the furthest vertex: rounding never cuts a corner off.
    for v in range(len(corners)):
        offset = max(offset, nx * corners[v, 0] + ny * corners[v, 1] + nz * corners[v, 2])
    plane[0], plane[1], plane[2], plane[3] = nx, ny, nz, offset
    own: float = nx * a[0] + ny * a[1] + nz * a[2]
    return offset - own


@kernel
def _is_known(planes: NDArray[np.float64], first: int, n: int) -> bool:
    """Return True if plane ``n`` is one of the planes from ``first`` on before it."""
    known = False
    for other in range(first, n):
        difference = 0.0
        for c in range(4):
            difference = max(difference, abs(planes[other, c] - planes[n, c]))
        known |= difference < _SAME_PLANE
    return known


def _blocks(ground: Ground, objects: tuple[SceneObject, ...]) -> Blocks:
    """Return the blocks of ground and objects together."""
    frame = ground.frame
    corner = np.array([frame.x_min, frame.y_min])
    cells = max(2, round(BLOCK / frame.cell))
    edge = cells * frame.cell
    lows, highs = bounds(objects)
    # Blocks that the bounding box of each object overlaps, counted from the ground's corner.
    low = np.floor((lows[:, :2] - 1e-6 - corner) / edge).astype(np.int64)
    high = np.floor((highs[:, :2] + 1e-6 - corner) / edge).astype(np.int64)
    along_x, along_y = (-(-n // cells) for n in ground.surface.shape)
    # Objects may overhang the ground: the lattice covers them, too.
    first = low.min(axis=0, initial=0)
    shape = np.maximum(high.max(axis=0, initial=0), [along_x - 1, along_y - 1]) - first + 1
    tops = np.full((*shape, 3), -np.inf)
    tops[..., OBJECTS_BOTTOM] = np.inf
    i, j = -first
    tops[i : i + along_x, j : j + along_y, GROUND_TOP] = _ground_tops(ground.heights, cells)
    lids = np.full((*shape, 3), -np.inf)
    lids[i : i + along_x, j : j + along_y] = _ground_lids(ground.heights, frame, cells)
    firsts, members = _enter_objects(low - first, high - first, lows[:, 2], highs[:, 2], tops)
    lattice = Lattice(
        x_min=float(frame.x_min + first[0] * edge),
        y_min=float(frame.y_min + first[1] * edge),
        edge=edge,
        z_min=float(min(float(ground.heights.min()), lows[:, 2].min(initial=np.inf)) - 1.0),
        z_max=float(tops[..., : OBJECTS_TOP + 1].max()) + 1.0,
        cells=cells,
        first_i=int(first[0] * cells),
        first_j=int(first[1] * cells),
    )
    return Blocks(lattice, tops, lids, firsts, members)


@kernel
def _enter_objects(
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    bottoms: NDArray[np.float32],
    peaks: NDArray[np.float32],
    tops: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return ``firsts`` and ``members`` of ``Blocks``, and write the objects' range of heights.

    Args:
        low: First block along x and y that each object's bounding box overlaps, shape (n, 2).
        high: Last block that it overlaps, shape (n, 2).
        bottoms: Lowest point of each object [m], shape (n,).
        peaks: Highest point of each object [m], shape (n,).
        tops: ``Blocks.tops``, its columns of objects changed in place.
    """
    along_x, along_y, _ = tops.shape
    firsts = np.zeros(along_x * along_y + 1, dtype=np.int64)
    for k in range(len(low)):
        for i in range(low[k, 0], high[k, 0] + 1):
            for j in range(low[k, 1], high[k, 1] + 1):
                firsts[i * along_y + j + 1] += 1
                tops[i, j, OBJECTS_TOP] = max(tops[i, j, OBJECTS_TOP], peaks[k])
                tops[i, j, OBJECTS_BOTTOM] = min(tops[i, j, OBJECTS_BOTTOM], bottoms[k])
    firsts = np.cumsum(firsts)
    filled, members = firsts.copy(), np.empty(firsts[-1], dtype=np.int64)
    for k in range(len(low)):
        for i in range(low[k, 0], high[k, 0] + 1):
            for j in range(low[k, 1], high[k, 1] + 1):
                members[filled[i * along_y + j]] = k
                filled[i * along_y + j] += 1
    return firsts, members


def _ground_tops(heights: NDArray[np.float32], cells: int) -> NDArray[np.float32]:
    """Return the highest corner of each block of ``cells`` x ``cells`` grid cells [m]."""
    along_x, along_y = (-(-(n - 1) // cells) for n in heights.shape)
    padded = np.pad(
        heights,
        [
            (0, n * cells + 1 - have)
            for n, have in zip((along_x, along_y), heights.shape, strict=True)
        ],
        mode="edge",
    )
    # The highest of the four corners of each grid cell, then the highest cell of each block.
    peaks = np.maximum.reduce(
        [padded[i : i + along_x * cells, j : j + along_y * cells] for i in (0, 1) for j in (0, 1)]
    )
    return peaks.reshape(along_x, cells, along_y, cells).max(axis=(1, 3))


@kernel
def _ground_lids(heights: NDArray[np.float32], frame: GridFrame, cells: int) -> NDArray[np.float64]:
    """Return ``Lid`` of each block of ``cells`` x ``cells`` grid cells, shape (bx, by, 3).

    Args:
        heights: Heights at the grid's corners [m], shape (nx, ny).
        frame: Position and resolution of the grid.
        cells: Number of cells along a block's edge.
    """
    nx, ny = heights.shape[0] - 1, heights.shape[1] - 1
    lids = np.empty(((nx + cells - 1) // cells, (ny + cells - 1) // cells, 3))
    for i in range(lids.shape[0]):
        for j in range(lids.shape[1]):
            a0, b0 = i * cells, j * cells
            a1, b1 = min(a0 + cells, nx), min(b0 + cells, ny)
            rise_x = rise_y = 0.0
            for b in range(b0, b1 + 1):
                rise_x += np.float64(heights[a1, b]) - np.float64(heights[a0, b])
            for a in range(a0, a1 + 1):
                rise_y += np.float64(heights[a, b1]) - np.float64(heights[a, b0])
            dx = rise_x / ((b1 - b0 + 1) * (a1 - a0) * frame.cell)
            dy = rise_y / ((a1 - a0 + 1) * (b1 - b0) * frame.cell)
            top = -np.inf
            for a in range(a0, a1 + 1):
                x = frame.x_min + a * frame.cell
                for b in range(b0, b1 + 1):
                    y = frame.y_min + b * frame.cell
                    top = max(top, np.float64(heights[a, b]) - dx * x - dy * y)
            lids[i, j, 0], lids[i, j, 1], lids[i, j, 2] = top + _LIFT, dx, dy
    return lids
