"""What a robot touches: the world in pybullet, ground as a heightfield and solids as one mesh."""

from dataclasses import dataclass

import numpy as np

from terrain.classes import TRAITS
from worlds.quiet_pybullet import pybullet
from worlds.world import World

_MAX_TRIANGLES = 40_000


@dataclass(frozen=True)
class Bodies:
    """Body numbers in one physics client.

    Attributes:
        ground: The heightfield.
        solids: Everything solid that stands on it, in pieces of many objects.
    """

    ground: int
    solids: tuple[int, ...]


def build_bodies(world: World, client: int) -> Bodies:
    """Put ground and solids of a world into a physics client.

    The same triangles as in the ray scene: the heightfield is cut along the same diagonals. Plants
    that wheels pass through have no body. One concave mesh costs a tenth of separate bodies.
    """
    heights = world.ground.heights
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_HEIGHTFIELD,
        meshScale=[world.ground.cell, world.ground.cell, 1.0],
        heightfieldData=heights.T.ravel(),
        numHeightfieldRows=heights.shape[0],
        numHeightfieldColumns=heights.shape[1],
        physicsClientId=client,
    )
    # pybullet centres a heightfield between its lowest and its highest point.
    middle = (float(heights.min()) + float(heights.max())) / 2
    ground = pybullet.createMultiBody(
        0, shape, basePosition=[0.0, 0.0, middle], physicsClientId=client
    )
    return Bodies(ground, tuple(_build_solids(world, client)))


def _build_solids(world: World, client: int) -> list[int]:
    """Return the bodies of all solid objects, several hundred to a mesh."""
    bodies: list[int] = []
    vertices: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    things = [thing for thing in world.objects if TRAITS[thing.semantic].solid]
    corners = faces = 0
    for number, thing in enumerate(things):
        triangles.append(thing.triangles + corners)
        vertices.append(thing.vertices)
        corners, faces = corners + len(thing.vertices), faces + len(thing.triangles)
        full = faces > _MAX_TRIANGLES
        if full or number == len(things) - 1:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                vertices=np.concatenate(vertices).astype(np.float64),
                indices=np.concatenate(triangles).ravel().astype(np.int32),
                flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
                physicsClientId=client,
            )
            bodies.append(pybullet.createMultiBody(0, shape, physicsClientId=client))
            vertices, triangles = [], []
            corners = faces = 0
    return bodies
