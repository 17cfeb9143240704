"""Reports of run folders of any kind, from labelled clouds to suites."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from andabata.app.run_kinds import RUN_KINDS, RunKind, known_kind
from andabata.configuration.usage import UsageError
from andabata.report.about import about_section
from andabata.report.folder import RunFolderError, read_about
from andabata.report.options import ReportOptions
from andabata.report.page import Page


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


def make_report(
    folders: Sequence[Path], options: ReportOptions
) -> tuple[Page, dict[str, Any], RenderableType]:
    """Return the report of runs of one kind: page, figures ready for JSON, and table for people.

    Args:
        folders: Folders of the runs.
        options: Drives of the report of off-road training, and their robot.

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
    return page.with_section(about_section(folders)), data, kind.shown(data)


def _is_parent(folder: Path, seeds: Sequence[Path]) -> bool:
    """Return True if a folder holds runs and is none."""
    return bool(seeds) and not (folder / "run.json").exists()


def _seed(file: Path) -> tuple[int, str]:
    """Return what the folders of seeds are sorted by: ``seed-10`` after ``seed-9``."""
    number = file.parent.name.removeprefix("seed-")
    return (int(number) if number.isdecimal() else 0), number
