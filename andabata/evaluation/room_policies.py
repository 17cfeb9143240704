"""What a policy was trained with, and the task of a comparison as such a policy reads it."""

from typing import Any

import numpy as np

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.catalogue import ROOM_TASKS, RoomTaskConfig
from andabata.tasks.rooms.config import RoomConfig
from rl.laws import LAWS
from rl.policy import Policy, with_observations

TRAINED = "trained"
"""Name of the laser that each policy was trained with; laws, and policies that do not say how they
were trained, take that of the task."""

_READ = (
    "windows",
    "window_fov_deg",
    "window_unit",
    "earlier_scan",
    "goal_encoding",
    "tracked_movers",
    "robot",
    "lidar",
)
"""Settings of an environment that a policy depends on; the rest is the comparison's."""


def trained_in(policy: Policy) -> RoomTaskConfig | None:
    """Return what a policy depends on, of the environment of the last stage that it was trained in.

    Other settings, such as rooms and reward, are the task's defaults.

    Returns:
        Settings; None if the policy does not say how it was trained, as laws do not.

    Raises:
        ValueError: If it was trained in no task in rooms, or its settings are not of this version.
    """
    stages: dict[str, Any] = policy.info.get("config", {}).get("stages", {})
    stage = stages.get(policy.info.get("stage", ""))
    if stage is None:
        return None
    environment: dict[str, Any] = stage["environment"]
    task = str(environment.get("task"))
    if task not in ROOM_TASKS:
        raise ValueError(f"task {task}")
    parts = {name: environment[name] for name in _READ if name in environment}
    return ROOM_TASKS[task].model_validate(parts)


def fitted(policy: Policy, config: RoomConfig) -> tuple[Policy, RoomConfig]:
    """Return a policy for any number of points, and a task with the robot and terms that it reads.

    Robot, windows, earlier scan, form of the goal and number of tracked movers are those of its
    training. A policy that does not say how it was trained takes the task's own, but for the form
    of the goal. Ranges count up to the largest one of the training, so that the open looks as it
    did there.

    Args:
        policy: Policy.
        config: Task, whose laser and points may be any.

    Raises:
        ValueError: If the policy reads other terms than the task has, or has other actions.
    """
    try:
        task = _as_trained(policy, config)
        if policy.actions.names != task.actions.names:
            raise ValueError(f"actions {policy.actions.names}")
        return with_observations(policy, task.observations), task
    except (KeyError, ValueError) as error:
        reads = ", ".join(f"{term.name} {term.shape}" for term in policy.observations.terms)
        raise ValueError(
            f"policy: expected one that drives in rooms, got one of kind {policy.architecture} "
            f"that reads {reads} and gives {', '.join(policy.actions.names)}; train one with "
            f"`andabata train --task {config.task}`"
        ) from error


def trained_lidar(policy: Policy, config: RoomConfig) -> PlanarLidarConfig:
    """Return the laser that a policy was trained with, a task's own if it does not say."""
    training = trained_in(policy)
    return config.lidar if training is None else training.lidar


def law_policy(name: str, config: RoomConfig) -> Policy:
    """Return a law for the robot and the terms of a task.

    Args:
        name: Name in ``LAWS``.
        config: Task.
    """
    known = {
        "bearings": config.terms.window_bearings.astype(np.float32),
        "radius": np.array([config.robot.radius], dtype=np.float32),
    }
    law = LAWS[name]
    constants = {part: known[part] for part in law.constants}
    return law(constants, config.observations, config.actions)


def _as_trained(policy: Policy, config: RoomConfig) -> RoomConfig:
    """Return a task with the robot and the terms of a policy's training."""
    training, names = trained_in(policy), {term.name for term in policy.observations.terms}
    # A task without points gets all beams for a policy that reads them.
    points = (config.points or None) if "points" in names else 0
    if training is None:
        polar = policy.observations.term("goal").shape == (2,)
        own = {"goal_encoding": "polar" if polar else "cosine", "points": points}
        return config.model_copy(update=own)
    update: dict[str, Any] = {name: getattr(training, name) for name in _READ if name != "lidar"}
    if training.window_unit == "ranges":
        reach = min(config.lidar.max_range, training.lidar.max_range)
        update["lidar"] = config.lidar.model_copy(update={"max_range": reach})
    return config.model_copy(update=update | {"points": points})
