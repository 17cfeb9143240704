"""Folders that commands write: results, pictures and the settings that made them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from andabata.app.plots.drives import drive_picture
from andabata.evaluation.drive import Driven
from andabata.records import atomic_io
from andabata.records.runs import describe, make_folder, write_json


def write_drive(
    folder: Path, driven: Driven, config: Mapping[str, Any], seed: int
) -> dict[str, Any]:
    """Write a drive's path, picture and settings into a folder.

    Args:
        folder: Folder to write, made where it is missing.
        driven: The drive.
        config: Settings of the robot, ready for JSON.
        seed: Seed of the drive.

    Returns:
        The drive without paths, and the name of the picture, ready for JSON.
    """
    data, picture = driven.as_dict(), make_folder(folder) / "drive.png"
    drawn = drive_picture(
        driven.world, driven.path, driven.task.goals, driven.title, walkers=driven.walkers
    )
    atomic_io.write(picture, drawn)
    write_json(folder / "drive.json", data)
    write_json(folder / "run.json", describe("drive", config, seed))
    return {name: value for name, value in data.items() if name not in ("path", "walkers")} | {
        "picture": str(picture)
    }


def write_evaluation(folder: Path, data: Mapping[str, Any]) -> None:
    """Write an evaluation's table, failures and settings into a folder."""
    write_json(folder / "evaluation.json", data)
    write_json(folder / "run.json", describe("evaluate", data["config"], data["seed"]))
