"""Gymnasium ids of the environments, whose own modules are imported when one is made."""

import gymnasium as gym

STAGES = ("Maze2D", "Maze3D", "Natural")

ROOM_TASK_NAMES = ("spn", "td3")
"""Names of the tasks in rooms, which are those of their modules in ``rooms``."""


def register_environments() -> None:
    """Register ``andabata/Maze2D-v0``, ``Maze3D-v0``, ``Natural-v0``, ``SPN-v0``, ``TD3-v0``, once.

    ``import andabata`` does it, as Gymnasium asks of third-party packages: it loads no plug-ins by
    itself. ``gymnasium.make("andabata:andabata/Natural-v0")`` imports the package first.
    """
    for stage in STAGES:
        name = f"andabata/{stage}-v0"
        if name not in gym.registry:
            gym.register(
                name,
                entry_point="andabata.tasks.offroad:make_offroad",
                vector_entry_point="andabata.tasks.vector:make_vector",
                kwargs={"stage": stage},
            )
    for task in ROOM_TASK_NAMES:
        name = f"andabata/{task.upper()}-v0"
        if name not in gym.registry:
            gym.register(
                name,
                entry_point=f"andabata.tasks.rooms.{task}:make_{task}",
                vector_entry_point=f"andabata.tasks.rooms.{task}:make_{task}_vector",
            )
