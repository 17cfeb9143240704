"""What figures of drives in rooms are drawn of: room, path, start, goal, end, and its legend.

Markers and colours are those of Zhang et al. (arXiv 2010.10209, Fig. 7).
"""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path as MplPath
from numpy.typing import NDArray

from andabata.evaluation.room_drives import RoomAttempt
from andabata.machine.planar.mover_contact import Contact
from andabata.report.class_colours import BLOCKED_COLOUR, FREE_COLOUR
from andabata.tasks.terminations import Outcome
from worlds.rooms.room import Room

_SOLID = "#b9b4aa"
PATH_COLOUR = "#4f6d8f"

END_STYLES: dict[Outcome, dict[str, Any]] = {
    Outcome.GOAL: {"marker": "o", "color": FREE_COLOUR, "label": "goal reached"},
    Outcome.COLLISION: {"marker": "x", "color": BLOCKED_COLOUR, "label": "crash"},
    Outcome.TIMEOUT: {"marker": "^", "color": "#e69f00", "label": "time-out"},
}
"""Markers and colours of ends (Fig. 7)."""

HIT_STYLE: dict[str, Any] = {"marker": "X", "color": "#7b3fa0", "label": "hit by a mover"}
"""The same of collisions that a mover caused, on a robot that drove or stood."""

HITS = (Contact.HIT, Contact.HIT_AT_REST)
"""Contacts that are not the robot's fault."""

_ENTRY = 1.75
"""Width of an entry of a legend [inches]."""

_FEW = 10
"""Number of paths up to which they do not hide each other."""


def draw_room(axes: Axes, room: Room) -> None:
    """Draw walls, boxes and posts."""
    for x_low, y_low, x_high, y_high in room.boxes.tolist():
        box = Rectangle((x_low, y_low), x_high - x_low, y_high - y_low, color=_SOLID, linewidth=0.8)
        axes.add_patch(box)
    for x, y, radius in room.circles.tolist():
        axes.add_patch(Circle((x, y), radius, color=_SOLID, linewidth=0.8))
    if len(room.edges):
        axes.add_patch(PathPatch(_outlines(room.edges), color=_SOLID, linewidth=0.8))
    axes.set_aspect("equal")
    axes.set_xlim(-room.half[0] - 0.2, room.half[0] + 0.2)
    axes.set_ylim(-room.half[1] - 0.2, room.half[1] + 0.2)
    axes.set_xlabel("x [m]", fontsize=8)
    axes.set_ylabel("y [m]", fontsize=8)
    axes.tick_params(labelsize=7)


def _outlines(edges: NDArray[np.float64]) -> MplPath:
    """Return the path along the edges of outlines, which encloses what is solid."""
    begins, ends = edges[:, :2], edges[:, 2:]
    first = np.r_[True, (begins[1:] != ends[:-1]).any(axis=1)]
    corners, codes = [], []
    for begin, end, new in zip(begins.tolist(), ends.tolist(), first.tolist(), strict=True):
        corners += [begin, end] if new else [end]
        codes += [MplPath.MOVETO, MplPath.LINETO] if new else [MplPath.LINETO]
    return MplPath(corners, codes)


def draw_drives(axes: Axes, drives: Sequence[RoomAttempt]) -> None:
    """Draw paths with their ends, failures on top; few paths are drawn bolder."""
    width = 1.4 if len(drives) <= _FEW else 0.6
    for drive in drives:
        axes.plot(*drive.path[:, :2].T, color=PATH_COLOUR, linewidth=width, alpha=0.7)
    for drive in sorted(drives, key=lambda each: list(END_STYLES).index(each.outcome)):
        draw_end(axes, drive, 4.5)


def draw_end(axes: Axes, drive: RoomAttempt, size: float = 8) -> None:
    """Draw how a drive ended."""
    whole = HIT_STYLE if drive.contact in HITS else END_STYLES[drive.outcome]
    style = {name: whole[name] for name in ("marker", "color")}
    over = 4 if drive.outcome is Outcome.GOAL else 5
    axes.plot(*drive.path[-1, :2], linestyle="", markersize=size, zorder=over, **style)


def draw_goal(axes: Axes, drive: RoomAttempt, name: str, colour: str = "#222222") -> None:
    """Draw a goal with its name."""
    axes.plot(
        *drive.detail.task.goal, "+", color=colour, markersize=11, markeredgewidth=2, zorder=6
    )
    offset: dict[str, Any] = {"textcoords": "offset points", "xytext": (6, 5), "fontsize": 9}
    axes.annotate(name, drive.detail.task.goal, color=colour, **offset)


def draw_start(axes: Axes, drive: RoomAttempt, name: str = "S") -> None:
    """Draw the start with its name and an arrow ahead."""
    x, y, yaw = drive.path[0].tolist()
    axes.plot(x, y, "o", color="black", markersize=6, zorder=6)
    axes.annotate(name, (x, y), textcoords="offset points", xytext=(-14, 8), fontsize=9)
    ahead = (0.4 * np.cos(yaw), 0.4 * np.sin(yaw))
    axes.arrow(x, y, *ahead, color="black", width=0.03, head_width=0.16, zorder=6)


def add_end_legend(
    figure: Figure,
    bars: bool = False,
    hits: bool = False,
    others: Sequence[Artist] = (),
    ends: Collection[Outcome] = tuple(END_STYLES),
) -> None:
    """Add the legend of ends below a figure.

    Args:
        figure: Figure.
        bars: True if ends are bars.
        hits: True if movers hit a robot.
        others: More entries.
        ends: Ends that are drawn.
    """
    styles = [style for outcome, style in END_STYLES.items() if outcome in ends]
    styles += [HIT_STYLE] if hits else []
    handles: list[Any] = [
        Patch(color=style["color"], label=style["label"])
        if bars
        else Line2D([], [], linestyle="", **style)
        for style in styles
    ]
    handles += others
    columns = min(max(int(figure.get_figwidth() / _ENTRY), 1), len(handles))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=9)


def room_panels(count: int, room: Room) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure of panels side by side, each in the shape of a room."""
    width = 6.2
    size = (width * count, width * room.half[1] / room.half[0] + 1.3)
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(1, count, squeeze=False)[0]
