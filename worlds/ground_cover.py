"""Low plants and leaves that cover the ground: lawns, meadows after the cut, litter.

Wheels drive over them and do not feel them; beams stop in them, so that they hide what is lower.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.classes import SemanticClass
from terrain.generators import smooth_noise

_PATCH = 15.0
"""Typical distance between patches [m]."""


class CoverConfig(BaseModel):
    """Low plants and leaves.

    Attributes:
        share: Share of the ground that they cover at difficulty 0.5; it rises with the difficulty.
        height: Height of the highest [m]; that of the others is from 3 cm on.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: float = Field(default=0.0, ge=0, le=1)
    height: float = Field(default=0.12, ge=0.03, le=0.15)


def ground_cover(
    surface: NDArray[np.uint8],
    cell: float,
    config: CoverConfig,
    difficulty: float,
    rng: np.random.Generator,
) -> NDArray[np.uint8] | None:
    """Return the height of the cover of each grid cell [cm], uint8; None without any.

    It lies in patches of plain ground, each about as high as its surroundings.

    Args:
        surface: Semantic class of each cell, uint8, shape (n, m).
        cell: Edge of a cell [m].
        config: Share and height.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness.
    """
    if not config.share:
        return None
    shape = (surface.shape[0], surface.shape[1])
    grown, growth = (smooth_noise(shape, cell, _PATCH, each) for each in rng.spawn(2))
    is_covered = grown > np.quantile(grown, 1.0 - min(config.share * (0.5 + difficulty), 1.0))
    least = min(0.03, config.height)
    share = np.clip(0.5 + 0.35 * growth, 0.0, 1.0)
    height = 100.0 * (least + (config.height - least) * share)
    is_covered &= surface == SemanticClass.GROUND
    return np.where(is_covered, np.round(height), 0.0).astype(np.uint8)
