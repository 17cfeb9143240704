"""Settings of navigation in rooms by a planar laser: SPN's task (arXiv 2010.10209)."""

from collections.abc import Sequence
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar_lidar import TRAINING_LIDAR, PlanarLidarConfig
from andabata.navigation.planning.lidar_map import LidarMapConfig
from andabata.tasks.rewards import RoomRewardConfig
from andabata.tasks.room_batch import DiscRobotConfig
from andabata.tasks.room_observations import GoalEncoding, LidarRandomization, room_observations
from andabata.tasks.terminations import TerminationConfig
from rl.spaces import ActionSpec, ObservationSpec
from worlds.room_catalogue import make_room
from worlds.rooms import RoomTask

TRAINING_ROOMS = ("spn-env0", "spn-env1", "spn-env2", "spn-env3")
"""Rooms of the curriculum, the easiest first."""


class SpnConfig(BaseModel):
    """Settings of a drive in rooms.

    Attributes:
        task: Name of the kind of task.
        rooms: Names of the rooms.
        favourite: Share of the episodes in the room that the difficulty names; the others have the
            rest in equal parts (paper: 0.7 and 0.1 each).
        random_rooms: Number of random rooms beside the named ones, ``random-0`` and so on
            (assumption; the paper has four rooms in all).
        random_share: Share of the episodes in them.
        tasks: ``random`` starts and goals, or one of the rooms' ``fixed`` ones.
        clearance: Smallest distance of random starts and goals from obstacles [m] (assumption).
        min_distance: Smallest distance of a random goal from its start [m] (assumption).
        robot: Body.
        lidar: Laser.
        points: Number of points of an observation. A laser with more beams gives the nearest of as
            many neighbours as it takes; the paper takes all 1080 (assumption: the nearest of nine
            changes no outcome). None takes all beams.
        goal_encoding: ``cosine`` gives the goal as distance / 5, cosine and sine of its bearing
            (assumption), ``polar`` as distance and bearing (paper).
        noise: Standard deviation of a beam's range [m].
        randomization: Lasers of the observations that are learnt from; None keeps the task's own.
        map: Settings of a local map whose sub-goal takes the goal's place; None without a memory,
            as in the paper.
        terminations: Rules that end an episode.
        reward: Constants of the reward.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: Literal["spn"] = "spn"
    rooms: tuple[str, ...] = Field(default=TRAINING_ROOMS, min_length=1)
    favourite: float = Field(default=0.7, gt=0, le=1)
    random_rooms: int = Field(default=0, ge=0, le=1000)
    random_share: float = Field(default=0.5, ge=0, le=1)
    tasks: Literal["random", "fixed"] = "random"
    clearance: float = Field(default=0.3, ge=0)
    min_distance: float = Field(default=1.0, ge=0)
    robot: DiscRobotConfig = Field(default_factory=DiscRobotConfig)
    lidar: PlanarLidarConfig = TRAINING_LIDAR
    points: int | None = Field(default=120, ge=1)
    goal_encoding: GoalEncoding = "cosine"
    noise: float = Field(default=0.0, ge=0)
    randomization: LidarRandomization | None = None
    map: LidarMapConfig | None = None
    terminations: TerminationConfig = Field(
        default_factory=lambda: TerminationConfig(goal_radius=0.3, time_limit=80.0, stuck_time=1e3)
    )
    reward: RoomRewardConfig = Field(default_factory=RoomRewardConfig)

    @property
    def capacity(self) -> int:
        """Number of points of an observation."""
        return self.lidar.count if self.points is None else self.points

    @property
    def unseen(self) -> Self:
        """The same with every room as often as others: random tasks that snapshots compare on."""
        shares = {"favourite": 1 / len(self.rooms), "random_rooms": 0}
        return self.model_copy(update=shares | {"randomization": None})

    @property
    def fixed(self) -> Self:
        """The same on the rooms' fixed tasks, the paper's test."""
        shares = {"tasks": "fixed", "random_rooms": 0}
        return self.model_copy(update=shares | {"randomization": None})

    @property
    def fixed_tasks(self) -> list[tuple[int, RoomTask]]:
        """Fixed tasks of the rooms, each with its room's index."""
        rooms = enumerate(make_room(name) for name in self.rooms)
        return [(index, task) for index, room in rooms for task in room.tasks]

    @property
    def all_rooms(self) -> tuple[str, ...]:
        """Names of all rooms, the curriculum's own first."""
        return self.rooms + tuple(f"random-{k}" for k in range(self.random_rooms))

    @property
    def observations(self) -> ObservationSpec:
        """Space of the observations."""
        fastest = max(self.robot.max_speed, self.robot.max_yaw_rate)
        return room_observations(self.capacity, self.goal_encoding, fastest)

    @property
    def actions(self) -> ActionSpec:
        """Space of the actions: speed and yaw rate."""
        return room_actions(self.robot)


def room_actions(robot: DiscRobotConfig) -> ActionSpec:
    """Return the space of the actions: speed and yaw rate."""
    return ActionSpec(
        names=("linear", "angular"),
        low=(0.0, -robot.max_yaw_rate),
        high=(robot.max_speed, robot.max_yaw_rate),
        units=("m/s", "rad/s"),
    )


def spn_config(
    rooms: str | Sequence[str] | None = None,
    lidar: str | None = None,
    config: SpnConfig | None = None,
) -> SpnConfig:
    """Return settings with rooms and a laser by their names; arguments as for ``make_spn``."""
    update: dict[str, Any] = {}
    if rooms is not None:
        update["rooms"] = (rooms,) if isinstance(rooms, str) else tuple(rooms)
    if lidar is not None:
        update["lidar"] = PlanarLidarConfig.parse(lidar)
    return (config or SpnConfig()).model_copy(update=update)
