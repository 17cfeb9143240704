"""Navigators of the BARN benchmark by name: those on flat ground, and policies of rooms."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from andabata.evaluation.room_policies import fitted, law_policy, trained_lidar
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarNavigator
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.models import shipped_policy
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS, planar_navigator
from andabata.navigation.planar.dynamic_window import VEHICLE_MAP
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.policy_navigator import (
    RoomPolicyNavigator,
    SimilarityConfig,
    scaled_lidar,
)
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from rl.laws import LAWS


class _RoomPolicy(NamedTuple):
    """A policy of rooms as it drives here.

    Attributes:
        policy: Name of a shipped policy, or ``heading``, the law that sees no obstacle.
        task: Task of its training.
        similarity: Units in which it measures this robot (tuned on generated fields of seeds 1000
            to 1029).
        has_map: True to head for sub-goals of the map of ``dwa``.
    """

    policy: str
    task: RoomConfig
    similarity: SimilarityConfig
    has_map: bool


ROOM_POLICIES = {
    "td3": _RoomPolicy("td3", Td3TaskConfig(), SimilarityConfig(), has_map=True),
    "spn": _RoomPolicy("spn", SpnConfig(), SimilarityConfig(length=1.4, rate=1.4), has_map=True),
    "heading": _RoomPolicy(
        "heading", Td3TaskConfig(), SimilarityConfig(length=1.2, rate=1.4), has_map=True
    ),
    "td3-goal": _RoomPolicy("td3", Td3TaskConfig(), SimilarityConfig(length=1.4), has_map=False),
    "spn-goal": _RoomPolicy(
        "spn", SpnConfig(), SimilarityConfig(length=1.4, rate=1.4), has_map=False
    ),
}
"""Policies of rooms, heading for sub-goals of a map or for the goal."""

BARN_NAVIGATORS = (*PLANAR_NAVIGATORS, *ROOM_POLICIES)
"""Names of all navigators."""


def barn_navigator(
    name: str,
    vehicle: PlanarVehicleConfig,
    lidar: PlanarLidarConfig,
    rng: np.random.Generator,
    policy: Path | None = None,
) -> PlanarNavigator:
    """Return a navigator by its name.

    Args:
        name: Name in ``BARN_NAVIGATORS``.
        vehicle: Robot, as far as it is known.
        lidar: Laser of the robot.
        rng: Source of draws.
        policy: File of the policy of ``distilled``, None for the shipped one.

    Raises:
        ValueError: If the file is no policy, or not a distilled one.
        OSError: If it cannot be read.
    """
    if name not in ROOM_POLICIES:
        return planar_navigator(name, vehicle, rng, policy)
    policy_name, task, similarity, has_map = ROOM_POLICIES[name]
    is_law = policy_name in LAWS
    actor = law_policy(policy_name, task) if is_law else shipped_policy(policy_name)
    seen = scaled_lidar(lidar, similarity.length)
    # The open looks as it did in training.
    reach = min(seen.max_range, trained_lidar(actor, task).max_range)
    seen = seen.model_copy(update={"max_range": reach})
    actor, task = fitted(actor, task.model_copy(update={"lidar": seen}))
    map_config = VEHICLE_MAP if has_map else None
    return RoomPolicyNavigator(vehicle, actor, task, similarity, map_config, rng)
