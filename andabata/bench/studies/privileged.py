"""Measures what limits driving, by telling the robot one thing at a time that it cannot know.

``python -m andabata.bench.studies.privileged`` drives the worlds, starts and noises of ``andabata
evaluate`` with the same settings, and prints Markdown tables. The robot drives as it is, and with

* ``true-pose``: its true pose in place of the filter's;
* ``true-cells``: true ground cells wherever a cloud shows one;
* ``true-map``: the true map as far as ground cells reach, seen or not;
* ``true-way``: the true map where nothing was seen, near and far: which way leads round;
* ``tracks``: what it sees moving, followed by itself; and ``true-movers``: as it truly moves.

What learning could win over the planner lies below these bounds. A ground cell is blocked if the
true map forbids a quarter of it.
"""

import argparse
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress

from andabata.assembly.controllers import DEFAULT_CONTROLLER
from andabata.assembly.prior_map import TRUTH
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.ground_cells import rotated, true_state
from andabata.bench.studies.true_movers import tell_true_movers
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.comparison import DrivenCell, run_comparison
from andabata.evaluation.offroad import (
    EvaluationConfig,
    OffroadComparison,
    drive_arm,
    trial_task,
)
from andabata.evaluation.offroad_pairs import controller_differences
from andabata.evaluation.perturbation import Arm
from andabata.evaluation.trial import OffroadAttempt
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.lidar_models import sensor_settings
from andabata.machine.planar.mover_contact import Contact
from andabata.models import Models
from andabata.navigation.mover_perception import MoverPerceptionConfig
from andabata.navigation.planning.ground_layer import GroundLayer
from andabata.runs.journal import Entry
from andabata.tasks.terminations import Outcome
from traversability.cartesian.elevation_grid import ANY_AGE, ElevationGrid
from traversability.cartesian.features import (
    MAX_RANGE,
    MIN_RANGE,
    GroundFeatures,
)
from traversability.cartesian.windows import EDGE_CELLS

AS_IT_IS, TRUE_POSE, TRUE_CELLS, TRUE_MAP, TRUE_WAY, TRACKS, TRUE_MOVERS = KNOWLEDGE = (
    "as-it-is",
    "true-pose",
    "true-cells",
    "true-map",
    "true-way",
    "tracks",
    "true-movers",
)
"""Names of what the robot knows."""

_CONTACTS = {
    "into mover": Contact.MOVER,
    "hit by mover": Contact.HIT,
    "hit at rest": Contact.HIT_AT_REST,
    "obstacle": Contact.OBSTACLE,
}
"""Contacts that end a drive, by the words of the table."""

UpdateLayer = Callable[[ElevationGrid, NDArray[np.float64], tuple[float, float]], None]


@dataclass(frozen=True)
class PrivilegedComparison(OffroadComparison):
    """One controller with each knowledge, in the same worlds with the same noise.

    Attributes:
        knowledge: Names of what the robot knows, of ``KNOWLEDGE``, the first to compare with.
    """

    journal: ClassVar[str] = "privileged.jsonl"

    knowledge: tuple[str, ...] = KNOWLEDGE

    def __post_init__(self) -> None:
        """Refuse knowledge that there is not.

        Raises:
            ValueError: If there is none of a name.
        """
        unknown = [name for name in self.knowledge if name not in KNOWLEDGE]
        if unknown:
            raise ValueError(
                f"knowledge: expected some of {', '.join(KNOWLEDGE)}, got {', '.join(unknown)}"
            )

    @property
    def about(self) -> Entry:
        """Heading of the journal; a study of more trials goes on with it."""
        return super().about | {"knowledge": list(self.knowledge)}

    def drive(self, cell: int) -> DrivenCell:
        """Drive a trial with each knowledge."""
        models = Models.from_bytes(self.files)
        scene, task = trial_task(self.config, cell)
        attempts: list[OffroadAttempt] = []
        for name in self.knowledge:
            robot = robot_that_knows(name, self.config.simulated_robot)
            arm = Arm(self.config.controllers[0], robot)
            driven = drive_arm(
                self.config, models, scene, task, arm, cell, prepare=partial(tell, name)
            )
            attempts += [replace(attempt, contender=name) for attempt in driven]
        return DrivenCell(tuple(attempts))


def robot_that_knows(name: str, robot: SimulatedRobotConfig) -> SimulatedRobotConfig:
    """Return the settings of a robot with some knowledge, of ``KNOWLEDGE``.

    Args:
        name: Name of what it knows.
        robot: Robot as it is.
    """
    exact = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)
    seeing = robot.movers or MoverPerceptionConfig()
    changes: dict[str, dict[str, Any]] = {
        TRUE_POSE: {"localizer": "truth", "errors": exact},
        TRUE_WAY: {"prior_map": robot.prior_map.model_copy(update={"source": TRUTH})},
        TRACKS: {"movers": seeing},
        TRUE_MOVERS: {"movers": seeing},
    }
    return robot.model_copy(update=changes.get(name, {}))


def tell(name: str, simulated_robot: SimulatedRobot) -> None:
    """Give a robot what its settings cannot, before it drives.

    Args:
        name: Name of what it knows, of ``KNOWLEDGE``.
        simulated_robot: Robot.
    """
    if name == TRUE_MOVERS:
        tell_true_movers(simulated_robot)
    if name in (TRUE_CELLS, TRUE_MAP):
        layer = _ground_layer(simulated_robot)
        update = true_layer_update(simulated_robot, layer, name == TRUE_MAP)
        layer.update = update  # type: ignore[method-assign, assignment]


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


def _ground_layer(simulated_robot: SimulatedRobot) -> GroundLayer:
    """Return the ground layer of a robot's perception.

    Raises:
        TypeError: If it has none.
    """
    layers = simulated_robot.perception.layers
    if layers is None or layers.ground is None:
        raise TypeError("controller: expected one with a planner and ground cells, got none")
    return layers.ground


def knowledge_row(name: str, attempts: Sequence[OffroadAttempt], goals: int) -> Row:
    """Return what happened with some knowledge: goals in a row, contacts, and what ended drives.

    Contacts are counted for a hundred goals that were tried.

    Args:
        name: Name of what the robot knows.
        attempts: Attempts of all knowledge.
        goals: Number of goals in a row.
    """
    tried = [attempt for attempt in attempts if attempt.contender == name]
    arrived = [attempt for attempt in tried if attempt.is_success]
    row: Row = {"knows": name, "drives": len({attempt.repetition for attempt in tried})}
    for goal in range(1, goals + 1):
        row[f"goal {goal}"] = sum(attempt.detail.goal == goal for attempt in arrived)
    row["goals tried"] = len(tried)
    ends = [attempt.contact for attempt in tried if attempt.outcome is Outcome.COLLISION]
    for label, contact in _CONTACTS.items():
        row[f"{label} a 100"] = round(100 * ends.count(contact) / len(tried), 1) if tried else None
    causes = Counter(a.detail.cause or str(a.outcome) for a in tried if not a.is_success)
    row["ended by"] = ", ".join(f"{cause} {n}" for cause, n in causes.most_common()) or "none"
    row["SPL"] = round(float(np.mean([a.spl for a in arrived])), 3) if arrived else None
    row["time [s]"] = round(float(np.mean([a.time for a in arrived])), 1) if arrived else None
    return row


def evaluation_of(options: argparse.Namespace) -> EvaluationConfig:
    """Return the evaluation whose worlds, starts and noises are driven."""
    robot = {"plant": options.plant, "reality": options.reality, **sensor_settings(options.sensor)}
    return EvaluationConfig.model_validate(
        {
            "suite": options.suite,
            "world": options.world,
            "controllers": (options.controller,),
            "trials": options.trials,
            "goals": options.goals,
            "seed": options.seed,
            "simulated_robot": robot | tomllib.loads("\n".join(options.set)),
        }
    )


def main(argv: Sequence[str] | None = None) -> None:
    """Drive with each kind of knowledge and print the tables."""
    parser = argparse.ArgumentParser(description="Measure what limits driving.")
    parser.add_argument("knowledge", nargs="*", metavar="WHAT", help=", ".join(KNOWLEDGE))
    parser.add_argument("--controller", default=DEFAULT_CONTROLLER, help="Who steers.")
    parser.add_argument("--suite", help="Suite of `andabata evaluate`, instead of worlds.")
    parser.add_argument("--world", default="natural-test", help="World preset.")
    parser.add_argument("--sensor", default="utm-30lx", help="Laser.")
    parser.add_argument("--plant", default="kinematic", help="Physics of the body.")
    parser.add_argument("--reality", default="field", help="Level of disturbances.")
    parser.add_argument("--seed", type=int, default=7300, help="Seed of the evaluation.")
    parser.add_argument("--trials", type=int, default=24, help="Number of trials.")
    parser.add_argument("--goals", type=int, default=3, help="Number of goals in a row.")
    parser.add_argument("--workers", type=int, default=1, help="Number of processes.")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=C", help="Setting.")
    parser.add_argument("--out", type=Path, help="Folder of what is done; a study goes on there.")
    options = parser.parse_args(argv)
    config, models = evaluation_of(options), Models()
    knowledge = tuple(options.knowledge) or KNOWLEDGE
    study = replace(PrivilegedComparison.of(config, models), knowledge=knowledge)
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    with ProcessEngine(options.workers) as engine, Progress(console=console) as progress:
        bar = progress.add_task("trials", total=len(study.cells()))
        attempts = run_comparison(
            study,
            engine=engine,
            folder=options.out,
            on_cell=lambda _: progress.advance(bar),
        )
    rows = [knowledge_row(name, attempts, config.goals) for name in knowledge]
    sys.stdout.write(markdown_table(rows) + "\n")
    sys.stdout.write(markdown_table(controller_differences(attempts, knowledge)))


if __name__ == "__main__":
    main()
