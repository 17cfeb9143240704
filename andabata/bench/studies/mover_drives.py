"""Measures what tracks of movers bring a robot off-road, beside none and the true movers.

``python -m andabata.bench.studies.mover_drives`` drives the same development worlds, starts and
noises as ``andabata evaluate`` with the same seed, with the kinematic plant and the planner, and
prints a Markdown table: without tracks, with them, and with the truth in their place.
"""

import argparse
import json
import sys
import tomllib
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.bench.studies.true_movers import tell_true_movers
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import run_tasks
from andabata.evaluation.offroad import EvaluationConfig, attempt_of, attempt_row
from andabata.evaluation.trial import OffroadAttempt, run_trial
from andabata.machine.lidar_models import sensor_settings
from andabata.machine.planar.mover_contact import Contact
from andabata.models import Models
from andabata.navigation.mover_perception import MoverPerceptionConfig
from andabata.tasks.terminations import Outcome
from worlds.scenes import SceneCache
from worlds.world import choose_task

UNAWARE, TRACKS, TRUTH = ARMS = ("off", "tracks", "truth")
"""What the robot knows of movers."""

_CONTROLLER = "planner"

_GOALS = 3


Drives = dict[str, tuple[OffroadAttempt, ...]]
"""Attempts of a trial by what the robot knows."""


def evaluation_of(
    preset: str, sensor: str, seed: int, trials: int, settings: dict[str, Any]
) -> EvaluationConfig:
    """Return the evaluation whose worlds, starts and noises are driven.

    Args:
        preset: World preset.
        sensor: Laser.
        seed: Seed.
        trials: Number of trials.
        settings: Further settings of the robot.
    """
    robot = {"plant": "kinematic", "reality": "field", **sensor_settings(sensor), **settings}
    return EvaluationConfig.model_validate(
        {
            "world": preset,
            "controllers": (_CONTROLLER,),
            "trials": trials,
            "goals": _GOALS,
            "seed": seed,
            "simulated_robot": robot,
        }
    )


def drive_arms(config: EvaluationConfig, arms: Sequence[str], trial: int) -> Drives:
    """Drive a trial once with each knowledge of movers.

    Args:
        config: Evaluation.
        arms: Names of what the robot knows, of ``ARMS``.
        trial: Number of the trial.

    Raises:
        ValueError: If there is no such arm.
    """
    unknown = set(arms) - set(ARMS)
    if unknown:
        raise ValueError(f"arms: expected some of {', '.join(ARMS)}, got {sorted(unknown)}")
    scenario, models = config.scenarios[trial], Models()
    scene = SceneCache().get(scenario.world, scenario.seed, scenario.difficulty, config.release)
    task = choose_task(scene.world.tasks, np.random.default_rng([config.seed, trial]))
    driven = {}
    for arm in arms:
        robot = config.simulated_robot
        movers = robot.movers or MoverPerceptionConfig()
        robot = robot.model_copy(update={"movers": None if arm == UNAWARE else movers})
        steering = make_steering(_CONTROLLER, scene.world, robot, models)
        simulated_robot = SimulatedRobot(scene, robot, models, steering)
        if arm == TRUTH:
            tell_true_movers(simulated_robot)
        rng = np.random.default_rng([config.seed, trial, 1])
        driven[arm] = run_trial(
            simulated_robot,
            task,
            config.terminations,
            rng,
            contender=arm,
            repetition=trial,
            tolerance=config.tolerance,
        )
        simulated_robot.close()
    return driven


def arm_row(arm: str, drives: Sequence[Sequence[OffroadAttempt]]) -> Row:
    """Return what happened in the drives with some knowledge, each of up to three goals.

    Contacts with movers are counted for a hundred goals that were tried.
    """
    row: Row = {"movers": arm, "drives": len(drives)}
    for k in range(1, _GOALS + 1):
        row[f"goal {k}"] = sum(sum(a.is_success for a in attempts) >= k for attempts in drives)
    tried = [attempt for attempts in drives for attempt in attempts]
    row["goals tried"] = len(tried)
    ends = [attempt.contact for attempt in tried if attempt.outcome is Outcome.COLLISION]
    for name, contact in (
        ("hit_mover", Contact.MOVER),
        ("hit_by_mover", Contact.HIT),
        ("hit_at_rest", Contact.HIT_AT_REST),
        ("obstacle", Contact.OBSTACLE),
    ):
        row[f"{name} a 100"] = round(100 * ends.count(contact) / len(tried), 1) if tried else None
    row["other failures"] = sum(
        not attempt.is_success and attempt.outcome is not Outcome.COLLISION for attempt in tried
    )
    times = [attempt.time for attempt in tried if attempt.is_success]
    row["time [s]"] = round(float(np.mean(times)), 1) if times else None
    return row


class DriveJournal:
    """File of the trials that are done: a study of hours goes on after a kill.

    Attributes:
        path: Path of the file; None for none.
        done: Drives of the trials that it has, by their number.
    """

    def __init__(self, path: Path | None, config: EvaluationConfig, arms: Sequence[str]) -> None:
        """Read what a file has, or begin it.

        Args:
            path: Path of the file; None for none.
            config: Evaluation.
            arms: Knowledge of movers in each drive of a trial, of ``ARMS``.

        Raises:
            ValueError: If it is the journal of other drives.
        """
        self.path, self.done = path, dict[int, Drives]()
        if path is None:
            return
        head = json.dumps({"config": config.model_dump(mode="json"), "arms": list(arms)})
        if not path.is_file():
            path.write_text(head + "\n", encoding="utf-8")
        # The last line may be the half of one.
        text, _, half = path.read_text(encoding="utf-8").rpartition("\n")
        if half:
            path.write_text(text + "\n", encoding="utf-8")
        first, *lines = text.splitlines()
        if first != head:
            raise ValueError(
                f"{path}: expected the journal of these drives, got that of others; name another"
            )
        for line in lines:
            entry = json.loads(line)
            self.done[entry["trial"]] = {
                arm: tuple(attempt_of(row) for row in rows) for arm, rows in entry["drives"].items()
            }

    def add(self, trial: int, drives: Drives) -> None:
        """Add a trial.

        Args:
            trial: Number of the trial.
            drives: Its drives.
        """
        self.done[trial] = drives
        if self.path is not None:
            rows = {arm: [attempt_row(each) for each in drives[arm]] for arm in drives}
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"trial": trial, "drives": rows}) + "\n")


def main(argv: Sequence[str] | None = None) -> None:
    """Drive and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", default=",".join(ARMS), help="What the robot knows.")
    parser.add_argument("--sensor", default="utm-30lx", help="Laser.")
    parser.add_argument("--world", default="natural-walkers", help="World preset.")
    parser.add_argument("--seed", type=int, default=7300, help="Seed of the evaluation.")
    parser.add_argument("--trials", type=int, default=24, help="Number of trials.")
    parser.add_argument("--workers", type=int, default=1, help="Number of processes.")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=C", help="Setting.")
    parser.add_argument(
        "--journal", type=Path, help="File of the trials that are done; drives go on."
    )
    options = parser.parse_args(argv)
    config = evaluation_of(
        options.world,
        options.sensor,
        options.seed,
        options.trials,
        tomllib.loads("\n".join(options.set)),
    )
    arms = options.arms.split(",")
    journal = DriveJournal(options.journal, config, arms)
    left = [trial for trial in range(options.trials) if trial not in journal.done]
    work = run_tasks(partial(drive_arms, config, arms), left, options.workers)
    for trial, driven in track(work, "trials", total=len(left), console=Console(stderr=True)):
        journal.add(trial, driven)
    drives = [journal.done[trial] for trial in range(options.trials)]
    rows = [arm_row(arm, [each[arm] for each in drives]) for arm in arms]
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
