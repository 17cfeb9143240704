"""Reports of evaluations in rooms, with the figures of Zhang et al. (arXiv 2010.10209)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from andabata.evaluation.room_drives import RoomAttempt, drive_tasks, drive_tour
from andabata.evaluation.room_moments import watch_cell
from andabata.evaluation.room_policies import TRAINED
from andabata.evaluation.room_table import Cell, over_rooms
from andabata.evaluation.rooms import RoomEvaluationConfig, cell_task, tasks_of
from andabata.evaluation.support_points import drive_with_support_points
from andabata.machine.planar.lidar import TRAINING_LIDAR
from andabata.report.blocks import Folded, Picture, Plot, Table, Text
from andabata.report.columns import HITS, several, with_reached
from andabata.report.page import Page, Section
from andabata.report.plots.film import film
from andabata.report.plots.room_clip import RATE, room_film
from andabata.report.plots.room_curves import study_figure
from andabata.report.plots.room_movers import NO_MOVERS, Movers
from andabata.report.plots.rooms import (
    ends_figure,
    memory_text,
    memory_words,
    moment_of,
    sudden_figure,
    support_points_figure,
    tour_figure,
    trajectories_figure,
)
from andabata.report.room_folder import RoomFolder
from andabata.tasks.rooms.config import RoomConfig
from rl.policies.point_set import PointSetPolicy
from rl.policy import Policy
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room

Row = dict[str, Any]

Driven = TypeVar("Driven")

_SHOWN_LIDARS = ("hokuyo-270", "ten-beams", "ten-beams-forward")
"""Lasers whose paths are shown, as in Fig. 7, if they were driven; else the first three."""

_SHOWN_POLICIES = 4
"""Largest number of policies whose support points are shown side by side, as in Fig. 6."""

_SHOWN_ROOMS = 4
"""Number of rooms side by side in a picture, and of those that a study shows."""

_SHOWN_TASKS = 4
"""Number of tasks of a room that support points are shown for, as in Fig. 6."""

_CELL = ("room", "policy", "lidar", "memory")
"""Columns that say what a cell is."""

_TOGETHER = ("policy", "lidar", "memory", "reached", "success_rate", "collisions", "timeouts")
"""Columns of all rooms together."""

_MANY = 24
"""Number of cells beyond which their table is folded."""

_BARS = 44
"""Width of a figure of ends, in bars; a room takes four more than its lasers."""

_DIFFERENCES = ("policy", "against", "lidar", "memory", "tasks", "success_rate", "difference")
"""Columns of a difference between policies."""

_STUDY = ("text", "reached", "success_rate", "collisions", "timeouts", "difference")
"""Columns of a laser of a study that are not folded."""

_OTHER_ROOMS = (
    "Rooms and rulings differ from the paper's, which are not all published: Env0 to Env3 are this "
    "project's own, as are those of the improved TD3; Env4 to Env7 follow the paper's references. "
    "Scores depend on the size of a room; the ratio of control steps to those of an oracle "
    "(T/oracle) does not. The oracle leaves out what moves."
)

_POINTS_TEXT = (
    "The points that give the features of a policy on points, every 20 control steps, with the "
    "laser of training (Fig. 6); moments after 160 steps are left out."
)


def report_rooms(path: Path) -> tuple[Page, Row]:
    """Return a page about an evaluation in rooms, and its figures.

    Args:
        path: Folder of the evaluation.
    """
    folder = RoomFolder(path)
    result, config = folder.result, folder.config
    shown = [lidar for lidar in config.lidars if lidar in _SHOWN_LIDARS] or config.lidars
    rooms = _rooms(config)
    moments, data = _moments(folder, rooms)
    paths = _paths(folder, {lidar: lidar for lidar in shown[:3]}, rooms)
    lead = ", ".join(dict.fromkeys(config.rooms))
    page = Page("Navigation in rooms", lead, (), [_success(result, config), paths, *moments])
    return page, {name: result[name] for name in ("rows", "pooled", "differences")} | data


def report_study(path: Path) -> tuple[Page, Row]:
    """Return a page about a study of a laser, and its figures.

    Args:
        path: Folder of the study.
    """
    folder = RoomFolder(path)
    result = folder.result
    rows = result["rows"]
    ordered = sorted(rows[1:], key=lambda row: float(row["difference"]))
    chosen = [rows[0], *ordered[-1:], *(ordered[:1] if len(ordered) > 1 else [])]
    rooms = _rooms(folder.config)[:_SHOWN_ROOMS]
    moments, data = _moments(folder, rooms)
    paths = _paths(folder, {row["text"]: row["lidar"] for row in chosen}, rooms)
    page = Page("Where to mount the laser", "", (), [_study(result), paths, *moments])
    return page, {"rows": rows, "advice": result["advice"]} | data


def _rooms(config: RoomEvaluationConfig) -> list[Room]:
    """Return the rooms of an evaluation."""
    return [make_room(room) for room in dict.fromkeys(config.rooms)]


def _success(result: Mapping[str, Any], config: RoomEvaluationConfig) -> Section:
    """Return how drives ended: in all rooms together, by room and cell, and in differences."""
    tasks = several(config.pairs, "task") if config.pairs else "Fixed tasks"
    number = "Fig. 4b" if config.task.task == "td3" else "Fig. 8"
    rows, (first, *others) = result["rows"], _groups(result)
    every = [*result["pooled"], *rows]
    cells = Table(with_reached(every), _cell_columns(every), every="All columns")
    words = "Differences in success, all rooms together, on the same tasks:"
    differences = [Text(words), Table(result["differences"], _DIFFERENCES)]
    return Section(
        "Success",
        f"{tasks} a cell. {_OTHER_ROOMS}",
        Table(with_reached(over_rooms(rows)), _TOGETHER, "All rooms together"),
        *_ends(rows, first, number),
        *(
            Folded(f"How drives of {', '.join(names)} ended", _ends(rows, names, number))
            for names in others
        ),
        Folded(f"All {len(every)} cells", [cells]) if len(every) > _MANY else cells,
        *(differences if result["differences"] else ()),
    )


def _study(result: Mapping[str, Any]) -> Section:
    """Return the differences of lasers from the laser as it is, with the advice."""
    rows = result["rows"]
    title = f"{rows[0]['lidar']}, {len(result['policies'])} policies, {rows[0]['trials']} drives"
    caption = "Success with each laser against the laser as it is, on the same tasks"
    return Section(
        "Differences",
        result["advice"],
        Text("Each interval below is that of one laser; the advice allows for all poses at once."),
        Plot(study_figure(rows, title), "differences", caption),
        Table(with_reached(rows), _STUDY, every="All columns"),
    )


def _groups(result: Mapping[str, Any]) -> list[list[str]]:
    """Return policies that are shown together: seeds of the same settings, else each alone."""
    names = list(dict.fromkeys(row["policy"] for row in result["rows"]))
    pooled = dict.fromkeys(row["policy"] for row in result["pooled"])
    groups = [[name for name in names if name in text.split(", ")] for text in pooled]
    together = {name for group in groups for name in group}
    return groups + [[name] for name in names if name not in together]


def _ends(rows: Sequence[Row], names: Sequence[str], number: str) -> list[Plot]:
    """Return how the drives of policies ended, as many rooms a figure as can be read."""
    mine, text = [row for row in rows if row["policy"] in names], ", ".join(names)
    rooms = list(dict.fromkeys(row["room"] for row in mine))
    lasers = len({row["lidar"] for row in mine})
    step = max(round(_BARS / (lasers + 4)), 1)
    parts = [rooms[begin : begin + step] for begin in range(0, len(rooms), step)]
    caption = f"How drives ended ({number}): {text}"
    return [
        Plot(ends_figure([row for row in mine if row["room"] in part], text), "ends", caption)
        for part in parts
    ]


def _cell_columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the columns of cells that are not folded: those that tell the rows apart."""
    several = [key for key in _CELL if len({row[key] for row in rows}) > 1] or ["room"]
    hits: Sequence[str] = HITS if any(row.get("movers") for row in rows) else ()
    return [
        *several,
        "reached",
        "success_rate",
        "collisions",
        *hits,
        "timeouts",
        "steps_to_oracle",
        "spl",
    ]


def _paths(folder: RoomFolder, lidars: Mapping[str, str], rooms: Sequence[Room]) -> Section:
    """Return paths and ends of the first policy, and a moving picture of its first drives (Fig. 7).

    Args:
        folder: Folder of the drives.
        lidars: Lasers by their names in the picture.
        rooms: Rooms.
    """
    name = next(iter(folder.policies))
    parts = [rooms[begin : begin + _SHOWN_ROOMS] for begin in range(0, len(rooms), _SHOWN_ROOMS)]
    plots = [
        _paths_plot(folder, lidars, part, memory)
        for memory in folder.config.memories
        for part in parts
    ]
    filmed = next((room for room in rooms if _has_movers(room)), rooms[0])
    text = f"Drives of {name}: paths, and where and how they ended (Fig. 7)."
    return Section("Paths", text, *plots, _film(folder, next(iter(lidars.values())), filmed))


def _paths_plot(
    folder: RoomFolder, lidars: Mapping[str, str], rooms: Sequence[Room], memory: str
) -> Plot:
    """Return paths and ends of the first policy in some rooms, a panel a laser and room."""
    name = next(iter(folder.policies))
    cells = {
        ("laser of its training" if text == TRAINED else f"laser {text}", room.name): Cell(
            name, lidar, room.name, memory
        )
        for text, lidar in lidars.items()
        for room in rooms
    }
    found = {key: folder.drives(cell) for key, cell in cells.items()}
    moving = {room.name for room in rooms if _has_movers(room)}
    movers = {key: _movers(folder, cell) for key, cell in cells.items() if cell.room in moving}
    title = f"policy {name}, {memory_words(memory)}"
    figure = trajectories_figure(found, rooms, title, movers)
    caption = f"Paths and ends: {name}, {memory_text(memory)}"
    return Plot(figure, f"paths-{memory}", caption, drawn=True)


def _has_movers(room: Room) -> bool:
    """Return True if something moves in a room from the beginning to the end."""
    return bool(room.movers) and not room.appearances


def _movers(folder: RoomFolder, cell: Cell) -> Movers:
    """Return the movers of the first drive of a cell, which is driven again."""
    watched = watch_cell(folder.config, folder.policies[cell.policy], cell, 0)
    return np.stack([moment.movers for moment in watched.moments])


def _film(folder: RoomFolder, lidar: str, room: Room) -> Picture:
    """Return a moving picture of the first policy's first drives in a room, a panel a memory."""
    name, policy = next(iter(folder.policies.items()))
    cells = {
        memory_text(memory): Cell(name, lidar, room.name, memory)
        for memory in folder.config.memories
    }
    drives = {text: folder.drives(cell) for text, cell in cells.items()}
    radius = cell_task(next(iter(cells.values())), folder.config, policy).robot.radius
    text, movers = f"{name}, {lidar}: the first drives in {room.name}, begun together", NO_MOVERS
    if room.movers:
        text = f"{name}, {lidar}: the first drive in {room.name}, among what moves there"
        movers = {name: _movers(folder, cell) for name, cell in cells.items()}
    pictures = film(room_film(drives, room, radius, movers), RATE, ".gif")
    return Picture(pictures, text, "gif", "drives")


def _moments(folder: RoomFolder, rooms: Sequence[Room]) -> tuple[list[Section | None], Row]:
    """Return what is driven anew, and its figures: support points, tours, sudden obstacles."""
    policies = folder.policies.items()
    on_points = {name: policy for name, policy in policies if isinstance(policy, PointSetPolicy)}
    standing = [room for room in rooms if on_points and not room.appearances]
    points = [_support_points(folder.config, on_points, room) for room in standing]
    tours = [_tour(folder, room) for room in rooms if _is_tour(room)]
    sudden = [_sudden(folder, room) for room in rooms if room.appearances]
    plots = [plot for plot, _ in (*tours, *sudden)]
    sections = [
        Section("Support points", _POINTS_TEXT, *points) if on_points else None,
        Section("Tours and obstacles that appear", "Driven from start to end (Fig. 10).", *plots)
        if plots
        else None,
    ]
    data = {"tours": [row for _, row in tours], "appearances": [row for _, row in sudden]}
    return sections, data


def _support_points(
    config: RoomEvaluationConfig, policies: Mapping[str, Policy], room: Room
) -> Plot:
    """Return the support points of drives to the goals of a room, or to those of four pairs."""
    fixed = () if _is_tour(room) else room.tasks
    tasks = (fixed or tasks_of(room, config))[:_SHOWN_TASKS]
    cell = Cell("", TRAINING_LIDAR.label, room.name, "reactive")
    found = {
        name: drive_with_support_points(policy, cell_task(cell, config, policy), tasks)
        for name, policy in list(policies.items())[:_SHOWN_POLICIES]
    }
    figure = support_points_figure(found, room, f"{room.name}: support points")
    return Plot(figure, f"support-{room.name}", f"Support points in {room.name} (Fig. 6)")


def _tour(folder: RoomFolder, room: Room) -> tuple[Plot, Row]:
    """Return the tour of a room, and its figures (Fig. 10a)."""
    goals, start = [task.goal for task in room.tasks], room.tasks[0].start
    drives = _driven(folder, room, lambda policy, task: drive_tour(policy, task, start, goals))
    figure = tour_figure(drives, room, f"{room.name}: goals in a row")
    legs = {name: [_drive_row(leg) for leg in driven] for name, driven in drives.items()}
    row = {"room": room.name, "goals": len(goals), "legs": legs}
    return Plot(figure, f"tour-{room.name}", f"Tour of {room.name} (Fig. 10a)"), row


def _sudden(folder: RoomFolder, room: Room) -> tuple[Plot, Row]:
    """Return a drive past obstacles that appear, and its figures (Fig. 10b)."""
    first = room.tasks[:1]
    drives = _driven(folder, room, lambda policy, task: drive_tasks(policy, task, first)[0])
    figure = sudden_figure(drives, room, f"{room.name}: obstacles that appear")
    caption = f"Obstacles that appear in {room.name} (Fig. 10b)"
    rows = {
        name: _drive_row(one)
        | {"appear_after": [moment_of(one, each) for each in room.appearances]}
        for name, one in drives.items()
    }
    return Plot(figure, f"sudden-{room.name}", caption), {"room": room.name, "drives": rows}


def _driven(
    folder: RoomFolder, room: Room, drive: Callable[[Policy, RoomConfig], Driven]
) -> dict[str, Driven]:
    """Return what the first policy drives with its first laser and each memory, by their names."""
    config, (name, policy) = folder.config, next(iter(folder.policies.items()))
    lidar = next((one for one in config.lidars if one in _SHOWN_LIDARS), config.lidars[0])
    cells = {memory: Cell(name, lidar, room.name, memory) for memory in config.memories}
    return {
        f"{lidar}, {memory_text(memory)}": drive(policy, cell_task(cell, config, policy))
        for memory, cell in cells.items()
    }


def _drive_row(drive: RoomAttempt) -> Row:
    """Return the figures of a drive."""
    return {"outcome": str(drive.outcome), "steps": drive.detail.steps, "length_m": drive.distance}


def _is_tour(room: Room) -> bool:
    """Return True if each task of a room starts where the one before ended."""
    return len({(task.start.x, task.start.y) for task in room.tasks}) > 1
