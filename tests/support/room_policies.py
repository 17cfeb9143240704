"""Policies with random weights, for tests of drives in rooms."""

import torch

from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.training.plans import load_plan
from rl.networks import DeterministicActor
from rl.point_set_actor import PointSetActor


def point_policy(seed=0, features=5, info=None):
    """Return a policy on points that was never trained."""
    task = SpnConfig()
    torch.manual_seed(seed)
    actor = PointSetActor(task.observations, task.actions, (16, 16), width=16, n_features=features)
    return actor.policy(info or {})


def window_policy(plan_name="td3", hidden=(8, 8), **changes):
    """Return a policy of TD3's task that was never trained, but says how it would have been."""
    plan = load_plan(plan_name, task="td3")
    task = plan.stages["Rooms"].environment.model_copy(update=changes)
    torch.manual_seed(0)
    actor = DeterministicActor(task.observations, task.actions, hidden, None)
    config = plan.model_dump(mode="json")
    config["stages"]["Rooms"]["environment"] = task.model_dump(mode="json")
    return actor.policy({"config": config, "stage": "Rooms", "seed": 0})
