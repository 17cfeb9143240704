"""Support points: the points of a scan that a policy on points decides by.

Of all points of a scan at most K give the K global features (Zhang et al., arXiv 2010.10209,
section IV-B): no other point has an effect on the action.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.room_drives import RoomAttempt, drive_tasks
from andabata.evaluation.room_policies import fitted
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.config import RoomConfig
from rl.policies.point_set import PointSetPolicy
from rl.policy import Policy
from worlds.rooms.room import RoomTask

_NEARLY = 1 - 1e-4
"""Share of the largest range from which on a beam has met nothing, in single precision."""


@dataclass(frozen=True)
class SupportPoints:
    """Support points at one moment of a drive.

    Attributes:
        step: Number of control steps before.
        pose: x, y [m] and yaw [rad] of the robot, shape (3,).
        places: Place of each support point in the room [m], shape (k, 2).
        counts: Number of features that each gives, shape (k,).
        is_return: True where the beam met something, False where it ends in the open, shape (k,).
    """

    step: int
    pose: NDArray[np.float64]
    places: NDArray[np.float64]
    counts: NDArray[np.int64]
    is_return: NDArray[np.bool_]


def drive_with_support_points(
    policy: Policy, config: RoomConfig, tasks: Sequence[RoomTask], every: int = 20
) -> list[tuple[RoomAttempt, list[SupportPoints]]]:
    """Drive tasks of a room and return each drive with its support points.

    Args:
        policy: Policy on points.
        config: Settings with one room.
        tasks: Starts and goals.
        every: Number of control steps between two moments (paper: 20).

    Raises:
        ValueError: If the policy is not one on points.
    """
    actor, task = fitted(policy, config)
    if not isinstance(actor, PointSetPolicy):
        raise ValueError(
            f"policy: expected one on points, got {policy.architecture}; only these have some"
        )
    seen: list[list[NDArray[np.int32]]] = [[] for _ in tasks]
    states: list[list[NDArray[np.float32]]] = [[] for _ in tasks]
    steps = np.zeros(len(tasks), dtype=np.int64)

    def on_states(numbers: NDArray[np.int64], observed: NDArray[np.float32]) -> None:
        for k, state in zip(numbers.tolist(), observed, strict=True):
            if steps[k] % every == 0:
                seen[k].append(actor.support_points(state))
                states[k].append(state.copy())
            steps[k] += 1

    drives = drive_tasks(policy, config, tasks, on_states)
    points = task.observations.slice_of("points")
    return [
        (
            drive,
            [
                support_points_of(
                    n * every, drive.path[n * every], state[points], chosen, task.lidar
                )
                for n, (state, chosen) in enumerate(zip(states[k], seen[k], strict=True))
            ],
        )
        for k, drive in enumerate(drives)
    ]


def support_points_of(
    step: int,
    pose: NDArray[np.float64],
    points: NDArray[np.float32],
    chosen: NDArray[np.int32],
    lidar: PlanarLidarConfig,
) -> SupportPoints:
    """Return the support points of a moment in the room.

    Args:
        step: Number of control steps before.
        pose: x, y [m] and yaw [rad] of the robot, shape (3,).
        points: sin and cos of each point's bearing over its distance [1/m], shape (2 n,).
        chosen: Index of the point that gives each feature, -1 for none, shape (K,).
        lidar: Laser that saw them.
    """
    numbers, counts = np.unique(chosen[chosen >= 0], return_counts=True)
    rows = points.reshape(-1, 2)[numbers].astype(np.float64)
    ahead, left = (rows[:, ::-1] / (rows**2).sum(axis=1, keepdims=True)).T
    # From the laser, not the robot's middle: a beam that met nothing ends at its own largest range.
    reached = np.hypot(ahead - lidar.x, left - lidar.y)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    places = pose[:2] + np.stack([c * ahead - s * left, s * ahead + c * left], axis=1)
    return SupportPoints(step, pose, places, counts, reached < _NEARLY * lidar.max_range)
