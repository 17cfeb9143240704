"""Rough ground: clods, gravel and ruts on the smooth ground of a natural world.

A wheel rolls over all of it. It lies on a grid of its own, fine enough for a wheel; the true map is
built of the smooth ground.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.classes import SemanticClass
from terrain.generators import distance_to_line, smooth_noise, winding_line
from terrain.heightfield import Heightfield
from terrain.relief import roughness, rut

_PATCH = 20.0
"""Typical distance between patches of rougher ground [m]."""

_GRAVEL_WAVES = (0.15, 0.35)
"""Wavelengths of gravel and litter [m]."""

_REACH = 1.2
"""Distance from the middle of a vehicle's track up to which there may be a rut [m]."""


class RoughnessConfig(BaseModel):
    """What wheels roll over, at difficulty 0.5; sizes and numbers rise with the difficulty.

    Random roughness of bare soil is 0 to 7 cm in soil science (RUSLE2, "random roughness"); fields
    and forest floors that people walk over have 0.5 to 2.5 cm.

    Attributes:
        clods: Standard deviation of clods and tussocks where they are highest [m].
        gravel: Standard deviation of gravel and litter in their patches, a third of the ground [m].
        ruts: Number of tracks of vehicles, each of two ruts of 2 to 4.5 cm.
        cells: Number of cells along the edge of one of the smooth ground.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    clods: float = Field(default=0.0, ge=0, le=0.03)
    gravel: float = Field(default=0.0, ge=0, le=0.015)
    ruts: int = Field(default=0, ge=0, le=100)
    cells: int = Field(default=3, ge=1, le=10)

    @property
    def is_smooth(self) -> bool:
        """True if there is nothing to roll over."""
        return not (self.clods or self.gravel or self.ruts)


def refined(
    smooth: Heightfield, surface: NDArray[np.uint8], cells: int
) -> tuple[Heightfield, NDArray[np.uint8]]:
    """Return ground on a finer grid, and the class of each of its cells.

    Args:
        smooth: Ground.
        surface: Semantic class of each of its cells, uint8, shape (nx - 1, ny - 1).
        cells: Number of new cells along the edge of one.
    """
    return smooth.refined(cells), surface.repeat(cells, 0).repeat(cells, 1)


def rough_ground(
    fine: Heightfield,
    surface: NDArray[np.uint8],
    config: RoughnessConfig,
    difficulty: float,
    rng: np.random.Generator,
    worn: NDArray[np.float64] | None = None,
) -> Heightfield:
    """Return the ground with what wheels roll over.

    Clods, gravel and ruts have random streams of their own: a change of one does not move the
    others. Water stays level; paths have gravel, and clods of a third of the height.

    Args:
        fine: Ground without it, on a grid that is fine enough for it.
        surface: Semantic class of each of its cells, uint8, shape (nx - 1, ny - 1).
        config: Sizes and numbers.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness.
        worn: Share that is worn off, 0 to 1, shape (nx, ny); None for nothing.
    """
    rise = np.where(at_nodes(surface == SemanticClass.WATER), 0.0, 0.5 + difficulty)
    soft = np.where(at_nodes(surface == SemanticClass.PATH), 1 / 3, 1.0)
    if worn is not None:
        rise *= 1.0 - worn
    clod_rng, gravel_rng, rut_rng = rng.spawn(3)
    heights = fine.heights.astype(np.float64)
    heights += rise * soft * config.clods * _clods(fine, clod_rng)
    heights += rise * config.gravel * _gravel(fine, gravel_rng)
    for _ in range(round(config.ruts * (0.5 + difficulty))):
        heights += _track(fine, rut_rng) * np.minimum(rise / (0.5 + difficulty), 1.0)
    return Heightfield(heights.astype(np.float32), fine.cell)


def at_nodes(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which nodes are a corner of a cell of some, shape (nx, ny).

    Args:
        cells: True for these cells, shape (nx - 1, ny - 1).
    """
    padded = np.pad(cells, 1, mode="edge")
    along = padded[1:] | padded[:-1]
    return along[:, 1:] | along[:, :-1]


def _clods(ground: Heightfield, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return clods of a standard deviation of 0.2 to 1 [-], by patches."""
    shape = ground.heights.shape
    patches = smooth_noise(shape, ground.cell, _PATCH, rng)
    return np.clip(0.7 + 0.25 * patches, 0.2, 1.0) * roughness(shape, ground.cell, rng)


def _gravel(ground: Heightfield, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return gravel of a standard deviation of 1 [-] in patches, a third of the ground."""
    shape = ground.heights.shape
    patches = smooth_noise(shape, ground.cell, _PATCH, rng)
    # Above 0.43 of a standard deviation lies a third; the edge of a patch is a metre wide.
    share = np.clip(1.0 + 4.0 * (patches - 0.43), 0.0, 1.0)
    return share * roughness(shape, ground.cell, rng, _GRAVEL_WAVES)


def _track(ground: Heightfield, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the ruts of a vehicle that drove 15 to 60 m [m]."""
    half = ground.width / 2
    line = winding_line(
        rng.uniform(-half, half, 2), rng.uniform(-np.pi, np.pi), rng.uniform(15, 60), 0.12, rng
    )
    distance = distance_to_line(ground.x, ground.y, line, reach=_REACH)
    return rut(distance, rng.uniform(1.1, 1.6), rng.uniform(0.02, 0.045))
