"""Continuous stands of plants: meadows, reeds and undergrowth that cover the ground.

A stand is a mosaic of porous tiles that follow the ground, each as high as the plants there. What
stands higher than the robot may cross is an obstacle; the low edge of a gradual stand is not.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject

KINDS = (SemanticClass.STALKS, SemanticClass.MEADOW, SemanticClass.THICKET)
"""Classes of stands, from the thinnest to the densest."""

TILE = 0.5
"""Edge of a tile [m]."""

_LEAST = 0.04
"""Height of the lowest plants [m]."""

_ROOTS = 0.03
"""Depth of a tile under the ground [m], which is no plane."""


def stand(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a stand as tiles of one class, 2 to 9 m wide and 0.2 to 1.2 m high in its middle.

    Heights are log-uniform and vary by a quarter. Half of the stands end abruptly; the others lose
    height over up to 2 m. Up to a third of a stand is gaps (assumptions).

    Args:
        ground: The heightfield.
        x: Map x of its middle [m].
        y: Map y of its middle [m].
        rng: Source of size, class, heights and gaps.
    """
    reach = rng.uniform(1.0, 4.5)
    height = 0.2 * 6.0 ** rng.uniform(0.0, 1.0)
    edge = rng.uniform(0.3, 2.0) if rng.random() < 0.5 else 0.0
    gaps = rng.uniform(0.0, 0.33) * (rng.random() < 0.5)
    kind = KINDS[int(rng.integers(len(KINDS)))]
    offsets = _offsets(reach)
    grid = (len(offsets), len(offsets))
    outline, cover, growth = (
        smooth_noise(grid, TILE, wavelength, rng) for wavelength in (2.5, 1.5, 1.0)
    )
    u, v = np.meshgrid(offsets, offsets, indexing="ij")
    # Distance to the wobbly edge, positive inside.
    inside = reach * (1 + 0.2 * outline) - np.hypot(u, v)
    share = np.clip(inside / edge, 0.0, 1.0) if edge else np.ones(grid)
    heights = np.maximum(height * share * np.clip(1 + 0.25 * growth, 0.3, 1.6), _LEAST)
    grown = (inside > 0) & (cover > np.quantile(cover, gaps))
    places = np.column_stack([x + u[grown], y + v[grown]])
    return tiles(ground, kind, places, heights[grown])


def _offsets(reach: float) -> NDArray[np.float64]:
    """Return the middles of tiles along one axis, from a stand's middle [m]."""
    n = int(np.ceil(1.6 * reach / TILE))
    return np.arange(-n, n + 1.0) * TILE


def tiles(
    ground: Heightfield,
    kind: SemanticClass,
    places: NDArray[np.float64],
    heights: NDArray[np.float64],
) -> list[SceneObject]:
    """Return square tiles of plants that lie on the slope of the ground; those beyond it are none.

    Args:
        ground: The heightfield.
        kind: Semantic class of the plants.
        places: Map x and y of the middles [m], shape (n, 2).
        heights: Heights over the ground [m], shape (n,).
    """
    half = TILE / 2
    limit = np.array([ground.width, ground.depth]) / 2 - TILE
    on_it = (np.abs(places) < limit).all(axis=1)
    places, heights = places[on_it], heights[on_it]
    x, y = places.T
    level = ground.height_at(x, y)
    rise_x = (ground.height_at(x + half, y) - ground.height_at(x - half, y)) / 2
    rise_y = (ground.height_at(x, y + half) - ground.height_at(x, y - half)) / 2
    stands = []
    for k in range(len(places)):
        corners = _CORNERS * [half, half, 1.0]
        z = level[k] + corners[:, 0] / half * rise_x[k] + corners[:, 1] / half * rise_y[k]
        z += np.where(corners[:, 2] > 0, heights[k], -_ROOTS)
        vertices = np.column_stack([x[k] + corners[:, 0], y[k] + corners[:, 1], z])
        stands.append(SceneObject(kind, vertices.astype(np.float32), _TRIANGLES))
    return stands


_CORNERS = np.array(
    [[u, v, w] for w in (0.0, 1.0) for u, v in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))]
)
"""Corners of a tile: four below, then four above, counter-clockwise."""

_TRIANGLES = np.array(
    [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    + [
        triangle
        for k in range(4)
        for n in [(k + 1) % 4]
        for triangle in ((k, n, n + 4), (k, n + 4, k + 4))
    ],
    dtype=np.uint32,
)
"""Triangles of a tile, counter-clockwise seen from outside."""
_TRIANGLES.setflags(write=False)
