"""A reward of your own, off-road: progress, less what turning to and fro costs.

``andabata train --stages 1 --reward examples/own_reward.py:smooth --out data/runs/smooth`` learns
by it, ``andabata report data/runs/smooth`` draws its terms.
"""

import numpy as np

from andabata.tasks.own_reward import RewardInput, Terms
from andabata.tasks.terminations import Ending

PROGRESS = 200.0
"""Reward of each metre nearer to the goal, or to the planner's sub-goal."""

NEARNESS = -5.0
"""Reward of each metre by which the nearest obstacle is nearer than 1 m."""

TURNING = -4.0
"""Reward of each rad/s by which the yaw rate changes from one step to the next."""

CRASH = -1000.0
"""Reward of the step that ends a drive badly."""


def smooth(step: RewardInput) -> Terms:
    """Return the terms of a step's reward by name, one number of each robot; their sum counts.

    Each robot's reward depends on its own row alone: robots are simulated in groups of any size.
    """
    nearest = step.ranges.min(axis=1).astype(np.float64)
    turned = np.abs(step.yaw_rates[:, 0] - step.yaw_rates[:, 1])
    crashed = np.isin(step.endings, (Ending.COLLISION, Ending.STUCK, Ending.TIPOVER))
    return {
        "progress": PROGRESS * (step.distance_before - step.distance),
        "nearness": NEARNESS * np.maximum(1.0 - nearest, 0.0),
        "turning": TURNING * turned,
        "crash": np.where(crashed, CRASH, 0.0),
    }
