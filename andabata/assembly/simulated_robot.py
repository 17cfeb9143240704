"""A robot put together: plant, sensors and navigator in one scene."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial.transform import Rotation

from andabata.assembly.navigator import NavigatorConfig, make_navigator
from andabata.machine.fault_injector import FaultInjector
from andabata.machine.faults import FaultSetting
from andabata.machine.geo_reference import GeoReference
from andabata.machine.magnetic_model import magnetic_field
from andabata.machine.plants import Plant, default_plant
from andabata.machine.pose import Pose
from andabata.machine.reality import Reality
from andabata.machine.sensor_readings import SensorReadings
from andabata.machine.simulator import Simulator, reseed
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.perception import CloudPerception
from traversability.cloud import PointCloud
from worlds.scenes import Scene
from worlds.world import Start, World

_YEAR = 2026.0
"""Date of simulated drives, for the magnetic field (assumption)."""


class SimulatedRobotConfig(NavigatorConfig):
    """Settings of a robot in simulation.

    Attributes:
        plant: Name of the plant: ``bullet``, that of all published results; ``mujoco``, another
            engine to judge with (extra ``mujoco``); ``wheels``, close to bullet and fast, for
            development, and the default where pybullet is not installed; or ``kinematic``, for
            training.
        reality: Differences between the simulated robot and the one that the navigator believes.
        faults: Faults of the senses in each drive, such as ``gnss:stuck@20``; see
            ``andabata.machine.faults``. In a replay they are added to what was recorded; a live
            navigator has none.
    """

    plant: Plant = Field(default_factory=default_plant)
    reality: Reality = Field(default_factory=Reality)
    faults: tuple[FaultSetting, ...] = ()


class SimulatedRobot:
    """One robot in one scene, driven again and again.

    Attributes:
        scene: World and its rays.
        config: Settings, with the datum of the drive.
        simulator: Plant and sensors.
        navigator: Navigator.
        localizer: Estimator of the navigator's pose.
        perception: Perception of the navigator.
    """

    def __init__(
        self,
        scene: Scene,
        config: SimulatedRobotConfig,
        models: Models | None = None,
        steering: Steering | None = None,
        far_sighted: bool = False,
    ) -> None:
        """Build everything once.

        Args:
            scene: World and its rays.
            config: Settings.
            models: Classifiers; needed with the rotating laser.
            steering: Controller and planner; None for a learner that drives from outside.
            far_sighted: True if returns beyond what clouds are made of are needed, as for a
                recording; the robot itself sees the same either way.

        Raises:
            ValueError: If the rotating laser comes without classifiers.
        """
        scene = scene.with_vegetation_limit(config.robot.max_traversable_vegetation)
        config = at_world(config, scene.world)
        self.scene = scene
        self.config = config
        self._rng = np.random.default_rng(0)
        reach = np.inf if far_sighted else config.assembly.sight
        self.simulator = Simulator(
            scene.world, scene.rays, config.robot, config.plant, config.sensing, self._rng, reach
        )
        self._errors = np.random.default_rng(0)
        self._injector = FaultInjector(config.faults, np.random.default_rng(0))
        parts = make_navigator(config, models, steering, self._errors, self._injector)
        self.navigator, self.localizer, self.perception = parts

    def place(
        self, start: Start, goal: NDArray[np.float64], rng: np.random.Generator
    ) -> SensorReadings:
        """Put the robot down at a start, heading for a goal [m]."""
        drive = rng.spawn(1)[0]
        self._rng.bit_generator.state = drive.bit_generator.state
        # From a stream of its own: what differs moves no noise.
        constants = self.config.reality.draw(drive.spawn(1)[0])
        readings = self.simulator.reset(start, constants)
        reseed(self._errors, self._rng)
        # From another stream of its own: up to a fault's onset a drive is that without it.
        self._injector.reset(drive.spawn(1)[0])
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        self.navigator.reset(self._believed(readings.truth.pose), readings.stamp)
        self.navigator.set_goal(goal)
        return readings

    def _believed(self, pose: Pose) -> Pose:
        """Return the pose that the filter starts at: the true one with the errors it expects."""
        if self.config.localizer == "truth":
            return pose
        tilt, yaw, _, position, height, *_ = self.config.filter.initial_sigma
        shift = self._rng.standard_normal(6) * [position, position, height, tilt, tilt, yaw]
        turn = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
        return Pose.from_euler(
            pose.position + shift[:3], turn[2] + shift[3], turn[1] + shift[4], turn[0] + shift[5]
        )

    def step(self, readings: SensorReadings) -> SensorReadings:
        """Drive one control period by the navigator, and return the readings of the next one."""
        return self.simulator.step(self.navigator.step(readings).wheels)

    def last_cloud(self) -> PointCloud | None:
        """Return the latest cloud around the robot, None without the rotating laser."""
        if not isinstance(self.perception, CloudPerception):
            return None
        if self.perception.assembler.cloud is None:
            return None
        return self.perception.assembler.relative(self.localizer.odometry)

    def close(self) -> None:
        """Free the plant."""
        self.simulator.close()


def at_world(config: SimulatedRobotConfig, world: World) -> SimulatedRobotConfig:
    """Return the configuration of a robot in a world, whose datum is that of the drive.

    A world that is nowhere on Earth leaves the configured datum, and so does one that the user has
    given. The magnetic field is that of the World Magnetic Model.

    Args:
        config: Configuration for any world.
        world: World.
    """
    datum, given = world.datum, config.sensing.geo_reference
    if datum is None or given != GeoReference():
        return config
    field = magnetic_field(datum.latitude_deg, datum.longitude_deg, datum.altitude, _YEAR)
    return with_geo_reference(
        config,
        GeoReference(
            latitude_deg=datum.latitude_deg,
            longitude_deg=datum.longitude_deg,
            altitude=datum.altitude,
            declination_deg=field.declination_deg,
            inclination_deg=field.inclination_deg,
            field=field.flux_density,
        ),
    )


def with_geo_reference(
    config: SimulatedRobotConfig, geo_reference: GeoReference
) -> SimulatedRobotConfig:
    """Return a robot's configuration with another datum of the map."""
    return config.model_copy(
        update={"sensing": config.sensing.model_copy(update={"geo_reference": geo_reference})}
    )
