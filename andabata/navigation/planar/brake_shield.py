"""Brake shield: lets a command pass only if the robot could still stop behind it.

Each command is rolled out as the robot follows it: what was commanded before and has no effect yet,
one period of the command itself, and then braking to rest. If the footprint meets a hit on the way,
the next slower command is tried, and braking in the end. A robot that is held up backs out for a
while, or turns on the spot, wherever that is free, so that it does not stand there for ever.
"""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import outline_distance, reach_of
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.dynamics import (
    MotionState,
    PlanarDynamics,
    advance_axis,
    axis_step,
    delayed,
)
from terrain.kernel import kernel


class BrakeShieldConfig(BaseModel):
    """Settings of ``BrakeShield``.

    Attributes:
        margin: Distance to a hit that counts as contact [m].
        shares: Shares of a command that are tried, the largest first.
        standing_speed: Speed below which a robot stands [m/s].
        standing_time: Time that it stands before it backs out or turns on the spot [s].
        recovery_time: Time for which it does so [s].
        turn_rate: Yaw rate of turns on the spot [rad/s].
        reverse_speed: Speed of driving backwards [m/s].
        rest_speed: Speed and yaw rate, as a speed of the footprint's corners, that count as rest
            [m/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    margin: float = Field(default=0.02, ge=0)
    shares: tuple[float, ...] = (1.0, 0.75, 0.5, 0.25)
    standing_speed: float = Field(default=0.05, ge=0)
    standing_time: float = Field(default=0.5, ge=0)
    recovery_time: float = Field(default=0.6, ge=0)
    turn_rate: float = Field(default=1.0, gt=0)
    reverse_speed: float = Field(default=0.3, gt=0)
    rest_speed: float = Field(default=0.02, gt=0)


class BrakeShield:
    """Checks commands against the hits around a robot.

    Attributes:
        config: Settings.
    """

    def __init__(
        self, vehicle: PlanarVehicleConfig, config: BrakeShieldConfig | None = None
    ) -> None:
        """Prepare for a robot.

        Args:
            vehicle: Outline and period of the robot.
            config: Settings.
        """
        self.config = config or BrakeShieldConfig()
        self._corners = np.array(vehicle.footprint, dtype=np.float64)
        self._reach, self._period = reach_of(vehicle.footprint), vehicle.period
        self.reset()

    def reset(self) -> None:
        """Forget how long the robot stands."""
        self._stood, self._recovery_left = 0.0, 0.0

    def safe(
        self,
        command: Twist,
        hits: NDArray[np.float64],
        state: MotionState,
        past: NDArray[np.float64],
        dynamics: PlanarDynamics,
    ) -> Twist:
        """Return the command, or the first of the slower ones behind which the robot can stop.

        Args:
            command: Wanted command.
            hits: Places of hits in the robot's frame [m], shape (k, 2).
            state: Motion now, at the origin of the robot's frame.
            past: Commands given before, the oldest first, at least as many as the delay holds,
                shape (p, 2).
            dynamics: Delay, lag and accelerations.
        """
        config = self.config
        is_still = max(abs(state.v), self._reach * abs(state.w)) < config.standing_speed
        self._stood = self._stood + self._period if is_still else 0.0
        self._recovery_left = max(self._recovery_left - self._period, 0.0)
        if self._stood > config.standing_time:
            self._stood, self._recovery_left = 0.0, config.recovery_time
        fastest = max(
            abs(command.linear), abs(state.v), abs(state.controller_v), config.reverse_speed
        )
        fastest = max(fastest, float(np.abs(past[:, 0]).max(initial=0.0)))
        reach = self._reach + config.margin + _way(fastest, dynamics)
        near = hits[np.hypot(*hits.T) < reach]
        near, margin = self._apart(near)
        if not len(near):
            return command
        for tried in self._candidates(command, near):
            if self._can_stop(tried, near, margin, state, past, dynamics):
                return tried
        return Twist(0.0, 0.0)

    def _apart(self, near: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Return the hits outside of the footprint, and the margin that the robot has now.

        A robot that stands nearer to something than the margin may move if it comes no nearer. A
        hit inside of the footprint is noise: a contact would have ended the drive.
        """
        distances = _distances(near, self._corners)
        is_outside = distances > 0.0
        least = float(distances[is_outside].min(initial=np.inf))
        return near[is_outside], min(self.config.margin, _HELD * least)

    def _candidates(self, command: Twist, near: NDArray[np.float64]) -> list[Twist]:
        """Return commands to try, the wanted one first."""
        config = self.config
        candidates = [
            Twist(share * command.linear, share * command.angular) for share in config.shares
        ]
        candidates.append(Twist(0.0, command.angular))
        if self._recovery_left > 0.0:
            # Back, away from the nearest hit, and to it.
            side = -math.copysign(config.turn_rate, near[np.hypot(*near.T).argmin(), 1])
            candidates[:0] = [
                Twist(-config.reverse_speed, 0.0),
                Twist(0.0, side),
                Twist(0.0, -side),
            ]
        return candidates

    def _can_stop(
        self,
        command: Twist,
        near: NDArray[np.float64],
        margin: float,
        state: MotionState,
        past: NDArray[np.float64],
        dynamics: PlanarDynamics,
    ) -> bool:
        """Return True if the robot comes to rest behind a command without a contact."""
        commands = np.vstack([past, [(command.linear, command.angular)]])
        return bool(
            _stops(
                commands,
                state,
                dynamics,
                self._period,
                near,
                self._corners,
                margin,
                self.config.rest_speed,
            )
        )


def _way(fastest: float, dynamics: PlanarDynamics) -> float:
    """Return a bound of the way to rest from a speed [m]: delay, lag, braking, two periods more."""
    late = dynamics.delay + 2.0 * dynamics.lag + 0.1
    return fastest * late + fastest**2 / (2.0 * dynamics.acceleration)


@kernel
def _distances(hits: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of each hit from the footprint [m], shape (k,)."""
    distances = np.empty(len(hits))
    for k in range(len(hits)):
        distances[k] = outline_distance(hits[k, 0], hits[k, 1], corners)
    return distances


@kernel
def _stops(
    commands: NDArray[np.float64],
    state: MotionState,
    dynamics: PlanarDynamics,
    period: float,
    hits: NDArray[np.float64],
    corners: NDArray[np.float64],
    margin: float,
    rest: float,
) -> bool:
    """Return True if a robot comes to rest without a contact.

    Args:
        commands: Commands, the oldest first, the last one of this period, shape (p, 2); then the
            robot is commanded to stand.
        state: Motion at the begin of this period.
        dynamics: Delay, lag and accelerations.
        period: Control period [s].
        hits: Places of hits in the frame of the state [m], shape (k, 2).
        corners: Corners of the footprint [m], shape (c, 2).
        margin: Distance to a hit that counts as contact [m].
        rest: Speed of the corners that counts as rest [m/s].
    """
    delay = dynamics.delay / period
    step_v = axis_step(dynamics.acceleration, dynamics.lag, period)
    step_w = axis_step(dynamics.yaw_acceleration, dynamics.lag, period)
    reach = 0.0
    for k in range(len(corners)):
        reach = max(reach, np.sqrt(corners[k, 0] ** 2 + corners[k, 1] ** 2))
    first = len(commands) - 1
    # Long enough for any braking: what never comes to rest is refused.
    steps = int(_LONGEST / period)
    driven = np.zeros((first + 1 + steps, 2))
    driven[: first + 1] = commands
    x, y, yaw, v, w = state.x, state.y, state.yaw, state.v, state.w
    set_v, set_w = state.controller_v, state.controller_w
    for k in range(first, first + steps):
        before_v, before_w = v, w
        set_v, v = advance_axis(set_v, v, delayed(driven, k, 0, delay), step_v)
        set_w, w = advance_axis(set_w, w, delayed(driven, k, 1, delay), step_w)
        # The middle of the period is looked at, too: at 2 m/s it is 0.1 m long.
        for _ in range(2):
            way, turn = 0.25 * (before_v + v) * period, 0.25 * (before_w + w) * period
            x += way * np.cos(yaw + 0.5 * turn)
            y += way * np.sin(yaw + 0.5 * turn)
            yaw += turn
            if _meets(x, y, yaw, hits, corners, reach, margin):
                return False
        if k > first + delay and abs(v) + reach * abs(w) < rest:
            return True
    return False


@kernel
def _meets(
    x: float,
    y: float,
    yaw: float,
    hits: NDArray[np.float64],
    corners: NDArray[np.float64],
    reach: float,
    margin: float,
) -> bool:
    """Return True if a hit is nearer to a footprint than the margin."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        if dx * dx + dy * dy < (reach + margin) ** 2:
            ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
            if outline_distance(ahead, left, corners) < margin:
                return True
    return False


_LONGEST = 4.0
"""Longest braking [s]."""

_HELD = 1 - 1e-6
"""Share of its distance that a robot within the margin keeps: all of it, but for rounding. Less,
taken again in each period, would let it creep into contact."""
