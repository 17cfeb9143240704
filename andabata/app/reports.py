"""Reports of run folders of any kind: training off-road and in rooms, evaluations, studies."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from andabata.app.console import Console, table_of
from andabata.app.options import ClassifierOptions
from andabata.app.usage import UsageError
from andabata.tasks.registration import ROOM_TASKS


class RunKind(StrEnum):
    """Kinds of run that reports tell apart."""

    OFFROAD_TRAINING = "train"
    SPN_TRAINING = "train --task spn"
    TD3_TRAINING = "train --task td3"
    ROOM_EVALUATION = "evaluate in rooms"
    LIDAR_STUDY = "lidar-study"


_ROOM_TRAININGS = {"spn": RunKind.SPN_TRAINING, "td3": RunKind.TD3_TRAINING}
"""Kind of a training in rooms by its task."""


@dataclass(frozen=True)
class MadeReport:
    """A report.

    Attributes:
        page: HTML page.
        data: Figures, ready for JSON.
        shown: Table for people.
    """

    page: bytes
    data: dict[str, Any]
    shown: RenderableType


def run_folders(folders: Sequence[Path]) -> list[Path]:
    """Return the folders of runs: of ``train --seeds``, those of the seeds in their order."""
    found: list[Path] = []
    for folder in folders:
        seeds = sorted(folder.glob("seed-*/run.json"), key=_seed)
        found += [file.parent for file in seeds] if _is_parent(folder, seeds) else [folder]
    return found


def run_kind(folder: Path) -> RunKind:
    """Return the kind of a run; that of off-road training checks what it reads itself.

    Raises:
        FileNotFoundError: If the folder holds no run.
    """
    about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    verb = about.get("verb")
    if verb == "lidar-study":
        return RunKind.LIDAR_STUDY
    if verb == "evaluate" and about.get("task") in ROOM_TASKS:
        return RunKind.ROOM_EVALUATION
    stages = about.get("config", {}).get("stages", {})
    tasks = {str(stage["environment"].get("task")) for stage in stages.values()}
    one = "".join(tasks) if len(tasks) == 1 else ""
    return _ROOM_TRAININGS.get(one, RunKind.OFFROAD_TRAINING)


def make_report(
    folders: Sequence[Path], models: ClassifierOptions, tests: int, workers: int, console: Console
) -> MadeReport:
    """Return the report of runs of one kind.

    Args:
        folders: Folders of the runs.
        models: Classifiers of off-road runs.
        tests: Number of drives of each off-road stage's policy.
        workers: Number of processes.
        console: Console that shows the progress.

    Raises:
        UsageError: If the runs are of several kinds, or one would be enough.
    """
    kinds = {folder: run_kind(folder) for folder in folders}
    kind = kinds[folders[0]]
    for folder, other in kinds.items():
        if other is not kind:
            raise UsageError(f"{folder}: expected a run of `{kind}` as the first, got `{other}`")
    if kind is RunKind.OFFROAD_TRAINING:
        return _offroad(folders, models, tests, workers, console)
    if kind is RunKind.SPN_TRAINING:
        from andabata.app.room_training_report import group_table, report_room_training

        page, data = report_room_training(folders)
        return MadeReport(page, data, table_of(group_table(data["groups"])))
    if kind is RunKind.TD3_TRAINING:
        from andabata.app.success_report import report_success, success_table

        page, data = report_success(folders)
        return MadeReport(page, data, table_of(success_table(data["groups"])))
    if len(folders) > 1:
        raise UsageError(f"runs: expected one folder of `{kind}`, got {len(folders)}")
    return _rooms(folders[0], kind)


def _offroad(
    folders: Sequence[Path], models: ClassifierOptions, tests: int, workers: int, console: Console
) -> MadeReport:
    """Return the report of off-road training."""
    from andabata.app.training_report import common_stages, read_runs, report_runs

    loaded = models.load()
    found = read_runs(folders, loaded)
    drives = len(found) * len(common_stages(found)) * tests
    with console.progress("test drives", drives) as step:
        page, data = report_runs(
            found, loaded, tests=tests, workers=workers, on_test=lambda: step(1)
        )
    return MadeReport(page, data, table_of(data["tests"]))


def _rooms(folder: Path, kind: RunKind) -> MadeReport:
    """Return the report of an evaluation in rooms, or of a study of a laser."""
    from andabata.app.room_folder import RoomFolder
    from andabata.app.room_report import report_rooms, report_study
    from andabata.app.tables import room_tables, study_table

    if kind is RunKind.LIDAR_STUDY:
        page, data = report_study(RoomFolder(folder))
        return MadeReport(page, data, study_table(data["rows"]))
    page, data = report_rooms(RoomFolder(folder))
    return MadeReport(page, data, room_tables(data))


def _is_parent(folder: Path, seeds: Sequence[Path]) -> bool:
    """Return True if a folder holds runs and is none."""
    return bool(seeds) and not (folder / "run.json").exists()


def _seed(file: Path) -> tuple[int, str]:
    """Return what the folders of seeds are sorted by: ``seed-10`` after ``seed-9``."""
    number = file.parent.name.removeprefix("seed-")
    return (int(number) if number.isdecimal() else 0), number
