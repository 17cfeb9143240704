"""Reports of evaluations in rooms, with the figures of Zhang et al. (arXiv 2010.10209)."""

from collections.abc import Mapping, Sequence
from typing import Any

from andabata.app.plots.room_curves import study_picture
from andabata.app.plots.rooms import (
    ends_picture,
    memory_text,
    moment_of,
    sudden_picture,
    support_points_picture,
    tour_picture,
    trajectories_picture,
)
from andabata.app.report import Report
from andabata.app.room_folder import RoomFolder
from andabata.evaluation.room_drives import RoomDrive, drive_tasks, drive_tour
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomEvaluationConfig, cell_task, tasks_of
from andabata.evaluation.support_points import drive_with_support_points
from andabata.machine.planar_lidar import TRAINING_LIDAR
from rl.point_set import PointSetPolicy
from rl.policy import Policy
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomTask

Row = dict[str, Any]

_SHOWN_LIDARS = ("hokuyo-270", "ten-beams", "ten-beams-forward")
"""Lasers whose paths are shown, as in Fig. 7, if they were driven; else the first three."""

_SHOWN_POLICIES = 4
"""Largest number of policies whose support points are shown side by side, as in Fig. 6."""

_SHOWN_ROOMS = 4
"""Number of rooms side by side in a picture, and of those that a study shows."""

_SHOWN_TASKS = 4
"""Number of tasks of a room that support points are shown for, as in Fig. 6."""

_OTHER_ROOMS = (
    "Rooms and rulings differ from the paper's, which are not all published: Env0 to Env3 are this "
    "project's own, as are those of the improved TD3; Env4 to Env7 follow the paper's references. "
    "Scores depend on the size of a room; the ratio of control steps to those of an oracle "
    "(T/oracle) does not. The oracle leaves out what moves."
)


def report_rooms(folder: RoomFolder) -> tuple[bytes, dict[str, Any]]:
    """Return an HTML page about an evaluation in rooms, and its figures.

    Args:
        folder: Folder of the evaluation.
    """
    result, config = folder.result, folder.config
    page = Report("Navigation in rooms")
    page.section("Success", f"{config.pairs or 'Fixed'} tasks a cell. {_OTHER_ROOMS}")
    for names in _groups(result):
        rows = [row for row in result["rows"] if row["policy"] in names]
        text = ", ".join(names)
        page.picture(ends_picture(rows, text), f"How drives ended (Fig. 8): {text}")
    page.table([_table_row(row) for row in [*result["pooled"], *result["rows"]]])
    if result["differences"]:
        page.note("Differences in success, all rooms together, on the same tasks:")
        page.table(result["differences"])
    shown = [lidar for lidar in config.lidars if lidar in _SHOWN_LIDARS] or config.lidars
    _drives(page, folder, {lidar: lidar for lidar in shown[:3]}, _rooms(config))
    data: dict[str, Any] = {name: result[name] for name in ("rows", "pooled", "differences")}
    return _with_moments(page, folder, _rooms(config), data)


def report_study(folder: RoomFolder) -> tuple[bytes, dict[str, Any]]:
    """Return an HTML page about a study of a laser, and its figures.

    Args:
        folder: Folder of the study.
    """
    result = folder.result
    rows = result["rows"]
    page = Report("Where to mount the laser")
    page.section("Differences", result["advice"])
    page.note("Each interval below is that of one laser; the advice allows for all poses at once.")
    title = f"{rows[0]['lidar']}, {len(result['policies'])} policies, {rows[0]['trials']} drives"
    caption = "Success with each laser against the laser as it is, on the same tasks"
    page.picture(study_picture(rows, title), caption)
    page.table([{name: row[name] for name in row if name != "by_room"} for row in rows])
    ordered = sorted(rows[1:], key=lambda row: float(row["difference"]))
    shown = [rows[0], *ordered[-1:], *(ordered[:1] if len(ordered) > 1 else [])]
    rooms = _rooms(folder.config)[:_SHOWN_ROOMS]
    _drives(page, folder, {row["text"]: row["lidar"] for row in shown}, rooms)
    return _with_moments(page, folder, rooms, {"rows": rows, "advice": result["advice"]})


def _rooms(config: RoomEvaluationConfig) -> list[Room]:
    """Return the rooms of an evaluation."""
    return [make_room(room) for room in dict.fromkeys(config.rooms)]


def _groups(result: Mapping[str, Any]) -> list[list[str]]:
    """Return policies that are shown together: seeds of the same settings, else each alone."""
    names = list(dict.fromkeys(row["policy"] for row in result["rows"]))
    pooled = dict.fromkeys(row["policy"] for row in result["pooled"])
    groups = [[name for name in names if name in text.split(", ")] for text in pooled]
    together = {name for group in groups for name in group}
    return groups + [[name] for name in names if name not in together]


def _table_row(row: Mapping[str, Any]) -> Row:
    """Return a row of the evaluation as the page shows it."""
    return {
        "room": row["room"],
        "policy": row["policy"],
        "lidar": row["lidar"],
        "memory": row["memory"],
        "reached": f"{row['successes']}/{row['trials']}",
        "95 %": f"{row['wilson_low']:.3f} to {row['wilson_high']:.3f}",
        "crashes": row["collisions"],
        **_hits(row),
        "time-outs": row["timeouts"],
        "T/oracle": row["steps_to_oracle"],
        "SPL": row["spl"],
        "score": row["score"],
    }


def _hits(row: Mapping[str, Any]) -> Row:
    """Return how many of the crashes movers caused, in rooms that have some."""
    if not row.get("movers"):
        return {}
    return {
        "of them hit by a mover": row["hit_by_mover"],
        "hit while standing": row["hit_at_rest"],
    }


def _drives(
    page: Report, folder: RoomFolder, lidars: Mapping[str, str], rooms: Sequence[Room]
) -> None:
    """Add paths and ends of the first policy, up to four rooms a picture (Fig. 7).

    Args:
        page: Page to add to.
        folder: Folder of the drives.
        lidars: Lasers by their names in the picture.
        rooms: Rooms.
    """
    name = next(iter(folder.policies))
    page.section("Paths", f"Drives of {name}: paths, and where and how they ended (Fig. 7).")
    for memory in folder.config.memories:
        title = f"{name}, {memory_text(memory)}"
        for begin in range(0, len(rooms), _SHOWN_ROOMS):
            some = rooms[begin : begin + _SHOWN_ROOMS]
            found = {
                (text, room.name): folder.drives(Cell(name, lidar, room.name, memory))
                for text, lidar in lidars.items()
                for room in some
            }
            page.picture(trajectories_picture(found, some, title), f"Paths and ends: {title}")


def _with_moments(
    page: Report, folder: RoomFolder, rooms: Sequence[Room], data: dict[str, Any]
) -> tuple[bytes, dict[str, Any]]:
    """Add what is driven anew: support points, tours and obstacles that appear."""
    config, policies = folder.config, folder.policies
    on_points = {
        name: policy for name, policy in policies.items() if isinstance(policy, PointSetPolicy)
    }
    if on_points:
        page.section(
            "Support points",
            "The points that give the features of a policy on points, every 20 control steps, with "
            "the laser of training (Fig. 6); moments after 160 steps are left out.",
        )
        for room in rooms:
            if not room.appearances:
                _support_points(page, config, on_points, room)
    if any(_is_tour(room) or room.appearances for room in rooms):
        page.section("Tours and obstacles that appear", "Driven from start to end (Fig. 10).")
    data["tours"] = [_tour(page, folder, room) for room in rooms if _is_tour(room)]
    data["appearances"] = [_sudden(page, folder, room) for room in rooms if room.appearances]
    return page.to_bytes(), data


def _support_points(
    page: Report, config: RoomEvaluationConfig, policies: Mapping[str, Policy], room: Room
) -> None:
    """Add the support points of drives to the four goals of a room, or to those of four pairs."""
    tasks = _fixed_tasks(room) or tasks_of(room, config)
    cell = Cell("", TRAINING_LIDAR.label, room.name, "reactive")
    found = {
        name: drive_with_support_points(
            policy, cell_task(cell, config, policy), tasks[:_SHOWN_TASKS]
        )
        for name, policy in list(policies.items())[:_SHOWN_POLICIES]
    }
    picture = support_points_picture(found, room, f"{room.name}: support points")
    page.picture(picture, f"Support points in {room.name}")


def _tour(page: Report, folder: RoomFolder, room: Room) -> Row:
    """Add the tour of a room, and return its figures (Fig. 10a)."""
    goals = [task.goal for task in room.tasks]
    drives = {
        driver: drive_tour(
            policy, cell_task(cell, folder.config, policy), room.tasks[0].start, goals
        )
        for driver, (policy, cell) in _drivers(folder, room).items()
    }
    page.picture(tour_picture(drives, room, f"{room.name}: goals in a row"), f"Tour of {room.name}")
    legs = {name: [_drive_row(leg) for leg in driven] for name, driven in drives.items()}
    return {"room": room.name, "goals": len(goals), "legs": legs}


def _sudden(page: Report, folder: RoomFolder, room: Room) -> Row:
    """Add a drive past obstacles that appear, and return its figures (Fig. 10b)."""
    drives = {
        driver: drive_tasks(policy, cell_task(cell, folder.config, policy), room.tasks[:1])[0]
        for driver, (policy, cell) in _drivers(folder, room).items()
    }
    picture = sudden_picture(drives, room, f"{room.name}: obstacles that appear")
    page.picture(picture, f"Obstacles that appear in {room.name}")
    return {
        "room": room.name,
        "drives": {
            name: _drive_row(drive)
            | {"appear_after": [moment_of(drive, one) for one in room.appearances]}
            for name, drive in drives.items()
        },
    }


def _drivers(folder: RoomFolder, room: Room) -> dict[str, tuple[Policy, Cell]]:
    """Return the first policy with its first laser and each memory, by a name for people."""
    config, (name, policy) = folder.config, next(iter(folder.policies.items()))
    lidar = next((one for one in config.lidars if one in _SHOWN_LIDARS), config.lidars[0])
    return {
        f"{lidar}, {memory_text(memory)}": (policy, Cell(name, lidar, room.name, memory))
        for memory in config.memories
    }


def _drive_row(drive: RoomDrive) -> Row:
    """Return the figures of a drive."""
    return {"outcome": str(drive.outcome), "steps": drive.steps, "length_m": drive.length}


def _fixed_tasks(room: Room) -> list[RoomTask]:
    """Return the fixed tasks of a room that begin at one start."""
    return [] if _is_tour(room) else list(room.tasks)


def _is_tour(room: Room) -> bool:
    """Return True if each task of a room starts where the one before ended."""
    return len({(task.start.x, task.start.y) for task in room.tasks}) > 1
