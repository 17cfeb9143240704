"""Tasks in rooms by name: the settings of each, and the rooms that judge it."""

from collections.abc import Mapping

from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import JUDGES, SCENES, Td3TaskConfig

RoomTaskConfig = SpnConfig | Td3TaskConfig
"""Settings of any task in rooms, distinguished by ``task``."""

ROOM_TASKS: Mapping[str, type[RoomTaskConfig]] = {"spn": SpnConfig, "td3": Td3TaskConfig}
"""Settings of each task."""

JUDGES_BY_TASK: Mapping[str, tuple[str, ...]] = {
    "spn": ("spn-env4", "spn-env5", "spn-env6", "spn-env7"),
    "td3": (*JUDGES, *SCENES),
}
"""Rooms of each paper's comparison; nothing is trained, chosen or tuned in them."""
