"""A robot put together: plant, senses, localisation, perception and navigator in one scene."""

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.localization.localizer import Localizer
from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings
from andabata.machine.simulator import SensingConfig, Simulator, reseed
from andabata.machine.vehicle import Plant
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.navigation.controller import Controller
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import CloudPerception, HorizontalPerception, Perception
from andabata.navigation.planning.local_planner import LocalPlannerConfig
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from traversability.cloud import PointCloud
from traversability.forest import Forest
from traversability.grid import PolarGrid
from worlds.scenes import Scene
from worlds.world import Start


class SimulatedRobotConfig(BaseModel):
    """What a robot is put together from.

    Attributes:
        robot: The body.
        plant: ``bullet``, in which every published result is judged, or ``kinematic``, for
            training.
        sensing: The scanner.
        assembly: How sweeps become clouds.
        grid: The polar grid.
        localizer: ``ukf``, the robot's filter, or ``truth``, the true pose with ``errors``, for
            ablation.
        filter: The filter's expectations.
        errors: Of the true pose.
        local_planner: The map of guided controllers.
        rollouts: Their look ahead.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: RobotModel = Field(default_factory=RobotModel)
    plant: Plant = "bullet"
    sensing: SensingConfig = Field(default_factory=SensingConfig)
    assembly: CloudAssemblyConfig = Field(default_factory=CloudAssemblyConfig)
    grid: PolarGrid = Field(default_factory=PolarGrid)
    localizer: Literal["ukf", "truth"] = "ukf"
    filter: UkfConfig = Field(default_factory=UkfConfig)
    errors: NoisyGroundTruthConfig = Field(default_factory=NoisyGroundTruthConfig)
    local_planner: LocalPlannerConfig = Field(default_factory=LocalPlannerConfig)
    rollouts: TrajectoryRolloutsConfig = Field(default_factory=TrajectoryRolloutsConfig)


class SimulatedRobot:
    """One robot in one scene, driven again and again."""

    def __init__(
        self,
        scene: Scene,
        config: SimulatedRobotConfig,
        forest: Forest | None = None,
        controller: Controller | None = None,
        far_sighted: bool = False,
    ) -> None:
        """Build everything once.

        Args:
            scene: Where to drive.
            config: What to build.
            forest: The cell classifier; needed with the rotating laser.
            controller: Where to steer; None for a learner.
            far_sighted: Whether somebody looks at returns beyond what clouds are made of, as a
                recording does; the robot itself sees the same either way.

        Raises:
            ValueError: If the rotating laser comes without a forest.
        """
        self.scene = scene
        self.config = config
        self._rng = np.random.default_rng(0)
        reach = np.inf if far_sighted else config.assembly.sight
        self.simulator = Simulator(
            scene.world, scene.rays, config.robot, config.plant, config.sensing, self._rng, reach
        )
        self.perception = make_perception(config, forest)
        self._errors = np.random.default_rng(0)
        self.localizer = make_localizer(config, self._errors)
        self.navigator = Navigator(config.robot, self.localizer, self.perception, controller)
        self.navigator.geofence = scene.geofence

    def place(self, start: Start, goal: np.ndarray, rng: np.random.Generator) -> SensorReadings:
        """Put the robot down; every noise comes from a child of ``rng``."""
        self._rng.bit_generator.state = rng.spawn(1)[0].bit_generator.state
        readings = self.simulator.reset(start)
        reseed(self._errors, self._rng)
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        self.navigator.reset(self._believed(readings.truth.pose), readings.stamp)
        self.navigator.set_goal(goal)
        return readings

    def _believed(self, pose: Pose) -> Pose:
        """Return where the robot believes to start: the filter is told no more than it expects."""
        if self.config.localizer == "truth":
            return pose
        tilt, yaw, _, position, height, *_ = self.config.filter.initial_sigma
        shift = self._rng.standard_normal(6) * [position, position, height, tilt, tilt, yaw]
        turn = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
        return Pose.from_euler(
            pose.position + shift[:3], turn[2] + shift[3], turn[1] + shift[4], turn[0] + shift[5]
        )

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


def make_perception(config: SimulatedRobotConfig, forest: Forest | None) -> Perception:
    """Return the perception that fits the scanner.

    Raises:
        ValueError: If the rotating laser comes without a forest.
    """
    if config.sensing.scanner == "horizontal":
        return HorizontalPerception(config.grid)
    if forest is None:
        raise ValueError("forest: expected a cell classifier for the rotating laser, got None")
    return CloudPerception(
        CloudAssembler(config.assembly, config.robot.lidar_height), forest, config.grid
    )


def with_geo_reference(
    config: SimulatedRobotConfig, geo_reference: GeoReference
) -> SimulatedRobotConfig:
    """Return a robot's configuration with another datum of the map."""
    return config.model_copy(
        update={"sensing": config.sensing.model_copy(update={"geo_reference": geo_reference})}
    )


def make_localizer(config: SimulatedRobotConfig, rng: np.random.Generator) -> Localizer:
    """Return what tells the robot where it is.

    Args:
        config: Of the robot.
        rng: Errors of the true pose.

    Raises:
        ValueError: If the filter comes without the senses that it needs.
    """
    if config.localizer == "truth":
        return NoisyGroundTruthLocalizer(config.errors, rng)
    if config.sensing.proprioception is None:
        raise ValueError(
            "proprioception: expected the senses that the filter needs, got none; "
            "localizer = truth does without"
        )
    return UkfLocalizer(config.filter, config.robot, config.sensing.geo_reference)
