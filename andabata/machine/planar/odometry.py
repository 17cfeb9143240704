"""Dead reckoning on flat ground and its errors: scale, heading and slip.

The pose by odometry moves by what the wheels measure. Its distances are off by a ratio that a drive
keeps, its heading is off by a random walk along the way, and slip is motion that the wheels do not
see.
"""

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_TURN = 2 * np.pi


class OdometryErrors(NamedTuple):
    """Standard deviations of the errors of dead reckoning.

    Attributes:
        scale: That of the ratio of distances by odometry to those of the wheels, drawn for each
            drive.
        turn: That of the heading after a metre [rad]; it grows with the root of the way.
        slip: That of the ratio of motion to the wheels' motion, drawn for each control period.
    """

    scale: float = 0.0
    turn: float = 0.0
    slip: float = 0.0

    def times(self, factor: float) -> Self:
        """Return errors that are larger by a factor."""
        return self._replace(
            scale=factor * self.scale, turn=factor * self.turn, slip=factor * self.slip
        )

    def over(self, periods: float) -> Self:
        """Return the errors for a control period as long as several of these.

        The slip of a longer period is the mean of what its parts would have had.
        """
        return self._replace(slip=self.slip / math.sqrt(periods))

    def drawn_scale(self, rng: np.random.Generator) -> float:
        """Return the ratio of distances by odometry to those of the wheels of a drive."""
        return 1.0 + self.scale * float(rng.standard_normal())

    def drawn_period(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return the draws of a control period, shape (3,).

        They are the ratios of speed and of yaw rate to those of the wheels, and the draw of the
        heading, of standard deviation 1.
        """
        draws = rng.standard_normal(3)
        draws[:2] = 1.0 + self.slip * draws[:2]
        return draws


class DeadReckoning:
    """Poses of many robots by odometry, in the frame in which they were put down.

    The robots follow each command exactly, so that the wheels are what slips.

    Attributes:
        poses: x, y [m] and yaw [rad] of each robot by odometry, float64, shape (n, 3).
    """

    def __init__(self, count: int, errors: OdometryErrors, period: float) -> None:
        """Prepare for a number of robots.

        Args:
            count: Number n of robots.
            errors: Errors of the odometry, for this control period.
            period: Control period [s].
        """
        self.poses = np.zeros((count, 3))
        self._errors, self._period = errors, period
        self._scales = np.ones(count)
        self._rngs = [np.random.default_rng(0) for _ in range(count)]

    def restart(self, k: int, pose: NDArray[np.float64], rng: np.random.Generator) -> None:
        """Put a robot down where it knows that it is.

        Args:
            k: Index of the robot.
            pose: True pose, shape (3,).
            rng: Source of the errors of the drive, which no other draws from.
        """
        self.poses[k], self._rngs[k] = pose, rng
        self._scales[k] = self._errors.drawn_scale(rng)

    def step(self, twists: NDArray[np.float64], chosen: NDArray[np.bool_]) -> None:
        """Move the poses of some robots by one control period.

        Args:
            twists: True speed [m/s] and yaw rate [rad/s] of each, shape (n, 2).
            chosen: True for robots that moved, shape (n,).
        """
        draws = np.ones((len(chosen), 3))
        for k in np.flatnonzero(chosen).tolist():
            draws[k] = self._errors.drawn_period(self._rngs[k])
        ways = twists * self._period * draws[:, :2]
        reckon(self.poses, ways, chosen, self._scales, self._errors.turn, draws[:, 2].copy())


def as_believed(
    places: NDArray[np.float64], poses: NDArray[np.float64], believed: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the places that robots head for when they head for places by poses that drift.

    Distance and bearing of what is returned from a true pose are those of a place from the believed
    pose. So a situation, which has the true pose, gives the same observation again.

    Args:
        places: Place that each robot heads for [m], shape (n, 2).
        poses: True x, y [m] and yaw [rad], shape (n, 3).
        believed: x, y [m] and yaw [rad] that the robots believe in, shape (n, 3).

    Returns:
        Places in the room [m], shape (n, 2).
    """
    turn, offsets = poses[:, 2] - believed[:, 2], places - believed[:, :2]
    c, s = np.cos(turn), np.sin(turn)
    x, y = c * offsets[:, 0] - s * offsets[:, 1], s * offsets[:, 0] + c * offsets[:, 1]
    return np.asarray(poses[:, :2] + np.stack([x, y], axis=1))


@kernel
def reckon(
    poses: NDArray[np.float64],
    ways: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    scales: NDArray[np.float64],
    turn: float,
    draws: NDArray[np.float64],
) -> None:
    """Move poses by what their wheels measured in a control period.

    Args:
        poses: x, y [m] and yaw [rad] of each robot, changed in place, shape (n, 3).
        ways: Way [m] and turn [rad] of the wheels of each, shape (n, 2).
        chosen: True for robots that moved, shape (n,).
        scales: Ratio of distances by odometry to those of the wheels of each, shape (n,).
        turn: Standard deviation of the heading after a metre [rad].
        draws: Draw of the heading of each, shape (n,).
    """
    for k in range(len(chosen)):
        if chosen[k]:
            seen = ways[k, 0] * scales[k]
            move_along_arc(poses[k], 0, seen, ways[k, 1])
            turn_off(poses[k], 0, turn, abs(seen), draws[k])


@kernel
def move_along_arc(state: NDArray[np.float64], first: int, way: float, turn: float) -> None:
    """Move the pose that begins at a part of a state along an exact arc, in place."""
    half = 0.5 * turn
    # An arc's chord leaves at half the turn; its length is the arc's times sinc.
    chord = way * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    state[first] += chord * np.cos(state[first + 2] + half)
    state[first + 1] += chord * np.sin(state[first + 2] + half)
    state[first + 2] = np.pi - (np.pi - state[first + 2] - turn) % _TURN


@kernel
def turn_off(state: NDArray[np.float64], first: int, turn: float, way: float, draw: float) -> None:
    """Turn the heading by odometry by its error over a way [m], in place.

    Variances add along the way: one draw for a period is as good as one a step.
    """
    move_along_arc(state, first, 0.0, turn * np.sqrt(way) * draw)
