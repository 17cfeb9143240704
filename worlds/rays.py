"""What a beam meets: the world in Embree, with grass and leaves that let beams through."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from worlds.world import World

NO_CLASS = 255
"""Class of a ray that meets nothing."""

_MAX_CROSSINGS = 24
_NUDGE = 1e-3


class RayScene:
    """Casts rays against a world; its geometries are one per semantic class."""

    def __init__(self, world: World) -> None:
        """Build the scene.

        Args:
            world: Whose ground and objects are cast against.
        """
        import open3d

        self._core = open3d.core
        meshes = _meshes(world)
        self._opaque, self._opaque_classes = _scene(open3d, meshes, porous=False)
        self._all, self._all_classes = _scene(open3d, meshes, porous=True)
        self._rates = np.full(256, np.inf)
        for semantic, traits in TRAITS.items():
            self._rates[semantic] = traits.hits_per_metre
        self._rays = np.zeros((0, 6), dtype=np.float32)
        self._tensor: Any = None

    def cast_opaque(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays that pass through everything porous.

        Args:
            origins: Map coordinates [m], float32, shape (n, 3).
            directions: Unit vectors, float32, shape (n, 3).

        Returns:
            Ranges [m], ``inf`` where nothing is met, and semantic classes, ``NO_CLASS`` there, (n,)
            each.
        """
        hit = self._cast(self._opaque, origins, directions)
        ranges = hit["t_hit"].numpy()
        return ranges, self._opaque_classes[_geometry(hit)]

    def cast(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        rng: np.random.Generator,
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Cast rays that grass, bushes and leaves stop with a probability per metre.

        Inside a porous volume the free path is exponential with ``hits_per_metre``; volumes may
        overlap, and a ray may begin inside of one.

        Args:
            origins: Map coordinates [m], float32, shape (n, 3).
            directions: Unit vectors, float32, shape (n, 3).
            rng: Decides where a ray ends inside a porous volume.

        Returns:
            As ``cast_opaque``.
        """
        hit = self._cast(self._all, origins, directions)
        ranges = hit["t_hit"].numpy().copy()
        classes = self._all_classes[_geometry(hit)].copy()
        porous = np.flatnonzero(np.isfinite(self._rates[classes]))
        if len(porous):
            self._cross(porous, hit, origins, directions, ranges, classes, rng)
        return ranges, classes

    def _cross(self, active, hit, origins, directions, ranges, classes, rng) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
        """Follow rays through porous volumes, face by face, and write where they end.

        ``depth`` counts, per ray and class, the volumes that the ray is inside of; a face that is
        left before any was entered tells that the ray began inside.
        """
        kinds = [int(s) for s in SemanticClass if np.isfinite(self._rates[s])]
        column = np.full(256, -1)
        column[kinds] = np.arange(len(kinds))
        rates = self._rates[kinds]
        depth = np.zeros((len(active), len(kinds)), dtype=np.int64)
        budget = rng.exponential(size=len(active))  # Optical depth at which each ray ends.
        here = np.zeros(len(active))
        there = ranges[active].astype(np.float64)
        kind = classes[active]
        entering = _entering(hit, directions, active)
        started = np.zeros(len(active), dtype=bool)
        for _ in range(_MAX_CROSSINGS):
            faces = column[kind]
            is_face = faces >= 0
            inside_from_start = (
                is_face
                & ~entering
                & (np.take_along_axis(depth, np.maximum(faces, 0)[:, None], 1)[:, 0] == 0)
            )
            rows = np.flatnonzero(inside_from_start)
            depth[rows, faces[rows]] += 1
            density = ((depth > 0) * rates).sum(axis=1)
            with np.errstate(invalid="ignore"):
                thickness = np.where(density > 0, density * (there - here), 0.0)
            ends_inside = thickness > budget
            stop = np.flatnonzero(ends_inside)
            if len(stop):
                ranges[active[stop]] = here[stop] + budget[stop] / density[stop]
                densest = ((depth[stop] > 0) * rates).argmax(axis=1)
                classes[active[stop]] = np.array(kinds, dtype=np.uint8)[densest]
            settle = np.flatnonzero(~ends_inside & ~is_face)
            ranges[active[settle]] = there[settle]
            classes[active[settle]] = kind[settle]
            going = np.flatnonzero(~ends_inside & is_face)
            if not len(going):
                return
            depth[going, faces[going]] += np.where(entering[going], 1, -1)
            active, depth, started = active[going], depth[going], started[going]
            budget = budget[going] - thickness[going]
            here = there[going]
            shift = (here + _NUDGE)[:, None].astype(np.float32)
            hit = self._cast(
                self._all, origins[active] + shift * directions[active], directions[active]
            )
            there = hit["t_hit"].numpy().astype(np.float64) + here + _NUDGE
            kind = self._all_classes[_geometry(hit)]
            entering = _entering(hit, directions[active], slice(None))
        ranges[active], classes[active] = np.inf, NO_CLASS

    def _cast(self, scene, origins, directions):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        """Cast rays from the buffer that lives as long as the scene."""
        count = len(origins)
        if count > len(self._rays):
            self._rays = np.zeros((count, 6), dtype=np.float32)
            self._tensor = self._core.Tensor.from_numpy(self._rays)  # Shares memory.
        self._rays[:count, :3] = origins
        self._rays[:count, 3:] = directions
        return scene.cast_rays(self._tensor[:count], nthreads=1)


def _meshes(world: World) -> dict[SemanticClass, tuple[NDArray[np.float32], NDArray[np.uint32]]]:
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


def _merged(
    pieces: list[tuple[NDArray[np.float32], NDArray[np.uint32]]],
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return several meshes as one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in pieces[:-1]], dtype=np.uint32)
    shifted = [triangles + offset for (_, triangles), offset in zip(pieces, offsets, strict=True)]
    return np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(shifted)


def _scene(open3d, meshes, porous):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return an Embree scene and the class of each of its geometries; the last entry is no hit."""
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    classes: list[int] = []
    for semantic, (vertices, triangles) in meshes.items():
        if porous or np.isinf(TRAITS[semantic].hits_per_metre):
            scene.add_triangles(
                open3d.core.Tensor.from_numpy(np.ascontiguousarray(vertices)),
                open3d.core.Tensor.from_numpy(np.ascontiguousarray(triangles)),
            )
            classes.append(int(semantic))
    return scene, np.array([*classes, NO_CLASS], dtype=np.uint8)


def _geometry(hit) -> NDArray[np.int64]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return the number of each ray's geometry, -1 where it meets none."""
    numbers = hit["geometry_ids"].numpy()
    return np.where(numbers == np.uint32(0xFFFFFFFF), -1, numbers.astype(np.int64))


def _entering(hit, directions, rows) -> NDArray[np.bool_]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return whether rays meet their triangles from outside."""
    normals = hit["primitive_normals"].numpy()[rows]
    return np.einsum("ij,ij->i", normals, directions[rows]) < 0
