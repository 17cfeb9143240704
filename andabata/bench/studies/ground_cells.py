"""Compares ground cells with the true map along drives, beside the polar cells that they lie in.

``python -m andabata.bench.studies.ground_cells`` drives to one goal in each of some development
worlds, kinematic plant, and prints two Markdown tables. Every ground cell whose measurement is
complete since the decision before is compared where it lies; it is blocked in truth if the true map
forbids a quarter of it. The polar cell's log odds are those of the scan at the same instant, if the
forest classified it. ``--ground-classifier FILE`` classifies the same drives with other trees.

The second table is the planner's map, which accumulates several sweeps of the laser: which ground
cells are obstacles to the planner.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from sklearn.metrics import average_precision_score, roc_auc_score

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.table import Row, markdown_table
from andabata.evaluation.trial import run_trial
from andabata.models import Models, shipped_ground_classifier
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.navigation.planning.ground_layer import GroundLayer
from andabata.navigation.planning.local_planner import LocalPlannerConfig
from andabata.tasks.episode_monitor import TerminationConfig
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures
from worlds.scenes import SceneCache
from worlds.traversability_map import Reason, TraversabilityMap

BANDS = ((0.7, 1.8), (1.8, 3.2), (3.2, 5.0), (5.0, 10.0))
"""Bands of distance of single measurements [m]."""

MAP_BANDS = ((0.7, 2.5), (2.5, 5.0))
"""Bands of distance of the planner's map [m]."""

CONFIG = LocalPlannerConfig()
LETHAL = (
    CONFIG.occupancy.lethal_log_odds / CONFIG.occupancy.max_log_odds * CONFIG.ground.max_log_odds
)
"""Log odds from which a ground cell is an obstacle to the planner."""

EVERY = 5
"""Control steps between two measurements: as often as a robot with a map decides."""

CLEAR = 0.3
"""Clearance from which a free cell counts as clear [m]."""

_CELL = 0.2
"""Edge of a ground cell [m]."""

_DISTANCE, _BLOCKED, _CLEARANCE, _POLAR, _GROUND = range(5)
_MAPPED = 3
"""Columns of the measurements; in the rows of the map the log odds stand in the fourth."""


class GroundCellRecorder:
    """Records what is estimated and what is true of each ground cell of each cloud.

    Attributes:
        measured: Blocks of rows: distance [m], 1 if blocked in truth, true clearance [m], log odds
            of the polar cell, log odds of the ground cell; float64, shape (n, 5) each.
        mapped: Blocks of rows: distance [m], 1 if blocked in truth, true clearance [m], log odds of
            the map; float64, shape (n, 4) each.
    """

    def __init__(self, simulated_robot: SimulatedRobot, classifier: GroundClassifier) -> None:
        """Begin with an empty map.

        Args:
            simulated_robot: Robot that drives.
            classifier: Classifier of the ground cells.

        Raises:
            ValueError: If the robot makes no clouds.
        """
        assembler = assembler_of(simulated_robot.perception)
        if assembler is None:
            raise ValueError("scanner: expected the rotating laser, got the horizontal one")
        self._assembler, self._localizer = assembler, simulated_robot.localizer
        self._truth = simulated_robot.scene.world.truth
        self._grid, self._classifier = simulated_robot.config.grid, classifier
        self._elevation, self._features = ElevationGrid(), GroundFeatures()
        self._map = GroundLayer(CONFIG.occupancy.cells, classifier, CONFIG.ground)
        self._settled = -np.inf
        self._steps = 0
        self.measured: list[NDArray[np.float64]] = []
        self.mapped: list[NDArray[np.float64]] = []

    def __call__(self, result: StepResult) -> None:
        """Record a control step."""
        truth, window = result.readings.truth, self._assembler.window
        self._steps += 1
        if result.scan is None or truth is None or self._steps % EVERY:
            return
        if window.settled <= self._settled:
            return
        points, stamps, newest, span = window.since(self._settled)
        self._settled = window.settled
        odometry, true = self._localizer.odometry, truth.pose
        here, yaw = odometry.position[:2], odometry.yaw
        self._elevation.describe(points, here, stamps, newest)
        self._features.describe(self._elevation, here, span)
        due = self._features.due
        ground = self._classifier.log_odds(self._features.values, self._features.cells, due)
        x, y = (_CELL * self._features.cells[due] + _CELL / 2 - here).T
        polar = result.scan.log_odds_of(self._grid)[self._polar_cells(x, y, yaw)]
        blocked, clearance = self._true_state(x, y, true.yaw - yaw, true.position[:2])
        far = self._features.values[due][:, GROUND_FEATURES.index("range")]
        self.measured.append(np.stack([far, blocked, clearance, polar, ground], axis=1))
        self._map.update(self._elevation, here, span)
        reach = int(MAP_BANDS[-1][1] / _CELL) + 1
        around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
        places = around + self._map.centre
        odds = self._map.log_odds[tuple((places & (CONFIG.occupancy.cells - 1)).T)]
        x, y = (_CELL * places[odds != 0] + _CELL / 2 - here).T
        blocked, clearance = self._true_state(x, y, true.yaw - yaw, true.position[:2])
        self.mapped.append(np.stack([np.hypot(x, y), blocked, clearance, odds[odds != 0]], axis=1))

    def _polar_cells(
        self, x: NDArray[np.float64], y: NDArray[np.float64], yaw: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return sector and ring of positions around the robot [m]."""
        bearing = np.arctan2(y, x) - yaw
        sector = np.floor((bearing / (2 * np.pi) + 1.5) * self._grid.n_sectors).astype(int)
        ring = np.searchsorted(self._grid.ring_edges, np.hypot(x, y), side="right") - 1
        # Ground cells reach as far as the last ring.
        return sector % self._grid.n_sectors, np.minimum(ring, self._grid.n_rings - 1)

    def _true_state(
        self,
        x: NDArray[np.float64],
        y: NDArray[np.float64],
        turn: float,
        position: NDArray[np.float64],
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Return ``true_state`` of cells around the robot, which lies at a true position."""
        return true_state(self._truth, rotated(x, y, turn) + position)


def rotated(x: NDArray[np.float64], y: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Return positions rotated about the origin, counter-clockwise [m], shape (n, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def true_state(
    truth: TraversabilityMap, centres: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which ground cells are blocked in truth, and the true clearance of their centres [m].

    A cell is blocked if the true map forbids the centre of one of its quarters.

    Args:
        truth: True map.
        centres: Centres of the cells in the map [m], shape (n, 2).
    """
    blocked = np.zeros(len(centres), dtype=bool)
    for u in (-_CELL / 4, _CELL / 4):
        for v in (-_CELL / 4, _CELL / 4):
            blocked |= truth.reason_at(centres[:, 0] + u, centres[:, 1] + v) != Reason.FREE
    return blocked, truth.clearance_at(centres[:, 0], centres[:, 1]).astype(float)


def record_drive(world: str, seed: int, classifier: GroundClassifier) -> GroundCellRecorder:
    """Drive to one goal in a world and return what was recorded."""
    config = SimulatedRobotConfig(plant="kinematic")
    scene = SceneCache().get(world, seed)
    models = Models()
    steering = make_steering("policy+planner", scene.world, config, models)
    simulated_robot = SimulatedRobot(scene, config, models, steering)
    recorder = GroundCellRecorder(simulated_robot, classifier)
    simulated_robot.navigator.observers.append(recorder)
    rng = np.random.default_rng([seed, 1])
    run_trial(simulated_robot, scene.world.tasks[0], TerminationConfig(), rng)
    simulated_robot.close()
    return recorder


def measurement_rows(measured: NDArray[np.float64]) -> list[Row]:
    """Return the scores of polar and of ground cells, by band of distance and over all bands.

    Args:
        measured: Rows of ``GroundCellRecorder.measured``; those without a polar cell do not count.
    """
    both = measured[np.isfinite(measured[:, _POLAR])]
    # The classifier's log odds are relative to the price of a miss; these are even odds.
    shift = np.log(CONFIG.ground.miss_cost)
    rows: list[Row] = []
    for near, end in (*BANDS, (BANDS[0][0], BANDS[-1][1])):
        band = both[(both[:, _DISTANCE] >= near) & (both[:, _DISTANCE] < end)]
        blocked, clear = band[:, _BLOCKED] > 0, band[:, _CLEARANCE] > CLEAR
        for name, odds in (("polar", band[:, _POLAR]), ("ground", band[:, _GROUND] + shift)):
            rows.append(
                {
                    "distance [m]": f"{near} to {end}",
                    "cells": name,
                    "average precision": average_precision_score(blocked, odds),
                    "AUC": roc_auc_score(blocked, odds),
                    "recall": float((odds[blocked] > 0).mean()),
                    "false alarms": float((odds[clear] > 0).mean()),
                }
            )
    return rows


def map_rows(mapped: NDArray[np.float64]) -> list[Row]:
    """Return the share of obstacles among blocked and among clear cells of the planner's map.

    Args:
        mapped: Rows of ``GroundCellRecorder.mapped``.
    """
    rows: list[Row] = []
    for near, end in MAP_BANDS:
        band = mapped[(mapped[:, _DISTANCE] >= near) & (mapped[:, _DISTANCE] < end)]
        blocked = band[:, _BLOCKED] > 0
        clear = ~blocked & (band[:, _CLEARANCE] > CLEAR)
        lethal = band[:, _MAPPED] > LETHAL
        rows.append(
            {
                "distance [m]": f"{near} to {end}",
                "obstacles among blocked cells": float(lethal[blocked].mean()),
                "among clear cells": float(lethal[clear].mean()),
            }
        )
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Drive, record and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", default="natural-test", help="World preset.")
    parser.add_argument("--first-world", type=int, default=7050, help="First world seed.")
    parser.add_argument("--worlds", type=int, default=6, help="Number of worlds.")
    parser.add_argument("--ground-classifier", type=Path, help="File; default: the shipped one.")
    options = parser.parse_args(argv)
    file = options.ground_classifier
    classifier = GroundClassifier.load(file) if file else shipped_ground_classifier()
    seeds = range(options.first_world, options.first_world + options.worlds)
    bar = track(seeds, "drives", console=Console(stderr=True))
    recorders = [record_drive(options.world, seed, classifier) for seed in bar]
    measured = np.concatenate([block for each in recorders for block in each.measured])
    mapped = np.concatenate([block for each in recorders for block in each.mapped])
    both = int(np.isfinite(measured[:, _POLAR]).sum())
    sys.stdout.write(f"{len(measured)} ground cells, {both} of them in classified polar cells\n\n")
    sys.stdout.write(markdown_table(measurement_rows(measured)) + "\n")
    sys.stdout.write(markdown_table(map_rows(mapped)))


if __name__ == "__main__":
    main()
