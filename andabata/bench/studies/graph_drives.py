"""Drives over a live ROS 2 graph beside the same drives within one process.

``python -m andabata.bench.studies.graph_drives --out DIR`` drives through the goals of 20
development worlds twice: by ``ros2 robot`` and ``ros2 navigator``, two processes in a domain of
their own and in real time, and by one process without a graph. World, start, goals, plant and rules
are the same, the noise is not. A run that was interrupted goes on in its folder.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.ros_graph import Graph, LoggedProcess, result, stop
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.statistics import paired_difference
from andabata.evaluation.trial import run_trial
from andabata.machine.geo_reference import GeoReference
from andabata.machine.reality import level
from andabata.models import Models
from andabata.runs.folder import commit, make_folder
from andabata.runs.journal import Entry, Journal
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import DEVELOPMENT_SEED, evaluation_world

WORLD, CONTROLLER, PLANT = "natural-test", "planner", "kinematic"

_TIME_LIMIT = 300.0
"""Longest drive to a goal [s]."""

_PATIENCE = 1200.0
"""Longest time that a robot's process may take [s]: three goals, and the start."""

_DOMAINS = 90
"""Number of domains that are used, from 1 on: Linux gives away the ports of those beyond."""


@dataclass(frozen=True)
class Drive:
    """A drive.

    Attributes:
        seed: Seed of the world and of the noise.
        reality: Level of the differences between the robot and the one it believes in.
        knows_datum: True if the navigator of the graph is given the datum, as that of one process
            has it; False if it lays the map on the first fixes.
    """

    seed: int
    reality: str
    knows_datum: bool = True


def drive(task: Drive) -> Row:
    """Drive through a world's goals twice, and return how each attempt ended, ready for JSON."""
    alone = drive_alone(task)
    return {"seed": task.seed, "alone": alone, **drive_in_graph(task)}


def drive_alone(task: Drive) -> list[str]:
    """Return the outcomes of a drive within this process, by goal."""
    scene, models = SceneCache(1).get(WORLD, evaluation_world(task.seed, 0)), Models()
    config = SimulatedRobotConfig(plant=PLANT, reality=level(task.reality))
    steering = make_steering(CONTROLLER, None, config, models)
    robot = SimulatedRobot(scene, config, models, steering)
    rules = TerminationConfig(time_limit=_TIME_LIMIT, stuck_time=_TIME_LIMIT)
    rng = np.random.default_rng([task.seed, 0, 1])
    attempts = run_trial(robot, scene.world.tasks[0], rules, rng)
    robot.close()
    return [str(attempt.outcome) for attempt in attempts]


def drive_in_graph(task: Drive) -> Row:
    """Return the outcomes of a drive over a graph, by goal, and how late its robot ended."""
    with tempfile.TemporaryDirectory() as name:
        graph = Graph(Path(name))
        graph.environment |= {"ROS_DOMAIN_ID": str(1 + os.getpid() % _DOMAINS)}

        def start(*words: object) -> LoggedProcess:
            own = (sys.executable, "-m", "andabata", "ros2", *words)
            return graph.start(*own, "--json", "--quiet")

        try:
            datum = ("--datum", _datum_text()) if task.knows_datum else ()
            start("navigator", "--controller", CONTROLLER, "--no-map", *datum)
            options = ("--set", f"plant={PLANT}", "--reality", task.reality)
            drive = ("--world", WORLD, "--seed", task.seed, "--seconds", _TIME_LIMIT)
            found = result(start("robot", *drive, *options), _PATIENCE)
        finally:
            for process in reversed(graph.processes):
                stop(process)
    return {"graph": found["outcomes"], "behind_s": found["behind_s"]}


def _datum_text() -> str:
    """Return the datum of simulated robots, as ``--datum`` takes it."""
    there = GeoReference()
    return f"{there.latitude_deg},{there.longitude_deg},{there.altitude}"


def summary(rows: Sequence[Row]) -> list[Row]:
    """Return for each goal how many drives reached it, over the graph and without it.

    Args:
        rows: Result of ``drive`` for each world.
    """
    found: list[Row] = []
    for goal in range(3):
        alone, graph = (
            np.array([_reached(row[side], goal) for row in rows]) for side in ("alone", "graph")
        )
        difference = paired_difference(alone, graph)
        found.append(
            {
                "goal": goal + 1,
                "worlds": len(rows),
                "without a graph": int(alone.sum()),
                "over the graph": int(graph.sum()),
                "difference": difference.mean,
                "low": difference.low,
                "high": difference.high,
                "only without": int((alone & ~graph).sum()),
                "only over it": int((graph & ~alone).sum()),
            }
        )
    return found


def _reached(outcomes: Sequence[str], goal: int) -> bool:
    """Return True if a goal, counted from 0, was reached."""
    return len(outcomes) > goal and outcomes[goal] == "goal"


def compare(drives: Sequence[Drive], folder: Path | None, workers: int) -> list[Row]:
    """Drive what the folder's journal lacks; return the rows of all drives by seed.

    Args:
        drives: Drives.
        folder: Folder of the journal, or None.
        workers: Number of pairs of processes at a time.
    """
    path = make_folder(folder) / "drives.jsonl" if folder else None
    about: Entry = {"world": WORLD, "controller": CONTROLLER, "plant": PLANT, "commit": commit()}
    about |= {"arms": sorted({f"{each.reality}, {each.knows_datum}" for each in drives})}
    journal = Journal(path, about)
    known = {entry["seed"] for entry in journal.entries}
    with ProcessEngine(workers) as engine:
        for done in engine.run(drive, [each for each in drives if each.seed not in known]):
            journal.append(done.result)
            sys.stderr.write(f"{len(journal.entries)} of {len(drives)}: {done.result}\n")
    wanted = {each.seed for each in drives}
    return sorted((e for e in journal.entries if e["seed"] in wanted), key=lambda e: e["seed"])


def main(argv: Sequence[str] | None = None) -> None:
    """Drive and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=20, help="Number of worlds.")
    parser.add_argument("--seed", type=int, default=DEVELOPMENT_SEED, help="First seed.")
    parser.add_argument("--reality", default="ideal", help="ideal, field or harsh.")
    parser.add_argument("--no-datum", action="store_true", help="Let the first fixes be it.")
    parser.add_argument("--out", type=Path, help="Folder; an interrupted run goes on there.")
    parser.add_argument("--workers", type=int, default=1, help="Pairs of processes at a time.")
    parser.add_argument("--json", action="store_true", help="JSON instead of a table.")
    options = parser.parse_args(argv)
    arm = options.reality, not options.no_datum
    drives = [Drive(options.seed + k, *arm) for k in range(options.drives)]
    rows = compare(drives, options.out, options.workers)
    data = {"goals": summary(rows), "drives": rows}
    sys.stdout.write(
        json.dumps(data, indent=2) + "\n" if options.json else markdown_table(data["goals"])
    )


if __name__ == "__main__":
    main()
