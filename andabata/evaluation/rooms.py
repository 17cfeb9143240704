"""Evaluation in rooms: policies, lasers and rooms side by side, each with and without a map.

Every policy and laser drives the same starts and goals of a room (Zhang et al., arXiv 2010.10209,
section IV-C), with the robot and the observation that it was trained with. Beside each count stands
the ratio of the steps to those of an oracle, which does not depend on the size of a room, but
leaves out what moves.
"""

import hashlib
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.engine import Engine, SerialEngine
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.comparison import Attempts, DrivenCell
from andabata.evaluation.judging import JUDGED_SENSES, checked_seed, judged_trials
from andabata.evaluation.room_drives import (
    RoomAttempt,
    RoomMeasures,
    drive_tasks,
    drives_to_bytes,
)
from andabata.evaluation.room_policies import TRAINED, fitted, trained_lidar
from andabata.evaluation.room_table import Cell, RoomTable, room_table
from andabata.machine.planar.lidar import PLANAR_LIDARS, PlanarLidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.runs.folder import commit
from andabata.runs.journal import Entry
from andabata.tasks.rooms.batch import DiscRobotConfig
from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK, ROOM_TASKS, RoomTaskConfig
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.lattice_oracle import geodesic_length, oracle_steps
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import JUDGED_CLEARANCE
from andabata.tasks.terminations import Outcome
from rl.policy import Policy, policy_from_bytes
from worlds.rooms.catalogue import make_room
from worlds.rooms.files import is_room_file, plan_digest
from worlds.rooms.room import Room, RoomTask, random_task

REACTIVE, WITH_MAP = "reactive", "map"
"""Names of what a policy heads for: the goal itself, or the sub-goal of a local map."""


class OracleQuery(NamedTuple):
    """Room and robot that an oracle is asked about.

    Attributes:
        room: Name of the room.
        robot: Body and its limits.
    """

    room: str
    robot: DiscRobotConfig


OracleTask = tuple[int, float] | None
"""Fewest steps of a task, and the length of its shortest way [m], whatever moves there; None where
no way is wide enough for the robot."""

DRIVES = "drives"
"""Folder of the paths of the cells."""


class RoomEvaluationConfig(BaseModel):
    """Settings of an evaluation in rooms.

    Attributes:
        task: Settings of the drives; rooms, laser, points and map are set for each cell, robot and
            other terms of the observation by each policy that says how it was trained.
        rooms: Names of the rooms, by default those that judge the task.
        lidars: Lasers, by names or labels; ``trained`` is that of each policy. By default SPN's
            seven, and for other tasks ``trained``.
        memories: Targets of policies: ``reactive`` the goal, ``map`` the sub-goal of a map.
        pairs: Number of random starts and goals in each room (paper: 100); 0 takes the room's fixed
            tasks.
        seed: Seed of starts and goals; of an evaluation that judges that of its release.
        release: Release that is judged, by ``andabata.evaluation.judging``; None to develop.
        map: Settings of the map.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: RoomTaskConfig = Field(default_factory=SpnConfig, discriminator="task")
    rooms: tuple[str, ...] = Field(default_factory=lambda data: _judges(data["task"]))
    lidars: tuple[str, ...] = Field(default_factory=lambda data: _lasers(data["task"]))
    memories: tuple[str, ...] = (REACTIVE, WITH_MAP)
    pairs: int = Field(default=100, ge=0)
    seed: int = Field(default=0, ge=0)
    release: str | None = None
    map: LidarMapConfig = Field(default_factory=LidarMapConfig)

    @model_validator(mode="after")
    def _check_split(self) -> Self:
        """Refuse judging seeds without their release, and a judging table of another form."""
        checked_seed(self.seed, self.release)
        if self.release is not None:
            judged_trials(self.release, self.pairs, "pairs")
            if self.rooms != _judges(self.task):
                raise ValueError(
                    f"rooms: expected those that judge {self.task.task}, "
                    f"{', '.join(_judges(self.task))}, got {', '.join(self.rooms)}; leave it out"
                )
            for name, least in JUDGED_SENSES.items():
                if (value := getattr(self.task, name)) < least:
                    raise ValueError(
                        f"task.{name}: expected {least} or more in a table that judges release "
                        f"{self.release}, got {value}; leave it out"
                    )
        return self


def judged_task(name: str, release: str | None = None) -> RoomTaskConfig:
    """Return the settings of a task's comparison.

    Starts and goals of ``td3`` leave room for GDAE's robot, the widest of its policies.

    Args:
        name: Name of the task.
        release: Release that is judged, with senses that drift and are noisy; None to develop.
    """
    wide = {"clearance": JUDGED_CLEARANCE} if name == "td3" else {}
    senses = {} if release is None else JUDGED_SENSES
    return ROOM_TASKS[name].model_validate({**wide, **senses})


def _judges(task: RoomTaskConfig) -> tuple[str, ...]:
    """Return the rooms of a task's comparison."""
    return JUDGES_BY_TASK[task.task]


def _lasers(task: RoomTaskConfig) -> tuple[str, ...]:
    """Return the lasers of a task's comparison."""
    return tuple(PLANAR_LIDARS) if isinstance(task, SpnConfig) else (TRAINED,)


def tasks_of(room: Room, config: RoomEvaluationConfig) -> list[RoomTask]:
    """Return a room's starts and goals: the same for every policy, laser and memory.

    Raises:
        ValueError: If fixed tasks are wanted of a room without such.
    """
    if config.pairs == 0:
        if not room.tasks:
            raise ValueError(
                f"pairs: expected 1 or more for room {room.name}, which has no fixed tasks, got 0"
            )
        return list(room.tasks)
    # The name, not the place in the list: adding a room changes no other's tasks.
    rng = np.random.default_rng([config.seed, zlib.crc32(room.name.encode())])
    task, radius = config.task, config.task.robot.radius
    # Policies of all robots drive the same tasks: the task's clearance makes room for the widest.
    clear = max(task.clearance, radius)
    return [random_task(room, rng, radius, clear, task.min_distance) for _ in range(config.pairs)]


def cell_task(cell: Cell, config: RoomEvaluationConfig, policy: Policy) -> RoomConfig:
    """Return the settings of a cell's drives: all beams of its laser become points.

    Raises:
        ValueError: If the policy cannot drive in rooms.
    """
    task: RoomConfig = config.task
    is_trained = cell.lidar == TRAINED
    lidar = trained_lidar(policy, task) if is_trained else PlanarLidarConfig.parse(cell.lidar)
    # Compared is the laser that is named: what training drew around it would blur it.
    update = {
        "rooms": (cell.room,),
        "random_rooms": 0,
        "lidar": lidar,
        "points": None,
        "randomization": None,
        "map": config.map if cell.memory == WITH_MAP else None,
    }
    return fitted(policy, task.model_copy(update=update))[1]


def alike(policies: Mapping[str, Policy]) -> list[tuple[str, ...]]:
    """Return the names of policies that differ in the seed alone, together, in their order."""
    groups: dict[str, list[str]] = {}
    for name, policy in policies.items():
        shapes = {key: tensor.shape for key, tensor in policy.tensors().items()}
        about = [policy.architecture, policy.terms, shapes, policy.info.get("config")]
        groups.setdefault(json.dumps(about, sort_keys=True), []).append(name)
    return [tuple(names) for names in groups.values()]


def cells_of(config: RoomEvaluationConfig, policies: Sequence[str]) -> list[Cell]:
    """Return the cells of an evaluation, each once, by room, laser, memory and policy."""
    return [
        Cell(name, lidar, room, memory)
        for room in dict.fromkeys(config.rooms)
        for lidar in dict.fromkeys(config.lidars)
        for memory in dict.fromkeys(config.memories)
        for name in policies
    ]


@dataclass(frozen=True)
class RoomComparison:
    """Policies in rooms; a cell is a policy with a laser and a memory in a room.

    Attributes:
        config: Settings.
        files: Bytes of the policies by name.
        robots: Robot of each policy.
        tasks: Starts and goals of each room.
    """

    unit: ClassVar[str] = "cells"
    journal: ClassVar[str] = "cells.jsonl"

    config: RoomEvaluationConfig
    files: Mapping[str, bytes]
    robots: Mapping[str, DiscRobotConfig]
    tasks: Mapping[str, Sequence[RoomTask]]

    @classmethod
    def of(cls, config: RoomEvaluationConfig, policies: Mapping[str, Policy]) -> Self:
        """Return the comparison of policies.

        Raises:
            ValueError: If a policy cannot drive in rooms, or a room has none of the tasks.
        """
        files = {name: policy.to_bytes() for name, policy in policies.items()}
        cells = {cell.policy: cell for cell in cells_of(config, tuple(policies))}
        robots = {name: cell_task(cells[name], config, policies[name]).robot for name in cells}
        tasks = {name: tasks_of(make_room(name), config) for name in dict.fromkeys(config.rooms)}
        return cls(config, files, robots, tasks)

    @property
    def about(self) -> Entry:
        """Heading of the journal; with rooms of files goes what was in them."""
        hashes = {name: hashlib.sha256(data).hexdigest() for name, data in self.files.items()}
        about: Entry = {"config": self.config.model_dump(mode="json"), "policies": hashes}
        about["commit"] = commit()
        own = {name: plan_digest(Path(name)) for name in self.config.rooms if is_room_file(name)}
        return about | ({"rooms": own} if own else {})

    def cells(self) -> Sequence[Cell]:
        """Return the cells by room, laser, memory and policy."""
        return cells_of(self.config, tuple(self.files))

    def label(self, cell: Cell) -> str:
        """Return room, laser and memory."""
        return f"{cell.room}, {cell.lidar}, {cell.memory}"

    def drive(self, cell: Cell) -> DrivenCell:
        """Drive the tasks of a cell, whose paths go to a file of its own."""
        # Noise that a policy keeps is the same for each cell: it is made anew.
        policy = policy_from_bytes(self.files[cell.policy], cell.policy)
        task = cell_task(cell, self.config, policy)
        drives = drive_tasks(policy, task, self.tasks[cell.room])
        number = self.cells().index(cell)
        attempts = tuple(_of_cell(cell, drive) for drive in drives)
        return DrivenCell(attempts, {f"{DRIVES}/{number}.npz": drives_to_bytes(drives)})

    def encode(self, cell: Cell, attempts: Attempts) -> Entry:
        """Return the entry of a cell: measures in the order of its tasks."""
        return {
            "cell": asdict(cell),
            "outcomes": [str(attempt.outcome) for attempt in attempts],
            "steps": [attempt.detail.steps for attempt in attempts],
            "lengths": [attempt.distance for attempt in attempts],
            "contacts": [int(attempt.contact) for attempt in attempts],
        }

    def decode(self, entry: Entry) -> tuple[Cell, Attempts]:
        """Return the cell of an entry and its attempts."""
        cell = Cell(**entry["cell"])
        period = self.robots[cell.policy].period
        columns = (entry[name] for name in ("steps", "outcomes", "contacts", "lengths"))
        measures = zip(*columns, strict=True)
        return cell, tuple(
            Attempt(
                contender=cell.policy,
                scenario=cell.room,
                repetition=number,
                outcome=Outcome(outcome),
                contact=Contact(contact),
                time=steps * period,
                distance=length,
                shortest=np.nan,
                detail=RoomMeasures(task, steps, cell.lidar, cell.memory),
            )
            for number, (task, (steps, outcome, contact, length)) in enumerate(
                zip(self.tasks[cell.room], measures, strict=True)
            )
        )


def _of_cell(cell: Cell, drive: RoomAttempt) -> RoomAttempt:
    """Return a drive with the cell that it belongs to."""
    detail = replace(drive.detail, lidar=cell.lidar, memory=cell.memory)
    return replace(drive, contender=cell.policy, detail=detail)


def oracle_of(config: RoomEvaluationConfig, query: OracleQuery) -> list[OracleTask]:
    """Return the fewest steps and the shortest way [m] of each task of a room for a robot."""
    room, radius = make_room(query.room), config.task.terminations.goal_radius
    return [_oracle_task(room, task, query.robot, radius) for task in tasks_of(room, config)]


def _oracle_task(
    room: Room, task: RoomTask, robot: DiscRobotConfig, goal_radius: float
) -> OracleTask:
    """Return the fewest steps and the shortest way [m]; None if the robot is too wide for any."""
    try:
        way = geodesic_length(room, task, robot.radius, goal_radius)
        return oracle_steps(room, task, robot, goal_radius), way
    except ValueError:
        return None


def tabulate(
    comparison: RoomComparison,
    policies: Mapping[str, Policy],
    attempts: Sequence[RoomAttempt],
    engine: Engine | None = None,
) -> RoomTable:
    """Return the table of attempts beside those of oracles.

    Args:
        comparison: Comparison that was driven.
        policies: Policies by name.
        attempts: Attempts of all cells.
        engine: Engine that asks the oracles; None for this process.
    """
    queries = [OracleQuery(each.scenario, comparison.robots[each.contender]) for each in attempts]
    asked, oracle = dict.fromkeys(queries), partial(oracle_of, comparison.config)
    oracles = {query: ways for _, query, ways in (engine or SerialEngine()).run(oracle, asked)}
    known = [
        _beside(attempt, oracles[query][attempt.repetition])
        for attempt, query in zip(attempts, queries, strict=True)
    ]
    return room_table(known, alike(policies))


def _beside(attempt: RoomAttempt, oracle: OracleTask) -> RoomAttempt:
    """Return an attempt with what the oracle of its robot drives."""
    if oracle is None:
        return attempt
    steps, way = oracle
    return replace(attempt, shortest=way, detail=replace(attempt.detail, oracle_steps=steps))
