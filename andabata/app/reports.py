"""Reports of run folders of any kind, from labelled clouds to suites."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from andabata.app.console import Console, table_of
from andabata.app.options.shared import ClassifierOptions
from andabata.configuration.usage import UsageError
from andabata.report.about import add_about
from andabata.report.columns import spoken
from andabata.report.folder import RunFolderError, read_about
from andabata.report.page import Report
from andabata.tasks.registration import ROOM_TASK_NAMES


class RunKind(StrEnum):
    """Kinds of run that reports tell apart."""

    CLOUDS = "clouds generate"
    CELL_CLASSIFIER = "classifier train or evaluate"
    GROUND_CLASSIFIER = "classifier ground"
    OFFROAD_TRAINING = "train"
    SPN_TRAINING = "train --task spn"
    TD3_TRAINING = "train --task td3"
    DRIVE = "drive"
    OFFROAD_EVALUATION = "evaluate"
    ROOM_EVALUATION = "evaluate in rooms"
    BARN_EVALUATION = "evaluate --task barn"
    LIDAR_STUDY = "lidar-study"


_VERBS = {
    "clouds generate": RunKind.CLOUDS,
    "classifier train": RunKind.CELL_CLASSIFIER,
    "classifier evaluate": RunKind.CELL_CLASSIFIER,
    "classifier ground": RunKind.GROUND_CLASSIFIER,
    "drive": RunKind.DRIVE,
    "lidar-study": RunKind.LIDAR_STUDY,
}
"""Kinds of run that their verb alone tells."""

_ROOM_TRAININGS = {"spn": RunKind.SPN_TRAINING, "td3": RunKind.TD3_TRAINING}
"""Kind of a training in rooms by its task."""

Made = tuple[Report, dict[str, Any], RenderableType]
"""Page, figures ready for JSON, and table for people."""


@dataclass(frozen=True)
class MadeReport:
    """A report.

    Attributes:
        page: Page.
        data: Figures, ready for JSON.
        shown: Table for people.
    """

    page: Report
    data: dict[str, Any]
    shown: RenderableType


@dataclass(frozen=True)
class ReportOptions:
    """What the report of off-road training drives.

    Attributes:
        models: Classifiers of off-road runs.
        tests: Number of drives of each off-road stage's policy.
        workers: Number of processes.
        console: Console that shows the progress.
    """

    models: ClassifierOptions
    tests: int
    workers: int
    console: Console


def run_folders(folders: Sequence[Path]) -> list[Path]:
    """Return the folders of runs: of ``train --seeds``, those of the seeds in their order."""
    found: list[Path] = []
    for folder in folders:
        seeds = sorted(folder.glob("seed-*/run.json"), key=_seed)
        found += [file.parent for file in seeds] if _is_parent(folder, seeds) else [folder]
    return found


def run_kind(folder: Path) -> RunKind:
    """Return the kind of a run.

    Raises:
        RunFolderError: If the folder holds no run, or one of a verb without a report.
    """
    about = read_about(folder)
    verb, task, config = about.get("verb"), about.get("task"), about.get("config") or {}
    if verb in _VERBS:
        return _VERBS[verb]
    if verb == "evaluate":
        if task in ROOM_TASK_NAMES:
            return RunKind.ROOM_EVALUATION
        # Folders of earlier versions do not name these tasks.
        is_barn = task == "barn" or "vehicle" in config
        return RunKind.BARN_EVALUATION if is_barn else RunKind.OFFROAD_EVALUATION
    if verb == "train":
        stages = config.get("stages", {})
        tasks = {str(stage["environment"].get("task")) for stage in stages.values()}
        one = "".join(tasks) if len(tasks) == 1 else ""
        return _ROOM_TRAININGS.get(one, RunKind.OFFROAD_TRAINING)
    known = ", ".join(kind.value for kind in RunKind)
    raise RunFolderError(
        f"{folder}: expected a run of {known}; got one of {verb!r}, perhaps of another version"
    )


def make_report(folders: Sequence[Path], options: ReportOptions) -> MadeReport:
    """Return the report of runs of one kind.

    Args:
        folders: Folders of the runs.
        options: Drives of off-road training.

    Raises:
        UsageError: If the runs are of several kinds, or one would be enough.
        RunFolderError: If a folder is incomplete or of another version.
    """
    kinds = {folder: run_kind(folder) for folder in folders}
    kind = kinds[folders[0]]
    for folder, other in kinds.items():
        if other is not kind:
            raise UsageError(f"{folder}: expected a run of `{kind}` as the first, got `{other}`")
    if kind in _OF_SEVERAL:
        page, data, shown = _OF_SEVERAL[kind](folders, options)
    elif len(folders) > 1:
        raise UsageError(f"runs: expected one folder of `{kind}`, got {len(folders)}")
    else:
        page, data, shown = _OF_ONE[kind](folders[0])
    add_about(page, folders)
    return MadeReport(page, data, shown)


def _offroad_training(folders: Sequence[Path], options: ReportOptions) -> Made:
    """Return the report of off-road training."""
    from andabata.report.training import report_runs
    from andabata.report.training_folder import common_stages, read_runs

    loaded = options.models.load()
    found = read_runs(folders, loaded)
    drives = len(found) * len(common_stages(found)) * options.tests
    with options.console.progress("test drives", drives) as step:
        page, data = report_runs(
            found,
            loaded,
            tests=options.tests,
            workers=options.workers,
            on_test=lambda: step(1),
        )
    return page, data, table_of([spoken(row) for row in data["tests"]])


def _spn_training(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of training for SPN."""
    from andabata.report.room_training import group_table, report_room_training

    page, data = report_room_training(folders)
    return page, data, table_of(group_table(data["groups"]))


def _td3_training(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of training for TD3's task."""
    from andabata.report.success import report_success, success_table

    page, data = report_success(folders)
    return page, data, table_of(success_table(data["groups"]))


def _drives(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of drives in one world."""
    from andabata.report.drive import report_drives

    page, data = report_drives(folders)
    shown = ("drive", "goal", "outcome", "time_s", "distance_m", "spl")
    return page, data, table_of([spoken(row, shown) for row in data["goals"]])


def _clouds(folder: Path) -> Made:
    """Return the report of labelled clouds."""
    from andabata.report.clouds import report_clouds

    page, data = report_clouds(folder)
    return page, data, table_of([spoken(row) for row in data["splits"]])


def _cell_classifier(folder: Path) -> Made:
    """Return the report of a classifier of polar cells."""
    from andabata.evaluation.classifier import tables
    from andabata.report.classifier import report_classifier

    page, data = report_classifier(folder)
    return page, data, tables(data)


def _ground_classifier(folder: Path) -> Made:
    """Return the report of a classifier of ground cells."""
    from andabata.evaluation.classifier import ground_classifier_table
    from andabata.report.classifier import report_ground

    page, data = report_ground(folder)
    return page, data, ground_classifier_table(data)


def _offroad_evaluation(folder: Path) -> Made:
    """Return the report of an evaluation off-road."""
    from andabata.app.tables import evaluation_tables
    from andabata.report.evaluation import report_evaluation

    page, data = report_evaluation(folder)
    return page, data, evaluation_tables(data["rows"])


def _barn_evaluation(folder: Path) -> Made:
    """Return the report of an evaluation in fields of cylinders."""
    from andabata.app.barn_tables import barn_tables
    from andabata.report.barn import report_barn

    page, data = report_barn(folder)
    return page, data, barn_tables(data)


def _room_evaluation(folder: Path) -> Made:
    """Return the report of an evaluation in rooms."""
    from andabata.app.tables import room_tables
    from andabata.report.room_folder import RoomFolder
    from andabata.report.rooms import report_rooms

    page, data = report_rooms(RoomFolder(folder))
    return page, data, room_tables(data)


def _lidar_study(folder: Path) -> Made:
    """Return the report of a study of a laser."""
    from andabata.app.tables import study_table
    from andabata.report.room_folder import RoomFolder
    from andabata.report.rooms import report_study

    page, data = report_study(RoomFolder(folder))
    return page, data, study_table(data["rows"])


_OF_SEVERAL: dict[RunKind, Callable[[Sequence[Path], ReportOptions], Made]] = {
    RunKind.OFFROAD_TRAINING: _offroad_training,
    RunKind.SPN_TRAINING: _spn_training,
    RunKind.TD3_TRAINING: _td3_training,
    RunKind.DRIVE: _drives,
}
"""Reports that several runs go into together."""

_OF_ONE: dict[RunKind, Callable[[Path], Made]] = {
    RunKind.CLOUDS: _clouds,
    RunKind.CELL_CLASSIFIER: _cell_classifier,
    RunKind.GROUND_CLASSIFIER: _ground_classifier,
    RunKind.OFFROAD_EVALUATION: _offroad_evaluation,
    RunKind.BARN_EVALUATION: _barn_evaluation,
    RunKind.ROOM_EVALUATION: _room_evaluation,
    RunKind.LIDAR_STUDY: _lidar_study,
}
"""Reports of one run."""


def _is_parent(folder: Path, seeds: Sequence[Path]) -> bool:
    """Return True if a folder holds runs and is none."""
    return bool(seeds) and not (folder / "run.json").exists()


def _seed(file: Path) -> tuple[int, str]:
    """Return what the folders of seeds are sorted by: ``seed-10`` after ``seed-9``."""
    number = file.parent.name.removeprefix("seed-")
    return (int(number) if number.isdecimal() else 0), number
