"""Synthetic labelled clouds: a robot drives a little, its laser sees, the truth labels."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator
from scipy.spatial.transform import Rotation

from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from terrain.classes import SemanticClass
from traversability.cloud import PointCloud
from worlds.catalogue import make_world, patch
from worlds.rays import RayScene
from worlds.scenes import Scene
from worlds.world import Start

Span = tuple[float, float]


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
        still: Share of clouds that are taken at a standstill.
        varied: Share of clouds that another robot might have taken: its laser mounted at another
            height and tilted, with fewer points, and parts of its view hidden. A classifier that
            learns from them depends on none of these.
        heights: Span of the optical centre's height in varied clouds [m].
        tilts: Span of the laser's tilt in varied clouds [rad], towards any side.
        kept: Span of the share of points kept in varied clouds.
        hidden: Largest number of directions in which part of the view of a varied cloud is hidden,
            as by parts of the robot or by ground too dark to return a beam.
        grass: Span of the height of low grass in half of the varied clouds [m]. It stops some of
            the beams above the ground, which stays drivable (assumption: to 15 cm; what is higher
            is an object of the world, high grass).
        litter: Span of the height of leaf litter and tufts in half of the varied clouds, root mean
            square [m].
        room: Least distance of the nearest forbidden ground [m].
        reach: Largest distance of the nearest forbidden ground, so that there is something to see
            [m].
        close: Share of the clouds that are taken closer than ``close_reach``, where misses count.
        close_reach: Largest distance of the nearest forbidden ground for close clouds [m].
        carry_time: Longest time for which the robot drives on and carries the complete cloud
            along, as it does between two clouds [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    presets: tuple[str, ...] = ("forest", "hill", "lake", "park", "natural", "hollow", "maze")
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
    still: float = Field(default=0.25, ge=0, le=1)
    varied: float = Field(default=0.0, ge=0, le=1)
    heights: Span = (0.45, 1.0)
    tilts: Span = (0.0, 0.0)
    kept: Span = (0.25, 1.0)
    hidden: int = Field(default=0, ge=0, le=64)
    grass: Span = (0.0, 0.0)
    litter: Span = (0.0, 0.0)
    room: float = Field(default=0.3, ge=0)
    reach: float = Field(default=4.0, gt=0)
    close: float = Field(default=0.4, ge=0, le=1)
    close_reach: float = Field(default=1.2, gt=0)
    carry_time: float = Field(default=3.3, ge=0)

    @field_validator(
        *("difficulty", "noise", "dropout", "tilt_sigma", "drift_sigma", "tilts", "kept"),
        *("grass", "litter"),
    )
    @classmethod
    def _check_span(cls, span: Span) -> Span:
        if not 0 <= span[0] <= span[1] <= 1:
            raise ValueError(f"expected 0 <= least <= most <= 1, got {span}")
        return span

    @field_validator("heights")
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
    return Scene(world, RayScene(world))


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
    noise, dropout = rng.uniform(*config.noise), rng.uniform(*config.dropout)
    lidar = config.sensing.lidar.model_copy(update={"noise": noise, "dropout": dropout})
    sensing = config.sensing.model_copy(update={"lidar": lidar, "proprioception": None})
    believed = NoisyGroundTruthConfig(
        position_sigma=rng.uniform(*config.drift_sigma),
        yaw_sigma=0.2 * rng.uniform(*config.drift_sigma),
        tilt_sigma=rng.uniform(*config.tilt_sigma),
    )
    robot, kept, hidden, tilt, cover = config.robot, 1.0, 0, None, (0.0, 0.0)
    if rng.random() < config.varied:
        robot = robot.model_copy(update={"lidar_height": rng.uniform(*config.heights)})
        kept = rng.uniform(*config.kept)
        if config.tilts[1] > 0:
            tilt = _tilt(rng.uniform(*config.tilts), rng.uniform(-np.pi, np.pi))
        if config.hidden:
            hidden = int(rng.integers(config.hidden + 1))
        if config.grass[1] > 0 or config.litter[1] > 0:
            grass, litter = rng.uniform(*config.grass), rng.uniform(*config.litter)
            cover = (grass * (rng.random() < 0.5), litter * (rng.random() < 0.5))
    simulator = Simulator(
        scene.world, scene.rays, robot, "kinematic", sensing, rng, config.assembly.sight
    )
    localizers = [NoisyGroundTruthLocalizer(sigma, rng) for sigma in (believed, _SURVEYED)]
    assemblers = [CloudAssembler(config.assembly, robot.lidar_height) for _ in localizers]
    speed = 0.0 if rng.random() < config.still else config.robot.speed
    steering = rng.uniform(-1, 1) * config.robot.max_steering if speed else 0.0
    wheels = SkidSteer(config.robot).wheel_speeds(speed, steering)
    readings = simulator.reset(start or _random_start(scene, config, rng))
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    for localizer in localizers:
        localizer.reset(readings.truth.pose, readings.stamp)
    half_turn = config.assembly.turn / lidar.head_rate
    carried = rng.uniform(0, config.carry_time)
    periods = []
    while readings.stamp < half_turn + 2 / lidar.sweep_hz + carried:
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
    # One sweep more ends the half turn.
    sweeps = simulator.sweeps(0.0, half_turn + 1 / lidar.sweep_hz, tilt)
    for localizer, assembler in zip(localizers, assemblers, strict=True):
        track = localizer.track
        assembler.add(sweeps, track if tilt is None else track.rotated(tilt))
    simulator.close()
    surveyed = assemblers[1].cloud
    if surveyed is None or surveyed.classes is None:
        raise ValueError("classes: expected the simulator's true classes, got none")
    truth = scene.world.truth
    severity = truth.severity_of(surveyed.points, surveyed.classes)
    forbidden = truth.forbidden_under(surveyed.points)
    pose = localizers[0].pose
    cloud = assemblers[0].relative(pose)
    cloud = replace(cloud, severity=severity, nontraversable=severity > 0, forbidden=forbidden)
    if any(cover):
        middle = Pose(*np.split(localizers[0].track.at(np.array([half_turn / 2]))[0], [3]))
        laser = _seen_from(pose, middle.matrix[:3] @ [0.0, 0.0, robot.lidar_height, 1.0])
        bare = np.isin(surveyed.classes, _BARE)
        cloud = replace(cloud, points=_covered(cloud.points, bare, laser, cover, rng))
    seen = np.ones(len(cloud), dtype=np.bool_)
    if kept < 1.0:
        seen &= rng.random(len(cloud)) < kept
    if hidden:
        seen &= ~_hidden(cloud.points, hidden, rng)
    return (cloud if seen.all() else cloud.select(seen)), pose


def _tilt(angle: float, direction: float) -> Rotation:
    """Return the rotation of a laser that leans by ``angle`` [rad] towards a bearing [rad]."""
    return Rotation.from_rotvec([-angle * np.sin(direction), angle * np.cos(direction), 0.0])


_BARE = (SemanticClass.GROUND, SemanticClass.PATH)
"""Classes on which low grass grows and litter lies."""

_WAVES = 60
"""Number of waves that litter is made of."""


def _seen_from(pose: Pose, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a place of the pose's frame in the levelled frame of the pose [m], shape (3,)."""
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    x, y, z = place - pose.position
    return np.array([c * x + s * y, c * y - s * x, z])


def _covered(
    points: NDArray[np.float32],
    bare: NDArray[np.bool_],
    laser: NDArray[np.float64],
    cover: tuple[float, float],
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return the points where their beams end on what covers the ground.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        bare: Which of them lie on ground that can be covered, shape (n,).
        laser: Optical centre in the middle of the cloud's time [m], shape (3,).
        cover: Height of grass, and root mean square of litter [m].
        rng: Share of beams that grass stops, blades and litter.
    """
    grass, litter = cover
    top = np.zeros(len(points))
    if grass > 0:
        stopped = rng.random(len(points)) < rng.uniform(0.1, 0.7)
        top += np.where(stopped, rng.uniform(0, grass, len(points)), 0.0)
    if litter > 0:
        bearing, phase = rng.uniform(0, 2 * np.pi, (2, _WAVES))
        number = 2 * np.pi / rng.uniform(0.3, 1.5, _WAVES)  # Wavelengths of 0.3 to 1.5 m.
        along = points[:, :1] * (number * np.cos(bearing)) + points[:, 1:2] * (
            number * np.sin(bearing)
        )
        top += litter * np.sqrt(2 / _WAVES) * np.cos(along + phase).sum(axis=1)
    below = np.maximum(laser[2] - points[:, 2], 0.1)
    # A blade stops the beam before it reaches the ground: the point moves back along the beam.
    share = np.where(bare, np.clip(top / below, -0.5, 0.5), 0.0)[:, None]
    return (points + share * (laser - points)).astype(np.float32)


_WEDGES = (0.02, 0.25)
"""Span of the width of a direction in which something is hidden [rad]."""


def _hidden(points: NDArray[np.float32], most: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return which points something hides, shape (n,).

    In each direction either a stretch of the ground is hidden or all of it but a stretch.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        most: Number of directions.
        rng: Directions, widths and stretches.
    """
    bearing = np.arctan2(points[:, 1], points[:, 0])
    distance = np.hypot(points[:, 0], points[:, 1])
    hidden = np.zeros(len(points), dtype=np.bool_)
    for _ in range(most):
        middle, width = rng.uniform(-np.pi, np.pi), rng.uniform(*_WEDGES)
        begin = rng.uniform(0.0, 8.0)
        end = begin + rng.exponential(3.0) + 0.3
        wedge = np.abs((bearing - middle + np.pi) % (2 * np.pi) - np.pi) < width / 2
        stretch = (distance >= begin) & (distance < end)
        hidden |= wedge & (stretch if rng.random() < 0.5 else ~stretch)
    return hidden


# The beams' true places: labels come from them, whatever the robot believes.
_SURVEYED = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)


def _random_start(scene: Scene, config: CloudsConfig, rng: np.random.Generator) -> Start:
    """Return a place on traversable ground that has something near it.

    Raises:
        ValueError: If none is found.
    """
    ground, truth = scene.world.ground, scene.world.truth
    half_x, half_y = ground.width / 2 - 5.0, ground.depth / 2 - 5.0
    reach = min(config.close_reach, config.reach) if rng.random() < config.close else config.reach
    for _ in range(10_000):
        x, y = rng.uniform(-half_x, half_x), rng.uniform(-half_y, half_y)
        if config.room <= float(truth.clearance_at(x, y)) <= reach:
            return Start(x, y, rng.uniform(-np.pi, np.pi))
    raise ValueError(
        f"room, reach: expected a place {config.room} to {config.reach} m from forbidden ground in "
        f"{scene.world.name} {scene.world.seed}, got none; widen the two"
    )
