"""Who says how a drive ended: physics and the true map, never the classifier."""

import math
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.sensor_readings import VehicleState
from worlds.world import World


class Outcome(StrEnum):
    """How a drive to one goal ended."""

    GOAL = "goal"
    COLLISION = "collision"
    TIPOVER = "tipover"
    STUCK = "stuck"
    TIMEOUT = "timeout"


class TerminationConfig(BaseModel):
    """Rules of a drive to one goal.

    Attributes:
        goal_radius: The goal is reached nearer than this [m] (paper: 1).
        time_limit: Longest drive [s] (paper: 180 in the maze, 300 in nature).
        stuck_time: A robot that stays within ``stuck_radius`` for this long is stuck [s]
            (assumption).
        stuck_radius: See ``stuck_time`` [m] (assumption).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    goal_radius: float = Field(default=1.0, gt=0)
    time_limit: float = Field(default=300.0, gt=0)
    stuck_time: float = Field(default=20.0, gt=0)
    stuck_radius: float = Field(default=0.3, gt=0)


class EpisodeMonitor:
    """Watches the true state of one drive and measures it.

    Attributes:
        distance: Metres driven.
        forbidden_distance: Metres driven where the true map forbids it.
        steering_variation: Integral of the squared yaw rate, a measure of restless steering [rad2/s].
        energy: What the motors gave [J]; None where the plant has none.
        min_clearance: Smallest distance from the body's centre to forbidden ground [m].
        path: Positions of the body, one a control step [m].
    """

    def __init__(self, world: World, config: TerminationConfig) -> None:
        """Judge drives in ``world``."""
        self._truth = world.truth
        self._config = config

    def begin(self, state: VehicleState, goal: NDArray[np.float64]) -> None:
        """Start measuring a drive to ``goal``, map coordinates [m], shape (2,)."""
        self._goal = goal
        self._began = state.stamp
        self._anchor = state.pose.position[:2]
        self._anchor_stamp = state.stamp
        self._work = state.work
        self.energy: float | None = None
        self.distance = 0.0
        self.forbidden_distance = 0.0
        self.steering_variation = 0.0
        self.min_clearance = np.inf
        self.path: list[NDArray[np.float64]] = [state.pose.position.copy()]
        self.time = 0.0

    def watch(self, state: VehicleState) -> Outcome | None:
        """Take in the true state after a control step; return the outcome, None before the end."""
        here = state.pose.position[:2]
        moved = math.hypot(*(here - self.path[-1][:2]).tolist())
        self.distance += moved
        self.steering_variation += float(state.angular[2] ** 2) * (
            state.stamp - self._began - self.time
        )
        self.time = state.stamp - self._began
        if state.work is not None and self._work is not None:
            self.energy = state.work - self._work
        forbidden, clearance = self._truth.at(float(here[0]), float(here[1]))
        if moved > 0 and forbidden:
            self.forbidden_distance += moved
        self.min_clearance = min(self.min_clearance, clearance)
        self.path.append(state.pose.position.copy())
        return self._verdict(state, here)

    def _verdict(self, state: VehicleState, here: NDArray[np.float64]) -> Outcome | None:
        """Return the outcome that the state means."""
        if state.tipped:
            return Outcome.TIPOVER
        if state.collided:
            return Outcome.COLLISION
        if self.goal_distance(state) < self._config.goal_radius:
            return Outcome.GOAL
        if math.hypot(*(here - self._anchor).tolist()) > self._config.stuck_radius:
            self._anchor, self._anchor_stamp = here, state.stamp
        if state.stamp - self._anchor_stamp > self._config.stuck_time:
            return Outcome.STUCK
        return Outcome.TIMEOUT if self.time >= self._config.time_limit else None

    def goal_distance(self, state: VehicleState) -> float:
        """Return the true horizontal distance to the goal [m]."""
        return math.hypot(*(self._goal - state.pose.position[:2]).tolist())
