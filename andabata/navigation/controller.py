"""What a controller is given each control step, and what it answers."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import VehicleState
from traversability.cloud import PointCloud, joined
from traversability.virtual_scan import VirtualScan
from worlds.world import Geofence


@dataclass(frozen=True)
class SweepWindow:
    """What was measured last in every direction: a whole cloud at any time, not at the turn's end.

    Attributes:
        parts: Placed points with stamps, in ``odom``, oldest first; none is empty.
        settled: Up to this stamp [s] places were measured with what lies beside them: the head has
            turned on since.
    """

    parts: tuple[PointCloud, ...]
    settled: float

    def since(
        self, stamp: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], tuple[float, float]]:
        """Return what was measured around the places that have settled since a stamp.

        That is one swath of the head, as far before these places as it has turned past them: what
        was measured half a turn earlier lies centimetres off, and would be a step beside them.

        Args:
            stamp: An earlier ``settled`` [s], so that everything is told of once.

        Returns:
            Points [m], shape (n, 3), how long before the newest of them each was measured [s],
            float32, shape (n,), and the ages of what has settled, from the first on, less than the
            second.
        """
        lag = _newest(self.parts[-1]) - self.settled
        swath = joined([part for part in self.parts if _newest(part) > stamp - lag])
        assert swath.stamps is not None
        newest = float(swath.stamps.max())
        ages = (newest - swath.stamps).astype(np.float32)
        return swath.points, ages, (newest - self.settled, newest - stamp)


def _newest(part: PointCloud) -> float:
    """Return the stamp of a part's newest point [s].

    Raises:
        ValueError: If it has no points, or they have no stamps.
    """
    if part.stamps is None or not len(part):
        raise ValueError("parts: expected points with stamps, got none")
    return float(part.stamps.max())


@dataclass(frozen=True)
class ControllerInput:
    """The situation as the robot knows it.

    Attributes:
        stamp: Time [s].
        scan: Virtual 2D scan in ``base_footprint``.
        heading_error: Where to head for relative to the robot's heading [rad], (-pi, pi]: the goal,
            or a sub-goal on the way there.
        goal_distance: Estimated horizontal distance to the goal [m].
        previous_steering: The last two steering commands, newest first [rad/s].
        pose: Estimated pose.
        odometry: Estimated pose in ``odom``, which drifts and never jumps.
        goal: Goal in the map [m], shape (2,).
        truth: The true state, for the oracle alone (simulation only).
        geofence: Where the robot may be at all: the fence that a field robot is given with its goals.
            None is everywhere.
        recent: What was measured last in every direction; None where there are no clouds.
    """

    stamp: float
    scan: VirtualScan
    heading_error: float
    goal_distance: float
    previous_steering: tuple[float, float]
    pose: Pose
    odometry: Pose
    goal: NDArray[np.float64]
    truth: VehicleState | None
    geofence: Geofence | None = None
    recent: SweepWindow | None = None


class Controller(Protocol):
    """Whatever decides where to steer.

    Attributes:
        pace: Share of the robot's speed that the last answer is meant for: 1, as in the paper, 0
            for a turn on the spot, below 0 backwards, above 1 in haste.
        hold: Control steps that an answer stands: who asks looks at the scan no more often.
    """

    pace: float
    hold: int

    def reset(self) -> None:
        """Forget the last drive."""

    def steer(self, view: ControllerInput) -> float:
        """Return the wanted yaw rate [rad/s], positive to the left."""
