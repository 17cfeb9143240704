"""Drives in rooms: a policy at its best from starts to goals, and the file that keeps them."""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.attempt import CONTACTS, Attempt
from andabata.evaluation.room_policies import fitted
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.env import RoomVectorEnv
from andabata.tasks.terminations import Outcome
from rl.driving import driven_many
from rl.policy import Policy
from worlds.rooms.room import RoomTask
from worlds.world import Start

_BATCH = 50
"""Number of robots that are driven side by side."""

OnStates = Callable[[NDArray[np.int64], NDArray[np.float32]], None]
"""Function that takes the numbers of the drives that go on, shape (k,), and what each observes
before its next step, shape (k, n_observations)."""


OnStep = Callable[[RoomVectorEnv, dict[str, Any]], None]
"""Function that takes the robots after they were put down, and after each step with its info."""


@dataclass(frozen=True)
class RoomMeasures:
    """Measures of a drive in a room.

    Attributes:
        task: Start and goal.
        steps: Number of control steps.
        lidar: Name or label of the laser, for comparisons.
        memory: Name of what the policy heads for; see ``RoomEvaluationConfig``.
        oracle_steps: Fewest control steps of an oracle, whatever moves; None where it has no way,
            or was not asked.
    """

    task: RoomTask
    steps: int
    lidar: str = ""
    memory: str = ""
    oracle_steps: int | None = None


RoomAttempt = Attempt[RoomMeasures]
"""Drive in a room, whose path has the poses x, y [m], yaw [rad], the start first."""


def room_attempt(
    task: RoomTask,
    outcome: Outcome,
    path: NDArray[np.float64],
    contact: Contact = Contact.NONE,
    *,
    room: str = "",
    number: int = 0,
    period: float = np.nan,
) -> RoomAttempt:
    """Return the attempt of a path.

    Args:
        task: Start and goal.
        outcome: How it ended.
        path: Poses after each control step, the start first: x, y [m], yaw [rad], shape (t, 3).
        contact: Contact at the end.
        room: Name of the room.
        number: Number of the task in its room.
        period: Time of a control step [s]; NaN where it is not known.
    """
    steps, driven = len(path) - 1, float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
    measures = RoomMeasures(task, steps)
    time = steps * period
    return Attempt("", room, number, outcome, contact, time, driven, np.nan, measures, path)


def drive_tasks(
    policy: Policy, config: RoomConfig, tasks: Sequence[RoomTask], on_states: OnStates | None = None
) -> list[RoomAttempt]:
    """Drive tasks of a room as a policy drives, and return the drives in their order.

    The robot and what it observes are those that the policy was trained with; see ``fitted``. Noise
    that the policy keeps is the same in each call.

    Args:
        policy: Policy, for any number of points.
        config: Settings with one room.
        tasks: Starts and goals.
        on_states: Function that sees what the robots observe, or None.

    Raises:
        ValueError: If the policy cannot read what the task observes.
    """
    actor, task = fitted(policy, config)
    attempts: list[RoomAttempt] = []
    # Robots do not see each other: a batch bounds the memory and changes no drive.
    for begin in range(0, len(tasks), _BATCH):
        part = tasks[begin : begin + _BATCH]
        robots = RoomVectorEnv(task, len(part), autoreset=False)
        attempts += _driven_together(actor, robots, part, begin, on_states)
    return attempts


def drive_task(
    policy: Policy,
    config: RoomConfig,
    task: RoomTask,
    number: int,
    on_states: OnStates | None = None,
    on_step: OnStep | None = None,
) -> RoomAttempt:
    """Drive one task alone as ``drive_tasks`` drives it among others, and return the drive.

    Movers and noise are the same. Other robots beside it may change the last digits of an action.

    Args:
        policy: Policy, for any number of points.
        config: Settings with one room.
        task: Start and goal.
        number: Number of the task among the others.
        on_states: Function that sees what the robot observes, or None.
        on_step: Function that sees the robot itself, or None.

    Raises:
        ValueError: If the policy cannot read what the task observes.
    """
    actor, fitting = fitted(policy, config)
    robots = RoomVectorEnv(fitting, 1, autoreset=False)
    (drive,) = _driven_together(actor, robots, [task], number, on_states, on_step)
    return drive


def drive_tour(
    policy: Policy, config: RoomConfig, start: Start, goals: Sequence[tuple[float, float]]
) -> list[RoomAttempt]:
    """Drive to goals in a row, each from where the robot stands, until one is not reached.

    With drift the robot knows where it is at the begin of each.

    Args:
        policy: Policy, for any number of points.
        config: Settings with one room.
        start: Pose at the start.
        goals: Goals in their order [m].

    Raises:
        ValueError: If the policy cannot read what the task observes.
    """
    attempts: list[RoomAttempt] = []
    for goal in goals:
        (drive,) = drive_tasks(policy, config, [RoomTask(start, goal)])
        attempts.append(drive)
        if drive.outcome is not Outcome.GOAL:
            break
        start = Start(*drive.path[-1].tolist())
    return attempts


def _driven_together(
    actor: Policy,
    robots: RoomVectorEnv,
    tasks: Sequence[RoomTask],
    begin: int,
    on_states: OnStates | None,
    on_step: OnStep | None = None,
) -> list[RoomAttempt]:
    """Drive tasks side by side; the number of the first is ``begin``."""
    count, (room, *_) = len(tasks), robots.config.all_rooms
    seeds: list[int | None] = [(begin + k) % _BATCH for k in range(count)]
    states, info = robots.reset(seed=seeds, options={"room": 0, "drive": list(tasks)})
    if on_step is not None:
        on_step(robots, info)
    # By the task's number, not its place beside others: a drive that is shown again alone draws the
    # same.
    rngs = [np.random.default_rng((0, begin + k)) for k in range(count)]
    paths = [[pose] for pose in robots.poses]
    attempts: dict[int, RoomAttempt] = {}
    while len(attempts) < count:
        going = np.array([k not in attempts for k in range(count)])
        left = np.flatnonzero(going)
        if on_states is not None:
            on_states(begin + left, states[left])
        actions = np.zeros((count, actor.actions.size), dtype=np.float32)
        actions[left] = driven_many(actor, states[left], [rngs[k] for k in left.tolist()])
        states, _, terminated, truncated, info = robots.step(actions)
        if on_step is not None:
            on_step(robots, info)
        poses = robots.poses
        for k in left.tolist():
            paths[k].append(poses[k])
        for k in np.flatnonzero(terminated | truncated).tolist():
            outcome, contact = Outcome(info["outcome"][k]), CONTACTS[info["contact"][k]]
            attempts[k] = room_attempt(
                tasks[k],
                outcome,
                np.array(paths[k]),
                contact if outcome is Outcome.COLLISION else Contact.NONE,
                room=room,
                number=begin + k,
                period=robots.config.robot.period,
            )
    return [attempts[k] for k in range(count)]


def drives_to_bytes(drives: Sequence[RoomAttempt]) -> bytes:
    """Return drives as a compressed npz file; paths are rounded to float32."""
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        starts=np.array(
            [
                (d.detail.task.start.x, d.detail.task.start.y, d.detail.task.start.yaw)
                for d in drives
            ]
        ),
        goals=np.array([drive.detail.task.goal for drive in drives]),
        outcomes=np.array([str(drive.outcome) for drive in drives]),
        steps=np.array([drive.detail.steps for drive in drives]),
        contacts=np.array([int(drive.contact) for drive in drives]),
        paths=np.concatenate([drive.path for drive in drives]).astype(np.float32),
    )
    return stream.getvalue()


def drives_from_bytes(data: bytes, name: str) -> list[RoomAttempt]:
    """Return the drives of a file's bytes.

    Args:
        data: Bytes of the file.
        name: Name of the file, for errors.

    Raises:
        ValueError: If it is no such file.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            parts = {key: file[key] for key in ("starts", "goals", "outcomes", "steps", "paths")}
            # Files from before there were movers say nothing about contacts.
            contacts = (
                file["contacts"] if "contacts" in file else np.zeros(len(parts["steps"]), int)
            )
        ends = np.cumsum(parts["steps"] + 1)
        paths = np.split(parts["paths"].astype(np.float64), ends[:-1])
        return [
            room_attempt(
                RoomTask(Start(*start), (goal[0], goal[1])),
                Outcome(outcome),
                path,
                Contact(contact),
            )
            for start, goal, outcome, path, contact in zip(
                parts["starts"].tolist(),
                parts["goals"].tolist(),
                parts["outcomes"].tolist(),
                paths,
                contacts.tolist(),
                strict=True,
            )
        ]
    except Exception as error:
        # A damaged zip raises errors of a dozen kinds.
        raise ValueError(f"{name}: expected drives of andabata, got {error}") from error
