"""What people have made and trodden on natural ground: trails with roots, and strips with kerbs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.kerbs import draw_strips, kerbstones, raised
from worlds.rough_ground import at_nodes
from worlds.trails import Trail, draw_trails, levelled, trodden

_FADE = 0.3
"""Distance beside a trail or strip over which the ground becomes as rough as elsewhere [m]."""


class WaysConfig(BaseModel):
    """Trails and kerbs; numbers are those at difficulty 0.5 and rise with it.

    Attributes:
        trails: Number of worn paths of 1 to 2 m across the world: level, bare, and kept free of
            objects.
        roots: Mean number of roots across a metre of trail, of 3 to 8 cm; a wheel climbs those
            below 5 cm [1/m].
        kerbs: Number of raised strips of 9 to 24 m, whose edges are steps of 6 to 12 cm.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trails: int = Field(default=0, ge=0, le=10)
    roots: float = Field(default=0.0, ge=0, le=2)
    kerbs: int = Field(default=0, ge=0, le=50)

    @property
    def is_empty(self) -> bool:
        """True if there is nothing of it."""
        return not (self.trails or self.kerbs)

    def scaled(self, share: float) -> "WaysConfig":
        """Return the settings of a square with a share of the area; as many trails cross it."""
        return self.model_copy(update={"kerbs": round(self.kerbs * share)})


@dataclass(frozen=True)
class Ways:
    """Ground with trails and strips.

    Attributes:
        base: Ground without what wheels roll over, on the grid that wheels feel.
        surface: Semantic class of each of its cells, uint8, shape (nx - 1, ny - 1).
        worn: Share of the roughness that is worn off, 0 to 1, shape (nx, ny).
        trails: The trails.
        stones: Kerbstones.
    """

    base: Heightfield
    surface: NDArray[np.uint8]
    worn: NDArray[np.float64]
    trails: list[Trail]
    stones: list[SceneObject]


def lay_ways(
    smooth: Heightfield,
    surface: NDArray[np.uint8],
    cells: int,
    config: WaysConfig,
    difficulty: float,
    rng: np.random.Generator,
) -> Ways:
    """Return smooth ground with trails and strips on a finer grid.

    Args:
        smooth: Ground without them.
        surface: Semantic class of each of its cells, uint8, shape (n, m).
        cells: Number of cells of the finer grid along the edge of one.
        config: Numbers.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness; trails and strips have streams of their own.
    """
    trail_rng, strip_rng = rng.spawn(2)
    trails = draw_trails(smooth, round(config.trails * (0.5 + difficulty)), trail_rng)
    strips = draw_strips(smooth, round(config.kerbs * (0.5 + difficulty)), strip_rng)
    level = levelled(smooth, trails)
    fine = level.refined(cells)
    heights = fine.heights + raised(fine, strips, trails)
    surface = surface.repeat(cells, 0).repeat(cells, 1)
    is_wet = at_nodes(surface == SemanticClass.WATER)
    heights[is_wet] = smooth.refined(cells).heights[is_wet]
    beds = [Trail(strip.line, 2 * strip.half) for strip in strips]
    worn = trodden(fine, trails + beds, _FADE)
    is_way = worn >= 1.0
    is_way = is_way[:-1, :-1] & is_way[1:, 1:] & (surface == SemanticClass.GROUND)
    return Ways(
        Heightfield(heights.astype(np.float32), fine.cell),
        np.where(is_way, SemanticClass.PATH, surface).astype(np.uint8),
        worn,
        trails,
        kerbstones(level, strips, trails, fine.cell),
    )
