"""Folders that commands write: results, pictures and the settings that made them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from andabata.evaluation.drive import Driven
from andabata.report.plots.axes import png
from andabata.report.plots.drives import drive_figure
from andabata.runs import atomic_io
from andabata.runs.folder import describe, make_folder, write_json
from traversability.files import cloud_to_bytes

DRIVE = "drive.json"
"""Result of a drive."""

EVALUATION = "evaluation.json"
"""Result of an evaluation."""

LAST_CLOUD = "last_cloud.npz"
"""Last cloud of a drive, levelled, around the robot."""


def write_drive(
    folder: Path,
    driven: Driven,
    config: Mapping[str, Any],
    seed: int,
    clip: Path | None = None,
) -> dict[str, Any]:
    """Write a drive's path, picture, last cloud and settings into a folder.

    Args:
        folder: Folder to write, made where it is missing.
        driven: The drive.
        config: Settings of the robot, ready for JSON.
        seed: Seed of the drive.
        clip: Clip of the drive that was written, None for none.

    Returns:
        The drive without paths, and the name of the picture, ready for JSON.
    """
    data, picture = driven.as_dict(), make_folder(folder) / "drive.png"
    data |= {"clip": str(clip)} if clip is not None else {}
    drawn = drive_figure(
        driven.world, driven.path, driven.task.goals, driven.title, walkers=driven.walkers
    )
    atomic_io.write(picture, png(drawn))
    if driven.cloud is not None:
        atomic_io.write(folder / LAST_CLOUD, cloud_to_bytes(driven.cloud))
    write_json(folder / DRIVE, data)
    write_json(folder / "run.json", describe("drive", config, seed))
    return without_paths(data) | {"picture": str(picture)}


def without_paths(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a drive without its long lists: paths, and motion over time."""
    return {name: data[name] for name in data if name not in ("path", "walkers", "trace")}
