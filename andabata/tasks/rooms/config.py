"""Settings of drives to a goal in rooms by a planar laser, which tasks give values of their own."""

import math
from collections.abc import Sequence
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.odometry import OdometryErrors
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.navigation.planar.mover_shield import MoverShieldConfig
from andabata.tasks.rewards import GdaeRewardConfig, ImprovedRewardConfig, RoomRewardConfig
from andabata.tasks.rooms.batch import DiscRobotConfig
from andabata.tasks.rooms.observations import LidarRandomization
from andabata.tasks.rooms.points import SECTORS
from andabata.tasks.rooms.terms import GoalEncoding, RoomTerms, room_observations
from andabata.tasks.terminations import TerminationConfig
from rl.spaces import ActionSpec, ObservationSpec
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import RoomTask

RandomKind = Literal["random", "clutter", "clutter-movers", "crowd-5", "crowd-10", "crowd-20"]
"""Kinds of random rooms: thin walls, clutter, clutter with movers, people; see the catalogue."""

RoomReward = RoomRewardConfig | GdaeRewardConfig | ImprovedRewardConfig
"""Constants of a reward in rooms; their kind says which."""

_UNSEEN = range(5000, 5032)
"""Seeds of the random rooms that a task without named rooms is compared on."""


class RoomConfig(BaseModel):
    """Settings of a drive in rooms; what differs between tasks is here, as data.

    Attributes:
        task: Name of the kind of task.
        rooms: Names of the rooms; none where there are random ones.
        main_room_share: Share of the episodes in the room that the difficulty names; the others
            have the rest in equal parts (SPN: 0.7 and 0.1 each).
        random_rooms: Number of random rooms beside the named ones, ``random-0`` and so on. Each
            episode draws one of them; a replay names rooms by their index, so they stay the same.
        random_kind: Kind of the random rooms.
        random_share: Share of the episodes in them, where there are named rooms too.
        tasks: ``random`` starts and goals, or one of the rooms' ``fixed`` ones.
        clearance: Smallest distance of random starts and goals from obstacles [m] (assumption).
        min_distance: Smallest distance of a random goal from its start [m] (assumption).
        robot: Body.
        lidar: Laser.
        points: Number of points of an observation. A laser with more beams gives the nearest of as
            many neighbours as it takes; SPN's paper takes all 1080 (assumption: the nearest of nine
            changes no outcome). None takes all beams, 0 gives no points.
        windows: Number of windows of bearing (SPN: 36 for its critics; TD3: 40; GDAE: 20).
        window_fov_deg: Angle around straight ahead that the windows cover together [deg].
        window_unit: ``reciprocals`` gives the nearest of each window as 1 / d, ``ranges`` as d.
        earlier_scan: Number of control steps since the scan whose windows are given, too, as if it
            were seen from the present pose: what moves differs. 0 gives none, as in the papers.
        goal_encoding: ``cosine`` gives the goal as distance / 5, cosine and sine of its bearing
            (assumption), ``polar`` as distance and bearing (both papers).
        tracked_movers: Number of the nearest movers that are given with place, velocity and radius,
            as the shield's tracker finds them in the scans; 0 gives none, as in the papers.
        noise: Standard deviation of a beam's range [m] (BARN's robot: 0.01).
        drift: Factor of the drift of the pose that map, shield and the goal's bearing go by, times
            that of BARN's robot: scale, heading and slip of its odometry. 0 believes the truth, as
            in training. Contacts and goals are judged by the truth.
        randomization: Lasers of the observations that are learnt from; None keeps the task's own.
        map: Settings of a local map whose sub-goal takes the goal's place; None without a memory,
            as in the papers.
        shield: Settings of a shield that keeps robots out of the way of movers, which it tracks in
            their scans; None without one, as in the papers.
        terminations: Rules that end an episode.
        reward: Constants of the reward, ``RoomRewardConfig`` without a ``kind``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: str
    rooms: tuple[str, ...] = ()
    main_room_share: float = Field(default=0.7, gt=0, le=1)
    random_rooms: int = Field(default=0, ge=0, le=1000)
    random_kind: RandomKind = "random"
    random_share: float = Field(default=0.5, ge=0, le=1)
    tasks: Literal["random", "fixed"] = "random"
    clearance: float = Field(default=0.3, ge=0)
    min_distance: float = Field(default=1.0, ge=0)
    robot: DiscRobotConfig = Field(default_factory=DiscRobotConfig)
    lidar: PlanarLidarConfig = Field(default_factory=PlanarLidarConfig)
    points: int | None = Field(default=120, ge=0)
    windows: int = Field(default=SECTORS, ge=1, le=1000)
    window_fov_deg: float = Field(default=360.0, gt=0, le=360)
    window_unit: Literal["reciprocals", "ranges"] = "reciprocals"
    earlier_scan: int = Field(default=0, ge=0, le=100)
    goal_encoding: GoalEncoding = "cosine"
    tracked_movers: int = Field(default=0, ge=0, le=20)
    noise: float = Field(default=0.0, ge=0)
    drift: float = Field(default=0.0, ge=0, le=10)
    randomization: LidarRandomization | None = None
    map: LidarMapConfig | None = None
    shield: MoverShieldConfig | None = None
    terminations: TerminationConfig
    reward: RoomReward = Field(default_factory=RoomRewardConfig)

    @model_validator(mode="after")
    def _check_rooms(self) -> Self:
        """Refuse tasks that are nowhere."""
        if not self.all_rooms:
            raise ValueError("rooms: expected a name or random_rooms, got none of either")
        return self

    @property
    def capacity(self) -> int:
        """Number of points of an observation."""
        return self.lidar.count if self.points is None else self.points

    @property
    def keeps_situations(self) -> bool:
        """True if a replay buffer keeps situations, and renders observations from them.

        That takes longer than to keep the observations. It pays where points make these large, and
        where other lasers are drawn for each sample.
        """
        return self.capacity > 0 or self.randomization is not None

    @property
    def unseen(self) -> Self:
        """The same with every room as often as others: random tasks that snapshots compare on.

        Without named rooms they are random ones of the same kind, which no pool holds.
        """
        rooms = self.rooms or tuple(f"{self.random_kind}-{seed}" for seed in _UNSEEN)
        shares = {"rooms": rooms, "main_room_share": 1 / len(rooms), "random_rooms": 0}
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
        pool = tuple(f"{self.random_kind}-{k}" for k in range(self.random_rooms))
        return self.rooms + pool

    @property
    def terms(self) -> RoomTerms:
        """What an observation is made of."""
        return RoomTerms(
            points=self.capacity,
            windows=self.windows,
            window_fov=math.radians(self.window_fov_deg),
            as_ranges=self.window_unit == "ranges",
            earlier_scan=self.earlier_scan,
            goal_encoding=self.goal_encoding,
            tracked_movers=self.tracked_movers,
        )

    @property
    def odometry_errors(self) -> OdometryErrors | None:
        """Errors of the robot's odometry for its control period; None where it knows the truth."""
        if self.drift == 0:
            return None
        barn = PLANAR_VEHICLES["barn"]
        return barn.odometry_errors.times(self.drift).over(self.robot.period / barn.period)

    @property
    def observations(self) -> ObservationSpec:
        """Space of the observations."""
        fastest = max(self.robot.max_speed, self.robot.max_yaw_rate)
        return room_observations(self.terms, self.lidar.max_range, fastest)

    @property
    def actions(self) -> ActionSpec:
        """Space of the actions: speed and yaw rate."""
        return room_actions(self.robot)


class JudgingRoomError(ValueError):
    """Room for judging alone that something would learn in."""


def refuse_judging_rooms(config: RoomConfig) -> None:
    """Refuse to train, to validate or to test a training in rooms that judge.

    Args:
        config: Settings of the episodes.

    Raises:
        JudgingRoomError: If one of the named rooms is for judging alone.
        UnknownRoomError: If there is no room of a name.
    """
    judges = [name for name in config.rooms if make_room(name).judges]
    if judges:
        raise JudgingRoomError(
            f"rooms: expected rooms to train and to validate in, got {', '.join(judges)}, for "
            "judging alone; name others, such as random-0, or leave them out, and drive these with "
            "andabata evaluate"
        )


def room_actions(robot: DiscRobotConfig) -> ActionSpec:
    """Return the space of the actions: speed and yaw rate."""
    return ActionSpec(
        names=("linear", "angular"),
        low=(0.0, -robot.max_yaw_rate),
        high=(robot.max_speed, robot.max_yaw_rate),
        units=("m/s", "rad/s"),
    )


def named_parts(rooms: str | Sequence[str] | None, lidar: str | None) -> dict[str, Any]:
    """Return rooms and a laser as the fields of settings, for those that are named.

    Args:
        rooms: Name of a room, or several; None leaves them.
        lidar: Name or label of a laser; None leaves it.

    Raises:
        ValueError: If the label is no laser's.
    """
    parts: dict[str, Any] = {}
    if rooms is not None:
        parts["rooms"] = (rooms,) if isinstance(rooms, str) else tuple(rooms)
    if lidar is not None:
        parts["lidar"] = PlanarLidarConfig.parse(lidar)
    return parts
