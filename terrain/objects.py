"""Things that stand on the ground: closed convex meshes, each with a semantic class."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass


@dataclass(frozen=True)
class SceneObject:
    """One closed convex solid (or porous volume) in the map frame.

    Attributes:
        semantic: What it is.
        vertices: Corners in the map frame [m], float32, shape (n, 3).
        triangles: Corner indices, uint32, shape (m, 3), counter-clockwise seen from outside.
    """

    semantic: SemanticClass
    vertices: NDArray[np.float32]
    triangles: NDArray[np.uint32]
