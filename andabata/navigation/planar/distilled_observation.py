"""Observation and actions of policies that are distilled from a navigator on flat ground.

A policy sees the nearest hit of each window around the robot, the direction of its goal, its
measured speeds, its last commands, and how the robot follows them as far as that is identified.
"""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.planar.readings import PlanarReadings
from andabata.navigation.planar.dynamics import PlanarDynamics
from andabata.navigation.planar.scan_points import in_robot_frame
from rl.policy import Policy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm, Scaling
from terrain.kernel import kernel

WINDOWS = 96
"""Number of windows around the robot: 72 of them are within 270 degrees."""

FAR = 10.0
"""Distance that stands for a window without a hit, and for any goal beyond [m]."""

COMMANDS = 3
"""Number of last commands that are seen."""

ACTIONS = ActionSpec(
    names=("linear", "angular"), low=(-0.5, -4.0), high=(2.0, 4.0), units=("m/s", "rad/s")
)
"""Speed and yaw rate within the limits of the sampling MPC."""


def _term(
    name: str, count: int, low: float, high: float, unit: str, scaling: Scaling = "linear"
) -> ObservationTerm:
    """Return a term of several numbers."""
    return ObservationTerm(
        name=name, shape=(count,), low=low, high=high, unit=unit, scaling=scaling
    )


OBSERVATIONS = ObservationSpec(
    terms=(
        _term("nearest", WINDOWS, 0.0, FAR, "m", scaling="proximity"),
        _term("goal_direction", 2, -1.0, 1.0, "1"),
        _term("goal_distance", 1, 0.0, FAR, "m"),
        _term("speed", 1, -2.0, 2.0, "m/s"),
        _term("yaw_rate", 1, -4.0, 4.0, "rad/s"),
        _term("previous_speeds", COMMANDS, -2.0, 2.0, "m/s"),
        _term("previous_yaw_rates", COMMANDS, -4.0, 4.0, "rad/s"),
        _term("delay", 1, 0.0, 0.25, "s"),
        _term("lag", 1, 0.0, 0.35, "s"),
        _term("acceleration", 1, 0.0, 5.0, "m/s2"),
        _term("yaw_acceleration", 1, 0.0, 12.0, "rad/s2"),
    )
)
"""Distances from the robot's centre by windows from straight behind on, counter-clockwise; the
commands from the newest to the oldest."""


def observe(
    hits: NDArray[np.float64],
    readings: PlanarReadings,
    goal: tuple[float, float],
    commands: NDArray[np.float64],
    dynamics: PlanarDynamics,
) -> NDArray[np.float32]:
    """Return the observation of a period, float32, shape (``OBSERVATIONS.size``,).

    Args:
        hits: Places of hits in the robot's frame [m], shape (k, 2).
        readings: Measurements at its begin.
        goal: Goal in the frame of the odometry [m].
        commands: Last speeds [m/s] and yaw rates [rad/s], the oldest first, shape (3, 2).
        dynamics: Dynamics as far as they are identified.
    """
    x, y = in_robot_frame(goal, readings.odometry)
    away = max(math.hypot(x, y), 1e-6)
    velocity, newest = readings.velocity, commands[::-1]
    return OBSERVATIONS.vector(
        {
            "nearest": nearest_by_window(hits, WINDOWS, FAR),
            "goal_direction": (x / away, y / away),
            "goal_distance": (min(away, FAR),),
            "speed": (velocity.linear,),
            "yaw_rate": (velocity.angular,),
            "previous_speeds": newest[:, 0],
            "previous_yaw_rates": newest[:, 1],
            **{name: (value,) for name, value in dynamics._asdict().items()},
        }
    )


def mirrored(
    observations: NDArray[np.float32], shares: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return observations and actions with left and right exchanged.

    Args:
        observations: Observations, shape (n, ``OBSERVATIONS.size``).
        shares: Actions as shares of their bounds, shape (n, 2).
    """
    seen, taken = observations.copy(), shares.copy()
    nearest = OBSERVATIONS.slice_of("nearest")
    seen[:, nearest] = observations[:, nearest][:, ::-1]
    for name in ("yaw_rate", "previous_yaw_rates"):
        seen[:, OBSERVATIONS.slice_of(name)] *= -1.0
    seen[:, OBSERVATIONS.slice_of("goal_direction").stop - 1] *= -1.0
    taken[:, 1] *= -1.0
    return seen, taken


def check_distilled(policy: Policy, name: str) -> Policy:
    """Return a policy after a check that it reads and gives what a distilled one does.

    Args:
        policy: Policy.
        name: Name of its file, for the error.

    Raises:
        ValueError: If its spaces are others.
    """
    if policy.observations != OBSERVATIONS or policy.actions != ACTIONS:
        terms = [term.name for term in policy.observations.terms]
        raise ValueError(
            f"{name}: expected a policy distilled from the sampling MPC, which reads "
            f"{[term.name for term in OBSERVATIONS.terms]} and gives {list(ACTIONS.names)}, got "
            f"one that reads {terms} and gives {list(policy.actions.names)}; make one with "
            "`andabata policy distill`"
        )
    return policy


def command_of(actions: NDArray[np.float64]) -> Twist:
    """Return a policy's actions as a command."""
    return Twist(float(actions[0]), float(actions[1]))


@kernel
def nearest_by_window(hits: NDArray[np.float64], windows: int, far: float) -> NDArray[np.float32]:
    """Return the distance of the nearest hit of each window around the origin [m], shape (w,).

    Args:
        hits: Places of hits [m], shape (k, 2).
        windows: Number of windows, from straight behind on, counter-clockwise.
        far: Distance of a window without a hit, and the largest [m].
    """
    nearest = np.full(windows, np.float32(far))
    for k in range(len(hits)):
        x, y = hits[k]
        window = int((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * windows) % windows
        nearest[window] = min(nearest[window], np.float32(np.sqrt(x * x + y * y)))
    return nearest
