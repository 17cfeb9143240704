"""Figures of drives in rooms, drawn without a screen.

They follow the figures of Zhang et al. (arXiv 2010.10209), whose numbers stand beside.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from andabata.evaluation.room_drives import RoomAttempt
from andabata.evaluation.room_policies import TRAINED
from andabata.evaluation.support_points import SupportPoints
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.report.plots.room_drawing import (
    END_STYLES,
    HIT_STYLE,
    HITS,
    PATH_COLOUR,
    add_end_legend,
    draw_drives,
    draw_end,
    draw_goal,
    draw_room,
    draw_start,
    room_panels,
)
from andabata.report.plots.room_movers import NO_MOVERS, Movers, draw_tracks, track_legend
from andabata.tasks.terminations import Outcome
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room

_MAY_APPEAR: dict[str, Any] = {"facecolor": "none", "edgecolor": "#d1483f", "linestyle": ":"}
"""Style of an obstacle that is not always there."""

_GOAL_MARKERS = ("o", "s", "^", "p")
"""Markers of the support points on the way to each goal (Fig. 6)."""

_LONG = 160
"""Control step up to which support points are shown: of a robot that stalls they pile up."""

_LEGS = ("#1540c4", "#d98e32", "#2f7d32", "#8a3fb0", "#d0006f", "#00838f")
"""Colours of the legs of a tour."""

Moments = Sequence[tuple[RoomAttempt, Sequence[SupportPoints]]]
"""Drives with the support points at some moments of each."""


def trajectories_figure(
    drives: Mapping[tuple[str, str], Sequence[RoomAttempt]],
    rooms: Sequence[Room],
    title: str,
    movers: Mapping[tuple[str, str], Movers] = NO_MOVERS,
) -> Figure:
    """Return paths and ends, a row a laser and a column a room (Fig. 7).

    What moves in a room moves on its own in each drive: the movers of the first one are shown, and
    its path is bold.

    Args:
        drives: Drives by laser, or by another text, and room.
        rooms: Rooms in the order of the columns.
        title: Title of the picture.
        movers: Movers of the first drive by laser and room, where there are some.
    """
    lidars = list(dict.fromkeys(lidar for lidar, _ in drives))
    size = (max(3.6 * len(rooms), 4.4), 3.9 * len(lidars) + 0.7)
    figure = Figure(figsize=size, layout="constrained")
    places = figure.subplots(len(lidars), len(rooms), squeeze=False)
    for row, lidar in zip(places, lidars, strict=True):
        for axes, room in zip(row, rooms, strict=True):
            mine = drives[lidar, room.name]
            draw_room(axes, room)
            for one in room.appearances:
                axes.add_patch(Circle(one.circle[:2], one.circle[2], **_MAY_APPEAR))
            tracks = movers.get((lidar, room.name))
            if tracks is not None:
                draw_tracks(axes, tracks)
                axes.plot(*mine[0].path[:, :2].T, color=PATH_COLOUR, linewidth=2.4, zorder=2.6)
            draw_drives(axes, mine)
            axes.set_title(f"{room.name}, {lidar}\n{_counts(mine)}", fontsize=9)
    figure.suptitle(title, fontsize=11)
    hits = any(drive.contact in HITS for some in drives.values() for drive in some)
    ends = {drive.outcome for some in drives.values() for drive in some}
    add_end_legend(figure, hits=hits, others=[track_legend()] if movers else (), ends=ends)
    return figure


def ends_figure(rows: Sequence[Mapping[str, Any]], title: str) -> Figure:
    """Return how drives ended as bars, a group a room and a bar a laser (Fig. 8).

    Args:
        rows: Rows of an evaluation in rooms; those of several policies are added up.
        title: Title of the picture.
    """
    rooms = list(dict.fromkeys(row["room"] for row in rows))
    lidars = list(dict.fromkeys(row["lidar"] for row in rows))
    memories = list(dict.fromkeys(row["memory"] for row in rows))
    labels = [_lidar_text(lidar) for lidar in lidars]
    size = (max(1.2 + 0.4 * len(lidars), 2.4) * len(rooms) + 0.6, 3.2 * len(memories) + 1.9)
    figure = Figure(figsize=size, layout="constrained")
    places = figure.subplots(len(memories), len(rooms), squeeze=False, sharey=True, sharex=True)
    for line, memory in zip(places, memories, strict=True):
        for axes, room in zip(line, rooms, strict=True):
            for k, lidar in enumerate(lidars):
                key = (room, lidar, memory)
                cell = [r for r in rows if (r["room"], r["lidar"], r["memory"]) == key]
                _draw_bar(axes, k, cell)
            axes.set_xticks(range(len(lidars)), labels, rotation=90, fontsize=8)
            axes.set_title(f"{room}, {memory_words(memory)}", fontsize=9)
            axes.set_ylim(0, 1)
        line[0].set_ylabel("share of drives")
    figure.suptitle(title, fontsize=11)
    add_end_legend(figure, bars=True, hits=any(_hits(row) for row in rows))
    return figure


def support_points_figure(found: Mapping[str, Moments], room: Room, title: str) -> Figure:
    """Return support points on the map, a panel a policy (Fig. 6).

    Markers tell the goal, colours the moment, as those of the robot's footprints; the more features
    a point gives, the larger its marker. Moments after 160 control steps are left out.

    Args:
        found: Drives with their support points by policy.
        room: Room of the drives.
        title: Title of the picture.
    """
    figure = Figure(figsize=(5.2 * len(found) + 0.8, 6.1), layout="constrained")
    places = figure.subplots(1, len(found), squeeze=False)[0]
    steps = [moment.step for drives in found.values() for _, some in drives for moment in some]
    norm, colours = Normalize(0, max(min(max(steps), _LONG), 1)), _moments()
    for axes, (name, drives) in zip(places, found.items(), strict=True):
        draw_room(axes, room)
        for k, (drive, moments) in enumerate(drives):
            axes.plot(*drive.path[:, :2].T, color=PATH_COLOUR, linewidth=0.7, alpha=0.7)
            for moment in (each for each in moments if each.step <= _LONG):
                colour = colours(norm(moment.step))
                _draw_moment(axes, moment, colour, _GOAL_MARKERS[k % len(_GOAL_MARKERS)])
            draw_goal(axes, drive, f"G{k}")
        starts = {drive.path[0].tobytes(): drive for drive, _ in drives}
        for k, drive in enumerate(starts.values()):
            draw_start(axes, drive, f"S{k}" if len(starts) > 1 else "S")
        axes.set_title(name, fontsize=10)
    scale = figure.colorbar(ScalarMappable(norm, colours), ax=list(places), shrink=0.75, pad=0.01)
    scale.set_label("control steps since the start")
    handles = [
        Line2D([], [], marker=marker, color="#444444", linestyle="", label=f"support point to G{k}")
        for k, marker in enumerate(_GOAL_MARKERS)
    ]
    hollow: dict[str, Any] = {
        "marker": "o",
        "color": "#444444",
        "markerfacecolor": "none",
        "linestyle": "",
    }
    handles.append(Line2D([], [], **hollow, label="hollow: end of a beam that met nothing"))
    # A narrow figure has no room for three of these texts side by side.
    columns = min(3, 1 + len(found))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=8)
    figure.suptitle(title, fontsize=11)
    return figure


def tour_figure(drives: Mapping[str, Sequence[RoomAttempt]], room: Room, title: str) -> Figure:
    """Return a tour of several goals in a row, a panel a driver (Fig. 10a).

    Args:
        drives: Legs by driver.
        room: Room of the tour.
        title: Title of the picture.
    """
    figure, places = room_panels(len(drives), room)
    for axes, (name, legs) in zip(places, drives.items(), strict=True):
        draw_room(axes, room)
        for k, leg in enumerate(legs):
            colour = _LEGS[k % len(_LEGS)]
            axes.plot(*leg.path[:, :2].T, color=colour, linewidth=1.8)
            draw_goal(axes, leg, f"G{k + 1}", colour)
            draw_end(axes, leg)
        draw_start(axes, legs[0])
        steps = sum(leg.detail.steps for leg in legs)
        reached = sum(leg.outcome is Outcome.GOAL for leg in legs)
        axes.set_title(f"{name}: {reached} of {len(room.tasks)} goals in {steps} steps", fontsize=9)
    figure.suptitle(title, fontsize=11)
    add_end_legend(figure)
    return figure


def sudden_figure(drives: Mapping[str, RoomAttempt], room: Room, title: str) -> Figure:
    """Return drives past obstacles that appear, each with its moment, a panel a driver (Fig. 10b).

    Args:
        drives: Drive by driver.
        room: Room with the obstacles.
        title: Title of the picture.
    """
    figure, places = room_panels(len(drives), room)
    for axes, (name, drive) in zip(places, drives.items(), strict=True):
        draw_room(axes, room)
        axes.plot(*drive.path[:, :2].T, color=PATH_COLOUR, linewidth=1.8)
        for number, one in enumerate(room.appearances, start=1):
            _draw_appearance(axes, drive, one, number)
        draw_goal(axes, drive, "G")
        draw_start(axes, drive)
        draw_end(axes, drive)
        ending = END_STYLES[drive.outcome]["label"]
        axes.set_title(f"{name}: {ending} after {drive.detail.steps} steps", fontsize=9)
    figure.suptitle(title, fontsize=11)
    add_end_legend(figure)
    return figure


def moment_of(drive: RoomAttempt, one: MoverPlan) -> int | None:
    """Return the control step after which an obstacle appeared to a robot, None if it did not."""
    due = (k for k, (x, y) in enumerate(drive.path[:-1, :2].tolist()) if one.is_due(x, y))
    return next(due, None)


def memory_text(memory: str) -> str:
    """Return a memory in a word or two, as results name it."""
    return {"map": "with map"}.get(memory, memory)


def memory_words(memory: str) -> str:
    """Return a memory in the words of a title."""
    return {"map": "with the map", "reactive": "without a memory"}.get(memory, memory)


def _lidar_text(lidar: str) -> str:
    """Return a laser's name with its label, as in the paper."""
    label = lidar if lidar == TRAINED else PlanarLidarConfig.parse(lidar).label
    return lidar if lidar == label else f"{lidar}\n{label}"


def _moments() -> Colormap:
    """Return the colours of moments: black at the start, as in the paper."""
    return LinearSegmentedColormap.from_list("moments", ["black", "#1540c4", "#d0006f", "#f0a000"])


def _draw_moment(axes: Axes, moment: SupportPoints, colour: Any, marker: str) -> None:  # noqa: ANN401
    """Draw the robot's footprint and its support points."""
    foot = Circle(tuple(moment.pose[:2]), 0.2, facecolor="none", edgecolor=colour, linewidth=1.2)
    axes.add_patch(foot)
    for place, count, is_return in zip(moment.places, moment.counts, moment.is_return, strict=True):
        face = colour if is_return else "none"
        style: dict[str, Any] = {
            "marker": marker,
            "markerfacecolor": face,
            "markeredgecolor": colour,
        }
        # The area grows with the features: 20 of one point still leave the room visible.
        size = 4.0 * float(np.sqrt(count))
        axes.plot(*place, linestyle="", markersize=size, alpha=0.75, zorder=3, **style)


def _draw_appearance(axes: Axes, drive: RoomAttempt, one: MoverPlan, number: int) -> None:
    """Draw an obstacle that appears, and the robot at that moment."""
    x, y, radius = one.circle
    step = moment_of(drive, one)
    style: dict[str, Any] = {"facecolor": "#e9a79f", "edgecolor": "#d1483f", "linewidth": 1.2}
    axes.add_patch(Circle((x, y), radius, **(_MAY_APPEAR if step is None else style)))
    axes.annotate(f"O{number}", (x, y), ha="center", va="center", fontsize=9)
    if step is None:
        return
    robot = tuple(drive.path[step, :2])
    axes.add_patch(Circle(robot, 0.2, facecolor="none", edgecolor="#d1483f", linewidth=1.2))
    below: dict[str, Any] = {
        "textcoords": "offset points",
        "xytext": (0, -32),
        "ha": "center",
        "fontsize": 8,
    }
    axes.annotate(f"O{number} appears\nafter {step} steps", robot, **below)


def _draw_bar(axes: Axes, tick: int, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the shares of ends of a cell, one on top of the other."""
    trials = sum(row["trials"] for row in rows)
    bottom = 0.0
    hits = sum(_hits(row) for row in rows)
    reached, crashed, late = (
        sum(row[name] for row in rows) for name in ("successes", "collisions", "timeouts")
    )
    success, crash, timeout = END_STYLES.values()
    parts = [(reached, success), (crashed - hits, crash), (late, timeout)]
    if hits:
        parts.insert(2, (hits, HIT_STYLE))
    for count, style in parts if trials else ():
        share = count / trials
        axes.bar(tick, share, bottom=bottom, width=0.8, color=style["color"])
        bottom += share
    if trials:
        text: dict[str, Any] = {
            "ha": "center",
            "va": "bottom",
            "rotation": 90,
            "fontsize": 7,
            "color": "white",
        }
        axes.text(tick, 0.03, f"{100 * reached / trials:.0f} %", **text)


def _hits(row: Mapping[str, Any]) -> int:
    """Return the number of collisions that movers caused; rows of earlier versions have none."""
    return int(row.get("hit_by_mover", 0) + row.get("hit_at_rest", 0))


def _counts(drives: Sequence[RoomAttempt]) -> str:
    """Return how many drives ended how, in words."""
    ends = Counter(drive.outcome for drive in drives)
    others = ((Outcome.COLLISION, "crash", "crashes"), (Outcome.TIMEOUT, "time-out", "time-outs"))
    texts = [
        f"{ends[outcome]} {one if ends[outcome] == 1 else several}"
        for outcome, one, several in others
        if ends[outcome]
    ]
    return ", ".join([f"{ends[Outcome.GOAL]} of {len(drives)} goals reached", *texts])
