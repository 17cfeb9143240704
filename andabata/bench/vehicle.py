"""What a body does in the reference plant: turning, climbing, sliding, steps, tipping over."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle
from andabata.machine.kinematic_vehicle import KinematicVehicle
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import Vehicle
from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box, frustum
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, World

RATES = (0.15, 0.2, 0.3, 0.4, 0.5)
"""Commanded yaw rates [rad/s], both ways."""

_HEADINGS = (0.0, 0.4, 0.8, 1.2)
_TURN_SLOPE, _SIZE, _CELL = 10.0, 30.0, 0.1

Row = dict[str, Any]


def turning(robot: RobotModel) -> list[Row]:
    """Return achieved over commanded yaw rate, by rate and ground, over four headings."""
    grounds: dict[str, tuple[World, tuple[float, ...]]] = {
        "flat": (_world(), _HEADINGS),
        "rough": (_rough(), _HEADINGS),
        "up": (_slope(_TURN_SLOPE), (0.0,)),
        "down": (_slope(_TURN_SLOPE), (np.pi,)),
        "across": (_slope(_TURN_SLOPE), (np.pi / 2, -np.pi / 2)),
    }
    rows: list[Row] = []
    for ground, (world, headings) in grounds.items():
        vehicle = BulletVehicle(world, robot)
        for rate in RATES:
            ratios = [
                _turn(vehicle, robot, side * rate, heading) / (side * rate)
                for heading in headings
                for side in (1, -1)
            ]
            row: Row = {"ground": ground, "rate": rate, "ratio": float(np.mean(ratios))}
            rows.append(row | {"least": min(ratios), "most": max(ratios)})
        vehicle.close()
    return rows


def _turn(vehicle: Vehicle, robot: RobotModel, rate: float, heading: float) -> float:
    """Return the yaw rate over two seconds, after one of running in [rad/s]."""
    vehicle.place(Start(0.0, 0.0, heading))
    wheels = SkidSteer(robot).wheel_speeds(robot.speed, rate)
    vehicle.drive(wheels, 100)
    before = vehicle.state.pose.yaw
    vehicle.drive(wheels, 200)
    return wrap(vehicle.state.pose.yaw - before) / 2.0


def slopes(robot: RobotModel) -> list[Row]:
    """Return climbing speed and sideways slip by slope, straight and while turning."""
    rows: list[Row] = []
    for angle in (0, 5, 10, 15, 20, 25, 30, 35):
        vehicle = BulletVehicle(_slope(angle), robot)
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


def obstacles(robot: RobotModel) -> list[Row]:
    """Return how far the body gets past steps, stones and trunks that lie across its way."""
    things: list[tuple[str, float, SceneObject | float]] = [
        ("step", height, height) for height in (0.02, 0.03, 0.05, 0.08, 0.12)
    ]
    for height in (0.03, 0.06, 0.09, 0.15):
        stone = box(SemanticClass.ROCK, (1.5, 0.23, 0.0), (0.3, 0.3, 2 * height))
        things.append(("stone", height, stone))
    for radius in (0.05, 0.15):
        trunk = frustum(SemanticClass.TRUNK, (1.5, 0.1, 0.0), (radius, radius), 3.0)
        things.append(("trunk", radius, trunk))
    rows: list[Row] = []
    for name, size, thing in things:
        if isinstance(thing, float):
            rise = thing
            world = _world(lambda x, y, rise=rise: rise * (x > 1.5))  # type: ignore[misc]
        else:
            world = _world(objects=(thing,))
        vehicle = BulletVehicle(world, robot)
        vehicle.place(Start(0.0, 0.0, 0.0))
        touched = False
        for _ in range(100):
            vehicle.drive(SkidSteer(robot).wheel_speeds(robot.speed, 0.0), 10)
            touched |= vehicle.state.collided
        reached = float(vehicle.state.pose.position[0])
        vehicle.close()
        rows.append({"thing": name, "size_m": size, "reached_m": reached, "contact": touched})
    return rows


def tipping(robot: RobotModel) -> Row:
    """Return the cross slope at which the body rolls over where friction holds it [deg]."""
    config = BulletConfig(friction=3.0, lateral_friction_ratio=1.0)
    limit = float("nan")
    for angle in range(20, 66):
        vehicle = BulletVehicle(_slope(float(angle)), robot, config)
        vehicle.place(Start(0.0, 0.0, np.pi / 2))
        vehicle.drive(WheelSpeeds(0.0, 0.0), 300)
        tipped = vehicle.state.tipped
        vehicle.close()
        if tipped:
            limit = float(angle)
            break
    ideal = np.rad2deg(np.arctan(robot.track / 2 / robot.centre_of_mass))
    return {"tips_over_deg": limit, "geometry_deg": float(ideal)}


def plants(robot: RobotModel, seed: int) -> Row:
    """Return how the two plants differ on the same rough ground under the same commands."""
    world, rng = _rough(), np.random.default_rng(seed)
    reference, fast = BulletVehicle(world, robot), KinematicVehicle(world, robot, rng)
    tilts: list[NDArray[np.float64]] = []
    rates: tuple[list[NDArray[np.float64]], ...] = ([], [])
    apart: list[float] = []
    for _ in range(12):
        x, y, yaw = rng.uniform(-1, 1, 3) * [5.0, 5.0, np.pi]
        start = Start(float(x), float(y), float(yaw))
        steering = rng.uniform(-robot.max_steering, robot.max_steering, 5)
        paths = []
        pair: tuple[Vehicle, ...] = (reference, fast)
        for vehicle, found in zip(pair, rates, strict=True):
            vehicle.place(start)
            rows = np.concatenate(
                [
                    vehicle.drive(SkidSteer(robot).wheel_speeds(robot.speed, rate), 200)
                    for rate in steering
                ]
            )
            yaw = np.unwrap(Rotation.from_quat(rows[:, 3:7]).as_euler("ZYX")[:, 0])
            found.append(np.diff(yaw[::10]) / 0.1)
            paths.append(rows)
        apart.append(float(np.hypot(*(paths[0][-1, :2] - paths[1][-1, :2]))))
        for row in paths[0][::50]:  # The reference's places, as the fast plant stands there.
            heading = float(Rotation.from_quat(row[3:7]).as_euler("ZYX")[0])
            fast.place(Start(row[0], row[1], heading))
            there = fast.drive(WheelSpeeds(0.0, 0.0), 1)[-1]
            tilt = [Rotation.from_quat(r[3:7]).as_euler("ZYX")[1:] for r in (row, there)]
            tilts.append(tilt[0] - tilt[1])
    reference.close()
    ours, theirs = (np.sort(np.concatenate(found)) for found in rates)
    grid = np.concatenate([ours, theirs])
    distance = np.abs(
        np.searchsorted(ours, grid, side="right") / len(ours)
        - np.searchsorted(theirs, grid, side="right") / len(theirs)
    ).max()
    pitch, roll = np.rad2deg(np.sqrt(np.mean(np.square(tilts), axis=0)))
    return {
        "roll_rms_deg": float(roll),
        "pitch_rms_deg": float(pitch),
        "yaw_rate_distance": float(distance),
        "apart_after_10_s_m": float(np.median(apart)),
    }


def _drive(vehicle: Vehicle, robot: RobotModel, start: Start, rate: float) -> NDArray[np.float64]:
    """Return three seconds of driving from a start."""
    vehicle.place(start)
    return vehicle.drive(SkidSteer(robot).wheel_speeds(robot.speed, rate), 300)


def _sideways(rows: NDArray[np.float64]) -> float:
    """Return the mean speed to the left over the last two seconds [m/s]."""
    moved = np.diff(rows[99:, :3], axis=0)
    return float(Rotation.from_quat(rows[100:, 3:7]).inv().apply(moved)[:, 1].sum() / 2.0)


def _world(
    height: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]] | None = None,
    objects: tuple[SceneObject, ...] = (),
) -> World:
    """Return a square of one height function, flat without."""
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
    """Return bumps of a quarter of a metre."""
    n = round(_SIZE / _CELL) + 1
    bumps = 0.25 * smooth_noise((n, n), _CELL, 4.0, np.random.default_rng(4))
    return _world(lambda x, y: bumps)
