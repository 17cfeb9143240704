"""Measures what the physics step of the reference plant costs and buys: why it steps at 200 Hz.

``python -m andabata.bench.studies.vehicle_rates`` prints a Markdown table. ``andabata bench
vehicle`` has turning and slopes at the rate that is used.
"""

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np

from andabata.bench.table import Row, markdown_table
from andabata.bench.vehicle import HEADINGS, flat_world, measured_yaw_rate
from andabata.machine.bullet_vehicle import BulletConfig, BulletVehicle
from andabata.machine.robot import RobotModel

STEPS = (0.01, 0.005, 0.0025, 0.00125)
"""Physics steps [s]."""

RATES = (0.15, 0.3, 0.5, -0.5, -0.3, -0.15)
"""Commanded yaw rates [rad/s]."""

_PERIODS = 35
"""Control periods of 0.1 s of one turn: placing and settling (0.5 s), run-in (1 s), turn (2 s)."""


def time_steps(robot: RobotModel) -> list[Row]:
    """Return achieved over commanded yaw rate, and the cost of a control period, by physics step.

    Args:
        robot: Body to drive.
    """
    rows: list[Row] = []
    for step in STEPS:
        vehicle = BulletVehicle(flat_world(), robot, BulletConfig(step=step))
        began = time.perf_counter()
        ratios = [
            measured_yaw_rate(vehicle, robot, rate, heading) / rate
            for rate in RATES
            for heading in HEADINGS
        ]
        cost = (time.perf_counter() - began) / len(ratios) / _PERIODS
        vehicle.close()
        rows.append(
            {
                "physics step [ms]": 1e3 * step,
                "mean turn ratio": float(np.mean(ratios)),
                "lowest": min(ratios),
                "highest": max(ratios),
                "ms per 0.1 s": 1e3 * cost,
            }
        )
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="andabata", help="andabata, husky or jackal.")
    options = parser.parse_args(argv)
    sys.stdout.write(markdown_table(time_steps(RobotModel.load(options.robot))))


if __name__ == "__main__":
    main()
