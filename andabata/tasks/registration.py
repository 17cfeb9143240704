"""Gymnasium ids of the environments, whose own modules are imported when one is made."""

import gymnasium as gym

STAGES = ("Maze2D", "Maze3D", "Natural")


def register_environments() -> None:
    """Register ``andabata/Maze2D-v0``, ``Maze3D-v0``, ``Natural-v0`` and ``SPN-v0``, once.

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
    if "andabata/SPN-v0" not in gym.registry:
        gym.register(
            "andabata/SPN-v0",
            entry_point="andabata.tasks.spn:make_spn",
            vector_entry_point="andabata.tasks.spn:make_spn_vector",
        )
