"""What a beam meets: the world in Embree, with grass and leaves that let beams through."""

from collections import OrderedDict
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from worlds.world import World

NO_CLASS = 255
"""Class of a ray that meets nothing."""

_TILE = 8.0
"""Side of the squares of the map that have a scene of their surroundings [m]."""

_TILES = 12
"""Scenes of surroundings that are kept, 3.7 MB each in a natural world; one takes 5 ms to make."""

_RATES = np.full(256, np.inf)
for _semantic, _traits in TRAITS.items():
    _RATES[_semantic] = _traits.hits_per_metre


class RayScene:
    """Casts rays against a world; its geometries are one per semantic class."""

    def __init__(self, world: World) -> None:
        """Build the scene.

        Args:
            world: Whose ground and objects are cast against.
        """
        meshes = _meshes(world)
        self._whole = _Bodies(meshes)
        self._opaque: _Bodies | None = None
        self._meshes = meshes
        self._boxes = {kind: _boxes(*mesh) for kind, mesh in meshes.items()}
        self._tiles: OrderedDict[tuple[int, int, float], _Bodies] = OrderedDict()

    def cast_opaque(
        self, rays: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays that pass through everything porous.

        Args:
            rays: Origin in the map [m] and unit direction of each, float32, shape (n, 6).

        Returns:
            Ranges [m], ``inf`` where nothing is met, and semantic classes, ``NO_CLASS`` there, (n,)
            each.
        """
        if self._opaque is None:
            opaque = {kind: mesh for kind, mesh in self._meshes.items() if np.isinf(_RATES[kind])}
            self._opaque = _Bodies(opaque)
        return self._opaque.first(rays)

    def cast(
        self, rays: NDArray[np.float32], rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays that grass, bushes and leaves stop with a probability per metre.

        Inside a porous volume the free path is exponential with ``hits_per_metre``; volumes may
        overlap, and a ray may begin inside of one.

        Args:
            rays: As for ``cast_opaque``.
            rng: Decides where a ray ends inside a porous volume; one draw a ray.

        Returns:
            As ``cast_opaque``.
        """
        return self.cast_through(rays, rng.standard_exponential(len(rays), dtype=np.float32))

    def cast_through(
        self,
        rays: NDArray[np.float32],
        budgets: NDArray[np.float32],
        reach: float | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays as ``cast`` does, each with its own draw.

        Args:
            rays: As for ``cast_opaque``.
            budgets: Optical depth of porous things at which each ray ends, float32, shape (n,).
            reach: Nobody looks further [m]: what is met beyond counts as nothing. Rays then have to
                begin within a metre of each other. None looks at all of the world.

        Returns:
            As ``cast_opaque``.
        """
        if reach is None:
            return self._whole.cross(rays, budgets)
        ranges, classes = self._around(rays[0], reach).cross(rays, budgets)
        _forget_beyond(ranges, classes, reach)
        return ranges, classes

    def _around(self, place: NDArray[np.float32], reach: float) -> "_Bodies":
        """Return the scene of a tile's surroundings, making it when it is not at hand."""
        column, row = (int(np.floor(place[c] / _TILE)) for c in (0, 1))
        key = (column, row, reach)
        if key not in self._tiles:
            middle = (np.array([column, row]) + 0.5) * _TILE
            half = _TILE / 2 + reach + 1.0  # A robot drives on while a batch lasts.
            near = {
                kind: _cut(*mesh, self._boxes[kind], middle, half)
                for kind, mesh in self._meshes.items()
            }
            self._tiles[key] = _Bodies({kind: mesh for kind, mesh in near.items() if len(mesh[1])})
        self._tiles.move_to_end(key)
        while len(self._tiles) > _TILES:
            self._tiles.popitem(last=False)
        return self._tiles[key]


Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices [m], float32, shape (v, 3), and triangles, uint32, shape (t, 3)."""


class _Faces(NamedTuple):
    """What rays meet on their way, nearest first.

    Attributes:
        splits: Faces ``splits[k]`` to ``splits[k + 1]`` are those of ray ``k``.
        distances: Of the faces [m].
        kinds: Their classes.
        steps: +1 where a porous volume is entered, -1 where it is left, 0 otherwise.
        began: In how many volumes of each porous class each ray began, shape (rays, classes).
    """

    splits: NDArray[np.int64]
    distances: NDArray[np.float64]
    kinds: NDArray[np.uint8]
    steps: NDArray[np.int64]
    began: NDArray[np.int64]


_UP = np.array([0.0123, 0.0217, 0.99969], dtype=np.float32)
"""Nearly upwards, along no edge of anything upright."""


class _Bodies:
    """Meshes in Embree, and what has to be known of their triangles."""

    def __init__(self, meshes: dict[SemanticClass, Mesh]) -> None:
        """Build the scene, one geometry a class."""
        import open3d

        self._from_numpy = open3d.core.Tensor.from_numpy
        self._scene: Any = open3d.t.geometry.RaycastingScene(nthreads=1)
        normals, self._first = [np.zeros((0, 3), dtype=np.float32)], [0]
        for vertices, triangles in meshes.values():
            self._scene.add_triangles(
                open3d.core.Tensor.from_numpy(np.ascontiguousarray(vertices)),
                open3d.core.Tensor.from_numpy(np.ascontiguousarray(triangles)),
            )
            a, b, c = (vertices[triangles[:, k]] for k in range(3))
            normals.append(np.cross(b - a, c - a).astype(np.float32))
            self._first.append(self._first[-1] + len(triangles))
        self._classes = np.array([*meshes, NO_CLASS], dtype=np.uint8)
        self._normals = np.concatenate(normals)
        self._starts = np.array(self._first[:-1], dtype=np.int64)

    def first(self, rays: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return range [m] and class of the first thing that each ray meets."""
        hit = self._scene.cast_rays(self._tensor(rays), nthreads=1)
        numbers = hit["geometry_ids"].numpy()
        return hit["t_hit"].numpy().copy(), _named(numbers, self._classes)

    def cross(
        self, rays: NDArray[np.float32], budgets: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return where each ray ends, given the optical depth at which it does."""
        ranges, classes = self.first(rays)
        porous = np.flatnonzero(_is_porous(classes))
        if not len(porous):
            return ranges, classes
        faces = self._faces(rays[porous])
        began = faces.began
        doubtful = np.flatnonzero(began.any(axis=1))
        if len(doubtful):
            # A ray that slips through an edge loses a face and seems to have begun inside. Two
            # rays from one place do not both slip.
            upwards = rays[porous[doubtful]]
            upwards[:, 3:] = _UP
            began[doubtful] = np.minimum(began[doubtful], self._faces(upwards).began)
        _end(
            porous,
            faces.splits,
            faces.distances,
            faces.kinds,
            faces.steps,
            began,
            budgets,
            ranges,
            classes,
        )
        return ranges, classes

    def _faces(self, rays: NDArray[np.float32]) -> "_Faces":
        """Return all faces that rays meet."""
        found = self._scene.list_intersections(self._tensor(rays), nthreads=1)
        splits = found["ray_splits"].numpy()
        return _Faces(
            splits,
            *_sides(
                splits,
                found["t_hit"].numpy(),
                found["geometry_ids"].numpy(),
                found["primitive_ids"].numpy(),
                self._classes,
                self._starts,
                self._normals,
                rays,
            ),
        )

    def _tensor(self, rays: NDArray[np.float32]) -> Any:  # noqa: ANN401
        """Return rays as open3d takes them, without a copy."""
        return self._from_numpy(np.ascontiguousarray(rays))


@njit(cache=True, nogil=True)
def _named(numbers, classes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the class of each geometry's number; what is no number is nothing."""
    found = np.empty(len(numbers), dtype=np.uint8)
    last = len(classes) - 1
    for k in range(len(numbers)):
        found[k] = classes[min(numbers[k], last)]
    return found


@njit(cache=True, nogil=True)
def _forget_beyond(ranges, classes, reach):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Make nothing of what is met beyond ``reach`` [m]."""
    for k in range(len(ranges)):
        if ranges[k] > reach:
            ranges[k], classes[k] = np.inf, NO_CLASS


@njit(cache=True, nogil=True)
def _is_porous(classes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return whether what was met lets beams through."""
    found = np.empty(len(classes), dtype=np.bool_)
    for k in range(len(classes)):
        found[k] = np.isfinite(_RATES[classes[k]])
    return found


_ONE_FACE = 2e-4
"""Two triangles of a class that are met nearer to each other, from the same side, are one [m]."""

_KINDS = np.array([int(kind) for kind in SemanticClass if np.isfinite(_RATES[kind])])
_COLUMNS = np.full(256, -1)
_COLUMNS[_KINDS] = np.arange(len(_KINDS))


@njit(cache=True, nogil=True)
def _sides(splits, distances, geometries, triangles, classes, starts, normals, rays):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Sort the faces of each ray by distance and tell entering from leaving.

    Two triangles are one face where a ray meets the edge between them. A face that is left and was
    never entered tells that the ray began inside.

    Returns:
        Distances and classes of the faces, +1 for porous volumes that are entered, -1 for those
        that are left and 0 otherwise, and in how many volumes of each class each ray began.
    """
    kinds = len(_KINDS)
    sorted_ = np.empty(len(distances), dtype=np.float64)
    found = np.empty(len(distances), dtype=np.uint8)
    steps = np.zeros(len(distances), dtype=np.int64)
    began = np.zeros((len(splits) - 1, kinds), dtype=np.int64)
    depth, latest = np.zeros(kinds, dtype=np.int64), np.empty((kinds, 2))
    for ray in range(len(splits) - 1):
        first, last = splits[ray], splits[ray + 1]
        order = first + np.argsort(distances[first:last], kind="mergesort")
        depth[:] = 0
        latest[:] = -1.0
        for n in range(last - first):
            face = order[n]
            sorted_[first + n] = distances[face]
            kind = classes[geometries[face]]
            found[first + n] = kind
            column = _COLUMNS[kind]
            if column < 0:
                continue
            triangle = starts[geometries[face]] + triangles[face]
            along = 0.0
            for c in range(3):
                along += rays[ray, 3 + c] * normals[triangle, c]
            side = 0 if along < 0 else 1
            if latest[column, side] < 0 or distances[face] - latest[column, side] > _ONE_FACE:
                steps[first + n] = 1 - 2 * side
                depth[column] += 1 - 2 * side
                began[ray, column] = max(began[ray, column], -depth[column])
            latest[column, side] = distances[face]
    return sorted_, found, steps, began


@njit(cache=True, nogil=True)
def _end(rows, splits, distances, kinds, steps, began, budgets, ranges, classes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write where rays end whose optical depth may be their budget."""
    depth = np.zeros(began.shape[1], dtype=np.int64)
    for k in range(len(rows)):
        ray, here, budget = rows[k], 0.0, float(budgets[rows[k]])
        depth[:] = began[k]
        ranges[ray], classes[ray] = np.inf, NO_CLASS
        for n in range(splits[k], splits[k + 1]):
            density, densest = 0.0, 0
            for c in range(len(depth)):
                if depth[c] > 0:
                    density += _RATES[_KINDS[c]]
                    if depth[densest] <= 0 or _RATES[_KINDS[c]] > _RATES[_KINDS[densest]]:
                        densest = c
            if density * (distances[n] - here) > budget:
                ranges[ray], classes[ray] = here + budget / density, _KINDS[densest]
                break
            if _COLUMNS[kinds[n]] < 0:
                ranges[ray], classes[ray] = distances[n], kinds[n]
                break
            budget -= density * (distances[n] - here)
            here = distances[n]
            depth[_COLUMNS[kinds[n]]] = max(0, depth[_COLUMNS[kinds[n]]] + steps[n])


def _meshes(world: World) -> dict[SemanticClass, Mesh]:
    """Return vertices and triangles of each semantic class."""
    vertices, triangles = world.ground.triangles()
    surface = np.repeat(world.surface.ravel(), 2)
    parts = {
        SemanticClass(kind): [(vertices, triangles[surface == kind])]
        for kind in np.unique(world.surface)
    }
    for thing in world.objects:
        parts.setdefault(thing.semantic, []).append((thing.vertices, thing.triangles))
    return {semantic: _merged(pieces) for semantic, pieces in parts.items()}


def _merged(pieces: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in pieces[:-1]], dtype=np.uint32)
    shifted = [triangles + offset for (_, triangles), offset in zip(pieces, offsets, strict=True)]
    return np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(shifted)


def _boxes(vertices: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return least and greatest x and y of each triangle [m], shape (t, 4)."""
    corners = vertices[:, :2][triangles]
    return np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)


def _cut(
    vertices: NDArray[np.float32],
    triangles: NDArray[np.uint32],
    boxes: NDArray[np.float32],
    middle: NDArray[np.float64],
    half: float,
) -> Mesh:
    """Return the part of a mesh that touches a square."""
    low, high = (middle - half).astype(np.float32), (middle + half).astype(np.float32)
    inside = (boxes[:, 0] <= high[0]) & (boxes[:, 1] <= high[1])
    inside &= (boxes[:, 2] >= low[0]) & (boxes[:, 3] >= low[1])
    kept = triangles[inside]
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[kept] = True
    numbers = np.cumsum(used, dtype=np.uint32) - 1
    return vertices[used], numbers[kept].astype(np.uint32)
