"""A navigator put together: localisation, perception, planner and controller, in one place.

Simulation, replay and the live graph get theirs here, so that all of them are the same.
"""

from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.localization.localizer import Localizer
from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import ReadingsFilter, unfiltered
from andabata.machine.simulator import SensingConfig
from andabata.models import Models
from andabata.navigation.arrival import ArrivalConfig
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.navigation.controller import NoPlanner, Steering
from andabata.navigation.laser_monitor import LaserMonitorConfig
from andabata.navigation.mover_perception import MoverPerception, MoverPerceptionConfig
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import CloudPerception, HorizontalPerception, Perception
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.local_planner import LocalPlannerConfig
from andabata.navigation.planning.prior_map import PriorMapConfig
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from traversability.grid import PolarGrid
from worlds.world import Geofence


class NavigatorConfig(BaseModel):
    """Settings of a robot's navigator.

    Attributes:
        robot: Body: size, speed, limits.
        sensing: Scanner and other sensors.
        assembly: Assembly of sweeps into clouds.
        grid: Polar grid; the limit of plants is always the robot's.
        localizer: ``ukf``, the robot's filter, or ``truth``, the true pose with ``errors``, for
            ablation.
        filter: Settings of the filter.
        errors: Errors of the true pose.
        local_planner: Settings of the local planner.
        prior_map: Heights that the local planner knows before the drive, and their costs.
        rollouts: Settings of its rollouts.
        arrival: Rules by which the robot declares a goal reached.
        laser_monitor: Silence of the laser from which the robot stands still.
        movers: Settings of the perception of what moves, which the map does not keep; None leaves
            it out. It needs the rotating or a 3D laser.
        geofence: Rectangle that the robot must not leave, ``x_min, y_min, x_max, y_max`` in the map
            [m], as an operator gives it; None for none. A simulated robot is not told where its
            world ends.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: RobotModel = Field(default_factory=RobotModel)
    sensing: SensingConfig = Field(default_factory=SensingConfig)
    assembly: CloudAssemblyConfig = Field(default_factory=CloudAssemblyConfig)
    grid: PolarGrid = Field(default_factory=PolarGrid)
    localizer: Literal["ukf", "truth"] = "ukf"
    filter: UkfConfig = Field(default_factory=UkfConfig)
    errors: NoisyGroundTruthConfig = Field(default_factory=NoisyGroundTruthConfig)
    local_planner: LocalPlannerConfig = Field(default_factory=LocalPlannerConfig)
    prior_map: PriorMapConfig = Field(default_factory=PriorMapConfig)
    rollouts: TrajectoryRolloutsConfig = Field(default_factory=TrajectoryRolloutsConfig)
    arrival: ArrivalConfig = Field(default_factory=ArrivalConfig)
    laser_monitor: LaserMonitorConfig = Field(default_factory=LaserMonitorConfig)
    movers: MoverPerceptionConfig | None = None
    geofence: Geofence | None = None

    @model_validator(mode="after")
    def _check_geofence(self) -> Self:
        """Refuse a geofence that holds no place."""
        if self.geofence is not None:
            x_min, y_min, x_max, y_max = self.geofence
            if not (x_min < x_max and y_min < y_max):
                raise ValueError(
                    "geofence: expected x_min, y_min, x_max, y_max [m] with each minimum below its "
                    f"maximum, got {list(self.geofence)}; swap them"
                )
        return self


class NavigatorParts(NamedTuple):
    """A navigator with the parts that others read.

    Attributes:
        navigator: Navigator.
        localizer: Estimator of its pose.
        perception: Perception: clouds, classifier, virtual scan.
    """

    navigator: Navigator
    localizer: Localizer
    perception: Perception


def make_navigator(
    config: NavigatorConfig,
    models: Models | None,
    steering: Steering | None,
    rng: np.random.Generator,
    readings_filter: ReadingsFilter = unfiltered,
) -> NavigatorParts:
    """Put a navigator together.

    Args:
        config: Settings.
        models: Classifiers; needed with the rotating laser.
        steering: Controller and planner; None for a learner that drives from outside.
        rng: Source of the errors of the true pose, with ``localizer = truth``.
        readings_filter: Filter between the source of the readings and the navigator.

    Raises:
        ValueError: If classifiers or the filter's sensors are missing.
    """
    steering = steering or Steering()
    has_planner = not isinstance(steering.planner, NoPlanner)
    localizer = make_localizer(config, rng)
    perception = make_perception(config, models, has_planner)
    navigator = Navigator(
        config.robot,
        localizer,
        perception,
        steering,
        readings_filter,
        config.arrival,
        config.laser_monitor,
    )
    navigator.geofence = config.geofence
    return NavigatorParts(navigator, localizer, perception)


def make_perception(
    config: NavigatorConfig, models: Models | None, with_layers: bool
) -> Perception:
    """Return the perception that fits the scanner.

    Args:
        config: Settings.
        models: Classifiers; needed with the rotating laser.
        with_layers: True for the layers that a planner reads.

    Raises:
        ValueError: If the rotating laser comes without classifiers.
    """
    if config.sensing.scanner == "horizontal":
        return HorizontalPerception(config.grid)
    if models is None:
        raise ValueError("models: expected classifiers for the rotating laser, got None")
    assembler = CloudAssembler(config.assembly, config.robot.lidar_height)
    movers = None
    if config.movers is not None:
        rows = config.sensing.lidar.rows_deg
        movers = MoverPerception(config.movers, config.robot.lidar_height, rows_deg=rows)
    layers = None
    if with_layers:
        planner = config.local_planner
        layers = CartesianLayers(
            assembler,
            planner.occupancy.cells,
            planner.occupancy.cell,
            planner.ground,
            planner.low_obstacles,
            models.ground_classifier,
            movers,
        )
    limit = config.robot.max_traversable_vegetation
    grid = config.grid.model_copy(update={"max_traversable_vegetation": limit})
    return CloudPerception(assembler, models.forest, grid, layers, movers)


def make_localizer(config: NavigatorConfig, rng: np.random.Generator) -> Localizer:
    """Return the estimator of the pose.

    Args:
        config: Settings.
        rng: Source of the errors of the true pose.

    Raises:
        ValueError: If the filter comes without the sensors that it needs.
    """
    if config.localizer == "truth":
        return NoisyGroundTruthLocalizer(config.errors, rng)
    if config.sensing.proprioception is None:
        raise ValueError(
            "proprioception: expected the sensors that the filter needs, got none; "
            "localizer = truth does without"
        )
    return UkfLocalizer(config.filter, config.robot, config.sensing.geo_reference)
