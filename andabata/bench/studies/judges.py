"""Compares judges: the same drives in several plants, and as often as bullet agrees with itself.

``python -m andabata.bench.studies.judges --out DIR`` drives to one goal in each of 60 development
worlds: in bullet, in bullet with another noise of the sensors, and in every other judge (``mujoco``
needs its extra). Start, task and noise of a drive are the same in all but the second. The share of
drives that end as in bullet tells a judge from it only where it is below that of bullet and
itself. A run that was killed goes on in its folder. ``--steps`` times the plants instead, in
turns.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import ClassVar, NamedTuple, cast, get_args

import numpy as np
from rich.console import Console
from rich.progress import Progress

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.comparison import Attempts, DrivenCell, run_comparison
from andabata.evaluation.offroad import attempt_of, attempt_row
from andabata.evaluation.statistics import paired_difference, wilson_interval
from andabata.evaluation.trial import OffroadAttempt, run_trial
from andabata.machine.kinematics import SkidSteer
from andabata.machine.plants import Plant
from andabata.machine.reality import level
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import Vehicle, make_vehicle
from andabata.models import Models
from andabata.runs.folder import commit, make_folder
from andabata.runs.journal import Entry
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import DEVELOPMENT_SEED
from worlds.world import Start

PRESETS = {
    **{"natural-test": 16, "natural": 8, "maze": 8, "hollow": 8, "natural-walkers": 8},
    **{"hill": 4, "stony": 4, "forest": 4},
}
"""Number of worlds of each preset, 60 in all."""

REFERENCE, AGAIN = "bullet", "bullet, other noise"
"""Names of the judge that the others are compared with, and of its own repetition."""

_PERIOD, _PERIODS = 10, 50
"""Ticks of a control period, and number of them in a turn of the timing."""


class Cell(NamedTuple):
    """World of a drive.

    Attributes:
        preset: World preset.
        seed: Seed of the world.
    """

    preset: str
    seed: int


def drives(count: int, first: int, preset: str | None = None) -> tuple[Cell, ...]:
    """Return the worlds of so many drives, of all presets as evenly as they go, or of one.

    Args:
        count: Number of drives; of all presets 60 at most.
        first: First seed of each preset's worlds.
        preset: The only preset, or None.
    """
    if preset is not None:
        return tuple(Cell(preset, first + k) for k in range(count))
    ranked = [
        ((k + 0.5) / number, Cell(preset, first + k))
        for preset, number in PRESETS.items()
        for k in range(number)
    ]
    return tuple(cell for _, cell in sorted(ranked, key=lambda each: each[0]))[:count]


@dataclass(frozen=True)
class JudgesComparison:
    """The same drives by several judges; a cell is a world.

    Attributes:
        plants: Judges beside bullet.
        count: Number of drives.
        first: First seed of each preset's worlds.
        controller: Name of the controller.
        reality: Level of the differences between the robot and the one it believes in.
        preset: World preset of all drives; None for those of ``PRESETS``.
    """

    unit: ClassVar[str] = "drives"
    journal: ClassVar[str] = "drives.jsonl"

    plants: tuple[Plant, ...]
    count: int
    first: int
    controller: str
    reality: str
    preset: str | None = None

    @property
    def about(self) -> Entry:
        """Heading of the journal; a comparison of more drives goes on with it."""
        return {
            "plants": list(self.plants),
            "first": self.first,
            "controller": self.controller,
            "reality": self.reality,
            "preset": self.preset,
            "models": Models().hashes,
            "commit": commit(),
        }

    def cells(self) -> Sequence[Cell]:
        """Return the worlds."""
        return drives(self.count, self.first, self.preset)

    def label(self, cell: Cell) -> str:
        """Return the name of a world."""
        return f"{cell.preset} {cell.seed}"

    def drive(self, cell: Cell) -> DrivenCell:
        """Drive to the first goal of a world by all judges."""
        arms = [(REFERENCE, "bullet", 0), (AGAIN, "bullet", 1)]
        arms += [(plant, plant, 0) for plant in self.plants]
        return DrivenCell(tuple(self._drive(cell, *arm) for arm in arms))

    def _drive(self, cell: Cell, name: str, plant: str, noise: int) -> OffroadAttempt:
        """Drive to the first goal of a world by one judge.

        Args:
            cell: World.
            name: Name of the judge in the tables.
            plant: Its plant.
            noise: Number of the noise of the sensors.
        """
        scene, models = SceneCache().get(cell.preset, cell.seed), Models()
        config = SimulatedRobotConfig(plant=cast(Plant, plant), reality=level(self.reality))
        steering = make_steering(self.controller, scene.world, config, models)
        robot = SimulatedRobot(scene, config, models, steering)
        task = replace(scene.world.tasks[0], goals=scene.world.tasks[0].goals[:1])
        rng = np.random.default_rng([cell.seed, noise])
        (attempt,) = run_trial(robot, task, TerminationConfig(), rng, contender=name)
        robot.close()
        return attempt

    def encode(self, cell: Cell, attempts: Attempts) -> Entry:
        """Return the entry of a world: a row of each judge."""
        return {"cell": list(cell), "rows": [attempt_row(attempt) for attempt in attempts]}

    def decode(self, entry: Entry) -> tuple[Cell, Attempts]:
        """Return the world of an entry and its attempts."""
        return Cell(*entry["cell"]), tuple(attempt_of(row) for row in entry["rows"])


def judge_rows(attempts: Sequence[OffroadAttempt]) -> list[Row]:
    """Return a row of each judge: goals, drives that end as in bullet, time and way.

    Args:
        attempts: Attempts of all judges, in the same order of the drives.
    """
    judges: dict[str, list[OffroadAttempt]] = {}
    for attempt in attempts:
        judges.setdefault(attempt.contender, []).append(attempt)
    reference = judges[REFERENCE]
    return [_judge_row(name, reference, own) for name, own in judges.items()]


def _judge_row(name: str, reference: list[OffroadAttempt], own: list[OffroadAttempt]) -> Row:
    """Return the row of one judge."""
    pairs = list(zip(reference, own, strict=True))
    same = sum((a.outcome, a.contact) == (b.outcome, b.contact) for a, b in pairs)
    low, high = wilson_interval(same, len(pairs))
    won, theirs = (np.array([each.is_success for each in one]) for one in (own, reference))
    difference = paired_difference(theirs, won)
    both = [(a, b) for a, b in pairs if a.is_success and b.is_success]
    return {
        "judge": name,
        "drives": len(pairs),
        "goals": int(won.sum()),
        "goals less bullet's": difference.mean,
        "goals low": difference.low,
        "goals high": difference.high,
        "same end": same,
        "same low": low,
        "same high": high,
        "time ratio": median(b.time / a.time for a, b in both) if both else None,
        "way ratio": median(b.distance / a.distance for a, b in both) if both else None,
    }


def differing(attempts: Sequence[OffroadAttempt]) -> list[Row]:
    """Return a row of each drive that does not end as in bullet: who ended how, and why."""
    rows: list[Row] = []
    reference = [each for each in attempts if each.contender == REFERENCE]
    known = {(each.scenario, each.detail.world_seed): each for each in reference}
    for each in attempts:
        base = known[each.scenario, each.detail.world_seed]
        if (each.outcome, each.contact) != (base.outcome, base.contact):
            world = f"{each.scenario} {each.detail.world_seed}"
            ends = {"bullet": _end(base), "there": _end(each)}
            rows.append({"world": world, "judge": each.contender, **ends})
    return rows


def _end(attempt: OffroadAttempt) -> str:
    """Return how a drive ended, and why."""
    return f"{attempt.outcome} {attempt.detail.cause or ''}".strip()


def time_plants(plants: Sequence[Plant], turns: int, first: int) -> list[Row]:
    """Return the CPU time of a tick in each plant, and its ratio to bullet's in the same turn.

    Args:
        plants: Plants to time.
        turns: Number of turns; medians are returned.
        first: Seed of the natural-test world that they drive in.
    """
    config, scene = SimulatedRobotConfig(), SceneCache().get("natural-test", first)
    start, kinematics = scene.world.tasks[0].start, SkidSteer(config.robot)
    rng = np.random.default_rng(0)
    commands = {"standing": (0.0, 0.0), "driving": (config.robot.speed, 0.2)}
    seconds: dict[tuple[str, str], list[float]] = {}
    with ExitStack() as stack:
        vehicles = {plant: make_vehicle(plant, scene.world, config.robot, rng) for plant in plants}
        for vehicle in vehicles.values():
            stack.callback(vehicle.close)
        for _ in range(turns):
            for what, twist in commands.items():
                wheels = kinematics.wheel_speeds(*twist)
                for plant, vehicle in vehicles.items():
                    seconds.setdefault((what, plant), []).append(_time(vehicle, wheels, start))
    return [
        {
            "doing": what,
            "plant": plant,
            "us a tick of 10 ms": 1e6 * median(taken) / _PERIOD,
            "ratio to bullet": median(
                one / other for one, other in zip(taken, seconds[what, "bullet"], strict=True)
            ),
        }
        for (what, plant), taken in seconds.items()
    ]


def _time(vehicle: Vehicle, wheels: WheelSpeeds, start: Start) -> float:
    """Return the mean CPU time of a control period from a start on [s]; others use the machine."""
    vehicle.place(start)
    vehicle.drive(wheels, _PERIOD)
    begin = time.process_time()
    for _ in range(_PERIODS):
        vehicle.drive(wheels, _PERIOD)
    return (time.process_time() - begin) / _PERIODS


def compare(comparison: JudgesComparison, folder: Path | None, workers: int) -> Row:
    """Drive what the folder's journal lacks, and return the tables, ready for JSON.

    Args:
        comparison: Comparison to drive.
        folder: Folder of the journal, or None.
        workers: Number of processes.
    """
    made = make_folder(folder) if folder else None
    console = Console(stderr=True)
    with ProcessEngine(workers) as engine, Progress(console=console) as progress:
        bar = progress.add_task(comparison.unit, total=len(comparison.cells()))
        attempts = run_comparison(
            comparison, engine=engine, folder=made, on_cell=lambda _: progress.advance(bar)
        )
    return {
        "about": comparison.about,
        "judges": judge_rows(attempts),
        "differing": differing(attempts),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Drive by all judges, or time the plants, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--judges", nargs="*", default=["mujoco"], choices=get_args(Plant))
    parser.add_argument("--drives", type=int, default=60, help="Number of drives.")
    parser.add_argument("--first-world", type=int, default=DEVELOPMENT_SEED, help="First seed.")
    parser.add_argument("--controller", default="policy+planner", help="Name of the controller.")
    parser.add_argument("--reality", default="ideal", help="ideal, field or harsh.")
    parser.add_argument("--world", help="World preset of all drives; by default a mixture.")
    parser.add_argument("--out", type=Path, help="Folder; a run that was killed goes on there.")
    parser.add_argument("--workers", type=int, default=2, help="Number of processes.")
    parser.add_argument("--steps", type=int, default=0, help="Number of turns of the timing.")
    parser.add_argument("--json", action="store_true", help="JSON instead of tables.")
    options = parser.parse_args(argv)
    plants = tuple(options.judges)
    if options.steps:
        timed = time_plants(("bullet", *plants), options.steps, options.first_world)
        data: Row = {"steps": timed}
    else:
        given = options.drives, options.first_world, options.controller, options.reality
        comparison = JudgesComparison(plants, *given, options.world)
        data = compare(comparison, options.out, options.workers)
    tables = [markdown_table(data[key]) for key in ("judges", "differing", "steps") if key in data]
    sys.stdout.write(json.dumps(data, indent=2) + "\n" if options.json else "\n".join(tables))


if __name__ == "__main__":
    main()
