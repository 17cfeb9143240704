"""Map-less navigation in rooms: the task of the improved TD3 (Guo et al.) and of GDAE."""

from collections.abc import Sequence

from andabata.tasks.rooms.env import RoomEnv, RoomVectorEnv
from andabata.tasks.rooms.td3_config import StateKind, Td3TaskConfig, td3_config


def make_td3(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    state: StateKind | None = None,
    config: Td3TaskConfig | None = None,
    render_mode: str | None = None,
) -> RoomEnv:
    """Make the environment: the entry point of ``andabata/TD3-v0``.

    Args:
        rooms: Name of a room, or several; None for a pool of random ones.
        lidar: Name or label of a laser; None for that of the state.
        state: Form of the state, one of ``STATES``; None for that of the settings.
        config: Settings to begin from.
        render_mode: None, the only one.
    """
    return RoomEnv(td3_config(rooms, lidar, state, config), render_mode)


def make_td3_vector(
    num_envs: int = 1,
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    state: StateKind | None = None,
    config: Td3TaskConfig | None = None,
) -> RoomVectorEnv:
    """Make the environment for many robots; arguments as for ``make_td3``."""
    return RoomVectorEnv(td3_config(rooms, lidar, state, config), num_envs)
