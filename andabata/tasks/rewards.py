"""Rewards as sums of named terms, over many robots: off-road, and in rooms."""

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator

from andabata.own_code import is_own
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
        function: File and name, ``FILE.py:NAME``, of a function of one's own whose terms take the
            place of all of these; None for none (``andabata.tasks.own_reward``).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    attraction: float = Field(default=200.0, ge=0)
    front: float = Field(default=0.1, ge=0)
    side: float = Field(default=0.03, ge=0)
    rear: float = Field(default=0.009, ge=0)
    max_range: float = Field(default=10.0, gt=0)
    collision: float = Field(default=-1000.0, le=0)
    tipover: float = Field(default=-1000.0, le=0)
    function: str | None = None

    @field_validator("function")
    @classmethod
    def _check_function(cls, name: str | None) -> str | None:
        """Refuse a name that is none of a user's own code."""
        if name is not None and not is_own(name):
            raise ValueError(f"expected FILE.py:NAME, got {name!r}")
        return name


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

    Sectors are added one after the other, as running sums are: a matrix product would choose its
    own order, and a robot alone would get another last bit than among others.
    """
    parts = repulsion_weights(config, ranges.shape[1]) * (config.max_range - ranges.astype(float))
    return np.add.accumulate(parts, axis=1)[:, -1]


@lru_cache(maxsize=8)
def repulsion_weights(config: RewardConfig, sectors: int) -> NDArray[np.float64]:
    """Return Kr of each sector [1/m], shape (sectors,), which nobody may write to."""
    bearings = np.abs(-np.pi + 2 * np.pi / sectors * (np.arange(sectors) + 0.5))
    inner = np.where(bearings <= np.pi / 2, config.side, config.rear)
    weights = np.where(bearings <= np.pi / 4, config.front, inner)
    weights.flags.writeable = False
    return weights


class RoomRewardConfig(BaseModel):
    """Constants of the reward in rooms (Zhang et al., arXiv 2010.10209, equation 3).

    The paper prints none of them: values of its reference [9] but for the step (assumption).

    Attributes:
        goal: Reward of the step that reaches the goal.
        collision: Reward of the step that ends in a collision, or stuck.
        progress: Reward of each metre nearer to the goal, c1.
        step: Reward of every other step, c2: standing still does not pay ([9]: -0.01).
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

    Goal and collision stand alone in their step, as printed; a time-out is a step like others. A
    robot that is stuck pays as for a collision: what stands and waits earns no way out.

    Args:
        config: Constants.
        distance_before: Distance to the goal before the step [m], shape (n,).
        distance: Distance to the goal after it [m], shape (n,).
        endings: ``Ending`` of each drive with this step, shape (n,).

    Returns:
        Terms by name, float64, shape (n,) each.
    """
    reached = endings == Ending.GOAL
    collided = (endings == Ending.COLLISION) | (endings == Ending.STUCK)
    other = ~(reached | collided)
    return {
        "goal": np.where(reached, config.goal, 0.0),
        "collision": np.where(collided, config.collision, 0.0),
        "progress": np.where(other, config.progress * (distance_before - distance), 0.0),
        "step": np.where(other, config.step, 0.0),
    }


class GdaeRewardConfig(BaseModel):
    """Constants of GDAE's reward (Cimurs et al. 2022, and their public code).

    It pays speed and no progress: with the discount of 0.99999 a circle at full speed is worth more
    than a goal.

    Attributes:
        kind: Name of the reward.
        goal: Reward of the step that reaches the goal.
        collision: Reward of the step that ends in a collision.
        speed: Reward of each m/s forward in every other step.
        turn: Reward of each rad/s of turning, either way.
        nearness: Reward of each metre by which the nearest obstacle is nearer than ``near_range``.
        near_range: Range from which an obstacle costs nothing [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["gdae"] = "gdae"
    goal: float = Field(default=100.0, ge=0)
    collision: float = Field(default=-100.0, le=0)
    speed: float = Field(default=0.5, ge=0)
    turn: float = Field(default=-0.5, le=0)
    nearness: float = Field(default=-0.5, le=0)
    near_range: float = Field(default=1.0, gt=0)


def gdae_reward(
    config: GdaeRewardConfig,
    twists: NDArray[np.float64],
    nearest: NDArray[np.float64],
    endings: NDArray[np.int64],
) -> dict[str, NDArray[np.float64]]:
    """Return the terms of one step's reward for n robots; their sum is the reward.

    Goal and collision stand alone in their step; a time-out is a step like others.

    Args:
        config: Constants.
        twists: Commanded speed [m/s] and yaw rate [rad/s] of the step, shape (n, 2).
        nearest: Smallest range after the step [m], shape (n,).
        endings: ``Ending`` of each drive with this step, shape (n,).

    Returns:
        Terms by name, float64, shape (n,) each.
    """
    reached, collided = endings == Ending.GOAL, endings == Ending.COLLISION
    other = ~(reached | collided)
    missing = np.maximum(config.near_range - nearest, 0.0)
    return {
        "goal": np.where(reached, config.goal, 0.0),
        "collision": np.where(collided, config.collision, 0.0),
        "speed": np.where(other, config.speed * twists[:, 0], 0.0),
        "turn": np.where(other, config.turn * np.abs(twists[:, 1]), 0.0),
        "nearness": np.where(other, config.nearness * missing, 0.0),
    }


class ImprovedRewardConfig(BaseModel):
    """Constants of the improved TD3's reward (Guo et al., equations 5 to 9).

    As printed, a step is paid by the sign of its progress alone: a robot that creeps collects as
    much in each step as one that drives, for longer, and earns more than by arriving.
    ``proportional`` pays the share of the most progress that a step can make (assumption).

    Attributes:
        kind: Name of the reward.
        goal: Reward of the step that reaches the goal (Eq. 5).
        collision: Reward of the step that ends in a collision.
        timeout: Reward of the step in which the time is over.
        gain: Reward of progress in heading, and in distance (Eq. 6 and 7).
        loss: Reward of the opposite.
        proportional: False for the printed rewards by sign.
        max_progress: Greatest progress in distance of a step [m]; for ``proportional`` alone
            (assumption: GDAE's 1 m/s for 0.1 s).
        max_turn: Greatest progress in heading of a step [rad] (assumption: 1 rad/s for 0.1 s).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["improved"] = "improved"
    goal: float = Field(default=100.0, ge=0)
    collision: float = Field(default=-100.0, le=0)
    timeout: float = Field(default=-100.0, le=0)
    gain: float = Field(default=1.5, ge=0)
    loss: float = Field(default=-2.0, le=0)
    proportional: bool = False
    max_progress: float = Field(default=0.1, gt=0)
    max_turn: float = Field(default=0.1, gt=0)


class GoalOffsets(NamedTuple):
    """Where the goals of n robots are.

    Attributes:
        distances: Distance to the goal [m], shape (n,).
        bearings: Bearing of the goal from straight ahead, from -pi to pi [rad], shape (n,).
    """

    distances: NDArray[np.float64]
    bearings: NDArray[np.float64]


def improved_reward(
    config: ImprovedRewardConfig,
    before: GoalOffsets,
    after: GoalOffsets,
    endings: NDArray[np.int64],
) -> dict[str, NDArray[np.float64]]:
    """Return the terms of one step's reward for n robots; their sum is the reward (Eq. 9).

    The dense terms are paid in the last step too, as printed. Eq. 7 pays a distance that stays the
    same, the text beside it does not; here the equation counts.

    Args:
        config: Constants.
        before: Goals before the step.
        after: Goals after it.
        endings: ``Ending`` of each drive with this step, shape (n,).

    Returns:
        Terms by name, float64, shape (n,) each.
    """
    turned = np.abs(before.bearings) - np.abs(after.bearings)
    nearer = before.distances - after.distances
    if config.proportional:
        heading = _graded(config, turned / config.max_turn)
        distance = _graded(config, nearer / config.max_progress)
    else:
        same_side = after.bearings * before.bearings >= 0
        heading = np.where(same_side & (turned > 0), config.gain, config.loss)
        distance = np.where(nearer >= 0, config.gain, config.loss)
    return {
        "goal": np.where(endings == Ending.GOAL, config.goal, 0.0),
        "collision": np.where(endings == Ending.COLLISION, config.collision, 0.0),
        "timeout": np.where(endings == Ending.TIMEOUT, config.timeout, 0.0),
        "heading": heading,
        "distance": distance,
    }


def _graded(config: ImprovedRewardConfig, share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return gains for positive and losses for negative shares of the most progress, (n,)."""
    share = np.clip(share, -1.0, 1.0)
    return np.where(share > 0, config.gain * share, -config.loss * share)
