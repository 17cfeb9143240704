"""Healthy senses: drives without any fault, in which no sense is doubted.

A doubt is any cause of a health that is not ok, except that fixes, or the compass, contradict the
estimate: multipath and magnetic disturbances do so in truth, and are simulated.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.localization.estimator_status import without_numbers
from andabata.machine.plants import Plant
from andabata.machine.reality import LEVELS, level
from andabata.models import Models
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world
from worlds.world import choose_task, jittered

PRESETS = ("natural-test", "natural-rough")
"""World presets, in turns."""

PLANTS: tuple[Plant, ...] = ("kinematic", "wheels", "bullet", "wheels")
"""Plants, in turns."""

TRUE_CAUSES = ("gnss: not accepted", "gnss: off", "compass: not accepted")
"""Causes that are true of the simulated senses."""

_SEED = 8006
"""Seed of the worlds; no limit was chosen by their drives."""

_LASTS = 60.0
"""Time that is driven, at most [s]."""


class HealthyDrive(NamedTuple):
    """Drive without a fault.

    Attributes:
        preset: World preset.
        seed: Seed of the world.
        reality: Level of what the robot does not know of itself.
        plant: Plant.
    """

    preset: str
    seed: int
    reality: str
    plant: Plant


def healthy_drives(count: int) -> Iterator[HealthyDrive]:
    """Yield drives, of which each 24 have each preset with each level and plant."""
    levels = tuple(LEVELS)
    for number in range(count):
        preset = PRESETS[number % len(PRESETS)]
        reality = levels[number // len(PRESETS) % len(levels)]
        plant = PLANTS[number // (len(PRESETS) * len(levels)) % len(PLANTS)]
        yield HealthyDrive(preset, evaluation_world(_SEED, number), reality, plant)


def healthy_senses_are_believed(count: int, folder: Path) -> Outcome:
    """Check that no sense is doubted in drives without a fault, by the planner.

    Args:
        count: Number of drives.
        folder: Folder for its files; none are made.
    """
    tally, models, scenes, seconds = Tally(), Models(), SceneCache(1), 0.0
    true_causes = Counter[str]()
    for drive in healthy_drives(count):
        name = f"{drive.preset}, world {drive.seed}, {drive.reality}, {drive.plant}"
        with tally.guarded(name):
            driven, causes = _causes(drive, models, scenes)
            tally.trials, seconds = tally.trials + 1, seconds + driven
            doubts = {cause: n for cause, n in causes.items() if cause not in TRUE_CAUSES}
            true_causes.update(cause for cause in causes if cause in TRUE_CAUSES)
            tally.expect(not doubts, f"{name}: {doubts}")
    told = ", ".join(f"{n} with {cause}" for cause, n in sorted(true_causes.items()))
    doubted = f"{len(tally.failures)} of {tally.trials} drives with a doubt"
    return tally.outcome(f"{doubted} in {seconds / 3600:.1f} h" + (f"; {told}" if told else ""))


def _causes(drive: HealthyDrive, models: Models, scenes: SceneCache) -> tuple[float, Counter[str]]:
    """Return the time of a drive [s], and the number of control steps of each cause."""
    config = SimulatedRobotConfig(plant=drive.plant, reality=level(drive.reality))
    scene = scenes.get(drive.preset, drive.seed)
    task, rng = choose_task(scene.world.tasks, 0), np.random.default_rng([drive.seed, 1])
    steering = make_steering("planner", scene.world, config, models)
    robot, causes = SimulatedRobot(scene, config, models, steering), Counter[str]()
    try:
        readings = robot.place(jittered(task.start, rng), np.array(task.goals[0]), rng)
        has_ended = False
        while readings.stamp < _LASTS and not has_ended:
            readings = robot.step(readings)
            causes.update(map(without_numbers, robot.localizer.status.causes))
            assert readings.truth is not None
            ended = readings.truth.collided or readings.truth.tipped
            has_ended = ended or robot.navigator.has_arrived
    finally:
        robot.close()
    return readings.stamp, causes
