"""Synthetic labelled clouds: a robot drives a little, its laser sees, the truth labels."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator
from scipy.spatial.transform import Rotation

from andabata.datasets.cloud_variation import CloudVariation, varied_cloud
from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from andabata.navigation.cloud_assembly import CloudAssemblyConfig, assembled_turn
from terrain.heightfield import Heightfield
from traversability.cloud import PointCloud
from worlds.catalogue import make_world, patch
from worlds.rays.scene import RayScene
from worlds.scenes import Scene
from worlds.traversability_map import TraversabilityMap
from worlds.world import Start

Span = tuple[float, float]

_SLOPE_REACH = 0.15
"""Half the stretch over which the slope of the ground under cover is taken [m]."""


class CloudsConfig(BaseModel):
    """Settings of labelled clouds. A value is drawn evenly from each span, anew for each cloud.

    Attributes:
        presets: World presets, taken in turn.
        difficulty: Span of the worlds' difficulty.
        patch_size: Edge of the worlds, which are patches of their presets [m]; 0 for whole worlds.
        patch_cell: Distance between grid lines of a patch [m].
        clouds_per_world: Largest number of clouds that share a world.
        robot: Body of the robot.
        sensing: Settings of the rotating laser.
        assembly: Settings of the assembly of sweeps into clouds.
        noise: Span of the standard deviation of the laser's range [m].
        dropout: Span of the probability that a return is lost.
        tilt_sigma: Span of the standard deviation of roll and pitch of the estimated pose [rad].
        drift_sigma: Span of the standard deviation of the estimated position [m], which wanders
            with a correlation time of a minute.
        standstill_share: Share of clouds that are taken at a standstill.
        varied_share: Share of clouds that another robot might have taken: its laser mounted at
            another height and tilted, with fewer points, and parts of its view hidden. A classifier
            that learns from them depends on none of these.
        lidar_heights: Span of the optical centre's height in varied clouds [m].
        lidar_tilts: Span of the laser's tilt in varied clouds [rad], towards any side.
        point_shares: Span of the share of points kept in varied clouds.
        max_hidden_directions: Largest number of directions in which part of the view of a varied
            cloud is hidden, as by parts of the robot or by ground too dark to return a beam.
        cover_share: Share of the varied clouds that have each of grass, litter and undulations.
        grass: Span of the height of low grass [m]. It stops some of the beams above the ground,
            which stays drivable (assumption: to 15 cm; what is higher is an object of the world).
        litter: Span of the height of leaf litter, root mean square [m].
        undulation: Span of the height of undulations of the ground, with waves of 0.3 to 2 m, root
            mean square [m].
        max_cover: Largest scatter of grass, litter and undulations together, root mean square [m]:
            what is higher is scaled down, since low plants on broken ground are not distinguished
            from high ones on level ground.
        exact_share: Share of the clouds that are taken without noise, dropout and errors of the
            pose, as another simulator's are.
        min_hazard_distance: Least distance of the nearest forbidden ground [m].
        max_hazard_distance: Largest distance of the nearest forbidden ground, so that there is
            something to see [m].
        close_share: Share of the clouds that are taken closer than ``max_close_distance``, where
            misses count.
        max_close_distance: Largest distance of the nearest forbidden ground for close clouds [m].
        carry_time: Longest time for which the robot drives on and carries the complete cloud
            along, as it does between two clouds [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    presets: tuple[str, ...] = (
        *("forest", "hill", "lake", "park", "natural", "hollow", "maze", "meadow"),
    )
    difficulty: Span = (0.2, 1.0)
    patch_size: float = Field(default=60.0, ge=0, le=200)
    patch_cell: float = Field(default=0.125, gt=0.02, le=0.5)
    clouds_per_world: int = Field(default=20, ge=1)
    robot: RobotModel = Field(default_factory=RobotModel)
    sensing: SensingConfig = Field(default_factory=SensingConfig)
    assembly: CloudAssemblyConfig = Field(default_factory=CloudAssemblyConfig)
    noise: Span = (0.005, 0.03)
    dropout: Span = (0.0, 0.03)
    tilt_sigma: Span = (0.0, 0.008)
    drift_sigma: Span = (0.0, 0.1)
    standstill_share: float = Field(default=0.25, ge=0, le=1)
    varied_share: float = Field(default=0.0, ge=0, le=1)
    lidar_heights: Span = (0.45, 1.0)
    lidar_tilts: Span = (0.0, 0.0)
    point_shares: Span = (0.25, 1.0)
    max_hidden_directions: int = Field(default=0, ge=0, le=64)
    cover_share: float = Field(default=0.5, ge=0, le=1)
    grass: Span = (0.0, 0.0)
    litter: Span = (0.0, 0.0)
    undulation: Span = (0.0, 0.0)
    max_cover: float = Field(default=0.065, gt=0, le=1)
    exact_share: float = Field(default=0.0, ge=0, le=1)
    min_hazard_distance: float = Field(default=0.3, ge=0)
    max_hazard_distance: float = Field(default=4.0, gt=0)
    close_share: float = Field(default=0.4, ge=0, le=1)
    max_close_distance: float = Field(default=1.2, gt=0)
    carry_time: float = Field(default=3.3, ge=0)

    @field_validator(
        *(
            "difficulty",
            "noise",
            "dropout",
            "tilt_sigma",
            "drift_sigma",
            "lidar_tilts",
            "point_shares",
        ),
        *("grass", "litter", "undulation"),
    )
    @classmethod
    def _check_span(cls, span: Span) -> Span:
        if not 0 <= span[0] <= span[1] <= 1:
            raise ValueError(f"expected 0 <= least <= most <= 1, got {span}")
        return span

    @field_validator("lidar_heights")
    @classmethod
    def _check_heights(cls, span: Span) -> Span:
        if not 0 < span[0] <= span[1] <= 5:
            raise ValueError(f"expected 0 < least <= most <= 5 m, got {span}")
        return span


def cloud_scene(config: CloudsConfig, preset: str, seed: int) -> Scene:
    """Return the world that clouds are taken in, with its rays.

    Args:
        config: Settings with the patch and the difficulty.
        preset: World preset.
        seed: Seed of the world and of its difficulty.
    """
    difficulty = np.random.default_rng([seed, 1]).uniform(*config.difficulty)
    if config.patch_size > 0:
        smaller = patch(preset, config.patch_size, config.patch_cell)
        world = make_world(preset, seed, difficulty, smaller)
    else:
        world = make_world(preset, seed, difficulty)
    scene = Scene(world, RayScene(world))
    return scene.with_vegetation_limit(config.robot.max_traversable_vegetation)


def labelled_cloud(
    scene: Scene, config: CloudsConfig, rng: np.random.Generator, start: Start | None = None
) -> PointCloud:
    """Return the cloud of ``take_cloud``."""
    return take_cloud(scene, config, rng, start)[0]


def take_cloud(
    scene: Scene, config: CloudsConfig, rng: np.random.Generator, start: Start | None = None
) -> tuple[PointCloud, Pose]:
    """Drive from a place until a cloud is complete, carry it on, and label its points.

    Args:
        scene: World and its rays.
        config: Settings.
        rng: Source of place, heading, steering and every noise.
        start: Start of the drive; None for a random place.

    Returns:
        The cloud in ``base_footprint`` as the robot believes it, with stamps, and with the classes,
        ``severity``, ``nontraversable`` and ``forbidden`` of the places that the beams hit in
        truth; and the estimated pose in the map.
    """
    sensing, believed = _draw_noise(config, rng)
    robot, variation = _draw_variation(config, rng)
    simulator = Simulator(
        scene.world, scene.rays, robot, "kinematic", sensing, rng, config.assembly.sight
    )
    localizers = [NoisyGroundTruthLocalizer(sigma, rng) for sigma in (believed, _SURVEYED)]
    wheels = _draw_wheels(config, rng)
    readings = _begin(simulator, start or _random_start(scene, config, rng), localizers)
    lidar = sensing.lidar
    half_turn = config.assembly.turn / lidar.head_rate
    carried = rng.uniform(0, config.carry_time)
    _drive(simulator, wheels, readings, half_turn + 2 / lidar.sweep_hz + carried, localizers, rng)
    # One sweep more ends the half turn.
    sweeps = simulator.sweeps(0.0, half_turn + 1 / lidar.sweep_hz, variation.tilt)
    simulator.close()
    tracks = [localizer.track for localizer in localizers]
    if variation.tilt is not None:
        tracks = [track.rotated(variation.tilt) for track in tracks]
    pose, lift = localizers[0].pose, robot.lidar_height
    cloud, (_, surveyed) = assembled_turn(config.assembly, lift, sweeps, tracks, pose)
    cloud = _labelled(cloud, surveyed, scene.world.truth)
    middle = Pose(*np.split(localizers[0].track.at(np.array([half_turn / 2]))[0], [3]))
    laser = _seen_from(pose, middle.matrix[:3] @ [0.0, 0.0, lift, 1.0])
    slopes = _slopes_under(surveyed, scene.world.ground, pose.yaw) if variation.covered else None
    return varied_cloud(cloud, variation, laser, rng, slopes), pose


def _draw_noise(
    config: CloudsConfig, rng: np.random.Generator
) -> tuple[SensingConfig, NoisyGroundTruthConfig]:
    """Return the laser with its noise, and the errors of the pose that the robot believes."""
    if config.exact_share and rng.random() < config.exact_share:
        lidar = config.sensing.lidar.model_copy(update={"noise": 0.0, "dropout": 0.0})
        return config.sensing.model_copy(update={"lidar": lidar, "proprioception": None}), _SURVEYED
    noise, dropout = rng.uniform(*config.noise), rng.uniform(*config.dropout)
    lidar = config.sensing.lidar.model_copy(update={"noise": noise, "dropout": dropout})
    believed = NoisyGroundTruthConfig(
        position_sigma=rng.uniform(*config.drift_sigma),
        yaw_sigma=0.2 * rng.uniform(*config.drift_sigma),
        tilt_sigma=rng.uniform(*config.tilt_sigma),
    )
    return config.sensing.model_copy(update={"lidar": lidar, "proprioception": None}), believed


def _draw_variation(
    config: CloudsConfig, rng: np.random.Generator
) -> tuple[RobotModel, CloudVariation]:
    """Return the robot with its laser's height, and what else another robot's cloud has."""
    if rng.random() >= config.varied_share:
        return config.robot, CloudVariation()
    share = config.cover_share
    robot = config.robot.model_copy(update={"lidar_height": rng.uniform(*config.lidar_heights)})
    variation = CloudVariation(kept=rng.uniform(*config.point_shares))
    if config.lidar_tilts[1] > 0:
        tilt = _tilt(rng.uniform(*config.lidar_tilts), rng.uniform(-np.pi, np.pi))
        variation = variation._replace(tilt=tilt)
    if config.max_hidden_directions:
        variation = variation._replace(hidden=int(rng.integers(config.max_hidden_directions + 1)))
    if config.grass[1] > 0 or config.litter[1] > 0:
        grass, litter = rng.uniform(*config.grass), rng.uniform(*config.litter)
        grass, litter = grass * (rng.random() < share), litter * (rng.random() < share)
        variation = variation._replace(grass=grass, litter=litter)
    if config.undulation[1] > 0:
        undulation = rng.uniform(*config.undulation) * (rng.random() < share)
        tufted, verge = rng.random(2) < 0.5
        variation = variation._replace(
            undulation=undulation, tufted=bool(tufted), verge=bool(verge)
        ).limited(config.max_cover)
    return robot, variation


def _draw_wheels(config: CloudsConfig, rng: np.random.Generator) -> WheelSpeeds:
    """Return the wheel speeds of a drive: standing, or a curve at the robot's speed."""
    speed = 0.0 if rng.random() < config.standstill_share else config.robot.speed
    steering = rng.uniform(-1, 1) * config.robot.max_steering if speed else 0.0
    return SkidSteer(config.robot).wheel_speeds(speed, steering)


def _begin(
    simulator: Simulator, start: Start, localizers: Sequence[NoisyGroundTruthLocalizer]
) -> SensorReadings:
    """Put the robot down, reset localizers to its true pose, and return the first readings.

    Raises:
        ValueError: If the readings have no true state.
    """
    readings = simulator.reset(start)
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    for localizer in localizers:
        localizer.reset(readings.truth.pose, readings.stamp)
    return readings


def _drive(
    simulator: Simulator,
    wheels: WheelSpeeds,
    readings: SensorReadings,
    duration: float,
    localizers: Sequence[NoisyGroundTruthLocalizer],
    rng: np.random.Generator,
) -> None:
    """Drive until a time, or to a collision and stand there, and let localizers follow.

    Args:
        simulator: Simulator of the robot.
        wheels: Wheel speeds.
        readings: Readings at the start.
        duration: Time at which the drive is over [s].
        localizers: Localizers that estimate where the robot is.
        rng: Source of the localizers' errors.
    """
    periods = []
    while readings.stamp < duration:
        readings = simulator.step(wheels, skip_scan=True)
        if readings.truth is not None and readings.truth.collided:
            wheels = WheelSpeeds(0.0, 0.0)
        periods.append(readings)
    ends = np.array([period.stamp for period in periods])
    tracks = np.array([period.true_track for period in periods])
    # In the order in which localizers that are updated in each period draw.
    draws = rng.standard_normal((len(periods), len(localizers), 5))
    for k, localizer in enumerate(localizers):
        localizer.follow(ends, tracks, draws[:, k])


def _labelled(
    cloud: PointCloud, surveyed: NDArray[np.float32], truth: TraversabilityMap
) -> PointCloud:
    """Return a cloud with the labels of the places that its beams hit in truth.

    Args:
        cloud: Cloud as the robot believes it.
        surveyed: Its points in the map, as they are in truth [m], shape (n, 3).
        truth: True map.

    Raises:
        ValueError: If there are no true classes.
    """
    if cloud.classes is None:
        raise ValueError("classes: expected the simulator's true classes, got none")
    severity = truth.severity_of(surveyed, cloud.classes)
    forbidden = truth.forbidden_under(surveyed)
    return replace(cloud, severity=severity, nontraversable=severity > 0, forbidden=forbidden)


def _slopes_under(
    places: NDArray[np.float32], ground: Heightfield, yaw: float
) -> NDArray[np.float64]:
    """Return the rise of the ground under map places along the robot's x and y, shape (n, 2)."""
    x, y = places[:, 0].astype(np.float64), places[:, 1].astype(np.float64)
    east, north = (
        (ground.height_at(x + dx, y + dy) - ground.height_at(x - dx, y - dy)) / (2 * _SLOPE_REACH)
        for dx, dy in ((_SLOPE_REACH, 0.0), (0.0, _SLOPE_REACH))
    )
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack([c * east + s * north, c * north - s * east])


def _tilt(angle: float, direction: float) -> Rotation:
    """Return the rotation of a laser that leans by ``angle`` [rad] towards a bearing [rad]."""
    return Rotation.from_rotvec([-angle * np.sin(direction), angle * np.cos(direction), 0.0])


def _seen_from(pose: Pose, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a place of the pose's frame in the levelled frame of the pose [m], shape (3,)."""
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    x, y, z = place - pose.position
    return np.array([c * x + s * y, c * y - s * x, z])


# The beams' true places: labels come from them, whatever the robot believes.
_SURVEYED = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)


def _random_start(scene: Scene, config: CloudsConfig, rng: np.random.Generator) -> Start:
    """Return a place on traversable ground that has something near it.

    Raises:
        ValueError: If none is found.
    """
    ground, truth = scene.world.ground, scene.world.truth
    half_x, half_y = ground.width / 2 - 5.0, ground.depth / 2 - 5.0
    least, most = config.min_hazard_distance, config.max_hazard_distance
    if rng.random() < config.close_share:
        most = min(config.max_close_distance, most)
    for _ in range(10_000):
        x, y = rng.uniform(-half_x, half_x), rng.uniform(-half_y, half_y)
        if least <= float(truth.clearance_at(x, y)) <= most:
            return Start(x, y, rng.uniform(-np.pi, np.pi))
    raise ValueError(
        f"min_hazard_distance, max_hazard_distance: expected a place {least} to "
        f"{config.max_hazard_distance} m from forbidden ground in "
        f"{scene.world.name} {scene.world.seed}, got none; widen the two"
    )
