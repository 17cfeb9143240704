"""Measures a body in a plant: turning, climbing, sliding, steps, tipping over."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.bench.table import Row
from andabata.bench.vehicle_ground import ground_drives, ground_table
from andabata.machine.kinematics import SkidSteer
from andabata.machine.plants import Plant, available_plants, default_plant, has_bullet
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import Vehicle, make_vehicle
from andabata.machine.wheels.body import WheelsConfig
from andabata.machine.wheels.vehicle import WheelsVehicle
from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box, frustum
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, World

VehicleMaker = Callable[[World], Vehicle]
"""Function that puts the body into a world."""

RATES = (0.15, 0.2, 0.3, 0.4, 0.5)
"""Commanded yaw rates [rad/s], both ways."""

HEADINGS = (0.0, 0.4, 0.8, 1.2)
"""Headings at which turning starts on flat ground [rad]."""

SLOPES_DEG = (0, 5, 10, 15, 20, 25, 30, 35)
"""Slopes of the ground [deg]."""

_TURN_SLOPE_DEG = 10.0
"""Slope on which turning is measured [deg]."""

_SIZE, _CELL = 30.0, 0.1
"""Edge of the ground and of its cells [m]."""

_RUN_IN, _MEASURED = 100, 200
"""Ticks of 10 ms before a measurement and of it."""


def bench_vehicle(
    robot: RobotModel,
    seed: int,
    step: Callable[[], None] | None = None,
    plant: Plant | None = None,
) -> Row:
    """Return all measurements of a body, ready for JSON.

    Args:
        robot: Body to drive.
        seed: Seed of the kinematic plant's slip, and of the comparison of the plants.
        step: Function that is called after each of the six parts.
        plant: Plant to measure it in; None for ``default_plant()``.
    """
    plant = default_plant() if plant is None else plant
    # They are compared with the reference, where it is.
    others = [name for name in available_plants() if name != "bullet"] if has_bullet() else []

    def make(world: World) -> Vehicle:
        return make_vehicle(plant, world, robot, np.random.default_rng(seed))

    parts: dict[str, Callable[[], Any]] = {
        "turning": lambda: turning(robot, make),
        "slopes": lambda: slopes(robot, make),
        "obstacles": lambda: obstacles(robot, make),
        "tipping": lambda: tipping(robot, _gripping(robot, plant, make)),
        "plants": lambda: [compare_plants(robot, seed, each) for each in others],
        "ground": lambda: ground_drives(robot, seed),
    }
    measurements: Row = {}
    for name, part in parts.items():
        measurements[name] = part()
        if step is not None:
            step()
    return measurements


def vehicle_tables(measurements: Row) -> list[tuple[str, list[Row]]]:
    """Return titles and tables for people.

    Args:
        measurements: Result of ``bench_vehicle``, and names of ``robot`` and ``plant``.
    """
    obstacle_rows = [
        {
            "obstacle": row["obstacle"],
            **{key: row[key] for key in ("size_m", "reached_m", "contact")},
        }
        for row in measurements["obstacles"]
    ]
    return [
        (
            f"{measurements['robot']}, {measurements['plant']}: yaw rate achieved over commanded",
            measurements["turning"],
        ),
        ("slopes", measurements["slopes"]),
        ("10 s towards an obstacle 1.5 m ahead", obstacle_rows),
        ("tipping over", [measurements["tipping"]]),
        ("other plants against bullet", measurements["plants"]),
        ("10 s over ground 1.5 m ahead, in all plants", ground_table(measurements["ground"])),
    ]


def _gripping(robot: RobotModel, plant: Plant, make: VehicleMaker) -> VehicleMaker:
    """Return a maker of the body on tyres that do not slide; the kinematic plant has none."""
    if plant == "bullet":
        from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle

        bullet = BulletConfig(friction=3.0, lateral_friction_ratio=1.0)
        return lambda world: BulletVehicle(world, robot, bullet)
    if plant == "mujoco":
        from andabata.machine.mujoco_model import MujocoConfig
        from andabata.machine.mujoco_vehicle import MujocoVehicle

        mujoco = MujocoConfig(friction=3.0, lateral_friction_ratio=1.0)
        return lambda world: MujocoVehicle(world, robot, mujoco)
    if plant == "wheels":
        wheels = WheelsConfig(friction=3.0, lateral_friction_ratio=1.0)
        return lambda world: WheelsVehicle(world, robot, wheels)
    return make


def turning(robot: RobotModel, make: VehicleMaker) -> list[Row]:
    """Return the ratio of achieved to commanded yaw rate by ground and rate.

    Each row has the mean, the least and the most over headings and both directions of turning.

    Args:
        robot: Body to drive.
        make: Maker of its plant.
    """
    grounds: dict[str, tuple[World, tuple[float, ...]]] = {
        "flat": (flat_world(), HEADINGS),
        "rough": (_rough(), HEADINGS),
        "up": (_slope(_TURN_SLOPE_DEG), (0.0,)),
        "down": (_slope(_TURN_SLOPE_DEG), (np.pi,)),
        "across": (_slope(_TURN_SLOPE_DEG), (np.pi / 2, -np.pi / 2)),
    }
    rows: list[Row] = []
    for ground, (world, headings) in grounds.items():
        vehicle = make(world)
        for rate in RATES:
            ratios = [
                measured_yaw_rate(vehicle, robot, side * rate, heading) / (side * rate)
                for heading in headings
                for side in (1, -1)
            ]
            row: Row = {"ground": ground, "rate": rate, "ratio": float(np.mean(ratios))}
            rows.append(row | {"least": min(ratios), "most": max(ratios)})
        vehicle.close()
    return rows


def measured_yaw_rate(vehicle: Vehicle, robot: RobotModel, rate: float, heading: float) -> float:
    """Return the mean yaw rate over two seconds, after a run-in of one second [rad/s].

    Args:
        vehicle: Plant, which is placed at the origin first.
        robot: Body, whose speed it drives with.
        rate: Commanded yaw rate [rad/s].
        heading: Initial heading [rad].
    """
    vehicle.place(Start(0.0, 0.0, heading))
    wheels = SkidSteer(robot).wheel_speeds(robot.speed, rate)
    vehicle.drive(wheels, _RUN_IN)
    before = vehicle.state.pose.yaw
    vehicle.drive(wheels, _MEASURED)
    return wrap(vehicle.state.pose.yaw - before) / 2.0


def slopes(robot: RobotModel, make: VehicleMaker) -> list[Row]:
    """Return climbing speed along the slope and sideways slip, straight and while turning.

    Args:
        robot: Body to drive.
        make: Maker of its plant.
    """
    rows: list[Row] = []
    for angle in SLOPES_DEG:
        vehicle = make(_slope(angle))
        climb = _drive(vehicle, robot, Start(0.0, 0.0, 0.0), 0.0)
        across = _drive(vehicle, robot, Start(0.0, 0.0, np.pi / 2), 0.0)
        slips = []
        for side in (1, -1):
            turned = _drive(vehicle, robot, Start(0.0, 0.0, np.pi / 2 - 0.4 * side), 0.4 * side)
            slips.append(_sideways(turned))
        vehicle.close()
        level = np.cos(np.deg2rad(angle))
        rows.append(
            {
                "slope_deg": angle,
                "climb_m_s": float((climb[-1, 0] - climb[99, 0]) / 2 / level),
                "slip_m_s": float(abs(_sideways(across))),
                "slip_turning_m_s": float(np.mean(np.abs(slips))),
            }
        )
    return rows


@dataclass(frozen=True)
class _Obstacle:
    """Obstacle across the body's way.

    Attributes:
        name: Kind of obstacle.
        size: Height, or radius of a trunk [m].
        object_: Object; None for a step of the ground itself.
    """

    name: str
    size: float
    object_: SceneObject | None

    def world(self) -> World:
        """Return flat ground with the obstacle 1.5 m ahead of the origin."""
        if self.object_ is not None:
            return flat_world((self.object_,))
        return _world(lambda x, y: np.where(x > 1.5, self.size, 0.0))


def _obstacles() -> list[_Obstacle]:
    """Return steps, stones under one wheel, and trunks."""
    obstacles = [_Obstacle("step", height, None) for height in (0.02, 0.03, 0.05, 0.08, 0.12)]
    for height in (0.03, 0.06, 0.09, 0.15):
        stone = box(SemanticClass.ROCK, (1.5, 0.23, 0.0), (0.3, 0.3, 2 * height))
        obstacles.append(_Obstacle("stone", height, stone))
    for radius in (0.05, 0.15):
        trunk = frustum(SemanticClass.TRUNK, (1.5, 0.1, 0.0), (radius, radius), 3.0)
        obstacles.append(_Obstacle("trunk", radius, trunk))
    return obstacles


def obstacles(robot: RobotModel, make: VehicleMaker) -> list[Row]:
    """Return how far the body drives in 10 s towards obstacles 1.5 m ahead, and if it touches.

    Args:
        robot: Body to drive.
        make: Maker of its plant.
    """
    rows: list[Row] = []
    for obstacle in _obstacles():
        vehicle = make(obstacle.world())
        vehicle.place(Start(0.0, 0.0, 0.0))
        touched = False
        for _ in range(100):
            vehicle.drive(SkidSteer(robot).wheel_speeds(robot.speed, 0.0), 10)
            touched |= vehicle.state.collided
        reached = float(vehicle.state.pose.position[0])
        vehicle.close()
        rows.append(
            {
                "obstacle": obstacle.name,
                "size_m": obstacle.size,
                "reached_m": reached,
                "contact": touched,
            }
        )
    return rows


def tipping(robot: RobotModel, make: VehicleMaker) -> Row:
    """Return the cross slope at which the body tips over if friction holds it [deg].

    ``geometry_deg`` is that of a rigid body with its track and centre of mass.

    Args:
        robot: Body to drive.
        make: Maker of its plant, on tyres that do not slide.
    """
    limit = float("nan")
    for angle in range(20, 66):
        vehicle = make(_slope(float(angle)))
        vehicle.place(Start(0.0, 0.0, np.pi / 2))
        vehicle.drive(WheelSpeeds(0.0, 0.0), 300)
        tipped = vehicle.state.tipped
        vehicle.close()
        if tipped:
            limit = float(angle)
            break
    ideal = np.rad2deg(np.arctan(robot.track / 2 / robot.centre_of_mass))
    return {"tips_over_deg": limit, "geometry_deg": float(ideal)}


def compare_plants(robot: RobotModel, seed: int, plant: Plant) -> Row:
    """Return how another plant differs from the reference under the same commands.

    Both drive 12 times for 10 s on the same rough ground. ``roll_rms_deg`` and ``pitch_rms_deg``
    compare their attitudes at the same places, ``yaw_rate_distance`` is the Kolmogorov-Smirnov
    distance of their yaw rates, and ``apart_after_10_s_m`` the median distance of their ends.

    Args:
        robot: Body to drive.
        seed: Seed of starts, commands and noise.
        plant: Name of the other plant.

    Raises:
        PlantError: If pybullet is not installed.
    """
    world, rng = _rough(), np.random.default_rng(seed)
    reference = make_vehicle("bullet", world, robot, rng)
    fast = make_vehicle(plant, world, robot, rng)
    tilts: list[NDArray[np.float64]] = []
    rates: tuple[list[NDArray[np.float64]], ...] = ([], [])
    apart: list[float] = []
    for _ in range(12):
        x, y, yaw = rng.uniform(-1, 1, 3) * [5.0, 5.0, np.pi]
        start = Start(float(x), float(y), float(yaw))
        steering = rng.uniform(-robot.max_steering, robot.max_steering, 5)
        paths = []
        pair: tuple[Vehicle, ...] = (reference, fast)
        for vehicle, changes in zip(pair, rates, strict=True):
            rows = _drive_commands(vehicle, robot, start, steering)
            yaw = np.unwrap(Rotation.from_quat(rows[:, 3:7]).as_euler("ZYX")[:, 0])
            changes.append(np.diff(yaw[::10]) / 0.1)
            paths.append(rows)
        apart.append(float(np.hypot(*(paths[0][-1, :2] - paths[1][-1, :2]))))
        tilts += [_tilt_difference(fast, row) for row in paths[0][::50]]
    reference.close()
    pitch, roll = np.rad2deg(np.sqrt(np.mean(np.square(tilts), axis=0)))
    return {
        "plant": plant,
        "roll_rms_deg": float(roll),
        "pitch_rms_deg": float(pitch),
        "yaw_rate_distance": distribution_distance(*(np.concatenate(changes) for changes in rates)),
        "apart_after_10_s_m": float(np.median(apart)),
    }


def distribution_distance(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the Kolmogorov-Smirnov distance of two samples, from 0 to 1."""
    one, other = np.sort(one), np.sort(other)
    both = np.concatenate([one, other])
    below = [np.searchsorted(each, both, side="right") / len(each) for each in (one, other)]
    return float(np.abs(below[0] - below[1]).max())


def _drive_commands(
    vehicle: Vehicle, robot: RobotModel, start: Start, steering: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the states of a drive with each yaw rate [rad/s] for two seconds."""
    vehicle.place(start)
    kinematics = SkidSteer(robot)
    return np.concatenate(
        [vehicle.drive(kinematics.wheel_speeds(robot.speed, rate), 200) for rate in steering]
    )


def _tilt_difference(vehicle: Vehicle, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the difference of pitch and roll [rad] when a vehicle is placed where a state is.

    Args:
        vehicle: Plant that is placed there.
        state: Row of the other plant: position [m] and quaternion first.
    """
    heading = float(Rotation.from_quat(state[3:7]).as_euler("ZYX")[0])
    vehicle.place(Start(state[0], state[1], heading))
    there = vehicle.drive(WheelSpeeds(0.0, 0.0), 1)[-1]
    one, other = (Rotation.from_quat(row[3:7]).as_euler("ZYX")[1:] for row in (state, there))
    return one - other


def _drive(vehicle: Vehicle, robot: RobotModel, start: Start, rate: float) -> NDArray[np.float64]:
    """Return the states of three seconds of driving from a start."""
    vehicle.place(start)
    return vehicle.drive(SkidSteer(robot).wheel_speeds(robot.speed, rate), 300)


def _sideways(rows: NDArray[np.float64]) -> float:
    """Return the mean speed to the left over the last two seconds [m/s]."""
    moved = np.diff(rows[99:, :3], axis=0)
    return float(Rotation.from_quat(rows[100:, 3:7]).inv().apply(moved)[:, 1].sum() / 2.0)


def flat_world(objects: tuple[SceneObject, ...] = ()) -> World:
    """Return flat ground with objects on it."""
    return _world(objects=objects)


def _world(
    height: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]] | None = None,
    objects: tuple[SceneObject, ...] = (),
) -> World:
    """Return a square of ground with a height function [m], flat if there is none."""
    n = round(_SIZE / _CELL) + 1
    lines = (np.arange(n) - (n - 1) / 2) * _CELL
    x, y = np.meshgrid(lines, lines, indexing="ij")
    heights = np.zeros_like(x) if height is None else height(x, y)
    ground = Heightfield(heights.astype(np.float32), _CELL)
    truth = build_truth(ground, objects, TruthConfig())
    surface = np.zeros((n - 1, n - 1), dtype=np.uint8)
    return World("bench", 0, 0.0, ground, surface, objects, (), truth)


def _slope(angle_deg: float) -> World:
    """Return a plane that rises along x."""
    return _world(lambda x, y: np.tan(np.deg2rad(angle_deg)) * x)


def _rough() -> World:
    """Return ground with undulations of a quarter of a metre."""
    n = round(_SIZE / _CELL) + 1
    heights = 0.25 * smooth_noise((n, n), _CELL, 4.0, np.random.default_rng(4))
    return _world(lambda x, y: heights)
