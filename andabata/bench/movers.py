"""Measures what robots know of movers: tracks against the truth, by laser, range and speed.

Off-road robots drive in development worlds with and without walkers, with the kinematic plant;
BARN's robot drives in rooms with and without movers, and in its fields of moving cylinders. What a
laser bounds is the share of moments at which it has looked at a mover, once or twice, since it came
into sight: a turning laser looks at a place once in seconds.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.mover_probe import MoverProbe
from andabata.bench.mover_tally import MAX_RANGE, Case, Moment, MoverDrive
from andabata.bench.planar_mover_drive import PLANAR, drive_among_planar_movers
from andabata.bench.reporter import Reporter
from andabata.bench.table import Row
from andabata.engine_processes import run_tasks
from andabata.machine.lidar_models import sensor_settings
from andabata.models import Models
from andabata.navigation.mover_perception import MoverPerception, MoverPerceptionConfig
from andabata.navigation.planar.circle_tracks import CircleTracksConfig
from worlds.scenes import SceneCache

LASERS = (PLANAR, "utm-30lx", "os1-64")
"""Lasers that are measured: BARN's planar one, the turning one, and a 3D one."""

OFFROAD_PRESETS = ("natural-walkers", "natural-test")
"""World presets of off-road lasers: with walkers and without."""

PLANAR_KINDS = ("clutter-movers", "clutter", "barn-moving-medium")
"""Kinds of rooms of the planar laser: with movers, without, and a field of moving cylinders."""

RANGES = (0.0, 2.0, 3.5, MAX_RANGE)
"""Edges of the classes of range [m]."""

Measure = Callable[[Moment], float]
"""Measure of a moment."""

SPEEDS = (0.0, 0.3, 0.8, 1.5, np.inf)
"""Edges of the classes of speed [m/s]: who hardly moves, and who walks slowly, fast, or runs."""


class BenchMoversConfig(BaseModel):
    """Settings of the trackers that are measured.

    Attributes:
        perception: Tracks off-road.
        circles: Tracks of the planar laser.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    perception: MoverPerceptionConfig = MoverPerceptionConfig()
    circles: CircleTracksConfig = CircleTracksConfig()


def bench_movers(
    config: BenchMoversConfig,
    lasers: Sequence[str],
    count: int,
    seconds: float,
    seed: int,
    workers: int,
    reporter: Reporter,
) -> dict[str, Any]:
    """Return the measures of all lasers, ready for JSON.

    Args:
        config: Settings of the trackers.
        lasers: Names of the lasers, of ``LASERS`` or of off-road sensors.
        count: Number of worlds of each kind.
        seconds: Duration of a drive [s].
        seed: Seed of the first world; each has the next one.
        workers: Number of processes.
        reporter: Receiver of progress.
    """
    cases = [
        (laser, kind, seed + k)
        for laser in lasers
        for kind in (PLANAR_KINDS if laser == PLANAR else OFFROAD_PRESETS)
        for k in range(count)
    ]
    drives = []
    with reporter.progress("drives", len(cases)) as step:
        for _, drive in run_tasks(partial(drive_case, config, seconds), cases, workers):
            drives.append(drive)
            step()
    return {
        "ranges": class_rows(drives, "range_m", RANGES, lambda moment: moment.distance),
        "speeds": class_rows(drives, "speed_m_s", SPEEDS, lambda moment: moment.speed),
        "drives": drive_rows(drives),
        "seed": seed,
        "worlds": count,
        "seconds": seconds,
    }


def drive_case(config: BenchMoversConfig, seconds: float, case: Case) -> MoverDrive:
    """Drive for a while and follow the movers.

    Args:
        config: Settings of the trackers.
        seconds: Duration [s].
        case: Laser, kind of world and seed.
    """
    if case[0] == PLANAR:
        return drive_among_planar_movers(config.circles, seconds, case)
    return drive_among_movers(config.perception, seconds, case)


def drive_among_movers(config: MoverPerceptionConfig, seconds: float, case: Case) -> MoverDrive:
    """Drive off-road for a while and follow the movers.

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
    rows = robot_config.sensing.lidar.rows_deg
    movers = MoverPerception(config, robot_config.robot.lidar_height, rows_deg=rows)
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


def class_rows(
    drives: Sequence[MoverDrive], key: str, edges: Sequence[float], of: Measure
) -> list[Row]:
    """Return what was found, a row for each laser and class; the first class of each holds all.

    Args:
        drives: Drives.
        key: Name of the column with the edges of a class, the upper one None where it is open.
        edges: Edges of the classes.
        of: Measure of a moment that decides its class.
    """
    rows: list[Row] = []
    for laser in dict.fromkeys(drive.case[0] for drive in drives):
        moments = [m for drive in drives if drive.case[0] == laser for m in drive.moments]
        for low, high in [(edges[0], edges[-1]), *pairwise(edges)]:
            chosen = [m for m in moments if low <= of(m) < high]
            bounds = [low, None if np.isinf(high) else high]
            rows.append({"laser": laser, key: bounds, **_found(chosen)})
    return rows


def _found(moments: Sequence[Moment]) -> Row:
    """Return what was found of some moments, and how well."""
    found = [m for m in moments if m.found]
    row: Row = {
        "moments": len(moments),
        "found": len(found),
        "missed": len(moments) - len(found),
        "found_share": _share(len(found), len(moments)),
        "looked_at_share": _share(sum(m.looks >= 1 for m in moments), len(moments)),
        "twice_share": _share(sum(m.looks >= 2 for m in moments), len(moments)),
    }
    for name, unit in (("place", "m"), ("velocity", "m_s")):
        errors = [getattr(m, f"{name}_error") for m in found]
        row[f"{name}_error_{unit}"] = float(np.median(errors)) if errors else None
        row[f"{name}_error_90_{unit}"] = float(np.quantile(errors, 0.9)) if errors else None
    return row


def _share(part: int, whole: int) -> float | None:
    """Return a share, None of nothing."""
    return part / whole if whole else None


def drive_rows(drives: Sequence[MoverDrive]) -> list[Row]:
    """Return false tracks and encounters, a row for each laser and kind of world."""
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
                "false_tracks": false,
                "false_a_minute": false / minutes if minutes else None,
                "encounters": sum(drive.encounters for drive in chosen),
                "found_in": sum(drive.met for drive in chosen),
                "jumps": sum(drive.jumps for drive in chosen),
                "cost_ms": 1e3 * float(np.mean([drive.cost for drive in chosen])),
            }
        )
    return rows


def class_table(rows: Sequence[Row], key: str, unit: str) -> list[Row]:
    """Return rows of ``class_rows`` as a table for people; errors are those of place and velocity.

    Args:
        rows: Rows.
        key: Name of the column with the edges.
        unit: Name of the column for people, with its unit.
    """
    return [
        {
            "laser": row["laser"],
            unit: _span(row[key]),
            "moments": row["moments"],
            "found": row["found_share"],
            "missed": row["missed"],
            "looked at": row["looked_at_share"],
            "error [m]": row["place_error_m"],
            "[m/s]": row["velocity_error_m_s"],
            "90 %": row["velocity_error_90_m_s"],
        }
        for row in rows
    ]


def _span(edges: Sequence[float | None]) -> str:
    """Return the edges of a class as text."""
    low, high = edges
    if high is None:
        return f"from {low:g}" if low else "all"
    return f"{low:g} to {high:g}"


def drive_table(rows: Sequence[Row]) -> list[Row]:
    """Return rows of ``drive_rows`` as a table for people."""
    return [
        {
            "laser": row["laser"],
            "world": row["world"],
            "minutes": row["minutes"],
            "tracks": row["tracks"],
            "false": row["false_tracks"],
            "a minute": row["false_a_minute"],
            "encounters": row["encounters"],
            "found in": row["found_in"],
            "cost [ms]": row["cost_ms"],
        }
        for row in rows
    ]
