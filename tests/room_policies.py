"""Policies on points with random weights, for tests of drives in rooms."""

import torch

from andabata.tasks.spn_config import SpnConfig
from rl.point_set_actor import PointSetActor


def point_policy(seed=0, features=5, info=None):
    """Return a policy on points that was never trained."""
    task = SpnConfig()
    torch.manual_seed(seed)
    actor = PointSetActor(task.observations, task.actions, (16, 16), width=16, n_features=features)
    return actor.policy(info or {})
