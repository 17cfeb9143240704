"""Drawing of a world: terrain and objects by class, sent once.

Large meshes have the material of cartoons: without a graphics card it draws four times as fast as
the one that reflects its surroundings.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.rendering.plants import GRASSY, Plants
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.world import World

if TYPE_CHECKING:
    import viser

GroundHeight = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""Function from places x and y in the map [m] to the height of the ground there [m]."""

_MOST_NODES = 160
"""Number of nodes along an edge of the drawn terrain: browsers without a graphics card draw it."""

_BLADE = 0.02
"""Half of the width of a blade of grass at its foot [m]."""

_SEE_THROUGH = {SemanticClass.FOLIAGE: 0.35, SemanticClass.BUSH: 0.8}
"""Opacity of what would hide the robot, or what beams pass through."""


class WorldDrawing:
    """Terrain and objects of a world in the scene."""

    def __init__(self, scene: "viser.SceneApi", root: str, world: World) -> None:
        """Draw a world.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            world: World to draw.
        """
        _terrain(scene, f"{root}/terrain", world)
        self._objects = [
            _objects(scene, f"{root}/objects/{semantic.name.lower()}", world, semantic)
            for semantic in sorted({each.semantic for each in world.objects})
        ]

    def show_objects(self, visible: bool) -> None:
        """Show or hide plants, rocks and walls."""
        for handle in self._objects:
            handle.visible = visible


def _terrain(scene: "viser.SceneApi", name: str, world: World) -> None:
    """Draw the ground, one mesh for each kind of surface."""
    ground, every = coarse(world.ground)
    vertices, triangles = ground.triangles()
    nx, ny = ground.heights.shape
    # The surface in the middle of each drawn cell.
    i = np.minimum(np.arange(nx - 1) * every + every // 2, world.surface.shape[0] - 1)
    j = np.minimum(np.arange(ny - 1) * every + every // 2, world.surface.shape[1] - 1)
    kinds = np.repeat(world.surface[np.ix_(i, j)].ravel(), 2)
    for kind in np.unique(kinds).tolist():
        red, green, blue = CLASS_COLOURS[kind].tolist()
        scene.add_mesh_simple(
            f"{name}/{SemanticClass(kind).name.lower()}",
            vertices,
            triangles[kinds == kind],
            color=(red, green, blue),
            material="toon5",
            cast_shadow=False,
            receive_shadow=False,
        )


def coarse(ground: Heightfield) -> tuple[Heightfield, int]:
    """Return a heightfield of few nodes, and the stride at which it takes those of the other.

    The extent stays the same but for less than a stride at the far edges.

    Args:
        ground: Heightfield of any number of nodes.
    """
    every = max(-(-max(ground.heights.shape) // _MOST_NODES), 1)
    heights = np.ascontiguousarray(ground.heights[::every, ::every])
    if every == 1:
        return ground, 1
    # Both are centred on the origin: the cut edge would shift the coarse one.
    nx, ny = (1 + (size - 1) // every for size in ground.heights.shape)
    exact = all((size - 1) % every == 0 for size in ground.heights.shape)
    if exact:
        return Heightfield(heights, ground.cell * every), every
    x = np.linspace(-ground.width / 2, ground.width / 2, nx)
    cell = float(x[1] - x[0])
    y = (np.arange(ny) - (ny - 1) / 2) * cell
    places = np.meshgrid(x, y, indexing="ij")
    return Heightfield(ground.height_at(*places).astype(np.float32), cell), every


def _objects(
    scene: "viser.SceneApi", name: str, world: World, semantic: SemanticClass
) -> "viser.SceneNodeHandle":
    """Draw all objects of a class as one mesh: grass as blades, others as their hulls."""
    if semantic in GRASSY:
        return _blades(scene, name, world, semantic)
    parts = [each for each in world.objects if each.semantic is semantic]
    counts = np.cumsum([0, *(len(each.vertices) for each in parts)])
    triangles = [
        each.triangles.astype(np.uint32) + np.uint32(first)
        for each, first in zip(parts, counts.tolist(), strict=False)
    ]
    red, green, blue = CLASS_COLOURS[semantic].tolist()
    return scene.add_mesh_simple(
        name,
        np.concatenate([each.vertices for each in parts]),
        np.concatenate(triangles),
        color=(red, green, blue),
        opacity=_SEE_THROUGH.get(semantic),
        material="toon3",
        cast_shadow=False,
        receive_shadow=False,
    )


def _blades(
    scene: "viser.SceneApi", name: str, world: World, semantic: SemanticClass
) -> "viser.SceneNodeHandle":
    """Draw all stands of a class as blades in one mesh."""
    stands = [each for each in world.objects if each.semantic is semantic]
    vertices = blade_corners(Plants.of(stands, world.ground)).reshape(-1, 3)
    red, green, blue = CLASS_COLOURS[semantic].tolist()
    return scene.add_mesh_simple(
        name,
        vertices,
        np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3),
        color=(red, green, blue),
        side="double",
        material="toon3",
        cast_shadow=False,
        receive_shadow=False,
    )


def blade_corners(plants: Plants) -> NDArray[np.float32]:
    """Return a triangle for each blade, across the way that it leans [m], shape (n, 3, 3)."""
    lean = plants.tips - plants.feet
    across = np.stack([-lean[:, 1], lean[:, 0], np.zeros(len(lean))], axis=1)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = _BLADE * np.where(length > 0, across / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    corners = (plants.feet - across, plants.feet + across, plants.tips)
    return np.stack([np.asarray(each, dtype=np.float32) for each in corners], axis=1)
