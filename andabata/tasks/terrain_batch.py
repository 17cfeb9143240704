"""Batch simulator of skid-steer robots on terrain: plant, beams and errors of the believed pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.clock import CONTROL_PERIOD, TICK_HZ, TICKS_PER_STEP
from andabata.machine.kinematic_vehicle import KinematicConfig, plant_parameters
from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import reseed
from andabata.tasks.planar import PlanarState
from andabata.tasks.terrain_kernel import (
    AHEAD,
    BatchBody,
    Beams,
    Robots,
    TerrainObstacles,
    Worlds,
    heading_errors,
    lay_out,
    measure,
    move,
)
from worlds.rooms.mover_motion import Movers
from worlds.world import Start


@dataclass(frozen=True)
class PlanarLidar:
    """A laser in the plane, fixed on the robot.

    Attributes:
        bearings: Bearing of each beam from the robot's heading [rad], shape (b,).
        z: Height [m].
        max_range: Largest range; free beams return it [m].
        x: Position on the robot [m].
        y: Position on the robot [m].
    """

    bearings: NDArray[np.float64]
    z: float
    max_range: float
    x: float = 0.0
    y: float = 0.0


class TerrainBatch:
    """Many skid-steer robots of one kind on terrain with moving obstacles: plant, beams, errors.

    Attributes:
        robots: State of all robots.
        movers: Moving obstacles of each robot's world; see ``Movers``.
        ranges: Range of each beam [m], float32, shape (n, b).
    """

    def __init__(
        self, count: int, robot: RobotModel, lidar: PlanarLidar, errors: NoisyGroundTruthConfig
    ) -> None:
        """Prepare for a number of robots.

        Args:
            count: Number of robots.
            robot: Body of all of them.
            lidar: Laser of all of them.
            errors: Errors of the poses that they believe to have.
        """
        self.robots = Robots.make(count)
        self.movers = Movers.none(count)
        self._kinematics = SkidSteer(robot)
        self._body = _body(robot, errors)
        directions = np.stack([np.cos(lidar.bearings), np.sin(lidar.bearings)], axis=1)
        self._beams = Beams(directions, lidar.x, lidar.y, lidar.z, lidar.max_range)
        self.ranges = np.zeros((count, len(lidar.bearings)), dtype=np.float32)
        self._slips = [np.random.default_rng(0) for _ in range(count)]
        self._wanders = [np.random.default_rng(0) for _ in range(count)]
        self._obstacles: list[TerrainObstacles] = []
        self._worlds: Worlds | None = None

    @property
    def outline(self) -> NDArray[np.float64]:
        """Outline of the body, as ``contact_map`` takes it."""
        return self._body.outline

    def add_world(self, obstacles: TerrainObstacles) -> int:
        """Add a static world and return its index."""
        self._obstacles.append(obstacles)
        self._worlds = None
        return len(self._obstacles) - 1

    def place(self, k: int, world: int, start: Start, rng: np.random.Generator) -> None:
        """Put a robot down at rest.

        Args:
            k: Index of the robot.
            world: Index of its world.
            start: Pose.
            rng: Source of its streams of noise, in the order of ``SimulatedRobot.place``.
        """
        robots = self.robots
        reseed(self._slips[k], rng)
        rng.integers(2**63)  # The beams' stream: there is nothing porous in a maze.
        reseed(self._wanders[k], rng)
        robots.worlds[k] = world
        robots.motions[k] = 0.0
        robots.motions[k, :3] = start.x, start.y, start.yaw
        robots.flags[k] = False
        robots.steps[k] = 0
        robots.errors[k] = self._body.spread[0] * self._wanders[k].standard_normal(5)

    def step(self, twists: NDArray[np.float64], chosen: NDArray[np.bool_]) -> PlanarState:
        """Drive robots for one control period.

        Args:
            twists: Executed speed [m/s] and yaw rate [rad/s] of each, shape (n, 2).
            chosen: True for robots that move; the others stand still, shape (n,).
        """
        robots = self.robots
        # Wheels have limits of their own, which scale both speeds down together.
        driven = twists.copy()
        for k in np.flatnonzero(chosen).tolist():
            wheels = self._kinematics.wheel_speeds(float(twists[k, 0]), float(twists[k, 1]))
            driven[k] = self._kinematics.twist(wheels)
            if robots.steps[k] % AHEAD == 0:
                self._slips[k].standard_normal(out=robots.slip[k])
                self._wanders[k].standard_normal(out=robots.wander[k])
        worlds = self._laid_out()
        move(driven, chosen, robots, self.movers, worlds, self._body, CONTROL_PERIOD)
        return self.observe(chosen)

    def observe(self, chosen: NDArray[np.bool_]) -> PlanarState:
        """Measure the beams of some robots and return the state of all."""
        worlds = self._laid_out()
        measure(chosen, self.robots, self.movers, worlds, self._beams, self.ranges)
        robots = self.robots
        return PlanarState(robots.motions[:, :3], robots.flags[:, 0], robots.flags[:, 1])

    @property
    def poses(self) -> NDArray[np.float64]:
        """True x, y [m] and yaw [rad], shape (n, 3)."""
        return self.robots.motions[:, :3]

    @property
    def stamps(self) -> NDArray[np.float64]:
        """Time since each robot was put down [s], shape (n,)."""
        return np.asarray(self.robots.steps * TICKS_PER_STEP / TICK_HZ)

    @property
    def believed_positions(self) -> NDArray[np.float64]:
        """Positions that the robots believe to have [m], shape (n, 2)."""
        return np.asarray(self.robots.motions[:, :2] + self.robots.errors[:, :2])

    def heading_errors(self, goals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the bearings of goals [m] as the robots believe them, shape (n,) [rad]."""
        return heading_errors(self.robots.motions, self.robots.errors, goals)

    def _laid_out(self) -> Worlds:
        """Return the static worlds behind each other."""
        if self._worlds is None:
            self._worlds = lay_out(self._obstacles)
        return self._worlds


def _body(robot: RobotModel, errors: NoisyGroundTruthConfig) -> BatchBody:
    """Return the numbers of a plant and of its believed pose."""
    plant = plant_parameters(robot, KinematicConfig())
    sigma = np.array([errors.position_sigma] * 2 + [errors.yaw_sigma] + [errors.tilt_sigma] * 2)
    times = np.array([errors.position_time] * 2 + [errors.yaw_time] * 3)
    keep = np.exp(-TICKS_PER_STEP / TICK_HZ / times)
    return BatchBody(
        slip=plant.slip,
        limits=plant.limits,
        sliding=plant.sliding,
        wheels=plant.wheels,
        outline=plant.outline,
        radius=robot.half_radius,
        keep=keep,
        spread=np.stack([sigma, sigma * np.sqrt(1 - keep * keep)]),
    )
