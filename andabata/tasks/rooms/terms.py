"""Terms of observations in rooms: what there is, in which order and form; the goal's two forms."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.rooms.kernel import MIN_RANGE
from andabata.tasks.rooms.mover_terms import MOVER_COLUMNS
from andabata.tasks.rooms.points import SECTORS
from rl.spaces import ObservationSpec, ObservationTerm

GoalEncoding = Literal["cosine", "polar"]
"""Goal as distance, cosine and sine of the bearing, or as distance and bearing (paper)."""

GOAL_DISTANCE = 5.0
"""Distance that a goal's distance is divided by with ``cosine`` [m]."""

_FAR = 100.0
"""Bound of a goal's distance [m]."""


@dataclass(frozen=True)
class RoomTerms:
    """What an observation in rooms is made of.

    Attributes:
        points: Number of points, masked where a laser has fewer; 0 for no points and no mask.
        windows: Number of windows of bearing.
        window_fov: Angle around straight ahead that the windows cover together [rad].
        as_ranges: True to give windows as ranges [m], False as reciprocals [1/m].
        earlier_scan: Number of control steps since the scan that is given as windows beside the
            present one, as if it were seen from the present pose; 0 for none.
        goal_encoding: Form of the goal.
        tracked_movers: Number of the nearest tracked movers; 0 for none.
    """

    points: int = 120
    windows: int = SECTORS
    window_fov: float = 2 * np.pi
    as_ranges: bool = False
    earlier_scan: int = 0
    goal_encoding: GoalEncoding = "cosine"
    tracked_movers: int = 0

    @property
    def window_bearings(self) -> NDArray[np.float64]:
        """Bearing of the middle of each window, counter-clockwise [rad], shape (windows,)."""
        return self.window_fov * ((np.arange(self.windows) + 0.5) / self.windows - 0.5)


def room_observations(terms: RoomTerms, max_range: float, max_speed: float) -> ObservationSpec:
    """Return the space of the observations: those of these terms that there are, in this order.

    | term | shape | meaning |
    |---|---|---|
    | ``points`` | (points, 2) | (sin a / d, cos a / d) of each point, bearing a, distance d [1/m] |
    | ``mask`` | (points,) | 1 for points that count, 0 for padding |
    | ``windows`` or ``ranges`` | (windows,) | nearest of each window: 1 / d [1/m], or d [m] |
    | ``earlier_windows`` or ``earlier_ranges`` | (windows,) | the same of the earlier scan |
    | ``goal`` | (3,) or (2,) | distance / 5 m, cosine, sine; or distance [m], bearing [rad] |
    | ``velocity`` | (2,) | speed [m/s], yaw rate [rad/s] |
    | ``movers`` | (tracked_movers, 6) | each as in ``MOVER_COLUMNS``, the nearest first |

    Args:
        terms: Parts of an observation.
        max_range: Largest range [m].
        max_speed: Largest speed [m/s] and yaw rate [rad/s].
    """
    near, count = 1.0 / MIN_RANGE, terms.points
    windows: tuple[str, float, str] = ("windows", near, "1/m")
    if terms.as_ranges:
        windows = ("ranges", max(max_range, MIN_RANGE), "m")
    name, high, unit = windows
    terms_of_task = [_term(name, (terms.windows,), 0.0, high, unit)]
    if terms.points:
        terms_of_task.insert(0, _term("mask", (count,), 0.0, 1.0, "1"))
        terms_of_task.insert(0, _term("points", (count, 2), -near, near, "1/m"))
    if terms.earlier_scan:
        terms_of_task.append(_term(f"earlier_{name}", (terms.windows,), 0.0, high, unit))
    if terms.goal_encoding == "polar":
        terms_of_task.append(_term("goal", (2,), -np.pi, _FAR, "m, rad"))
    else:
        terms_of_task.append(_term("goal", (3,), -1.0, _FAR / GOAL_DISTANCE, "5 m, 1, 1"))
    terms_of_task.append(_term("velocity", (2,), -max_speed, max_speed, "m/s, rad/s"))
    if terms.tracked_movers:
        shape = (terms.tracked_movers, MOVER_COLUMNS)
        terms_of_task.append(_term("movers", shape, -near, near, "1/m, m/s, m, 1"))
    return ObservationSpec(terms=tuple(terms_of_task))


def _term(name: str, shape: tuple[int, ...], low: float, high: float, unit: str) -> ObservationTerm:
    """Return a term that networks take as it is."""
    return ObservationTerm(name=name, shape=shape, low=low, high=high, unit=unit, scaling="none")


def encoded_goals(
    poses: NDArray[np.float64], goals: NDArray[np.float64], encoding: GoalEncoding
) -> NDArray[np.float64]:
    """Return goals as networks take them, shape (n, 3) or (n, 2).

    Args:
        poses: x, y [m] and yaw [rad] of the robots, shape (n, 3).
        goals: Goals in the room [m], shape (n, 2).
        encoding: Form of the goal.
    """
    away = goals - poses[:, :2]
    distances = np.hypot(*away.T)
    bearings = np.arctan2(away[:, 1], away[:, 0]) - poses[:, 2]
    if encoding == "polar":
        return np.stack([distances, np.pi - (np.pi - bearings) % (2 * np.pi)], axis=1)
    return np.stack([distances / GOAL_DISTANCE, np.cos(bearings), np.sin(bearings)], axis=1)
