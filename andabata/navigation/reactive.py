"""Controllers without learning: straight to the goal, and a reactive law on the virtual scan."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from traversability.grid import PolarGrid


class StraightController:
    """Steers at the goal and ignores the scan: the lower bound.

    The law is the way-point law of the paper's authors, a yaw rate proportional to the yaw error.
    """

    def __init__(self, speed: float, gain: float = 5.5) -> None:
        """Take the law's numbers.

        Args:
            speed: Forward speed [m/s].
            gain: Gain from yaw error to yaw rate [1/s].
        """
        self._speed, self._gain = speed, gain

    def reset(self) -> None:
        """There is nothing to forget."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return a twist towards the goal."""
        return Twist(self._speed, self._gain * situation.heading_error)


class ReactiveConfig(BaseModel):
    """Numbers of the reactive law (assumption: the predecessor's is not published).

    Attributes:
        look_ahead: A sector is open when it is free this far, or as far as the goal [m].
        margin: Clearance kept on each side of the body [m].
        clearance_weight: Radians of detour accepted for a sector that is free to the last ring.
        commitment_weight: Share of the change of direction that is charged to a new one.
        gain: Factor from the chosen bearing to the yaw rate [1/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    look_ahead: float = Field(default=3.0, gt=0)
    margin: float = Field(default=0.25, ge=0)
    clearance_weight: float = Field(default=0.25, ge=0)
    commitment_weight: float = Field(default=0.35, ge=0)
    gain: float = Field(default=5.5, gt=0)


class ReactiveController:
    """Takes the open sector nearest the goal's bearing, weighing clearance and its own last choice.

    Source: assumption, since the predecessor's law is not published; obstacles are widened by the
    body as in vector field histograms (Borenstein and Koren 1991).
    """

    def __init__(
        self, robot: RobotModel, grid: PolarGrid, config: ReactiveConfig | None = None
    ) -> None:
        """Prepare the law for a body and a grid."""
        self._config = config or ReactiveConfig()
        self._speed = robot.speed
        self._bearings = grid.bearings
        difference = self._bearings[:, None] - self._bearings[None, :]
        self._apart = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
        self._half_width = robot.width / 2 + self._config.margin
        self._last: float | None = None

    def reset(self) -> None:
        """Forget the last choice."""
        self._last = None

    def act(self, situation: ControllerInput) -> Twist:
        """Return a twist towards the best open sector; hard over when none is open."""
        free = self._passable(situation.scan.finite())
        reach = min(self._config.look_ahead, max(situation.goal_distance, 1.0))
        open_sectors = free >= reach
        if not open_sectors.any():
            open_sectors = free >= free.max() - 1e-6
        cost = _between(self._bearings, situation.heading_error)
        cost = cost - self._config.clearance_weight * free / situation.scan.max_range
        if self._last is not None:
            last = self._last - situation.pose.yaw
            cost = cost + self._config.commitment_weight * _between(self._bearings, last)
        cost[~open_sectors] = np.inf
        best = int(np.argmin(cost))
        bearing = float(self._bearings[best])
        half_sector = np.pi / len(self._bearings) + 1e-6
        if _between(np.array([situation.heading_error]), bearing)[0] <= half_sector:
            bearing = situation.heading_error
        self._last = situation.pose.yaw + bearing
        return Twist(self._speed, self._config.gain * bearing)

    def _passable(self, ranges: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return how far the whole body can go in each sector [m], shape (n_sectors,)."""
        reach = np.arcsin(np.clip(self._half_width / np.maximum(ranges, 1e-3), 0.0, 1.0))
        in_the_way = self._apart <= reach[None, :] + 1e-9
        return np.where(in_the_way, ranges[None, :], np.inf).min(axis=1).clip(max=ranges.max())


def _between(bearings: NDArray[np.float64], bearing: float) -> NDArray[np.float64]:
    """Return the unsigned angles between bearings and one bearing [rad]."""
    return np.abs((bearings - bearing + np.pi) % (2 * np.pi) - np.pi)
