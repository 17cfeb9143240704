"""Terminations of a drive to one goal, over many robots: physics and the true map decide."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field


class Outcome(StrEnum):
    """How a drive to one goal ended.

    The last two are those of drives that end with the robot's own word: it declared a goal reached
    that was too far away, or left the world.
    """

    GOAL = "goal"
    COLLISION = "collision"
    TIPOVER = "tipover"
    STUCK = "stuck"
    TIMEOUT = "timeout"
    FALSE_ARRIVAL = "false arrival"
    LEFT_WORLD = "left world"


class Ending(IntEnum):
    """An outcome as a number, for arrays; ``NONE`` while the drive goes on."""

    NONE = 0
    GOAL = 1
    COLLISION = 2
    TIPOVER = 3
    STUCK = 4
    TIMEOUT = 5
    FALSE_ARRIVAL = 6
    LEFT_WORLD = 7

    @property
    def outcome(self) -> Outcome | None:
        """The outcome, None while the drive goes on."""
        return None if self is Ending.NONE else Outcome[self.name]


class TerminationConfig(BaseModel):
    """Rules of a drive to one goal.

    Attributes:
        goal_radius: Distance below which the goal is reached [m] (paper: 1).
        time_limit: Longest drive [s] (paper: 180 in the maze, 300 in nature).
        stuck_time: Time after which a robot that stays within ``stuck_radius`` is stuck [s]
            (assumption).
        stuck_radius: Radius of staying [m] (assumption).
        timeout_terminates: True if a time-out is an end like a collision (Guo et al., Eq. 5), False
            if it cuts a drive short, whose last state a learner bootstraps from.
        collision_range: Range of the virtual scan below which a drive ends as a collision, touched
            or not [m] (paper: 0.72); None for contact alone. The scan is the latest that a
            controller was given, before a planner ends its ranges; unknown sectors count as free.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    goal_radius: float = Field(default=1.0, gt=0)
    time_limit: float = Field(default=300.0, gt=0)
    stuck_time: float = Field(default=20.0, gt=0)
    stuck_radius: float = Field(default=0.3, gt=0)
    timeout_terminates: bool = False
    collision_range: float | None = Field(default=None, gt=0)

    def truncated(self, endings: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return True where an ending cuts a drive short instead of terminating it, shape (n,).

        Args:
            endings: ``Ending`` of each drive, shape (n,).
        """
        return (endings == Ending.TIMEOUT) & (not self.timeout_terminates)


@dataclass(frozen=True)
class Drives:
    """State of n drives after a control step.

    Attributes:
        positions: True positions in the map [m], shape (n, 2).
        goal_distances: Distances to the goals [m], shape (n,).
        collided: True where the body touches something, shape (n,).
        tipped: True where the body has rolled over, shape (n,).
        stamps: Time of each robot's clock [s], shape (n,).
        times: Time since the begin of each drive [s], shape (n,).
        nearest: Smallest range of each robot's virtual scan [m], shape (n,), infinite before the
            first; None where no scan is seen.
    """

    positions: NDArray[np.float64]
    goal_distances: NDArray[np.float64]
    collided: NDArray[np.bool_]
    tipped: NDArray[np.bool_]
    stamps: NDArray[np.float64]
    times: NDArray[np.float64]
    nearest: NDArray[np.float64] | None = None


class Terminations:
    """Ends drives, and remembers where each robot was last seen to move.

    Attributes:
        anchors: Place that each robot has to leave [m], shape (n, 2).
        anchor_stamps: Stamp at which it was there [s], shape (n,).
    """

    def __init__(self, config: TerminationConfig, count: int = 1, sees_scan: bool = False) -> None:
        """Prepare for a number of robots.

        Args:
            config: Rules.
            count: Number of robots.
            sees_scan: True if each step comes with ``Drives.nearest``.

        Raises:
            ValueError: If the rules need a scan and none is seen.
        """
        if config.collision_range is not None and not sees_scan:
            raise ValueError(
                "terminations.collision_range: expected None where drives end without a virtual "
                f"scan, got {config.collision_range}; leave it out: it is a rule of off-road "
                "training and evaluation"
            )
        self._config = config
        self.anchors = np.zeros((count, 2))
        self.anchor_stamps = np.zeros(count)

    def begin(self, k: int, position: NDArray[np.float64], stamp: float = 0.0) -> None:
        """Begin the drive of robot ``k`` at a position [m], shape (2,), and a stamp [s]."""
        self.anchors[k] = position
        self.anchor_stamps[k] = stamp

    def endings(self, drives: Drives) -> NDArray[np.int64]:
        """Return the ``Ending`` of each drive, int64, shape (n,).

        The first that holds counts: rolled over, collision, goal, stuck, time-out.
        """
        config = self._config
        at_goal = drives.goal_distances < config.goal_radius
        collided = drives.collided | self.too_near(drives)
        going = ~(drives.tipped | collided | at_goal)
        far = np.hypot(*(drives.positions - self.anchors).T) > config.stuck_radius
        moved = going & far
        self.anchors[moved] = drives.positions[moved]
        self.anchor_stamps[moved] = drives.stamps[moved]
        stuck = drives.stamps - self.anchor_stamps > config.stuck_time
        late = drives.times >= config.time_limit
        outcomes = np.zeros(len(late), dtype=np.int64)
        # From the last to the first, which overwrites the others.
        outcomes[late] = Ending.TIMEOUT
        outcomes[stuck] = Ending.STUCK
        outcomes[at_goal] = Ending.GOAL
        outcomes[collided] = Ending.COLLISION
        outcomes[drives.tipped] = Ending.TIPOVER
        return outcomes

    def too_near(self, drives: Drives) -> NDArray[np.bool_]:
        """Return True where the virtual scan alone makes a collision, shape (n,)."""
        limit = self._config.collision_range
        if limit is None or drives.nearest is None:
            return np.zeros(len(drives.stamps), dtype=np.bool_)
        return drives.nearest < limit
