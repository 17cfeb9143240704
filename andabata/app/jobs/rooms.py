"""Evaluations in rooms with their progress on the console, and their folder."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.engine import Engine
from andabata.evaluation.lidar_study import LidarStudyConfig, study_lidar
from andabata.evaluation.room_drives import RoomDrive
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import (
    OnCell,
    RoomEvaluationConfig,
    cells_of,
    evaluate_rooms,
)
from andabata.report.room_folder import RoomFolder
from rl.policy import Policy


def run_room_evaluation(
    config: RoomEvaluationConfig,
    policies: Mapping[str, Policy],
    engine: Engine,
    folder: Path | None,
    console: Console,
) -> dict[str, Any]:
    """Evaluate policies in rooms and return the table and the settings, ready for JSON.

    Args:
        config: Rooms, lasers, memories and pairs.
        policies: Policies by name.
        engine: Engine that does the work.
        folder: Folder for the journal, the drives and the results, or None. An evaluation that was
            killed goes on from the journal.
        console: Console that shows the progress.
    """
    kept = None if folder is None else RoomFolder(folder)
    with watched_cells(config, policies, kept, console) as on_cell:
        journal = None if kept is None else kept.journal
        table = evaluate_rooms(config, policies, engine, journal, on_cell)
    data = {
        "rows": table.rows,
        "pooled": table.pooled,
        "differences": table.differences,
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
    }
    if kept is not None:
        kept.finish("evaluate", config, policies, data)
    return data


def run_lidar_study(
    config: LidarStudyConfig,
    policies: Mapping[str, Policy],
    engine: Engine,
    folder: Path | None,
    console: Console,
) -> dict[str, Any]:
    """Study a laser and return rows, advice and settings, ready for JSON.

    Args:
        config: Laser, changes, rooms and pairs.
        policies: Policies by name, such as several seeds.
        engine: Engine that does the work.
        folder: Folder as of ``run_room_evaluation``, or None.
        console: Console that shows the progress.
    """
    kept, cells = None if folder is None else RoomFolder(folder), config.cells
    with watched_cells(cells, policies, kept, console) as on_cell:
        journal = None if kept is None else kept.journal
        study = study_lidar(config, policies, engine, journal, on_cell)
    data = {
        "rows": study.rows,
        "advice": study.advice,
        "policies": list(policies),
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
    }
    if kept is not None:
        kept.finish("lidar-study", cells, policies, data)
    return data


@contextmanager
def watched_cells(
    config: RoomEvaluationConfig,
    policies: Mapping[str, Policy],
    folder: RoomFolder | None,
    console: Console,
) -> Iterator[OnCell]:
    """Yield a function that shows the progress of cells and keeps their drives.

    Args:
        config: Settings of the cells.
        policies: Policies by name.
        folder: Folder for the drives, None for none.
        console: Console that shows the progress.
    """
    numbers = {cell: k for k, cell in enumerate(cells_of(config, tuple(policies)))}
    if folder is not None:
        folder.begin()
    with console.progress("cells", len(numbers)) as step:

        def on_cell(cell: Cell, drives: list[RoomDrive] | None) -> None:
            if folder is not None and drives is not None:
                folder.keep_drives(numbers[cell], drives)
            step(1, f"{cell.room}, {cell.lidar}, {cell.memory}")

        yield on_cell
