"""Settings of navigation in rooms by a planar laser: SPN's task (arXiv 2010.10209)."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from andabata.machine.planar.lidar import TRAINING_LIDAR, PlanarLidarConfig
from andabata.tasks.rooms.config import RoomConfig, named_parts
from andabata.tasks.terminations import TerminationConfig

TRAINING_ROOMS = ("spn-env0", "spn-env1", "spn-env2", "spn-env3")
"""Rooms of the curriculum, the easiest first."""


class SpnConfig(RoomConfig):
    """Settings of SPN's task: a curriculum of four rooms, points of 1080 beams, 400 steps.

    Attributes:
        task: Name of the kind of task.
        rooms: Names of the rooms (paper: four).
        lidar: Laser (paper: 360 degrees, 1080 beams, 5 m).
        terminations: Rules that end an episode (assumption; the paper prints none).
    """

    task: Literal["spn"] = "spn"
    rooms: tuple[str, ...] = Field(default=TRAINING_ROOMS, min_length=1)
    lidar: PlanarLidarConfig = TRAINING_LIDAR
    terminations: TerminationConfig = Field(
        default_factory=lambda: TerminationConfig(goal_radius=0.3, time_limit=80.0, stuck_time=1e3)
    )


def spn_config(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
) -> SpnConfig:
    """Return settings with rooms and a laser by their names; arguments as for ``make_spn``."""
    return (config or SpnConfig()).model_copy(update=named_parts(rooms, lidar))
