"""Report of training runs of every task, with sections of what the runs have.

Those of off-road runs are here, with the figures of the paper (Sanchez et al. 2023, section 5).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.engine_processes import run_tasks
from andabata.evaluation.trial import OffroadAttempt, run_trial
from andabata.machine.plants import default_plant
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.navigation.navigator import StepResult
from andabata.report.blocks import Fact, Plot, Table
from andabata.report.options import ReportOptions
from andabata.report.page import Page, Section
from andabata.report.plots.drives import sights_figure, tests_figure, world_figure
from andabata.report.plots.training import learning_figure, rewards_figure
from andabata.report.room_training import tests_sections
from andabata.report.success import success_sections
from andabata.report.training_folder import TrainingRun, check_alike, common_stages, told_apart
from andabata.report.training_page import TrainingSections
from andabata.tasks.offroad import OffroadConfig
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.training.plans import StagePlan
from traversability.virtual_scan import VirtualScan
from worlds.catalogue import make_world
from worlds.scenes import SceneCache
from worlds.world import World, choose_task

Row = dict[str, Any]

_STAGE_COLUMNS = (
    "run",
    "stage",
    "episodes",
    "mean_time_s",
    "first 40",
    "last 40",
    "most_circling",
    "validation",
)
"""Columns of a stage that are not folded."""

Test = tuple[int, str, int]
"""Index of a run, name of a stage and index of a test drive."""

_COUNTED = ("goal", "collision", "tipover", "timeout")
"""Ends of episodes that are counted."""

_FEW = 40
"""Number of episodes at the beginning and at the end of a stage that are counted."""

_REWARD_TEXT = (
    "Mean over the episodes of an update, exploring, one line a run: where the paper takes the "
    "latest 1000 steps of one robot, several robots drive here between two updates."
)

_STAGES_TEXT = (
    "Validation: success in worlds that are kept for it, without exploration. The paper's "
    "episodes took 83.4 s, 78.6 s and 94.6 s on average in its stages of 200 episodes each."
)

_WORLDS_TEXT = "The first world of each family that is kept for validation."

_SCANS_TEXT = "The first virtual scan of a test drive, in blue, on the true map."

_TESTS_TEXT = (
    f"The policy at the end of each stage, in {default_plant()} with the whole chain, without "
    "exploration. "
    "Dots are starts, stars goals; a cross is where a drive failed."
)


Sight = tuple[Pose, VirtualScan]
"""True pose of a robot, and its virtual scan there."""

Tested = tuple[OffroadAttempt, Sight | None]
"""Test drive, and the first virtual scan of it."""


def report_training(folders: Sequence[Path], options: ReportOptions) -> tuple[Page, Row]:
    """Return a page about training runs of one task, and its figures.

    Args:
        folders: Folders of the runs, each another seed or plan.
        options: Classifiers of off-road runs, and how their policies are tested.

    Raises:
        RunFolderError: If a folder holds no run, or one without a stage that is over.
        ValueError: If the runs do not belong on one page.
    """
    runs = [TrainingRun.read(folder) for folder in folders]
    environment = runs[0].stages[-1].environment
    if isinstance(environment, OffroadConfig):
        shown = _offroad_sections(runs, options)
    else:
        # TD3's task has no fixed tasks to test on: its success is that of the latest episodes.
        sections = tests_sections if isinstance(environment, SpnConfig) else success_sections
        shown = sections(runs)
    return shown.page, shown.rows


def _offroad_sections(runs: Sequence[TrainingRun], options: ReportOptions) -> TrainingSections:
    """Return the sections on off-road runs of one plan.

    Each stage's policy drives in the first world of validation, in the default plant and with the
    whole chain.
    """
    models = options.models()
    check_alike(runs, models)
    runs = told_apart(runs)
    stages = common_stages(runs)
    driven = _drive_all(runs, stages, models, options)
    stage_rows = [_stage_row(run, stage) for run in runs for stage in stages]
    tests = [
        _test_row(runs[k].name, name, n, attempt) for (k, name, n), (attempt, _) in driven.items()
    ]
    worlds = {stage.name: _world(stage) for stage in stages}
    return TrainingSections(
        title=f"Learning to drive: {runs[0].plan.learner.algorithm}",
        lead=f"{', '.join(run.name for run in runs)}; stages {', '.join(worlds)}.",
        rows={"stages": stage_rows, "tests": tests},
        learning=Section("Reward", _REWARD_TEXT, *_rewards(runs)),
        results=Section("Stages", _STAGES_TEXT, _stages_table(stage_rows)),
        worlds=(
            Section("Worlds", _WORLDS_TEXT, *_worlds(worlds.values())),
            Section("Scans", _SCANS_TEXT, _scans(stages, worlds, driven)),
        ),
        drives=Section("Tests", _TESTS_TEXT, *_tests(runs, worlds, driven), Table(tests)),
        facts=[_fact(stage.name, stage_rows) for stage in stages],
    )


def _drive_all(
    runs: Sequence[TrainingRun],
    stages: Sequence[StagePlan],
    models: Models,
    options: ReportOptions,
) -> dict[Test, Tested]:
    """Return the test drives of each stage of each run."""
    numbers = range(options.tests)
    jobs = [(k, stage.name, n) for stage in stages for k in range(len(runs)) for n in numbers]
    drive, driven = partial(_drive, runs, models.to_bytes()), {}
    with options.progress("test drives", len(jobs)) as step:
        for job, result in run_tasks(drive, jobs, options.workers):
            driven[job] = result
            step(1)
    return driven


def offroad(stage: StagePlan) -> OffroadConfig:
    """Return the environment of an off-road stage.

    Raises:
        ValueError: If the stage is of another task.
    """
    if not isinstance(stage.environment, OffroadConfig):
        raise ValueError(f"stage {stage.name}: expected off-road, got {stage.environment.task}")
    return stage.environment


def _world(stage: StagePlan) -> World:
    """Return the world of a stage's test drives."""
    one = offroad(stage).unseen
    return make_world(one.preset, one.seeds[0], one.difficulty)


def _test_robot(environment: OffroadConfig) -> SimulatedRobotConfig:
    """Return a stage's robot for the tests: the default plant and the real robot's sensors."""
    simulated_robot, tested = environment.simulated_robot, SimulatedRobotConfig()
    readings = tested.sensing.proprioception
    sensing = simulated_robot.sensing.model_copy(update={"proprioception": readings})
    parts = {
        "robot": simulated_robot.robot,
        "sensing": sensing,
        "assembly": simulated_robot.assembly,
        "grid": simulated_robot.grid,
    }
    return tested.model_copy(update=parts)


def _drive(runs: Sequence[TrainingRun], files: tuple[bytes, bytes, bytes], job: Test) -> Tested:
    """Return a test drive of a run's stage, and the first virtual scan."""
    number, stage, test = job
    run, environment = runs[number], offroad(runs[number].plan.stages[stage]).unseen
    models = replace(Models.from_bytes(files), policy=run.policy(stage))
    scene = SceneCache().get(environment.preset, environment.seeds[0], environment.difficulty)
    config = _test_robot(environment)
    name = "policy+planner" if environment.heading == "subgoal" else "policy"
    steering = make_steering(name, scene.world, config, models)
    simulated_robot = SimulatedRobot(scene, config, models, steering)
    first: list[Sight] = []

    def observe(result: StepResult) -> None:
        if result.scan is not None and result.readings.truth is not None:
            first.append((result.readings.truth.pose, result.scan))
            simulated_robot.navigator.observers.clear()

    simulated_robot.navigator.observers.append(observe)
    task = choose_task(scene.world.tasks, test)
    # The same starts and noises for every run.
    (attempt, *_) = run_trial(
        simulated_robot,
        replace(task, goals=task.goals[:1]),
        environment.terminations,
        np.random.default_rng([environment.seeds[0], test]),
    )
    simulated_robot.close()
    return attempt, first[0] if first else None


def _stage_row(run: TrainingRun, stage: StagePlan) -> Row:
    """Return the figures of a stage of a run."""
    rows = [row for row in run.history if row["name"] == stage.name]
    episodes = rows[-1]["episodes"]
    ends = {
        "first": [row for row in rows if row["episodes"] <= _FEW],
        "last": [row for row in rows if row["episodes"] > episodes - _FEW],
    }
    return {
        "run": run.name,
        "stage": stage.name,
        "episodes": episodes,
        "mean_time_s": 0.1 * sum(row["played"] * row["mean_steps"] for row in rows) / episodes,
        **{
            f"{outcome}_{end}_{_FEW}": sum(row["outcomes"].get(outcome, 0) for row in part)
            for end, part in ends.items()
            for outcome in _COUNTED
        },
        "most_circling": max(row["circling"] for row in rows),
        "validation": rows[-1]["validation"],
    }


def _fact(stage: str, rows: Sequence[Row]) -> Fact:
    """Return how many of the last episodes of a stage reached their goals, over all runs."""
    mine = [row for row in rows if row["stage"] == stage]
    reached = sum(row[f"goal_last_{_FEW}"] for row in mine)
    played = sum(row[f"{end}_last_{_FEW}"] for row in mine for end in _COUNTED)
    validation = [row["validation"][stage] for row in mine if stage in row["validation"]]
    more = f"validation {np.mean(validation):.2f}" if validation else "not validated"
    return Fact(f"{stage}, last episodes", f"{reached} of {played} goals", more)


def _test_row(run: str, stage: str, test: int, attempt: OffroadAttempt) -> Row:
    """Return the figures of a test drive."""
    return {
        "run": run,
        "stage": stage,
        "test": test + 1,
        "outcome": str(attempt.outcome),
        "time_s": attempt.time,
        "distance_m": attempt.distance,
        "shortest_m": attempt.shortest,
        "spl": attempt.spl,
    }


def _rewards(runs: Sequence[TrainingRun]) -> Iterator[Plot]:
    """Yield the rewards during training (Figure 17), and the goals that were reached."""
    figure = rewards_figure({run.name: run.history for run in runs})
    caption = "Reward of a control step, whole and by term (Fig. 17)"
    yield Plot(figure, "rewards", caption, drawn=True)
    for run in runs:
        caption = f"{run.name}: goals reached while exploring"
        yield Plot(learning_figure(run.history), f"learning-{run.name}", caption, drawn=True)


def _stages_table(rows: Sequence[Row]) -> Table:
    """Return the table of the stages of the runs."""
    return Table([row | _reached(row) for row in rows], _STAGE_COLUMNS, every="All counts")


def _reached(row: Row) -> Row:
    """Return how many of a stage's first and last episodes reached their goals."""
    return {
        f"{end} {_FEW}": f"{row[f'goal_{end}_{_FEW}']} of "
        f"{sum(row[f'{outcome}_{end}_{_FEW}'] for outcome in _COUNTED)}"
        for end in ("first", "last")
    }


def _worlds(worlds: Iterable[World]) -> Iterator[Plot]:
    """Yield a world of each family, with its starts and goals (Figures 12 and 15)."""
    for name, world in {world.name: world for world in worlds}.items():
        caption = f"{name}: starts and goals (Fig. 12, 15)"
        yield Plot(world_figure(world), f"world-{name}", caption)


def _scans(
    stages: Sequence[StagePlan], worlds: Mapping[str, World], driven: Mapping[Test, Tested]
) -> Plot | None:
    """Return the first virtual scan of each stage (Figure 13)."""
    sights = {}
    for stage in stages:
        _, sight = driven[0, stage.name, 0]
        if sight is not None:
            scanner = offroad(stage).simulated_robot.sensing.scanner
            name = f"{stage.name}: {scanner} laser"
            sights[name] = (worlds[stage.name], *sight)
    grid = offroad(stages[0]).simulated_robot.grid
    caption = f"{', '.join(sights)} (Fig. 13)"
    return Plot(sights_figure(sights, grid), "scans", caption) if sights else None


def _tests(
    runs: Sequence[TrainingRun], worlds: Mapping[str, World], driven: Mapping[Test, Tested]
) -> Iterator[Plot]:
    """Yield the test drives after each stage (Figures 14 and 16)."""
    for stage, world in worlds.items():
        drives: dict[str, list[OffroadAttempt]] = {run.name: [] for run in runs}
        for (k, name, _), (attempt, _) in driven.items():
            if name == stage:
                drives[runs[k].name].append(attempt)
        title = f"after {stage}: {world.name} {world.seed}"
        figure = tests_figure(world, drives, title)
        caption = f"Tests {title} (Fig. 14, 16)"
        yield Plot(figure, f"tests-{stage}", caption, drawn=True, light=True)
