"""Navigator that drives a vehicle by a policy of a disc robot in rooms, by similarity.

A policy of a small and slow robot drives a larger and faster one as if lengths were measured in
another unit of length, and times in another unit of time: all that it sees is divided by these, and
its speeds are multiplied by them. A robot without delay and lag would drive the same path, scaled
(assumption; the papers of SPN and TD3 drive one robot each).
"""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.lidar_map import LidarMap, LidarMapConfig
from andabata.tasks.rooms.batch import room_arrays
from andabata.tasks.rooms.config import RoomConfig
from andabata.tasks.rooms.kernel import MIN_RANGE
from andabata.tasks.rooms.observations import RoomRenderer
from rl.driving import driven
from rl.policy import Policy


class SimilarityConfig(BaseModel):
    """Units in which a policy measures another robot than its own.

    Attributes:
        length: Unit of length: sizes of this robot over those of the policy's own.
        rate: Pace: yaw rates of this robot over those of the policy's own. Speeds have the factor
            ``length * rate``, times between two decisions ``1 / rate``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    length: float = Field(default=1.0, gt=0, le=10)
    rate: float = Field(default=1.0, gt=0, le=10)


class RoomPolicyNavigator:
    """Drives to a goal by a policy of rooms, heading for the goal or for sub-goals of a map.

    Attributes:
        policy: Policy.
    """

    def __init__(
        self,
        vehicle: PlanarVehicleConfig,
        policy: Policy,
        task: RoomConfig,
        similarity: SimilarityConfig,
        map_config: LidarMapConfig | None,
        rng: np.random.Generator,
    ) -> None:
        """Prepare for a robot.

        Args:
            vehicle: Limits and period of the robot.
            policy: Policy for what ``task`` observes.
            task: Robot and terms that the policy was trained with, and this robot's laser, in the
                policy's units; see ``scaled_lidar``.
            similarity: Units of the policy.
            map_config: Settings of the map that gives sub-goals; None heads for the goal itself.
            rng: Draws of the noise that the policy drives with.

        Raises:
            ValueError: If the policy reads tracked movers or an earlier scan, which this robot does
                not keep.
        """
        for name in ("tracked_movers", "earlier_scan"):
            if number := getattr(task.terms, name):
                raise ValueError(
                    f"policy: expected one without {name}, which this robot does not keep, got one "
                    f"with {number}; train one with --set stages.Rooms.environment.{name}=0"
                )
        self.policy, self._vehicle, self._rng = policy, vehicle, rng
        self._similarity, self._task = similarity, task
        self._renderer = RoomRenderer(room_arrays([]), [task.lidar], task.terms)
        self._map = None if map_config is None else LidarMap(map_config)
        decision = task.robot.period / similarity.rate
        self._repeat = max(1, round(decision / vehicle.period))
        self.reset(PlanarLidarConfig(), (0.0, 0.0))

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive; see ``PlanarNavigator``."""
        self._lidar, self._goal = lidar, np.array(goal)
        self._bearings = lidar.bearings
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        self._left, self._command = 0, Twist(0.0, 0.0)
        self.policy.reset()
        if self._map is not None:
            self._map.reset()

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this period; the policy decides as often as it did in training."""
        target = self._target(readings)
        if self._left == 0:
            self._left = self._repeat
            self._command = self._decision(readings, target)
        self._left -= 1
        return self._command

    def _target(self, readings: PlanarReadings) -> NDArray[np.float64]:
        """Return the goal, or the sub-goal of the map, in the frame of the odometry [m]."""
        if self._map is None:
            return self._goal
        pose, reach = np.array(readings.odometry), self._lidar.max_range
        self._map.update(pose, self._bearings, readings.ranges, reach, self._mount)
        return self._map.subgoal(pose[:2], self._goal)

    def _decision(self, readings: PlanarReadings, target: NDArray[np.float64]) -> Twist:
        """Return what the policy wants, in this robot's units and within its limits."""
        length, rate = self._similarity.length, self._similarity.rate
        x, y, yaw = readings.odometry
        speed = readings.velocity.linear / (length * rate)
        motion = np.array([[x / length, y / length, yaw, speed, readings.velocity.angular / rate]])
        far = self._task.lidar.max_range
        # What returned nothing, or was not measured, counts as the largest range, as in training.
        ranges = np.nan_to_num(readings.ranges / length, nan=far, posinf=far)
        reciprocals = (1.0 / np.clip(ranges, MIN_RANGE, far)).astype(np.float32)
        mounted = np.zeros(1, dtype=np.int64)
        (state,) = self._renderer.observe(reciprocals[None], mounted, motion, target[None] / length)
        shares = driven(self.policy, state, self._rng)
        linear, angular = self._task.actions.scaled(shares).tolist()
        return self._vehicle.limited(Twist(linear * length * rate, angular * rate))


def scaled_lidar(lidar: PlanarLidarConfig, length: float) -> PlanarLidarConfig:
    """Return a laser as a robot sees it whose unit of length is ``length`` times as long."""
    scaled = {name: getattr(lidar, name) / length for name in ("max_range", "x", "y")}
    return lidar.model_copy(update=scaled)
