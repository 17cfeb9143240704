"""Section of a report on how its runs were made: command, commit, seeds, versions, settings."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from andabata.report.blocks import Code, Folded, Table, Text
from andabata.report.folder import read_about
from andabata.report.page import Section


def about_section(folders: Sequence[Path]) -> Section:
    """Return the section on how runs were made.

    Args:
        folders: Folders of the runs.

    Raises:
        RunFolderError: If one holds no run.
    """
    abouts = [read_about(folder) for folder in folders]
    first = abouts[0]
    commands = list(dict.fromkeys(about["command"] for about in abouts if about.get("command")))
    unknown = Text("The command is not on record: the run is of an earlier version.")
    settings = "Settings" if len(folders) == 1 else f"Settings of {folders[0]}"
    return Section(
        "How it was made",
        "",
        Table([_row(folder, about) for folder, about in zip(folders, abouts, strict=True)]),
        Code("\n".join(commands)) if commands else unknown,
        Folded("Versions", [Table(_versions(first))]) if first.get("versions") else None,
        Folded(settings, [Code(json.dumps(first.get("config"), indent=1, sort_keys=True))]),
    )


def _row(folder: Path, description: dict[str, Any]) -> dict[str, Any]:
    """Return a run in a few words."""
    return {
        "folder": str(folder),
        "verb": description.get("verb"),
        "seed": description.get("seed"),
        "commit": description.get("commit"),
        "version": (description.get("versions") or {}).get("andabata"),
        "config_sha256": str(description.get("config_sha256") or "")[:12],
    }


def _versions(description: dict[str, Any]) -> list[dict[str, str]]:
    """Return the versions of Python and of packages."""
    found = {"python": description.get("python"), **description["versions"]}
    return [
        {"package": name, "version_of": str(version)}
        for name, version in found.items()
        if version is not None
    ]
