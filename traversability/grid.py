"""Polar grid around the robot (Sanchez et al. 2023, section 3.2)."""

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

MAX_RING_BINS = 2**20
"""Largest number of bins in which squared distances are looked up: half a ring takes one."""


class PolarGrid(BaseModel):
    """Cells of the local grid, in the horizontal plane of ``base_footprint``.

    Sector ``i`` covers bearings from ``-pi + i * 2 pi / n_sectors`` counter-clockwise to the next;
    ring ``j`` covers distances from ``ring_edges[j]`` to ``ring_edges[j + 1]``.

    Attributes:
        n_sectors: Number of sectors (paper: 32).
        n_rings: Number of rings (paper: 10).
        inner_radius: First ring edge [m]. Assumption: 0.6, under the paper's 0.72 m collision
            range.
        outer_radius: Last ring edge [m] (paper: 10).
        max_height: Height above ``cut`` over which points are not projected [m] (paper: 1.2).
        cut: Level that heights are limited from: the ``base`` plane of the robot (paper), which
            hides the ground itself of slopes, or the local ``ground``, followed from ring to ring
            (assumption).
        min_points: Number of points below which a cell is empty (paper: 5).
        max_traversable_vegetation: Height of plants that the robot may cross [m]; features of
            heights over the ground are relative to it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    n_sectors: int = Field(default=32, ge=4, le=360)
    n_rings: int = Field(default=10, ge=1, le=100)
    inner_radius: float = Field(default=0.6, gt=0)
    outer_radius: float = Field(default=10.0, gt=0)
    max_height: float = Field(default=1.2, gt=0)
    cut: Literal["base", "ground"] = "ground"
    min_points: int = Field(default=5, ge=3)
    max_traversable_vegetation: float = Field(default=0.15, gt=0, le=1)

    @model_validator(mode="after")
    def _check_radii(self) -> "PolarGrid":
        """Check that the first ring edge is smaller than the last one, and no ring too narrow."""
        if not self.inner_radius < self.outer_radius:
            raise ValueError(
                f"inner_radius: expected less than outer_radius ({self.outer_radius} m), "
                f"got {self.inner_radius} m"
            )
        step = (self.outer_radius / self.inner_radius) ** (1 / self.n_rings)
        if self.inner_radius**2 * (step - 1) < self.outer_radius**2 / MAX_RING_BINS:
            raise ValueError(
                f"inner_radius: expected a first ring that can be told from the next, got one from "
                f"{self.inner_radius} to {self.inner_radius * step:.3g} m of {self.n_rings} rings "
                f"to {self.outer_radius} m; take a larger one, or fewer rings"
            )
        return self

    @property
    def ring_edges(self) -> NDArray[np.float64]:
        """Ring edges [m], shape (n_rings + 1,). Geometric by assumption."""
        return _ring_edges(self.inner_radius, self.outer_radius, self.n_rings)

    @property
    def bearings(self) -> NDArray[np.float64]:
        """Bearing of each sector's centre [rad], shape (n_sectors,)."""
        return _bearings(self.n_sectors)


@lru_cache(maxsize=64)
def _ring_edges(inner: float, outer: float, rings: int) -> NDArray[np.float64]:
    """Return geometric ring edges [m], cached: they are needed with every cloud."""
    exponents = np.arange(rings + 1, dtype=np.float64) / rings
    edges = np.asarray(np.power(outer / inner, exponents) * inner, dtype=np.float64)
    edges.setflags(write=False)
    return edges


@lru_cache(maxsize=64)
def _bearings(sectors: int) -> NDArray[np.float64]:
    """Return the bearings of the sectors' centres [rad], cached."""
    width = 2 * np.pi / sectors
    bearings = -np.pi + width * (np.arange(sectors, dtype=np.float64) + 0.5)
    bearings.setflags(write=False)
    return bearings
