"""Navigation in rooms by a planar laser: the task of SPN (Zhang et al., arXiv 2010.10209)."""

from collections.abc import Sequence

from andabata.tasks.rooms.env import RoomEnv, RoomVectorEnv
from andabata.tasks.rooms.spn_config import SpnConfig, spn_config


def make_spn(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
    render_mode: str | None = None,
) -> RoomEnv:
    """Make the environment: the entry point of ``andabata/SPN-v0``.

    Args:
        rooms: Name of a room, or several; None for the four of the curriculum.
        lidar: Name or label of a laser; None for the training laser.
        config: Settings to begin from.
        render_mode: None, the only one.
    """
    return RoomEnv(spn_config(rooms, lidar, config), render_mode)


def make_spn_vector(
    num_envs: int = 1,
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
) -> RoomVectorEnv:
    """Make the environment for many robots; arguments as for ``make_spn``."""
    return RoomVectorEnv(spn_config(rooms, lidar, config), num_envs)
