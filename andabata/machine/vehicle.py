"""The vehicle's seam: two plants behind one interface."""

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from worlds.world import Start, World

Plant = Literal["bullet", "kinematic"]


class Vehicle(Protocol):
    """A body with driven wheels on the ground of a world."""

    def place(self, start: Start) -> None:
        """Put the body down at rest; its time becomes zero."""

    def drive(self, wheels: WheelSpeeds, ticks: int) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks.

        Returns:
            At the end of each tick: x, y, z [m] and quaternion x, y, z, w of ``base_footprint`` in
            the map, actual left and right wheel speed [rad/s]; shape (ticks, 9).

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """

    @property
    def state(self) -> VehicleState:
        """The true state; ``collided`` holds for any tick of the last drive."""

    def close(self) -> None:
        """Free what the plant holds."""


def make_vehicle(
    plant: Plant, world: World, robot: RobotModel, rng: np.random.Generator
) -> Vehicle:
    """Return a plant.

    Args:
        plant: ``bullet``, rigid-body physics, the reference; or ``kinematic``, terrain-following
            and fast.
        world: Where it stands.
        robot: Its numbers.
        rng: Wheel slip of the kinematic plant.

    Raises:
        ValueError: If there is no such plant.
    """
    if plant == "bullet":
        from andabata.machine.bullet_vehicle import BulletVehicle

        return BulletVehicle(world, robot)
    if plant == "kinematic":
        from andabata.machine.kinematic_vehicle import KinematicVehicle

        return KinematicVehicle(world, robot, rng)
    raise ValueError(f"plant: expected bullet or kinematic, got {plant!r}")
