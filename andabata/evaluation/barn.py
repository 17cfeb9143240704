"""The BARN benchmark: navigators on the same worlds with the same noise, scored by its rules.

A run starts at rest with its goal 10 m ahead. The clock runs from 0.1 m of motion; a run succeeds
within 1 m of the goal, and fails with any contact or after 100 s. Its score is success x OT /
clip(t, 2 OT, 8 OT), at most 0.5, where OT is the time of the world's path at 2 m/s. Since half of
the largest speed earns the full score, success x OT / t stands beside it, without a limit either
way. Worlds here are public or generated and the simulator is light: no place in a competition.
"""

import hashlib
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.barn_navigators import BARN_NAVIGATORS, barn_navigator
from andabata.evaluation.barn_table import BarnAttempt, BarnMeasures, run_of, run_row
from andabata.evaluation.comparison import Attempts, DrivenCell
from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES, PlanarVehicleConfig
from andabata.own_code import own_digests
from andabata.runs.folder import commit
from andabata.runs.journal import Entry
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveResult,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from worlds.rooms.barn import NARROW, PUBLISHED, BarnWorld, barn_world
from worlds.rooms.crowds import SIZES, crowd_world
from worlds.rooms.moving_fields import moving_field
from worlds.sdf.barn import BarnFile, barn_files, read_barn_world
from worlds.sdf.moving_barn import faults

Fields = Literal[
    "published",
    "narrow",
    "moving-easy",
    "moving-medium",
    "moving-hard",
    "crowd-5",
    "crowd-10",
    "crowd-20",
]
"""Kinds of generated worlds: of cylinders that stand, or that move at three levels, or of people.
"""

_KINDS = {"published": "barn"} | {f"crowd-{people}": f"crowd-{people}" for people in SIZES}
"""Names of generated worlds without their seeds, where they are not ``barn-`` and the kind."""

GENERATED = "generated"
"""Worlds of the project's own generator, in the place of a folder."""

OFFICIAL_TRIALS = 10
"""Number of runs of each world that the benchmark takes."""

ALL_WORLDS, EVERY = 300, 6
"""Number of the benchmark's worlds, and which of them it scores: every sixth from 0."""

FIRST_JUDGING = 100_000
"""Seed of the first generated world that judges; smaller ones are for tuning."""


class BarnEvaluationConfig(BaseModel):
    """Settings of an evaluation.

    Attributes:
        worlds: Folder of the benchmark's worlds, or ``generated``.
        fields: Rules of generated worlds: as published, harder ones, with cylinders that move, or
            rooms with people.
        count: Number of generated worlds.
        first_seed: Seed of the first generated world; each has the next one.
        controllers: Names of the navigators.
        trials: Number of runs of each world.
        official: True if these are the benchmark's own worlds, trials, robot and rules.
        vehicle: Robot that is driven.
        believed: Robot that the navigators take it for; None tells them the true dynamics, those
            before any draws.
        policy: File of the policy of ``distilled``, None for the shipped one.
        lidar: Laser.
        rules: Rules of a run.
        seed: Seed of all noise.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    worlds: str = GENERATED
    fields: Fields = "published"
    count: int = Field(default=50, ge=1, le=100_000)
    first_seed: int = Field(default=FIRST_JUDGING, ge=0)
    controllers: tuple[str, ...] = BARN_NAVIGATORS
    trials: int = Field(default=OFFICIAL_TRIALS, ge=1, le=10_000)
    official: bool = False
    vehicle: PlanarVehicleConfig = PLANAR_VEHICLES["barn"]
    believed: PlanarVehicleConfig | None = PLANAR_VEHICLES["barn"]
    policy: Path | None = None
    lidar: PlanarLidarConfig = BARN_LIDAR
    rules: DriveRules = DriveRules()
    seed: int = Field(default=0, ge=0)


def world_names(config: BarnEvaluationConfig) -> tuple[str, ...]:
    """Return the names of an evaluation's worlds.

    Raises:
        BarnFileError: If a folder is not as the benchmark has it.
    """
    if config.worlds == GENERATED:
        kind = _KINDS.get(config.fields, f"barn-{config.fields}")
        return tuple(f"{kind}-{config.first_seed + k}" for k in range(config.count))
    return tuple(file.name for file in _files(config))


def _files(config: BarnEvaluationConfig) -> tuple[BarnFile, ...]:
    """Return the files of an evaluation's worlds: the public ones alone of a full official set."""
    files = barn_files(Path(config.worlds))
    # Of a folder with some of the worlds all count: it was chosen by hand.
    if config.official and len(files) >= ALL_WORLDS:
        return tuple(file for file in files if file.number % EVERY == 0)
    return files


def world_notes(config: BarnEvaluationConfig) -> tuple[str, ...]:
    """Return what was read past in the worlds of an evaluation whose models move, a line each.

    Raises:
        SdfError: If a world file is none.
        BarnFileError: If a folder is not as the benchmark has it.
    """
    if config.worlds == GENERATED:
        return ()
    moving = (file.world for file in _files(config) if file.path is None)
    return tuple(note for world in moving for note in faults(world))


def load_world(config: BarnEvaluationConfig, name: str) -> BarnWorld:
    """Return a world of an evaluation by its name.

    Raises:
        SdfError: If a world file is none.
        BarnFileError: If a path file is none.
        MotionFileError: If the motion of a model cannot be read.
    """
    if config.worlds == GENERATED:
        return _generated(config.fields, int(name.rpartition("-")[2]))
    (file,) = (file for file in _files(config) if file.name == name)
    return read_barn_world(file)


def _generated(fields: Fields, seed: int) -> BarnWorld:
    """Return a generated world of a kind."""
    match fields:
        case "published":
            return barn_world(seed, PUBLISHED)
        case "narrow":
            return barn_world(seed, NARROW)
        case "moving-easy":
            return moving_field(seed, "easy")
        case "moving-medium":
            return moving_field(seed, "medium")
        case "moving-hard":
            return moving_field(seed, "hard")
        case "crowd-5":
            return crowd_world(seed, 5)
        case "crowd-10":
            return crowd_world(seed, 10)
        case "crowd-20":
            return crowd_world(seed, 20)


@dataclass(frozen=True)
class BarnComparison:
    """Navigators by the rules of BARN; a cell is a world, which every navigator drives.

    Attributes:
        config: Settings.
    """

    unit: ClassVar[str] = "worlds"
    journal: ClassVar[str] = "worlds.jsonl"

    config: BarnEvaluationConfig

    @property
    def about(self) -> Entry:
        """Heading of the journal; with worlds and policies of files goes what was in them."""
        config = self.config
        about: Entry = {"config": config.model_dump(mode="json"), "commit": commit()}
        if config.worlds != GENERATED:
            # Files may change between two runs on a journal; generated worlds follow the commit.
            about["files"] = {file.name: _digest(file) for file in _files(config)}
        if config.policy is not None:
            about["policy"] = hashlib.sha256(config.policy.read_bytes()).hexdigest()
        own = own_digests(config.controllers)
        return about | ({"own": own} if own else {})

    def cells(self) -> Sequence[str]:
        """Return the names of the worlds."""
        return world_names(self.config)

    def label(self, cell: str) -> str:
        """Return the name of a world."""
        return cell

    def drive(self, cell: str) -> DrivenCell:
        """Drive all runs of a world, by controller; a trial has the same noise for all."""
        world = load_world(self.config, cell)
        return DrivenCell(
            tuple(
                drive_barn_run(self.config, world, cell, controller, trial)
                for controller in self.config.controllers
                for trial in range(self.config.trials)
            )
        )

    def encode(self, cell: str, attempts: Attempts) -> Entry:
        """Return the entry of a world: its name and its runs."""
        return {"world": cell, "runs": [run_row(attempt) for attempt in attempts]}

    def decode(self, entry: Entry) -> tuple[str, Attempts]:
        """Return the world of an entry and its runs."""
        return entry["world"], tuple(map(run_of, entry["runs"]))


def drive_barn_run(
    config: BarnEvaluationConfig,
    world: BarnWorld,
    name: str,
    controller: str,
    trial: int,
    on_readings: Callable[[PlanarReadings, Twist], None] | None = None,
) -> BarnAttempt:
    """Return one run with its path; the same arguments give the same path.

    Args:
        config: Settings.
        world: World.
        name: Name of the world, from which the noise is drawn.
        controller: Name of the navigator.
        trial: Number of the run in its world.
        on_readings: Function that sees the readings and the command of each period.
    """
    result = drive_in_field(config, world, name, controller, trial, on_readings)
    measures = BarnMeasures(world.optimal_time, result.goal_distance, result.speed)
    return Attempt(
        contender=controller,
        scenario=name,
        repetition=trial,
        outcome=result.outcome,
        contact=result.contact,
        time=round(result.time, 6),
        distance=float(np.hypot(*np.diff(result.path[:, :2], axis=0).T).sum()),
        shortest=np.nan,
        detail=measures,
        path=result.path,
    )


def drive_in_field(
    config: BarnEvaluationConfig,
    world: BarnWorld,
    name: str,
    controller: str,
    trial: int,
    on_readings: Callable[[PlanarReadings, Twist], None] | None = None,
) -> DriveResult:
    """Return the drive of a run; the arguments are those of ``drive_barn_run``."""
    # By the name of the world: another choice of worlds changes the noise of none.
    key = [config.seed, zlib.crc32(name.encode()), trial]
    (task,) = world.room.tasks
    robot = SimulatedPlanarRobot(
        world.room, task, config.vehicle, config.lidar, np.random.default_rng([*key, 0])
    )
    # The outline is in the robot's papers; its dynamics need not be.
    believed = (config.believed or config.vehicle).model_copy(
        update={"footprint": config.vehicle.footprint, "period": config.vehicle.period}
    )
    # Apart from the robot's noise: navigators that draw differently meet the same noise.
    draws = np.random.default_rng([*key, 1])
    navigator = barn_navigator(controller, believed, config.lidar, draws, config.policy)
    return drive_to_goal(navigator, robot, task, config.rules, on_readings)


def _digest(file: BarnFile) -> str:
    """Return the SHA-256 of a world's files: they may have changed since."""
    return hashlib.sha256(b"".join(each.read_bytes() for each in file.files)).hexdigest()
