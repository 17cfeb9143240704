"""Synthetic labelled clouds: a robot drives a little, its laser sees, the truth labels."""

from dataclasses import replace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.localization.localizer import NoisyTruthConfig, NoisyTruthLocalizer
from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.machine.senses import WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.tasks.scenes import Scene
from traversability.cloud import PointCloud
from worlds.world import Start


class CloudsConfig(BaseModel):
    """How labelled clouds are made.

    Attributes:
        presets: World presets, taken in turn.
        robot: The body.
        sensing: The rotating laser.
        assembly: How sweeps become clouds.
        room: Clouds are taken where the nearest forbidden ground is this far at least [m].
        reach: And this far at most, so that there is something to see [m].
        carry_time: After the cloud is complete the robot drives on for up to this long and the
            cloud is carried along, as it is between two clouds [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    presets: tuple[str, ...] = ("natural",)
    robot: RobotModel = Field(default_factory=RobotModel)
    sensing: SensingConfig = Field(default_factory=SensingConfig)
    assembly: CloudAssemblyConfig = Field(default_factory=CloudAssemblyConfig)
    room: float = Field(default=0.5, ge=0)
    reach: float = Field(default=4.0, gt=0)
    carry_time: float = Field(default=3.3, ge=0)


# Labels come from the points' places on the true map, so the pose must not wander over it; the
# inclinometers' error stays, since it bends every cloud on the robot too.
_SURVEYED = NoisyTruthConfig(position_sigma=0.0, yaw_sigma=0.0)


def labelled_cloud(scene: Scene, config: CloudsConfig, rng: np.random.Generator) -> PointCloud:
    """Drive from a random place until a cloud is complete, carry it on, and label its points.

    Args:
        scene: Where to drive.
        config: How.
        rng: Place, heading, steering and every noise.

    Returns:
        The cloud in ``base_footprint`` with stamps, classes and ``nontraversable``.
    """
    simulator = Simulator(scene.world, scene.rays, config.robot, "kinematic", config.sensing, rng)
    localizer = NoisyTruthLocalizer(_SURVEYED, rng)
    assembler = CloudAssembler(config.assembly, config.robot.lidar_height)
    wheels = SkidSteer(config.robot).wheel_speeds(
        config.robot.speed, rng.uniform(-1, 1) * config.robot.max_steering
    )
    senses = simulator.reset(_random_start(scene, config, rng))
    if senses.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    localizer.reset(senses.truth.pose, senses.stamp)
    remaining = int(rng.uniform(0, config.carry_time) / 0.1)
    while assembler.cloud is None or remaining > 0:
        if assembler.cloud is not None:
            remaining -= 1
        senses = simulator.step(wheels)
        if senses.truth is not None and senses.truth.collided:
            wheels = WheelSpeeds(0.0, 0.0)
        localizer.update(senses)
        if senses.sweeps is not None:
            assembler.add(senses.sweeps, localizer.track)
    simulator.close()
    in_map = assembler.cloud
    if in_map.classes is None:
        raise ValueError("classes: expected the simulator's true classes, got none")
    bad = scene.world.truth.nontraversable(in_map.points, in_map.classes)
    return replace(assembler.relative(localizer.pose), nontraversable=bad)


def _random_start(scene: Scene, config: CloudsConfig, rng: np.random.Generator) -> Start:
    """Return a place on traversable ground that has something near it.

    Raises:
        ValueError: If none is found.
    """
    ground, truth = scene.world.ground, scene.world.truth
    half_x, half_y = ground.width / 2 - 5.0, ground.depth / 2 - 5.0
    for _ in range(10_000):
        x, y = rng.uniform(-half_x, half_x), rng.uniform(-half_y, half_y)
        if config.room <= float(truth.clearance_at(x, y)) <= config.reach:
            return Start(x, y, rng.uniform(-np.pi, np.pi))
    raise ValueError(
        f"room, reach: expected a place {config.room} to {config.reach} m from forbidden ground in "
        f"{scene.world.name} {scene.world.seed}, got none; widen the two"
    )
