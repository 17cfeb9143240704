"""Section of a report on how its runs were made: command, commit, seeds, versions, settings."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from andabata.report.folder import read_about
from andabata.report.page import Report


def add_about(page: Report, folders: Sequence[Path]) -> None:
    """Add how runs were made.

    Args:
        page: Page to add to.
        folders: Folders of the runs.

    Raises:
        RunFolderError: If one holds no run.
    """
    abouts = [read_about(folder) for folder in folders]
    first = abouts[0]
    page.section("How it was made")
    page.table([_row(folder, about) for folder, about in zip(folders, abouts, strict=True)])
    commands = list(dict.fromkeys(about["command"] for about in abouts if about.get("command")))
    if commands:
        page.code("\n".join(commands))
    else:
        page.note("The command is not on record: the run is of an earlier version.")
    if first.get("versions"):
        with page.folded("Versions"):
            page.table([{"package": name, "version_of": v} for name, v in _versions(first)])
    with page.folded("Settings" if len(folders) == 1 else f"Settings of {folders[0]}"):
        page.code(json.dumps(first.get("config"), indent=1, sort_keys=True))


def _row(folder: Path, about: dict[str, Any]) -> dict[str, Any]:
    """Return a run in a few words."""
    return {
        "folder": str(folder),
        "verb": about.get("verb"),
        "seed": about.get("seed"),
        "commit": about.get("commit"),
        "version": (about.get("versions") or {}).get("andabata"),
        "config_sha256": str(about.get("config_sha256") or "")[:12],
    }


def _versions(about: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the versions of Python and of packages."""
    found = {"python": about.get("python"), **about["versions"]}
    return [(name, str(version)) for name, version in found.items() if version is not None]
