"""What a beam meets: a heightfield and convex things on it, some of which let beams through."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from terrain.objects import SceneObject
from worlds.ray_walk import cast_rays
from worlds.world import World

_BLOCK = 1.0
"""Edge of the squares of the map that know their highest ground and their things [m], about."""


class RayScene:
    """Casts rays against a world.

    The world is laid out in blocks that know their highest ground and what stands in them
    (``worlds.ray_walk``).

    Attributes:
        layout: The world in arrays.
    """

    def __init__(self, world: World) -> None:
        """Lay out the world for rays.

        Args:
            world: Whose ground and objects are cast against.

        Raises:
            ValueError: If a thing is not convex.
        """
        ground = world.ground
        laid = Ground(
            np.ascontiguousarray(ground.heights),
            np.ascontiguousarray(world.surface),
            np.array([-ground.width / 2, -ground.depth / 2, ground.cell]),
        )
        self.layout = Layout(laid, _things(world.objects), _blocks(laid, world.objects))

    def cast(
        self,
        rays: NDArray[np.float32],
        budgets: NDArray[np.float32],
        reach: float = np.inf,
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays that grass, bushes and leaves stop with a probability per metre.

        Inside a porous volume the free path is exponential with ``hits_per_metre``; volumes may
        overlap, and a ray may begin inside of one.

        Args:
            rays: Origin in the map [m] and unit direction of each, float32, shape (n, 6).
            budgets: Optical depth of porous things at which each ray ends: standard exponential
                draws, or infinity to pass through them all, float32, shape (n,).
            reach: Nobody looks further [m]: what is met beyond counts as nothing.

        Returns:
            Ranges [m], ``inf`` where nothing is met, and semantic classes, ``NO_CLASS`` there, (n,)
            each.
        """
        ranges = np.empty(len(rays), dtype=np.float32)
        classes = np.empty(len(rays), dtype=np.uint8)
        ground, things, blocks = self.layout
        cast_rays(rays, budgets, reach, *ground, *things, *blocks, ranges, classes)
        return ranges, classes


class Ground(NamedTuple):
    """The heightfield.

    Attributes:
        heights: Of the grid's corners [m], float32, shape (nx, ny).
        surface: Class of each square, uint8, shape (nx - 1, ny - 1).
        frame: Least x and y and the distance between grid lines [m].
    """

    heights: NDArray[np.float32]
    surface: NDArray[np.uint8]
    frame: NDArray[np.float64]


class Things(NamedTuple):
    """Convex things as the planes of their faces.

    Attributes:
        kinds: Semantic class of each, uint8, shape (n,).
        boxes: Least x, y, z, then greatest, of each [m], shape (n, 6).
        starts: Planes ``starts[k]`` to ``starts[k + 1]`` are those of thing ``k``.
        planes: Outward unit normal and distance from the map's origin [m], shape (p, 4).
    """

    kinds: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    starts: NDArray[np.int64]
    planes: NDArray[np.float64]


class Blocks(NamedTuple):
    """Squares of the map, and what is in them.

    Attributes:
        lattice: Least x and y of the first block, the edge of a block, and less and more than any z
            of the world [m], shape (5,).
        squares: Grid squares along a block's edge, and the grid square at the first block's corner,
            shape (3,).
        tops: Of each block the highest ground, the highest and the lowest of its things [m], shape
            (bx, by, 3).
        firsts: Things ``firsts[b]`` to ``firsts[b + 1]`` of ``members`` are those of block ``b``,
            counted row by row.
        members: Numbers of things.
    """

    lattice: NDArray[np.float64]
    squares: NDArray[np.int64]
    tops: NDArray[np.float64]
    firsts: NDArray[np.int64]
    members: NDArray[np.int64]


class Layout(NamedTuple):
    """A world as compiled code walks through it."""

    ground: Ground
    things: Things
    blocks: Blocks


def _things(objects: tuple[SceneObject, ...]) -> Things:
    """Return the objects' planes.

    Raises:
        ValueError: If one is not convex.
    """
    corners = np.concatenate([np.zeros((0, 3)), *(thing.vertices for thing in objects)])
    triangles = np.concatenate(
        [np.zeros((0, 3), dtype=np.int64), *(thing.triangles.astype(np.int64) for thing in objects)]
    )
    firsts = np.cumsum([0] + [len(thing.vertices) for thing in objects])
    faces = np.cumsum([0] + [len(thing.triangles) for thing in objects])
    boxes, starts, planes, dents = _planes(corners, triangles, firsts, faces)
    if dents.max(initial=0.0) > _DENT:
        k = int(np.argmax(dents))
        where = ", ".join(f"{value:.1f}" for value in boxes[k, :3])
        raise ValueError(
            f"objects: expected convex things, got a {objects[k].semantic.name.lower()} at "
            f"({where}) with a dent of {dents[k]:.2f} m; put it together from convex pieces"
        )
    kinds = np.array([thing.semantic for thing in objects], dtype=np.uint8)
    return Things(kinds, boxes, starts, planes)


_SAME = 1e-4
"""Planes whose numbers are nearer than this are one: the triangles of one face."""

_DENT = 0.005
"""How far a corner may stand out over another face of a convex thing [m]."""


@kernel
def _planes(corners, triangles, firsts, faces):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return boxes around convex meshes, the planes of their faces, each once, and their dents."""
    count = len(firsts) - 1
    boxes, starts = np.empty((count, 6)), np.zeros(count + 1, dtype=np.int64)
    planes, dents = np.empty((len(triangles), 4)), np.zeros(count)
    n = 0
    for k in range(count):
        for c in range(3):
            low, high = np.inf, -np.inf
            for v in range(firsts[k], firsts[k + 1]):
                low, high = min(low, corners[v, c]), max(high, corners[v, c])
            boxes[k, c], boxes[k, 3 + c] = low - _SAME, high + _SAME
        for face in range(faces[k], faces[k + 1]):
            one = firsts[k] + triangles[face, 0]
            two = firsts[k] + triangles[face, 1]
            three = firsts[k] + triangles[face, 2]
            ax, bx = corners[two, 0] - corners[one, 0], corners[three, 0] - corners[one, 0]
            ay, by = corners[two, 1] - corners[one, 1], corners[three, 1] - corners[one, 1]
            az, bz = corners[two, 2] - corners[one, 2], corners[three, 2] - corners[one, 2]
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            size = np.sqrt(nx * nx + ny * ny + nz * nz)
            if size < 1e-12:
                continue
            nx, ny, nz, offset = nx / size, ny / size, nz / size, -np.inf
            for v in range(firsts[k], firsts[k + 1]):  # The furthest: rounded corners stay inside.
                offset = max(offset, nx * corners[v, 0] + ny * corners[v, 1] + nz * corners[v, 2])
            own = nx * corners[one, 0] + ny * corners[one, 1] + nz * corners[one, 2]
            dents[k] = max(dents[k], offset - own)
            planes[n, 0], planes[n, 1], planes[n, 2], planes[n, 3] = nx, ny, nz, offset
            known = False
            for other in range(starts[k], n):
                apart = 0.0
                for c in range(4):
                    apart = max(apart, abs(planes[other, c] - planes[n, c]))
                known |= apart < _SAME
            n += not known
        starts[k + 1] = n
    return boxes, starts, planes[:n].copy(), dents


def _blocks(ground: Ground, objects: tuple[SceneObject, ...]) -> Blocks:
    """Return the blocks of ground and things together."""
    corner, cell = ground.frame[:2], ground.frame[2]
    squares = max(2, round(_BLOCK / cell))
    edge = squares * cell
    lows = np.array([thing.vertices.min(axis=0) for thing in objects]).reshape(-1, 3)
    highs = np.array([thing.vertices.max(axis=0) for thing in objects]).reshape(-1, 3)
    low = np.floor((lows[:, :2] - 1e-6 - corner) / edge).astype(np.int64)
    high = np.floor((highs[:, :2] + 1e-6 - corner) / edge).astype(np.int64)
    across, along = (-(-n // squares) for n in ground.surface.shape)
    first = low.min(axis=0, initial=0)
    shape = np.maximum(high.max(axis=0, initial=0), [across - 1, along - 1]) - first + 1
    tops = np.full((*shape, 3), -np.inf)
    tops[..., 2] = np.inf
    padded = np.pad(
        ground.heights,
        [
            (0, n * squares + 1 - have)
            for n, have in zip((across, along), ground.heights.shape, strict=True)
        ],
        mode="edge",
    )
    peaks = np.maximum.reduce(
        [padded[i : i + across * squares, j : j + along * squares] for i in (0, 1) for j in (0, 1)]
    )
    peaks = peaks.reshape(across, squares, along, squares).max(axis=(1, 3))
    i, j = -first
    tops[i : i + across, j : j + along, 0] = peaks
    lists: list[list[int]] = [[] for _ in range(shape[0] * shape[1])]
    for k in range(len(objects)):
        (i0, j0), (i1, j1) = low[k] - first, high[k] - first + 1
        here = tops[i0:i1, j0:j1]
        np.maximum(here[..., 1], highs[k, 2], out=here[..., 1])
        np.minimum(here[..., 2], lows[k, 2], out=here[..., 2])
        for row in range(i0, i1):
            for column in range(j0, j1):
                lists[row * shape[1] + column].append(k)
    firsts = np.cumsum([0] + [len(numbers) for numbers in lists])
    members = np.array([k for numbers in lists for k in numbers], dtype=np.int64)
    floor = min(float(ground.heights.min()), lows[:, 2].min(initial=np.inf)) - 1.0
    roof = float(tops[..., :2].max()) + 1.0
    lattice = np.array([*(corner + first * edge), edge, floor, roof])
    return Blocks(lattice, np.array([squares, *(first * squares)]), tops, firsts, members)
