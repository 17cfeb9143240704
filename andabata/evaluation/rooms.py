"""Evaluation in rooms: policies, lasers and rooms side by side, each with and without a map.

Every policy and laser drives the same starts and goals of a room (Zhang et al., arXiv 2010.10209,
section IV-C), with the robot and the observation that it was trained with. Beside each count stands
the ratio of the steps to those of an oracle, which does not depend on the size of a room, but
leaves out what moves.
"""

import hashlib
import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.engine import Engine, SerialEngine
from andabata.evaluation.room_drives import RoomDrive, drive_tasks
from andabata.evaluation.room_policies import TRAINED, fitted, trained_lidar
from andabata.evaluation.room_table import (
    Cell,
    CellResult,
    OracleTask,
    RoomTable,
    Row,
    cell_row,
    difference_row,
    pooled_row,
)
from andabata.machine.planar.lidar import PLANAR_LIDARS, PlanarLidarConfig
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.runs.folder import commit
from andabata.runs.journal import Journal
from andabata.tasks.rooms.batch import DiscRobotConfig
from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK, ROOM_TASKS, RoomTaskConfig
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.lattice_oracle import geodesic_length, oracle_steps
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import JUDGED_CLEARANCE
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


OnCell = Callable[[Cell, list[RoomDrive] | None], None]
"""Function that takes a cell and its drives, None for a cell that stood in the journal."""


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
        seed: Seed of starts and goals.
        map: Settings of the map.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    task: RoomTaskConfig = Field(default_factory=SpnConfig, discriminator="task")
    rooms: tuple[str, ...] = Field(default_factory=lambda data: _judges(data["task"]))
    lidars: tuple[str, ...] = Field(default_factory=lambda data: _lasers(data["task"]))
    memories: tuple[str, ...] = (REACTIVE, WITH_MAP)
    pairs: int = Field(default=100, ge=0)
    seed: int = Field(default=0, ge=0)
    map: LidarMapConfig = Field(default_factory=LidarMapConfig)


def judged_task(name: str) -> RoomTaskConfig:
    """Return the settings of a task's comparison.

    Starts and goals of ``td3`` leave room for GDAE's robot, the widest of its policies.
    """
    wide = {"clearance": JUDGED_CLEARANCE} if name == "td3" else {}
    return ROOM_TASKS[name](**wide)


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


def drive_cell(
    config: RoomEvaluationConfig, policies: Mapping[str, bytes], cell: Cell
) -> list[RoomDrive]:
    """Drive the tasks of a cell."""
    policy = policy_from_bytes(policies[cell.policy], cell.policy)
    task = cell_task(cell, config, policy)
    return drive_tasks(policy, task, tasks_of(make_room(cell.room), config))


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


def drive_cells(
    config: RoomEvaluationConfig,
    policies: Mapping[str, Policy],
    engine: Engine | None = None,
    journal: Path | None = None,
    on_cell: OnCell | None = None,
) -> list[CellResult]:
    """Drive every cell and return the measures of each.

    Args:
        config: Settings.
        policies: Policies by name.
        engine: Engine that runs the cells, on which the result does not depend; None for this
            process.
        journal: JSON-lines file to which finished cells are appended; cells that stand in it are
            not driven again, so that a killed evaluation goes on where it was, by the same code.
        on_cell: Function that is called with each cell and its drives, before the cell counts as
            finished; at once for each cell of the journal.

    Raises:
        ValueError: If the journal belongs to another evaluation, a policy cannot drive in rooms,
            or a room has none of the tasks.
    """
    files = {name: policy.to_bytes() for name, policy in policies.items()}
    hashes = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    about = {"config": config.model_dump(mode="json"), "policies": hashes, "commit": commit()}
    if own := {name: plan_digest(Path(name)) for name in config.rooms if is_room_file(name)}:
        about["rooms"] = own  # A file may have changed since.
    kept = Journal(journal, about)
    done = {result.cell: result for result in map(CellResult.from_json, kept.entries)}
    cells = cells_of(config, tuple(policies))
    missing = [cell for cell in cells if cell not in done]
    if on_cell is not None:
        for cell in done:
            on_cell(cell, None)
    work = partial(drive_cell, config, files)
    for _, cell, drives in (engine or SerialEngine()).run(work, missing):
        done[cell] = CellResult.of(cell, drives)
        if on_cell is not None:
            on_cell(cell, drives)
        kept.append(done[cell].to_json())
    return [done[cell] for cell in cells]


def evaluate_rooms(
    config: RoomEvaluationConfig,
    policies: Mapping[str, Policy],
    engine: Engine | None = None,
    journal: Path | None = None,
    on_cell: OnCell | None = None,
) -> RoomTable:
    """Drive every cell and return the table.

    Args:
        config: Settings.
        policies: Policies by name.
        engine: Engine that runs the cells, on which the result does not depend; None for this
            process.
        journal: Journal of the drives; see ``drive_cells``.
        on_cell: Function that is called with each cell and its drives.

    Raises:
        ValueError: As ``drive_cells``.
    """
    results = drive_cells(config, policies, engine, journal, on_cell)
    queries = {cell: _query(cell, config, policies) for cell in (each.cell for each in results)}
    asked = dict.fromkeys(queries.values())
    oracle = partial(oracle_of, config)
    oracles = {query: ways for _, query, ways in (engine or SerialEngine()).run(oracle, asked)}
    rows = [
        cell_row(result, oracles[queries[result.cell]]) | _movers(result.cell) for result in results
    ]
    found = {result.cell: result for result in results}
    pooled = [
        pooled_row([found[replace(cell, policy=name)] for name in names], oracles[queries[cell]])
        | _movers(cell)
        for names in alike(policies)
        for cell in cells_of(config, names[:1])
        if len(names) > 1
    ]
    return RoomTable(rows, pooled, _differences(config, alike(policies), found))


def _query(cell: Cell, config: RoomEvaluationConfig, policies: Mapping[str, Policy]) -> OracleQuery:
    """Return what the oracle of a cell is asked: policies of one task have robots of their own."""
    return OracleQuery(cell.room, cell_task(cell, config, policies[cell.policy]).robot)


def _movers(cell: Cell) -> Row:
    """Return the number of a room's movers, which the oracle leaves out."""
    return {"movers": len(make_room(cell.room).movers)}


def _differences(
    config: RoomEvaluationConfig,
    groups: Sequence[tuple[str, ...]],
    found: Mapping[Cell, CellResult],
) -> list[Row]:
    """Return how groups of policies differ from the first one, by laser and memory."""
    rooms = tuple(dict.fromkeys(config.rooms))

    def results(names: tuple[str, ...], cell: Cell) -> list[list[CellResult]]:
        cells = [[replace(cell, policy=name, room=room) for room in rooms] for name in names]
        return [[found[one] for one in mine] for mine in cells]

    return [
        difference_row(results(groups[0], cell), results(names, cell))
        for cell in cells_of(config.model_copy(update={"rooms": rooms[:1]}), [""])
        for names in groups[1:]
    ]
