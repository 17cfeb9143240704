"""Measures what limits driving, by giving the robot privileged information, one kind at a time.

``python -m andabata.bench.studies.privileged`` drives to three goals in each of some development
worlds, in bullet with the whole chain, and prints a Markdown table. The robot drives as it is and,
one thing at a time, with its true pose, with true ground cells wherever a cloud shows one, with the
true map as far as ground cells reach, seen or not, and by the oracle. Sensors draw their noise from
the same seeds in every variant. A ground cell is blocked if the true map forbids a quarter of it.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.ground_cells import rotated, true_state
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import run_tasks
from andabata.evaluation.failure_cause import failure_cause
from andabata.evaluation.statistics import wilson_interval
from andabata.evaluation.trial import run_trial
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.models import Models
from andabata.navigation.planning.ground_layer import GroundLayer
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from traversability.cartesian.elevation_grid import ANY_AGE, ElevationGrid
from traversability.cartesian.features import (
    MAX_RANGE,
    MIN_RANGE,
    GroundFeatures,
)
from traversability.cartesian.windows import EDGE_CELLS
from worlds.scenes import SceneCache

GOALS = 3
"""Number of goals of a task."""

AS_IT_IS, TRUE_POSE, TRUE_CELLS, TRUE_MAP, ORACLE = VARIANTS = (
    "as it is",
    "true pose",
    "true ground cells",
    "true map",
    "oracle",
)
"""Names of what the robot is given."""

_TRUE_POSE_CONFIG = SimulatedRobotConfig(
    localizer="truth",
    errors=NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0),
)

UpdateLayer = Callable[[ElevationGrid, NDArray[np.float64], tuple[float, float]], None]


@dataclass(frozen=True)
class Drive:
    """Outcome of a drive to three goals in a row.

    Attributes:
        spl: Success weighted by path length of each goal that was reached.
        failure: Cause of the failure, or the last outcome.
    """

    spl: tuple[float, ...]
    failure: str


def true_layer_update(
    simulated_robot: SimulatedRobot, layer: GroundLayer, unseen: bool
) -> UpdateLayer:
    """Return a replacement of ``GroundLayer.update`` that writes true states.

    Args:
        simulated_robot: Robot that drives.
        layer: Its ground layer.
        unseen: True to write all cells within reach, False for those that the cloud shows.
    """
    features, config = GroundFeatures(), simulated_robot.config.local_planner.ground
    reach = int(MAX_RANGE / layer.cell) + 1
    around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)

    def update(
        elevation: ElevationGrid, here: NDArray[np.float64], span: tuple[float, float] = ANY_AGE
    ) -> None:
        layer.follow(here)
        places, edge = around + layer.centre, EDGE_CELLS * elevation.cell
        if not unseen:
            features.describe(elevation, here, span)
            places = features.cells[features.due]
        centres = (places + 0.5) * edge - here
        far = np.hypot(*centres.T)
        near = (far >= MIN_RANGE) & (far <= MAX_RANGE)
        odometry = simulated_robot.localizer.odometry
        true = simulated_robot.simulator.vehicle.state.pose
        x, y = centres[near].T
        spots = rotated(x, y, true.yaw - odometry.yaw) + true.position[:2]
        blocked, _ = true_state(simulated_robot.scene.world.truth, spots)
        i, j = (places[near] & (len(layer.log_odds) - 1)).T
        most = config.max_log_odds
        layer.log_odds[i, j] = np.where(blocked, most, -most)

    return update


def drive_with(variant: str, world: tuple[str, int]) -> Drive:
    """Drive to the goals of a world's first task.

    Args:
        variant: Name of what the robot is given, one of ``VARIANTS``.
        world: Preset and seed.

    Raises:
        ValueError: If there is no such variant.
    """
    if variant not in VARIANTS:
        raise ValueError(f"variant: expected one of {', '.join(VARIANTS)}, got {variant!r}")
    preset, seed = world
    config = _TRUE_POSE_CONFIG if variant == TRUE_POSE else SimulatedRobotConfig()
    scene = SceneCache().get(preset, seed)
    name = "oracle" if variant == ORACLE else "policy+planner"
    models = Models()
    steering = make_steering(name, scene.world, config, models)
    simulated_robot = SimulatedRobot(scene, config, models, steering)
    if variant in (TRUE_CELLS, TRUE_MAP):
        layer = _ground_layer(simulated_robot)
        update = true_layer_update(simulated_robot, layer, variant == TRUE_MAP)
        layer.update = update  # type: ignore[method-assign, assignment]
    rng = np.random.default_rng([seed, 1])
    attempts = run_trial(simulated_robot, scene.world.tasks[0], TerminationConfig(), rng)
    simulated_robot.close()
    last = attempts[-1]
    cause = failure_cause(scene.world, last.path[-1], last.outcome)
    reached = [attempt.spl for attempt in attempts if attempt.outcome is Outcome.GOAL]
    return Drive(tuple(reached), str(cause or last.outcome))


def _ground_layer(simulated_robot: SimulatedRobot) -> GroundLayer:
    """Return the ground layer of a robot's perception.

    Raises:
        TypeError: If it has none.
    """
    layers = simulated_robot.perception.layers
    if layers is None or layers.ground is None:
        raise TypeError("controller: expected one with a planner and ground cells, got none")
    return layers.ground


def reached_in_a_row(drives: Sequence[Drive]) -> list[int]:
    """Return the number of drives that reached the first, the first two, and all three goals."""
    return [sum(len(drive.spl) > k for drive in drives) for k in range(GOALS)]


def variant_row(variant: str, drives: Sequence[Drive]) -> Row:
    """Return success by goal with 95 % Wilson intervals, mean SPL and causes of failures."""
    row: Row = {"variant": variant, "drives": len(drives)}
    for k, reached in enumerate(reached_in_a_row(drives), start=1):
        low, high = wilson_interval(reached, len(drives))
        row[f"goal {k}"] = f"{reached} [{low:.2f}, {high:.2f}]"
    spl = [each for drive in drives for each in drive.spl]
    failures = Counter(drive.failure for drive in drives if len(drive.spl) < GOALS)
    row["SPL"] = float(np.mean(spl)) if spl else None
    row["failures"] = ", ".join(f"{n} {cause}" for cause, n in failures.most_common()) or "none"
    return row


def main(argv: Sequence[str] | None = None) -> None:
    """Drive with each kind of information and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("variants", nargs="*", metavar="VARIANT", help=", ".join(VARIANTS))
    parser.add_argument("--world", default="natural-test", help="World preset.")
    parser.add_argument("--first-world", type=int, default=7200, help="First world seed.")
    parser.add_argument("--worlds", type=int, default=30, help="Number of worlds.")
    parser.add_argument("--workers", type=int, default=2, help="Number of processes.")
    options = parser.parse_args(argv)
    worlds = [(options.world, options.first_world + k) for k in range(options.worlds)]
    rows = []
    for variant in options.variants or VARIANTS:
        work = run_tasks(partial(drive_with, variant), worlds, options.workers)
        bar = track(work, variant, total=len(worlds), console=Console(stderr=True))
        rows.append(variant_row(variant, [drive for _, drive in bar]))
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
