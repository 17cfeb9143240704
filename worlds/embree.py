"""The same world in Embree, as open3d brings it: what our own rays are held against."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from worlds.ray_walk import NO_CLASS
from worlds.world import World


class EmbreeScene:
    """A world's triangles, one geometry a semantic class; rays end at the first they meet."""

    def __init__(self, world: World, porous: bool = True) -> None:
        """Build the scene.

        Args:
            world: Whose ground and objects are cast against.
            porous: Whether things that let beams through are in it, as solid ones.
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
        """Return range [m] and class of the first thing that each ray meets; see ``RayScene``."""
        hit = self.raw(rays)
        numbers = np.minimum(hit["geometry_ids"].numpy(), len(self._classes) - 1)
        return hit["t_hit"].numpy(), self._classes[numbers]

    def raw(self, rays: NDArray[np.float32]) -> Any:  # noqa: ANN401 - open3d's own dictionary.
        """Return what open3d returns."""
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
    for thing in world.objects:
        parts.setdefault(thing.semantic, []).append((thing.vertices, thing.triangles))
    merged = {}
    for semantic, pieces in parts.items():
        firsts = np.cumsum([0] + [len(corners) for corners, _ in pieces[:-1]], dtype=np.uint32)
        shifted = [faces + first for (_, faces), first in zip(pieces, firsts, strict=True)]
        merged[semantic] = (
            np.concatenate([corners for corners, _ in pieces]),
            np.concatenate(shifted),
        )
    return merged
