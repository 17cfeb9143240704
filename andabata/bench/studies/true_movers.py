"""The movers as they truly are, in the place of the tracks: a known upper bound.

The robot drives as with tracks, by the same code; only what it is told of movers is the truth.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.mover_perception import MoverPerception, MoverPerceptionConfig
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.perception import CloudPerception

_SLACK = 0.3
"""Distance from a body within which returns may be its own [m]: a cell and a half."""


class TrueMovers(MoverPerception):
    """Tells the true movers of a simulated world, in the ``odom`` of a robot, seen or not."""

    def __init__(self, config: MoverPerceptionConfig, robot: SimulatedRobot) -> None:
        """Begin without movers.

        Args:
            config: Settings of what it stands for.
            robot: Robot that drives.
        """
        self._localizer = robot.localizer
        super().__init__(config, robot.config.robot.lidar_height)

    def reset(self) -> None:
        """Forget everything."""
        super().reset()
        self._places: NDArray[np.float64] | None = None
        self._then = 0.0
        self._been: deque[tuple[float, NDArray[np.float64]]] = deque()

    def update(self, readings: SensorReadings, track: PoseTrack) -> None:
        """Take in where the movers are.

        Args:
            readings: Readings.
            track: Estimated poses in ``odom`` by stamp, which are not needed.

        Raises:
            ValueError: If the readings hold no true state.
        """
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none; simulate")
        rows = np.empty((0, 5)) if readings.walkers is None else readings.walkers
        pose, odometry = readings.truth.pose, self._localizer.odometry
        turn = odometry.yaw - pose.yaw
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, -s], [s, c]])
        places = (rows[:, :2] - pose.position[:2]) @ rotation.T + odometry.position[:2]
        velocities = np.zeros_like(places)
        if self._places is not None and readings.stamp > self._then:
            moved = (rows[:, :2] - self._places) / (readings.stamp - self._then)
            velocities = moved @ rotation.T
        self._places, self._then = rows[:, :2].copy(), readings.stamp
        # Who stands is an obstacle like any other, for tracks, too.
        least = self.config.frames.min_speed
        there = (rows[:, 3] > 0) & (np.hypot(*velocities.T) >= least)
        zeros = np.zeros(int(there.sum()))
        numbers = np.flatnonzero(there).astype(np.float64)
        self.movers = TrackedMovers(
            places[there], velocities[there], rows[there, 3], zeros, zeros, numbers
        )
        discs = np.column_stack([places[there], rows[there, 3] + _SLACK])
        self._been.append((readings.stamp, discs))
        while self._been[0][0] < readings.stamp - self.config.free_space.left_time:
            self._been.popleft()

    @property
    def transient_places(self) -> NDArray[np.float64]:
        """Middles of the cells in which movers are, or were a while ago [m], shape (k, 2)."""
        free = self.config.free_space
        half = free.cells // 2
        centre = np.floor(self._localizer.odometry.position[:2] / free.cell)
        steps = np.arange(-half, half)
        is_under = np.zeros((2 * half, 2 * half), dtype=np.bool_)
        for _, discs in list(self._been)[::-3]:
            for x, y, radius in discs:
                across = (centre[0] + steps + 0.5) * free.cell - x
                along = (centre[1] + steps + 0.5) * free.cell - y
                if np.abs(across).min() < radius and np.abs(along).min() < radius:
                    is_under |= across[:, None] ** 2 + along**2 < radius * radius
        return np.asarray((np.argwhere(is_under) - half + centre + 0.5) * free.cell)


def tell_true_movers(robot: SimulatedRobot) -> None:
    """Put the true movers in the place of a robot's perception of movers.

    Raises:
        TypeError: If the robot has none.
    """
    perception, config = robot.perception, robot.config.movers
    if not isinstance(perception, CloudPerception) or config is None or perception.layers is None:
        raise TypeError("movers: expected a robot with a planner that perceives movers, got none")
    perception.movers = perception.layers.movers = TrueMovers(config, robot)
