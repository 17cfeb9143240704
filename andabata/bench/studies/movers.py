"""Measures what off-road robots know of movers: tracks against the truth, by laser and range.

``python -m andabata.bench.studies.movers`` drives in development worlds with and without walkers,
with the kinematic plant, and prints two Markdown tables. A moment is a control step at which a
walker has been in sight for a second within 5 m: two of three rays from the laser to its body meet
nothing before. It is found if a track is near its place. A track that is never near a walker is
false. What a laser bounds is the share of moments at which it has looked at the walker, once or
twice, since it came into sight: a turning laser looks at a place once in seconds.
"""

import argparse
import sys
import tomllib
from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np
from rich.console import Console
from rich.progress import track

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.mover_probe import MAX_RANGE, Case, MoverDrive, MoverProbe
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import run_tasks
from andabata.machine.lidar_models import sensor_settings
from andabata.models import Models
from andabata.navigation.mover_perception import MoverPerception, MoverPerceptionConfig
from worlds.scenes import SceneCache

RANGES = (0.0, 2.0, 3.5, MAX_RANGE)
"""Edges of the classes of range [m]."""


def drive_among_movers(config: MoverPerceptionConfig, seconds: float, case: Case) -> MoverDrive:
    """Drive for a while and follow the movers.

    Args:
        config: Settings of the perception of movers.
        seconds: Duration [s].
        case: Laser, preset and seed.
    """
    sensor, preset, seed = case
    scene, models = SceneCache().get(preset, seed), Models()
    settings = {"plant": "kinematic", **sensor_settings(sensor)}
    robot_config = SimulatedRobotConfig.model_validate(settings)
    steering = make_steering("policy+planner", scene.world, robot_config, models)
    robot = SimulatedRobot(scene, robot_config, models, steering)
    movers = MoverPerception(config, robot_config.robot.lidar_height)
    probe = MoverProbe(case, robot, movers)
    task = scene.world.tasks[0]
    goals = [np.array(goal) for goal in task.goals]
    readings = robot.place(task.start, goals[0], np.random.default_rng([seed, 1]))
    while readings.stamp < seconds:
        # The navigator has taken in these readings, and none after them.
        wheels = robot.navigator.step(readings).wheels
        if readings.stamp > 0:
            probe(readings)
        if robot.navigator.has_arrived and len(goals) > 1:
            goals = goals[1:]
            robot.navigator.set_goal(goals[0])
        readings = robot.simulator.step(wheels)
    robot.close()
    return probe.finish(readings.stamp)


def range_rows(drives: Sequence[MoverDrive]) -> list[Row]:
    """Return what was found, a row for each laser and class of range."""
    rows: list[Row] = []
    for sensor in dict.fromkeys(drive.case[0] for drive in drives):
        moments = [m for drive in drives if drive.case[0] == sensor for m in drive.moments]
        classes = [(RANGES[0], RANGES[-1]), *pairwise(RANGES)]
        for low, high in classes:
            chosen = [m for m in moments if low <= m.distance < high]
            found = [m for m in chosen if m.found]
            row: Row = {"laser": sensor, "range [m]": f"{low:g} to {high:g}"}
            row["moments"] = len(chosen)
            row["found"] = _share(len(found), len(chosen))
            row["looked at"] = _share(sum(m.looks >= 1 for m in chosen), len(chosen))
            row["twice"] = _share(sum(m.looks >= 2 for m in chosen), len(chosen))
            for name, unit in (("place", "m"), ("velocity", "m/s")):
                errors = [getattr(m, f"{name}_error") for m in found]
                row[f"{name} error [{unit}]"] = float(np.median(errors)) if errors else None
                row[f"{name} 90 % [{unit}]"] = float(np.quantile(errors, 0.9)) if errors else None
            rows.append(row)
    return rows


def _share(part: int, whole: int) -> float | None:
    """Return a share, None of nothing."""
    return part / whole if whole else None


def drive_rows(drives: Sequence[MoverDrive]) -> list[Row]:
    """Return false tracks and encounters, a row for each laser and preset."""
    rows: list[Row] = []
    for key in dict.fromkeys(drive.case[:2] for drive in drives):
        chosen = [drive for drive in drives if drive.case[:2] == key]
        minutes = sum(drive.duration for drive in chosen) / 60.0
        false = sum(drive.false_tracks for drive in chosen)
        rows.append(
            {
                "laser": key[0],
                "world": key[1],
                "minutes": minutes,
                "tracks": sum(drive.tracks for drive in chosen),
                "false tracks": false,
                "a minute": false / minutes if minutes else None,
                "encounters": sum(drive.encounters for drive in chosen),
                "found in": sum(drive.met for drive in chosen),
                "jumps": sum(drive.jumps for drive in chosen),
                "cost [ms]": 1e3 * float(np.mean([drive.cost for drive in chosen])),
            }
        )
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Drive and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensors", default="utm-30lx,os1-64", help="Lasers.")
    parser.add_argument("--presets", default="natural-walkers,natural-test", help="World presets.")
    parser.add_argument("--first-world", type=int, default=7300, help="First world seed.")
    parser.add_argument("--worlds", type=int, default=6, help="Number of worlds.")
    parser.add_argument("--seconds", type=float, default=120.0, help="Duration of a drive [s].")
    parser.add_argument("--workers", type=int, default=1, help="Number of processes.")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=C", help="Setting.")
    options = parser.parse_args(argv)
    config = MoverPerceptionConfig.model_validate(tomllib.loads("\n".join(options.set)))
    cases = [
        (sensor, preset, options.first_world + k)
        for sensor in options.sensors.split(",")
        for preset in options.presets.split(",")
        for k in range(options.worlds)
    ]
    work = run_tasks(partial(drive_among_movers, config, options.seconds), cases, options.workers)
    bar = track(work, "drives", total=len(cases), console=Console(stderr=True))
    drives = [drive for _, drive in bar]
    sys.stdout.write(markdown_table(range_rows(drives)) + "\n")
    sys.stdout.write(markdown_table(drive_rows(drives)))


if __name__ == "__main__":
    main()
