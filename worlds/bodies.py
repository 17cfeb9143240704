"""Collision bodies of a world in pybullet: the ground as a heightfield, solid objects as meshes."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS
from terrain.heightfield import Heightfield
from worlds.quiet_pybullet import pybullet
from worlds.rooms.movers import MoverPlan
from worlds.walking import BELOW
from worlds.world import World

_MAX_TRIANGLES = 40_000
"""Number of triangles after which a new mesh begins."""


@dataclass(frozen=True)
class Bodies:
    """Body identifiers in one physics client.

    Attributes:
        ground: Identifier of the heightfield.
        solids: Identifiers of the meshes of solid objects, hundreds of objects each.
        walkers: Identifiers of the walkers' cylinders, below the ground until they are moved.
    """

    ground: int
    solids: tuple[int, ...]
    walkers: tuple[int, ...] = ()


def build_bodies(world: World, client: int) -> Bodies:
    """Create ground and solid objects of a world in a physics client.

    The triangles are those of the ray scene: the heightfield is split along the same diagonals.
    Plants that wheels pass through have no body. One concave mesh takes a tenth of the time of a
    body for each object.

    Args:
        world: The world.
        client: Identifier of the physics client.
    """
    ground = build_ground(world.ground, (0.0, 0.0), client)
    return Bodies(ground, build_solids(world, client), build_walkers(world, client))


def build_ground(ground: Heightfield, middle: tuple[float, float], client: int) -> int:
    """Create a heightfield, and return the identifier of its body.

    Args:
        ground: Heights; its own middle is the origin of its coordinates.
        middle: Where that is in the map [m].
        client: Identifier of the physics client.
    """
    heights = ground.heights
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_HEIGHTFIELD,
        meshScale=[ground.cell, ground.cell, 1.0],
        heightfieldData=heights.T.ravel(),
        numHeightfieldRows=heights.shape[0],
        numHeightfieldColumns=heights.shape[1],
        physicsClientId=client,
    )
    # pybullet centres a heightfield between its lowest and its highest point.
    level = (float(heights.min()) + float(heights.max())) / 2
    body: int = pybullet.createMultiBody(
        0, shape, basePosition=[*middle, level], physicsClientId=client
    )
    return body


def build_walkers(world: World, client: int) -> tuple[int, ...]:
    """Create the walkers' cylinders below the ground, and return the identifiers of the bodies."""
    return tuple(_build_walker(mover.plan, client) for mover in world.movers)


def _build_walker(plan: MoverPlan, client: int) -> int:
    """Create an upright cylinder that nothing pushes, and return the identifier of its body."""
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_CYLINDER, radius=plan.radius, height=plan.height, physicsClientId=client
    )
    body: int = pybullet.createMultiBody(0, shape, basePosition=BELOW, physicsClientId=client)
    return body


def move_walker(
    body: int,
    place: Sequence[float],
    velocity: Sequence[float],
    client: int,
) -> None:
    """Move a walker's cylinder.

    Args:
        body: Identifier of the body.
        place: Its middle [m].
        velocity: Velocity [m/s], which contacts see.
        client: Identifier of the physics client.
    """
    pybullet.resetBasePositionAndOrientation(
        body, place, (0.0, 0.0, 0.0, 1.0), physicsClientId=client
    )
    pybullet.resetBaseVelocity(body, velocity, (0.0, 0.0, 0.0), physicsClientId=client)


def build_solids(world: World, client: int) -> tuple[int, ...]:
    """Create all solid objects, hundreds to a mesh, and return the identifiers of their bodies."""
    bodies: list[int] = []
    vertices: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    solids = [each for each in world.objects if TRAITS[each.semantic].solid]
    corners = faces = 0
    for number, each in enumerate(solids):
        triangles.append(each.triangles + corners)
        vertices.append(each.vertices)
        corners, faces = corners + len(each.vertices), faces + len(each.triangles)
        full = faces > _MAX_TRIANGLES
        if full or number == len(solids) - 1:
            bodies.append(_mesh(np.concatenate(vertices), np.concatenate(triangles), client))
            vertices, triangles = [], []
            corners = faces = 0
    return tuple(bodies)


def _mesh(vertices: NDArray[np.floating], triangles: NDArray[np.integer], client: int) -> int:
    """Create a body of a mesh that may be hollow, and return its identifier.

    It is read from a file, of which nothing is kept: pybullet never frees a mesh that it is given
    as arrays, 6 MB in a natural world, not even when its client is disconnected.

    Args:
        vertices: Corners [m], shape (v, 3).
        triangles: Indices of the corners of each face, shape (t, 3).
        client: Identifier of the physics client.
    """
    pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=client)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.obj"
        corners = ("v %.9g %.9g %.9g\n" * len(vertices)) % tuple(vertices.ravel().tolist())
        faces = ("f %d %d %d\n" * len(triangles)) % tuple((triangles + 1).ravel().tolist())
        file.write_text(corners + faces, encoding="utf-8")
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH,
            fileName=str(file),
            flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
            physicsClientId=client,
        )
        # The file is read again for the body.
        body: int = pybullet.createMultiBody(0, shape, physicsClientId=client)
    return body
