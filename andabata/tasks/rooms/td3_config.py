"""Settings of map-less navigation in rooms: the task of the improved TD3 (Guo et al.) and of GDAE.

The paper names neither the robot's size nor its speeds and rates: they are those of GDAE (Cimurs,
Suh and Lee 2022), whose scheme it improves, and the radius is that of SPN's robot (assumption).
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig
from andabata.tasks.rooms.config import RandomKind, RoomConfig, named_parts
from andabata.tasks.terminations import TerminationConfig

JUDGES = ("td3-env1", "td3-env2", "td3-env3", "td3-env4")
"""Rooms of the paper's comparison; nothing is trained, chosen or tuned in them."""

SCENES = ("td3-corridor", "td3-bend", "td3-gate-060", "td3-gate-080", "td3-gate-100", "td3-wall")
"""Special scenes of the paper, with harder ones; they judge too."""

StateKind = Literal["scaled", "printed", "gdae"]
"""Form of the state: ours, that of the improved TD3, or that of GDAE; see ``STATES``."""

STATES: Mapping[StateKind, Mapping[str, Any]] = {
    "scaled": {},
    "printed": {"window_unit": "ranges", "goal_encoding": "polar"},
    "gdae": {
        "lidar": PlanarLidarConfig(fov_deg=180, resolution_deg=1, max_range=10),
        "windows": 20,
        "window_fov_deg": 180.0,
        "window_unit": "ranges",
        "goal_encoding": "polar",
    },
}
"""Settings of each form of the state.

``scaled`` has the nearest of 40 windows as reciprocals and the goal as distance / 5, cosine and
sine (assumption). ``printed`` is the paper's 44 values: 40 nearest ranges all around, distance and
bearing of the goal, speed and yaw rate. ``gdae`` has 20 ranges of the front half instead.
"""

GDAE_RADIUS = 0.35
"""Distance from the laser at which GDAE counts a collision [m]: the radius of its robot here."""

JUDGED_CLEARANCE = 0.4
"""Smallest distance of starts and goals from obstacles in comparisons [m] (assumption): every robot
drives the same tasks, and GDAE's is the widest."""


class Td3TaskConfig(RoomConfig):
    """Settings of TD3's task: cluttered random rooms, 40 windows of a laser all around, 500 steps.

    Attributes:
        task: Name of the kind of task.
        random_rooms: Number of random rooms, one of which each episode draws (assumption; the paper
            trains in ENV1, which judges alone here).
        random_kind: Kind of the random rooms.
        min_distance: Smallest distance of a random goal from its start [m] (assumption).
        robot: Body (assumption: limits and period of GDAE).
        lidar: Laser (assumption but for the field of view; GDAE's range).
        points: Number of points of an observation: none, the networks read windows.
        windows: Number of windows of bearing (paper: 40).
        terminations: Rules that end an episode (assumption: those of GDAE).
    """

    task: Literal["td3"] = "td3"
    random_rooms: int = Field(default=256, ge=0, le=1000)
    random_kind: RandomKind = "clutter"
    min_distance: float = Field(default=2.0, ge=0)
    robot: DiscRobotConfig = Field(
        default_factory=lambda: DiscRobotConfig(max_speed=1.0, max_yaw_rate=1.0, period=0.1)
    )
    lidar: PlanarLidarConfig = PlanarLidarConfig(resolution_deg=1.0, max_range=10.0)
    points: int | None = Field(default=0, ge=0)
    windows: int = Field(default=40, ge=1, le=1000)
    terminations: TerminationConfig = Field(
        default_factory=lambda: TerminationConfig(goal_radius=0.3, time_limit=50.0, stuck_time=1e3)
    )


def td3_config(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    state: StateKind | None = None,
    config: Td3TaskConfig | None = None,
) -> Td3TaskConfig:
    """Return settings with rooms, a laser and a state by names; arguments as for ``make_td3``.

    Raises:
        ValueError: If there is no such state, or no such laser.
    """
    if state is not None and state not in STATES:
        raise ValueError(f"state: expected one of {', '.join(STATES)}, got {state!r}")
    update = {} if state is None else dict(STATES[state])
    if rooms is not None:
        update["random_rooms"] = 0
    return (config or Td3TaskConfig()).model_copy(update=update | named_parts(rooms, lidar))
