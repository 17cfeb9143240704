"""Physics rate, turning, climbing, sliding: why the bullet plant steps at 200 Hz.

Run with ``python tests/benchmarks/bench_vehicle.py``; prints Markdown tables.
"""

import sys
import time
from typing import TextIO

import numpy as np

from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from terrain.heightfield import Heightfield
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, World

ROBOT = RobotModel()
KINEMATICS = SkidSteer(ROBOT)
RATES = (0.15, 0.3, 0.5, -0.5, -0.3, -0.15)
HEADINGS = (0.0, 0.4, 0.8, 1.2)


def world_of(slope_deg: float) -> World:
    """Return a plane of 40 m that rises along x."""
    x = np.linspace(-20, 20, 201)
    heights = np.repeat((np.tan(np.deg2rad(slope_deg)) * x)[:, None], 201, axis=1)
    ground = Heightfield(heights.astype(np.float32), 0.2)
    truth = build_truth(ground, (), TruthConfig())
    return World("slope", 0, 0.0, ground, np.zeros((200, 200), np.uint8), (), (), truth)


def turn_ratio(vehicle: BulletVehicle, rate: float, heading: float) -> float:
    """Return the achieved yaw rate over the commanded one."""
    vehicle.place(Start(0.0, 0.0, heading))
    vehicle.drive(KINEMATICS.wheel_speeds(0.3, rate), 100)
    before = vehicle.state.pose.yaw
    vehicle.drive(KINEMATICS.wheel_speeds(0.3, rate), 200)
    return wrap(vehicle.state.pose.yaw - before) / 2.0 / rate


def _head(out: TextIO, *names: str) -> None:
    """Write a table's head."""
    out.write(f"\n| {' | '.join(names)} |\n|{'---|' * len(names)}\n")


def main() -> None:
    """Print the tables."""
    out = sys.stdout
    _head(out, "physics step [ms]", "mean turn ratio", "lowest", "highest", "ms per 0.1 s")
    flat = world_of(0.0)
    for step in (0.01, 0.005, 0.0025, 0.00125):
        vehicle = BulletVehicle(flat, ROBOT, BulletConfig(step=step))
        began = time.perf_counter()
        ratios = [turn_ratio(vehicle, rate, heading) for rate in RATES for heading in HEADINGS]
        cost = (time.perf_counter() - began) / len(ratios) / 35 * 1e3
        vehicle.close()
        row = (1e3 * step, np.mean(ratios), min(ratios), max(ratios), cost)
        out.write("| " + " | ".join(f"{value:.3g}" for value in row) + " |\n")
    _head(out, "commanded [rad/s]", "mean turn ratio over four headings")
    vehicle = BulletVehicle(flat, ROBOT)
    for rate in RATES:
        ratios = [turn_ratio(vehicle, rate, heading) for heading in HEADINGS]
        out.write(f"| {rate} | {np.mean(ratios):.3f} |\n")
    vehicle.close()
    _head(out, "slope [deg]", "climb [m/s along it]", "slip on a cross slope [m/s]")
    for angle in (0, 10, 20, 25, 30, 35):
        vehicle = BulletVehicle(world_of(angle), ROBOT)
        vehicle.place(Start(0.0, 0.0, 0.0))
        rows = vehicle.drive(KINEMATICS.wheel_speeds(0.3, 0.0), 300)
        climb = (rows[-1, 0] - rows[99, 0]) / 2.0 / np.cos(np.deg2rad(angle))
        vehicle.place(Start(0.0, 0.0, np.pi / 2))
        rows = vehicle.drive(KINEMATICS.wheel_speeds(0.3, 0.0), 300)
        out.write(f"| {angle} | {climb:.3f} | {-(rows[-1, 0] - rows[99, 0]) / 2.0:.3f} |\n")
        vehicle.close()


if __name__ == "__main__":
    main()
