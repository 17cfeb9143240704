"""Moments of a drive in a room: robot, beams, movers, support points and reward at every step.

Evaluations keep paths alone. The rest is the same whenever the drive is driven again, so it is
driven again when somebody wants to see it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.barn import BarnEvaluationConfig, drive_barn_run, load_world
from andabata.evaluation.room_drives import drive_task
from andabata.evaluation.room_policies import fitted
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig, cell_task, tasks_of
from andabata.evaluation.support_points import SupportPoints, support_points_of
from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.tasks.rooms.env import RoomVectorEnv
from rl.policies.point_set import PointSetPolicy
from rl.policy import Policy
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room, RoomTask

_NEARLY = 1 - 1e-4
"""Share of the largest range from which on a beam has met nothing, in single precision."""


@dataclass(frozen=True)
class RoomMoment:
    """A moment of a drive in a room.

    Attributes:
        pose: x, y [m] and yaw [rad] of the robot, shape (3,).
        velocity: Speed [m/s] and yaw rate [rad/s].
        origin: Place of the laser [m], shape (2,).
        ends: Ends of the beams [m], shape (b, 2).
        hits: True for beams that met something, shape (b,).
        movers: x, y and radius of each mover [m], 0 for one that is not there, shape (m, 3).
        support: Support points of the policy; None of one that has none.
        rewards: Terms of the reward of the step that led here, by name.
    """

    pose: NDArray[np.float64]
    velocity: tuple[float, float]
    origin: NDArray[np.float64]
    ends: NDArray[np.float64]
    hits: NDArray[np.bool_]
    movers: NDArray[np.float64]
    support: SupportPoints | None
    rewards: Mapping[str, float]


class WatchedDrive(NamedTuple):
    """A drive in a room with all its moments.

    Attributes:
        room: Room.
        task: Start and goal.
        outline: Corners of the robot from its middle, counter-clockwise [m], shape (k, 2).
        period: Time from moment to moment [s].
        outcome: How it ended, in a word.
        moments: Moments, the start first.
    """

    room: Room
    task: RoomTask
    outline: NDArray[np.float64]
    period: float
    outcome: str
    moments: list[RoomMoment]


def watch_cell(
    config: RoomEvaluationConfig, policy: Policy, cell: Cell, number: int
) -> WatchedDrive:
    """Drive one task of a cell again, and return all its moments.

    Args:
        config: Settings of the evaluation.
        policy: Policy of the cell.
        cell: Policy, laser, room and memory.
        number: Number of the task, from 0.

    Raises:
        ValueError: If there is no such task, or the policy cannot drive in rooms.
    """
    room = make_room(cell.room)
    tasks = tasks_of(room, config)
    if not 0 <= number < len(tasks):
        raise ValueError(f"drive: expected 0 to {len(tasks) - 1}, got {number}")
    task_config = cell_task(cell, config, policy)
    actor, fitting = fitted(policy, task_config)
    points = fitting.observations.slice_of("points") if _has_points(actor) else slice(0, 0)
    supports: list[tuple[NDArray[np.float32], NDArray[np.int32]]] = []
    moments: list[RoomMoment] = []

    def on_states(numbers: NDArray[np.int64], observed: NDArray[np.float32]) -> None:
        if isinstance(actor, PointSetPolicy):
            supports.append((observed[0][points].copy(), actor.support_points(observed[0])))

    def on_step(robots: RoomVectorEnv, info: dict[str, Any]) -> None:
        moments.append(_moment(robots, fitting.lidar, info))

    drive = drive_task(policy, task_config, tasks[number], number, on_states, on_step)
    for k, (state, chosen) in enumerate(supports):
        support = support_points_of(k, moments[k].pose, state, chosen, fitting.lidar)
        moments[k] = RoomMoment(**{**vars(moments[k]), "support": support})
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    outline = fitting.robot.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outcome = str(drive.outcome)
    return WatchedDrive(room, tasks[number], outline, fitting.robot.period, outcome, moments)


def _has_points(actor: Policy) -> bool:
    """Return True for a policy on points."""
    return isinstance(actor, PointSetPolicy)


def _moment(robots: RoomVectorEnv, lidar: PlanarLidarConfig, info: dict[str, Any]) -> RoomMoment:
    """Return the moment of the only robot."""
    batch, terms = robots.batch, info.get("reward_terms", {})
    pose, (speed, yaw_rate) = batch.poses[0].copy(), batch.motions[0, 3:].tolist()
    origin, ends, hits = beam_ends(pose, lidar, 1.0 / batch.reciprocals[0].astype(np.float64))
    movers = np.column_stack([batch.movers.places[0], batch.movers.radii[0]])
    rewards = {name: float(values[0]) for name, values in terms.items()}
    return RoomMoment(pose, (speed, yaw_rate), origin, ends, hits, movers, None, rewards)


def beam_ends(
    pose: NDArray[np.float64], lidar: PlanarLidarConfig, ranges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the place of a laser, the ends of its beams, and which met something.

    Args:
        pose: x, y [m] and yaw [rad] of the robot, shape (3,).
        lidar: Laser.
        ranges: Range of each beam [m], the largest or infinite where it met nothing, shape (b,).

    Returns:
        Places [m], shapes (2,) and (b, 2), and bool, shape (b,).
    """
    c, s = np.cos(pose[2]), np.sin(pose[2])
    shift = np.array([c * lidar.x - s * lidar.y, s * lidar.x + c * lidar.y])
    origin = pose[:2] + shift
    angles = pose[2] + np.radians(lidar.yaw_deg) + lidar.bearings
    reach = np.minimum(ranges, lidar.max_range)
    ends = origin + reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return origin, ends, ranges < _NEARLY * lidar.max_range


def watch_barn(
    config: BarnEvaluationConfig, name: str, controller: str, trial: int
) -> WatchedDrive:
    """Drive one run of a BARN evaluation again, and return all its moments.

    Args:
        config: Settings of the evaluation.
        name: Name of the world.
        controller: Name of the navigator.
        trial: Number of the run in its world.

    Raises:
        ValueError: If a world is none, or a policy cannot drive here.
    """
    world = load_world(config, name)
    seen: list[tuple[NDArray[np.float64], Twist]] = []

    def on_readings(readings: PlanarReadings, command: Twist) -> None:
        seen.append((readings.ranges.astype(np.float64), command))

    result = drive_barn_run(config, world, name, controller, trial, on_readings)
    moments = []
    for pose, (ranges, command) in zip(result.path, seen, strict=False):
        origin, ends, hits = beam_ends(pose, config.lidar, ranges)
        twist, none = (command.linear, command.angular), np.zeros((0, 3))
        moments.append(RoomMoment(pose, twist, origin, ends, hits, none, None, {}))
    (task,) = world.room.tasks
    outline = np.array(config.vehicle.footprint, dtype=np.float64).reshape(-1, 2)
    period, outcome = config.vehicle.period, str(result.outcome)
    return WatchedDrive(world.room, task, outline, period, outcome, moments)
