"""Evaluation in rooms: policies, lasers and rooms side by side, each with and without a map.

Every policy and laser drives the same starts and goals of a room (Zhang et al., arXiv 2010.10209,
section IV-C). Beside each count stands the ratio of the steps to those of an oracle, which does not
depend on the size of a room.
"""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.engine import run_tasks
from andabata.evaluation.statistics import wilson_interval
from andabata.machine.planar_lidar import PLANAR_LIDARS, PlanarLidarConfig
from andabata.navigation.planning.lidar_map import LidarMapConfig
from andabata.tasks.lattice_oracle import geodesic_length, oracle_steps
from andabata.tasks.spn import SpnConfig, SpnVectorEnv
from andabata.tasks.terminations import Outcome
from rl.policy import Policy, policy_from_bytes, with_observations
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomTask, random_task

Row = dict[str, Any]

REACTIVE, WITH_MAP = "reactive", "map"
"""Names of what a policy heads for: the goal itself, or the sub-goal of a local map."""

JUDGES = ("spn-env4", "spn-env5", "spn-env6", "spn-env7")
"""Rooms of the paper's comparison; nothing is trained, chosen or tuned in them."""

_BATCH = 50
"""Number of robots that are driven side by side."""


class RoomEvaluationConfig(BaseModel):
    """Settings of an evaluation in rooms.

    Attributes:
        rooms: Names of the rooms.
        lidars: Lasers, by names or labels.
        memories: What policies head for: ``reactive`` the goal, ``map`` the sub-goal of a map.
        pairs: Number of random starts and goals in each room (paper: 100); 0 takes the room's fixed
            tasks.
        seed: Seed of starts and goals.
        task: Settings of the drives; rooms, laser, points and map are set for each cell.
        map: Settings of the map.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    rooms: tuple[str, ...] = JUDGES
    lidars: tuple[str, ...] = tuple(PLANAR_LIDARS)
    memories: tuple[str, ...] = (REACTIVE, WITH_MAP)
    pairs: int = Field(default=100, ge=0)
    seed: int = Field(default=0, ge=0)
    task: SpnConfig = Field(default_factory=SpnConfig)
    map: LidarMapConfig = Field(default_factory=LidarMapConfig)


@dataclass(frozen=True)
class Cell:
    """One cell of the comparison.

    Attributes:
        policy: Name of the policy.
        lidar: Name or label of the laser.
        room: Name of the room.
        memory: ``reactive`` or ``map``.
    """

    policy: str
    lidar: str
    room: str
    memory: str


@dataclass(frozen=True)
class RoomDrive:
    """One drive.

    Attributes:
        task: Start and goal.
        outcome: How it ended.
        steps: Number of control steps.
        path: Poses after each control step, the start first: x, y [m], yaw [rad], shape (t, 3).
    """

    task: RoomTask
    outcome: Outcome
    steps: int
    path: NDArray[np.float64]

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(np.hypot(*np.diff(self.path[:, :2], axis=0).T).sum())

    @property
    def score(self) -> float:
        """Score of a task as the paper has it (equation 5): 1 - 0.001 T, or -1."""
        return 1 - 0.001 * self.steps if self.outcome is Outcome.GOAL else -1.0


def tasks_of(room: Room, config: RoomEvaluationConfig) -> list[RoomTask]:
    """Return a room's starts and goals: the same for every policy, laser and memory."""
    if config.pairs == 0:
        return list(room.tasks)
    # The name, not the place in the list: adding a room changes no other's tasks.
    rng = np.random.default_rng([config.seed, zlib.crc32(room.name.encode())])
    task, radius = config.task, config.task.robot.radius
    clear = max(task.clearance, radius)
    return [random_task(room, rng, radius, clear, task.min_distance) for _ in range(config.pairs)]


def drive_tasks(policy: Policy, config: SpnConfig, tasks: Sequence[RoomTask]) -> list[RoomDrive]:
    """Drive tasks of a room with a policy at its best, and return the drives in their order.

    Args:
        policy: Policy, for any number of points.
        config: Settings with one room.
        tasks: Starts and goals.

    Raises:
        ValueError: If the policy cannot read what the task observes.
    """
    found: list[RoomDrive] = []
    for begin in range(0, len(tasks), _BATCH):
        found += _driven_together(policy, config, tasks[begin : begin + _BATCH])
    return found


def _driven_together(
    policy: Policy, config: SpnConfig, tasks: Sequence[RoomTask]
) -> list[RoomDrive]:
    """Drive tasks side by side."""
    count = len(tasks)
    robots = SpnVectorEnv(config, count, autoreset=False)
    actor = with_observations(policy, config.observations)
    states, _ = robots.reset(seed=0, options={"room": 0, "drive": list(tasks)})
    paths = [[pose] for pose in robots.poses]
    found: dict[int, RoomDrive] = {}
    while len(found) < count:
        going = np.array([k not in found for k in range(count)])
        actions = np.zeros((count, actor.actions.size), dtype=np.float32)
        actions[going] = actor.best_many(states[going])
        states, _, terminated, truncated, info = robots.step(actions)
        poses = robots.poses
        for k in np.flatnonzero(going).tolist():
            paths[k].append(poses[k])
        for k in np.flatnonzero(terminated | truncated).tolist():
            outcome = Outcome(info["outcome"][k])
            found[k] = RoomDrive(tasks[k], outcome, len(paths[k]) - 1, np.array(paths[k]))
    return [found[k] for k in range(count)]


def cell_task(cell: Cell, config: RoomEvaluationConfig) -> SpnConfig:
    """Return the settings of a cell's drives: all beams of its laser become points."""
    return config.task.model_copy(
        update={
            "rooms": (cell.room,),
            "lidar": PlanarLidarConfig.parse(cell.lidar),
            "points": None,
            "randomization": None,
            "map": config.map if cell.memory == WITH_MAP else None,
        }
    )


def drive_cell(
    config: RoomEvaluationConfig, policies: Mapping[str, bytes], cell: Cell
) -> list[RoomDrive]:
    """Drive the tasks of a cell."""
    policy = policy_from_bytes(policies[cell.policy], cell.policy)
    return drive_tasks(policy, cell_task(cell, config), tasks_of(make_room(cell.room), config))


def oracle_of(config: RoomEvaluationConfig, name: str) -> list[tuple[int, float]]:
    """Return the fewest steps and the shortest way [m] of each task of a room."""
    room, robot = make_room(name), config.task.robot
    radius = config.task.terminations.goal_radius
    return [
        (oracle_steps(room, task, robot, radius), geodesic_length(room, task, robot.radius, radius))
        for task in tasks_of(room, config)
    ]


def evaluate_rooms(
    config: RoomEvaluationConfig,
    policies: Mapping[str, Policy],
    workers: int = 1,
    on_cell: Callable[[Cell, list[RoomDrive]], None] | None = None,
) -> list[Row]:
    """Drive every cell and return the table, a row a cell.

    Args:
        config: Settings.
        policies: Policies by name.
        workers: Number of processes; the result does not depend on it.
        on_cell: Function that is called with each cell and its drives.
    """
    files = {name: policy.to_bytes() for name, policy in policies.items()}
    oracles = dict(run_tasks(partial(oracle_of, config), config.rooms, workers))
    cells = [
        Cell(name, lidar, room, memory)
        for room in config.rooms
        for lidar in config.lidars
        for memory in config.memories
        for name in policies
    ]
    table = []
    for cell, drives in run_tasks(partial(drive_cell, config, files), cells, workers):
        table.append(cell_row(cell, drives, oracles[cell.room]))
        if on_cell is not None:
            on_cell(cell, drives)
    return table


def cell_row(cell: Cell, drives: Sequence[RoomDrive], oracle: Sequence[tuple[int, float]]) -> Row:
    """Return the table's row of a cell.

    Args:
        cell: Policy, laser, room and memory.
        drives: Drives of its tasks.
        oracle: Fewest steps and shortest way [m] of each task.
    """
    ends = [drive.outcome for drive in drives]
    reached = ends.count(Outcome.GOAL)
    low, high = wilson_interval(reached, len(drives))
    ratios, spl = [], []
    for drive, (steps, way) in zip(drives, oracle, strict=True):
        arrived = drive.outcome is Outcome.GOAL
        spl.append(way / max(drive.length, way) if arrived and drive.length > 0 else float(arrived))
        if arrived:
            ratios.append(drive.steps / max(steps, 1))
    return {
        "policy": cell.policy,
        "lidar": cell.lidar,
        "room": cell.room,
        "memory": cell.memory,
        "trials": len(drives),
        "successes": reached,
        "collisions": ends.count(Outcome.COLLISION),
        "timeouts": ends.count(Outcome.TIMEOUT),
        "success_rate": reached / len(drives),
        "wilson_low": low,
        "wilson_high": high,
        "score": sum(drive.score for drive in drives),
        "steps_to_oracle": float(np.mean(ratios)) if ratios else None,
        "spl": float(np.mean(spl)),
        "mean_steps": float(np.mean([drive.steps for drive in drives])),
    }
