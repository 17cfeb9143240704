"""Reports of run folders of any kind, from labelled clouds to suites."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from andabata.app.console import Console
from andabata.app.options.models import ClassifierOptions
from andabata.app.run_kinds import RUN_KINDS, RunKind, known_kind
from andabata.configuration.usage import UsageError
from andabata.report.about import add_about
from andabata.report.folder import RunFolderError, read_about
from andabata.report.page import Report

Made = tuple[Report, dict[str, Any]]
"""Page, and its figures ready for JSON."""


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
    found = known_kind(about)
    if found is None:
        known = ", ".join(kind.name for kind in RUN_KINDS)
        raise RunFolderError(
            f"{folder}: expected a run of {known}; got one of {about.get('verb')!r}, perhaps of "
            "another version"
        )
    return found


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
            raise UsageError(
                f"{folder}: expected a run of `{kind.name}` as the first, got `{other.name}`"
            )
    if len(folders) > 1 and not kind.takes_several:
        raise UsageError(f"runs: expected one folder of `{kind.name}`, got {len(folders)}")
    given = (folders, options) if kind.takes_several else folders
    page, data = kind.function("report")(*given)
    add_about(page, folders)
    return MadeReport(page, data, kind.function("table")(data))


def report_offroad_training(folders: Sequence[Path], options: ReportOptions) -> Made:
    """Return the report of off-road training."""
    from andabata.report.training import report_runs
    from andabata.report.training_folder import common_stages, read_runs

    loaded = options.models.load()
    found = read_runs(folders, loaded)
    drives = len(found) * len(common_stages(found)) * options.tests
    with options.console.progress("test drives", drives) as step:
        return report_runs(
            found,
            loaded,
            tests=options.tests,
            workers=options.workers,
            on_test=lambda: step(1),
        )


def report_spn_training(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of training for SPN."""
    from andabata.report.room_training import report_room_training

    return report_room_training(folders)


def report_td3_training(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of training for TD3's task."""
    from andabata.report.success import report_success

    return report_success(folders)


def report_several_drives(folders: Sequence[Path], _: ReportOptions) -> Made:
    """Return the report of drives in one world."""
    from andabata.report.drive import report_drives

    return report_drives(folders)


def _is_parent(folder: Path, seeds: Sequence[Path]) -> bool:
    """Return True if a folder holds runs and is none."""
    return bool(seeds) and not (folder / "run.json").exists()


def _seed(file: Path) -> tuple[int, str]:
    """Return what the folders of seeds are sorted by: ``seed-10`` after ``seed-9``."""
    number = file.parent.name.removeprefix("seed-")
    return (int(number) if number.isdecimal() else 0), number
