"""Interface of the vehicle, and the choice between its two plants."""

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from worlds.walking import WalkerTrack
from worlds.world import Start, World

Plant = Literal["bullet", "kinematic"]
"""Names of the plants."""


class Vehicle(Protocol):
    """Body with driven wheels on the ground of a world."""

    def place(self, start: Start) -> None:
        """Put the body down at rest and set its time to zero."""

    def drive(
        self, wheels: WheelSpeeds, ticks: int, walkers: WalkerTrack | None = None
    ) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks.

        Args:
            wheels: Commanded wheel speeds.
            ticks: Number of ticks.
            walkers: Walkers of the world at the end of each of these ticks; None for none.

        Returns:
            Rows of x, y, z [m] and quaternion x, y, z, w of ``base_footprint`` in the map, actual
            left and right wheel speed [rad/s] at the end of each tick; shape (ticks, 9).

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """

    @property
    def state(self) -> VehicleState:
        """True state of the body; ``collided`` is true if any tick of the last drive collided."""

    def close(self) -> None:
        """Release the resources of the plant."""


def make_vehicle(
    plant: Plant, world: World, robot: RobotModel, rng: np.random.Generator
) -> Vehicle:
    """Return a plant.

    Args:
        plant: Name of the plant: ``bullet``, rigid-body physics, the reference; or ``kinematic``,
            terrain-following and fast.
        world: Ground and objects.
        robot: Parameters of the body.
        rng: Source of the kinematic plant's wheel slip.

    Raises:
        ValueError: If the name is another.
    """
    if plant == "bullet":
        from andabata.machine.bullet_vehicle import BulletVehicle

        return BulletVehicle(world, robot)
    if plant == "kinematic":
        from andabata.machine.kinematic_vehicle import KinematicVehicle

        return KinematicVehicle(world, robot, rng)
    raise ValueError(f"plant: expected bullet or kinematic, got {plant!r}")
