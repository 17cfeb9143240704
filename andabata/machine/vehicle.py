"""Interface of the vehicle, and the choice between its plants."""

from typing import Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from andabata.machine.plants import Plant, check_plant
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from worlds.walking import WalkerTrack
from worlds.world import Start, World


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
            walkers: Walkers of the world at the end of each of these ticks, or None.

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
        plant: Name of the plant: ``bullet``, rigid-body physics, the reference; ``mujoco``, the
            same body in another engine (extra ``mujoco``); ``wheels``, a rigid body on ray-cast
            wheels, calibrated against bullet and far faster; or ``kinematic``, terrain-following,
            the fastest.
        world: Ground and objects.
        robot: Parameters of the body.
        rng: Source of the kinematic plant's wheel slip.

    Raises:
        PlantError: If its engine is not installed.
        ValueError: If the name is another.
    """
    check_plant(plant)
    if plant == "bullet":
        from andabata.machine.bullet_vehicle import BulletVehicle

        return BulletVehicle(world, robot)
    if plant == "mujoco":
        from andabata.machine.mujoco_vehicle import MujocoVehicle

        return MujocoVehicle(world, robot)
    if plant == "wheels":
        from andabata.machine.wheels.vehicle import WheelsVehicle

        return WheelsVehicle(world, robot)
    if plant == "kinematic":
        from andabata.machine.kinematic_vehicle import KinematicVehicle

        return KinematicVehicle(world, robot, rng)
    raise ValueError(f"plant: expected one of {', '.join(get_args(Plant))}, got {plant!r}")
