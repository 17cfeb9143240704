"""The paper's reward as a sum of named terms (section 4.2), its sign mended."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

TERMS = ("attraction", "repulsion", "collision", "tipover")
"""Names of the terms."""


class RewardConfig(BaseModel):
    """Constants of the reward.

    Attributes:
        attraction: Reward of each metre nearer to the goal, Ka (paper: 200).
        front: Kr of the sectors within 45 degrees of the heading [1/m] (paper: 0.1; which sectors
            is an assumption, they are in a figure only).
        side: Kr of the sectors from 45 to 90 degrees [1/m] (paper: 0.03).
        rear: Kr of the rest [1/m] (paper: 0.009).
        max_range: Range at which a sector repels no more [m] (paper: 10).
        collision: Added once when the drive ends in a collision, or stuck (assumption; the paper
            has none, 0).
        tipover: Added once when the robot rolls over (assumption; 0 in the paper).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    attraction: float = Field(default=200.0, ge=0)
    front: float = Field(default=0.1, ge=0)
    side: float = Field(default=0.03, ge=0)
    rear: float = Field(default=0.009, ge=0)
    max_range: float = Field(default=10.0, gt=0)
    collision: float = Field(default=-1000.0, le=0)
    tipover: float = Field(default=-1000.0, le=0)


def paper_reward(
    config: RewardConfig,
    ranges: NDArray[np.floating],
    distance_before: float,
    distance: float,
    outcome: str | None,
) -> dict[str, float]:
    """Return the terms of one step's reward; their sum is the reward.

    The attraction is ``Ka (d_before - d)``: the printed sign rewards driving away.

    Args:
        config: Constants.
        ranges: Finite free ranges after the step [m], shape (n,), sector 0 behind, then
            counter-clockwise.
        distance_before: Distance to the goal before the step [m].
        distance: Distance to the goal after it [m].
        outcome: How the drive ended with this step, None when it goes on.
    """
    repulsion = repulsion_weights(config, len(ranges)) @ (config.max_range - ranges)
    return {
        "attraction": config.attraction * (distance_before - distance),
        "repulsion": -float(repulsion),
        "collision": config.collision if outcome in ("collision", "stuck") else 0.0,
        "tipover": config.tipover if outcome == "tipover" else 0.0,
    }


def repulsion_weights(config: RewardConfig, sectors: int) -> NDArray[np.float64]:
    """Return Kr of each sector [1/m]."""
    bearings = np.abs(-np.pi + 2 * np.pi / sectors * (np.arange(sectors) + 0.5))
    inner = np.where(bearings <= np.pi / 2, config.side, config.rear)
    return np.where(bearings <= np.pi / 4, config.front, inner)
