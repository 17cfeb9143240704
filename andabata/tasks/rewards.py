"""Rewards as sums of named terms, over many robots: off-road, and in rooms."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.tasks.terminations import Ending

TERMS = ("attraction", "repulsion", "collision", "tipover")
"""Names of the terms."""


class RewardConfig(BaseModel):
    """Constants of the off-road reward (Sanchez et al. 2023, section 4.2, its sign mended).

    Attributes:
        attraction: Reward of each metre nearer to the goal, Ka (paper: 200).
        front: Kr of the sectors within 45 degrees of the heading [1/m] (paper: 0.1; which sectors
            is an assumption, they are in a figure only).
        side: Kr of the sectors from 45 to 90 degrees [1/m] (paper: 0.03).
        rear: Kr of the rest [1/m] (paper: 0.009).
        max_range: Range at which a sector repels no more [m] (paper: 10).
        collision: Reward of a drive that ends in a collision, or stuck (assumption; the paper has
            none, 0).
        tipover: Reward of a drive that ends rolled over (assumption; 0 in the paper).
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
    ranges: NDArray[np.float32],
    distance_before: NDArray[np.float64],
    distance: NDArray[np.float64],
    endings: NDArray[np.int64],
) -> dict[str, NDArray[np.float64]]:
    """Return the terms of one step's reward for n robots; their sum is the reward.

    The attraction is ``Ka (d_before - d)``: the printed sign rewards driving away.

    Args:
        config: Constants.
        ranges: Finite free ranges after the step [m], float32, shape (n, sectors), sector 0 behind,
            then counter-clockwise.
        distance_before: Distance to the goal before the step [m], shape (n,).
        distance: Distance to the goal after it [m], shape (n,).
        endings: ``Ending`` of each drive with this step, shape (n,).

    Returns:
        Terms by name, float64, shape (n,) each.
    """
    collided = (endings == Ending.COLLISION) | (endings == Ending.STUCK)
    return {
        "attraction": config.attraction * (distance_before - distance),
        "repulsion": -_repulsion(config, ranges),
        "collision": np.where(collided, config.collision, 0.0),
        "tipover": np.where(endings == Ending.TIPOVER, config.tipover, 0.0),
    }


def _repulsion(config: RewardConfig, ranges: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the sum of Kr (max_range - range) over the sectors, shape (n,).

    Sectors are added one after the other: a matrix product would choose its own order, and a robot
    alone would get another last bit than among others.
    """
    total = np.zeros(len(ranges))
    for sector, weight in enumerate(repulsion_weights(config, ranges.shape[1])):
        total += weight * (config.max_range - ranges[:, sector].astype(np.float64))
    return total


def repulsion_weights(config: RewardConfig, sectors: int) -> NDArray[np.float64]:
    """Return Kr of each sector [1/m], shape (sectors,)."""
    bearings = np.abs(-np.pi + 2 * np.pi / sectors * (np.arange(sectors) + 0.5))
    inner = np.where(bearings <= np.pi / 2, config.side, config.rear)
    return np.where(bearings <= np.pi / 4, config.front, inner)


class RoomRewardConfig(BaseModel):
    """Constants of the reward in rooms (Zhang et al., arXiv 2010.10209, equation 3).

    The paper prints none of them: values of its reference [9] but for the step (assumption).

    Attributes:
        goal: Reward of the step that reaches the goal.
        collision: Reward of the step that ends in a collision.
        progress: Reward of each metre nearer to the goal, c1.
        step: Reward of every other step, c2: standing still is no way out ([9]: -0.01).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    goal: float = Field(default=5.0, ge=0)
    collision: float = Field(default=-5.0, le=0)
    progress: float = Field(default=1.0, ge=0)
    step: float = Field(default=-0.02, le=0)


def room_reward(
    config: RoomRewardConfig,
    distance_before: NDArray[np.float64],
    distance: NDArray[np.float64],
    endings: NDArray[np.int64],
) -> dict[str, NDArray[np.float64]]:
    """Return the terms of one step's reward for n robots; their sum is the reward.

    Goal and collision stand alone in their step, as printed; a time-out is a step like others.

    Args:
        config: Constants.
        distance_before: Distance to the goal before the step [m], shape (n,).
        distance: Distance to the goal after it [m], shape (n,).
        endings: ``Ending`` of each drive with this step, shape (n,).

    Returns:
        Terms by name, float64, shape (n,) each.
    """
    reached, collided = endings == Ending.GOAL, endings == Ending.COLLISION
    other = ~(reached | collided)
    return {
        "goal": np.where(reached, config.goal, 0.0),
        "collision": np.where(collided, config.collision, 0.0),
        "progress": np.where(other, config.progress * (distance_before - distance), 0.0),
        "step": np.where(other, config.step, 0.0),
    }
