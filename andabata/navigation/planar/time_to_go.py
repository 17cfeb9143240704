"""Time to go: how long the way to the goal takes from each cell, at the speed its clearance allows.

The allowed speed is the one at which the margin of the rollouts, which grows with speed, fits into
the clearance: both planners judge a gap alike, so that the field leads through none that the
rollouts refuse. Ground that no beam has met anything on counts as free (assumption).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planar.nearest_hits import NearestHits
from andabata.navigation.planning.cost_to_go import search, search_for
from terrain.kernel import kernel

_GOAL_SHIFT = 1e-6
"""Shift of the goal, in cells: goals like to lie on the edges of cells, where rounding must not
choose."""


class MarginConfig(BaseModel):
    """Distance to obstacles that the robot keeps where it can.

    Attributes:
        standing: Margin of a robot that hardly moves [m].
        per_speed: Further margin per speed [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    standing: float = Field(default=0.05, gt=0)
    per_speed: float = Field(default=0.10, gt=0)

    def at(self, speed: float) -> float:
        """Return the margin at a speed [m]."""
        return self.standing + self.per_speed * abs(speed)


class TimeToGoConfig(BaseModel):
    """Settings of the field.

    Attributes:
        stride: Number of cells of the hits along the edge of a cell of the field.
        min_speed: Speed that is allowed however small the clearance [m/s].
        proximity_cost: Extra time of a metre without any clearance [s/m]; it falls to none where
            the robot that stands has its margin.
        margin: Field is known wherever the time is no more than the robot's and this [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stride: int = Field(default=2, ge=1, le=8)
    min_speed: float = Field(default=0.3, gt=0)
    proximity_cost: float = Field(default=40.0, ge=0)
    margin: float = Field(default=2.0, ge=0)


class SpeedLimits(NamedTuple):
    """Speed that a clearance allows.

    Attributes:
        inscribed_radius: Clearance of the robot's middle that it can just drive with [m].
        per_speed: Further clearance per speed [s].
        min_speed: Speed that is allowed however small the clearance [m/s].
        max_speed: Largest speed [m/s].
        proximity_cost: Extra time of a metre without any clearance [s/m].
    """

    inscribed_radius: float
    per_speed: float
    min_speed: float
    max_speed: float
    proximity_cost: float


class TimeField(NamedTuple):
    """Field as kernels read it.

    Attributes:
        times: Time to the goal in cells at the largest speed, infinite where the search has not
            been, float32, shape (n, n).
        corner: Place of the first cell's corner [m], shape (2,).
        cell: Edge of a cell [m].
        unit: Time for a cell at the largest speed [s].
        unknown: Least time where the search has not been [s], shape (1,).
    """

    times: NDArray[np.float32]
    corner: NDArray[np.float64]
    cell: float
    unit: float
    unknown: NDArray[np.float64]


class TimeToGo:
    """Time to the goal around the robot.

    Attributes:
        limits: Speed that a clearance allows.
        field: Field of the last update.
        costs: Time of a cell's length as a multiple of that at the largest speed, float32, shape
            (n, n).
    """

    def __init__(
        self, cells: int, cell: float, limits: SpeedLimits, config: TimeToGoConfig
    ) -> None:
        """Prepare for a square.

        Args:
            cells: Number of cells of the hits along its edge.
            cell: Edge of a cell of the hits [m].
            limits: Speed that a clearance allows.
            config: Settings.
        """
        n, self._stride = cells // config.stride, config.stride
        edge = cell * config.stride
        self.limits, self._margin = limits, config.margin
        self.costs = np.ones((n, n), dtype=np.float32)
        times = np.full((n, n), np.inf, dtype=np.float32)
        self.field = TimeField(times, np.zeros(2), edge, edge / limits.max_speed, np.zeros(1))
        highest = limits.max_speed * (1.0 / limits.min_speed + limits.proximity_cost)
        self._search = search_for(self.costs, times, highest, 1.0)

    def update(
        self, hits: NearestHits, position: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> None:
        """Compute the field around the robot.

        Args:
            hits: Nearest hits of the square.
            position: Position of the robot in it [m], shape (2,).
            goal: Goal; beyond the square the way to it counts as free [m], shape (2,).
        """
        field, n = self.field, len(self.costs)
        field.corner[:] = hits.corner
        _price(hits, self._stride, self.limits, self.costs)
        first = self._search.first
        first[:] = np.clip((position - field.corner) / field.cell, 0, n - 1)
        last = np.floor((goal - field.corner) / field.cell + _GOAL_SHIFT).astype(np.int64)
        margin = self._margin / field.unit
        search(self._search, last, margin)
        # What the search has not reached costs more than the robot's way and the margin.
        field.unknown[0] = (float(field.times[tuple(first)]) + margin) * field.unit


@kernel
def time_at(field: TimeField, x: float, y: float) -> float:
    """Return the time to the goal at a place [s], between the middles of the nearest cells."""
    n = len(field.times)
    u = min(max((x - field.corner[0]) / field.cell - 0.5, 0.0), n - 1.001)
    v = min(max((y - field.corner[1]) / field.cell - 0.5, 0.0), n - 1.001)
    i, j = int(u), int(v)
    a, b = u - i, v - j
    near = field.times[i, j] * (1 - a) + field.times[i + 1, j] * a
    next_ = field.times[i, j + 1] * (1 - a) + field.times[i + 1, j + 1] * a
    time = (near * (1 - b) + next_ * b) * field.unit
    # Infinite and, where it is multiplied by none, not a number.
    return float(time) if time < np.inf else field.unknown[0]


@kernel
def allowed_speed(clearance: float, limits: SpeedLimits) -> float:
    """Return the speed that a clearance of the robot's middle allows [m/s]."""
    fits = (clearance - limits.inscribed_radius) / limits.per_speed
    return min(max(fits, limits.min_speed), limits.max_speed)


@kernel
def _price(hits: NearestHits, stride: int, limits: SpeedLimits, costs: NDArray[np.float32]) -> None:
    """Write the time of a cell's length, as a multiple of that at the largest speed."""
    for i in range(len(costs)):
        for j in range(len(costs)):
            x = hits.corner[0] + (i + 0.5) * stride * hits.cell
            y = hits.corner[1] + (j + 0.5) * stride * hits.cell
            squared = np.inf
            for p in range(i * stride, (i + 1) * stride):
                for q in range(j * stride, (j + 1) * stride):
                    away = (hits.places[p, q, 0] - x) ** 2 + (hits.places[p, q, 1] - y) ** 2
                    squared = min(squared, away)
            clearance = min(np.sqrt(squared), hits.reach)
            time = 1.0 / allowed_speed(clearance, limits)
            time += limits.proximity_cost * max(1.0 - clearance / limits.inscribed_radius, 0.0)
            costs[i, j] = max(time * limits.max_speed, 1.0)


def limits_of(
    half_width: float, max_speed: float, margin: MarginConfig, config: TimeToGoConfig
) -> SpeedLimits:
    """Return the speeds that clearances allow to a robot with the margin of its rollouts.

    Args:
        half_width: Least distance of the footprint's edge from the robot's middle [m].
        max_speed: Largest speed [m/s].
        margin: Margin of the rollouts.
        config: Settings of the field.

    Raises:
        ValueError: If the least allowed speed exceeds the largest.
    """
    if not (config.min_speed <= max_speed and math.isfinite(half_width)):
        raise ValueError(
            f"min_speed: expected at most the largest speed, {max_speed} m/s, "
            f"got {config.min_speed} m/s; lower it"
        )
    inscribed = half_width + margin.standing
    return SpeedLimits(
        inscribed, margin.per_speed, config.min_speed, max_speed, config.proximity_cost
    )
