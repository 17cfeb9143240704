"""The same worlds in Embree, through open3d: the reference that ``RayScene`` is tested against."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from worlds.rays.geometry import NO_CLASS
from worlds.world import World


class EmbreeScene:
    """A world's triangles, one geometry per semantic class, all opaque."""

    def __init__(self, world: World, porous: bool = True) -> None:
        """Build the scene.

        Args:
            world: World whose ground and objects rays are cast against.
            porous: True to include porous objects, as opaque ones.
        """
        import open3d

        self._from_numpy = open3d.core.Tensor.from_numpy
        self._scene: Any = open3d.t.geometry.RaycastingScene(nthreads=1)
        classes = []
        for semantic, (vertices, triangles) in _meshes(world).items():
            if porous or np.isinf(TRAITS[semantic].hits_per_metre):
                self._scene.add_triangles(self._from_numpy(vertices), self._from_numpy(triangles))
                classes.append(int(semantic))
        self._classes = np.array([*classes, NO_CLASS], dtype=np.uint8)

    def first(self, rays: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return range [m] and class of each ray's first hit; see ``RayScene.cast``."""
        hit = self.raw(rays)
        numbers = np.minimum(hit["geometry_ids"].numpy(), len(self._classes) - 1)
        return hit["t_hit"].numpy(), self._classes[numbers]

    def raw(self, rays: NDArray[np.float32]) -> Any:  # noqa: ANN401 - open3d's own dictionary.
        """Return open3d's result for rays, float32, shape (n, 6)."""
        return self._scene.cast_rays(self._from_numpy(rays), nthreads=1)


def _meshes(
    world: World,
) -> dict[SemanticClass, tuple[NDArray[np.float32], NDArray[np.uint32]]]:
    """Return vertices [m] (v, 3) and triangles (t, 3) of each semantic class."""
    vertices, triangles = world.ground.triangles()
    surface = np.repeat(world.surface.ravel(), 2)
    parts = {
        SemanticClass(kind): [(vertices, triangles[surface == kind])]
        for kind in np.unique(world.surface)
    }
    for each in world.objects:
        parts.setdefault(each.semantic, []).append((each.vertices, each.triangles))
    merged = {}
    for semantic, pieces in parts.items():
        firsts = np.cumsum([0] + [len(corners) for corners, _ in pieces[:-1]], dtype=np.uint32)
        shifted = [faces + first for (_, faces), first in zip(pieces, firsts, strict=True)]
        merged[semantic] = (
            np.concatenate([corners for corners, _ in pieces]),
            np.concatenate(shifted),
        )
    return merged
