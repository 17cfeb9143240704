"""Figures of evaluations: success by goal and by difficulty, paths of all trials, BARN's scores."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from andabata.evaluation.statistics import wilson_interval
from andabata.report.columns import word
from andabata.report.plots.drive_traces import COLOURS
from andabata.report.plots.room_drawing import draw_room
from worlds.rooms.room import Room

Row = Mapping[str, Any]

ENDS: Mapping[str, tuple[str, str]] = {
    "goal": ("o", "#2f9a50"),
    "collision": ("x", "#d1483f"),
    "tipover": ("v", "#8a5cc4"),
    "timeout": ("^", "#e08a1e"),
    "stuck": ("s", "#8c6d46"),
    "false arrival": ("D", "#4a6fa5"),
    "left world": ("*", "#444444"),
}
"""Marker and colour of each end of a drive."""

_BINS = 5
"""Number of ranges of difficulty."""

_PANELS = 3
"""Largest number of panels side by side."""


def goals_figure(rows: Sequence[Row], paper: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Return success by goal with 95 % intervals, a panel a world (Sanchez et al., Table 4).

    Args:
        rows: Rows of ``andabata.evaluation.offroad_table.summarise``.
        paper: Rates of the paper by world and name, one a goal; drawn hollow.
    """
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    figure, places = _panels(len(worlds), (4.4, 3.4))
    for axes, world in zip(places, worlds, strict=True):
        there = [row for row in rows if row["world"] == world and row["goal"] != "all"]
        for k, controller in enumerate(controllers):
            mine = [row for row in there if row["controller"] == controller]
            x = np.array([row["goal"] for row in mine]) + _aside(k, len(controllers))
            _intervals(axes, x, mine, COLOURS[k % len(COLOURS)], controller)
        for k, (name, rates) in enumerate(paper.get(world, {}).items()):
            style: dict[str, Any] = {"marker": "Dd"[k % 2], "markerfacecolor": "none"}
            goals = np.arange(1, len(rates) + 1)
            axes.plot(goals, rates, linestyle=":", color="#777777", label=f"paper: {name}", **style)
        axes.set_ylim(0, 1.03)
        axes.set_xticks(sorted({row["goal"] for row in there}))
        axes.set_xlabel("goal in a row")
        axes.set_title(world, fontsize=10)
        axes.grid(axis="y", alpha=0.25)
    places[0].set_ylabel("reached")
    handles = {
        t: h for one in places for h, t in zip(*one.get_legend_handles_labels(), strict=True)
    }
    # A panel is as wide as two columns of names.
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside lower center",
        ncols=min(2 * len(places), 6),
        fontsize=9,
    )
    return figure


def difficulty_figure(trials: Sequence[Row], controllers: Sequence[str]) -> Figure:
    """Return success over ranges of difficulty with 95 % intervals.

    Args:
        trials: Rows of whole trials: ``controller``, ``difficulty`` and ``success``.
        controllers: Names of the controllers.
    """
    figure = Figure(figsize=(8.2, 3.4), layout="constrained")
    axes = figure.add_subplot()
    hardest = max(row["difficulty"] for row in trials)
    edges = np.linspace(0.0, hardest + 1e-9, _BINS + 1)
    for k, controller in enumerate(controllers):
        mine = [row for row in trials if row["controller"] == controller]
        bins = np.searchsorted(edges, [row["difficulty"] for row in mine], side="right") - 1
        points = []
        for number in range(_BINS):
            ends = [row["success"] for row, one in zip(mine, bins, strict=True) if one == number]
            if ends:
                low, high = wilson_interval(sum(ends), len(ends))
                rates = {"success_rate": sum(ends) / len(ends), "wilson_low": low}
                points.append((number, rates | {"wilson_high": high}))
        middle = np.array([(edges[n] + edges[n + 1]) / 2 for n, _ in points])
        aside = _aside(k, len(controllers)) * hardest / _BINS
        _intervals(
            axes, middle + aside, [row for _, row in points], COLOURS[k % len(COLOURS)], controller
        )
    axes.set_ylim(0, 1.03)
    axes.set_xlabel("difficulty of the world")
    axes.set_ylabel("all goals reached")
    axes.grid(alpha=0.25)
    axes.legend()
    return figure


def paths_figure(trials: Mapping[str, Sequence[Row]], title: str) -> Figure:
    """Return the paths of all trials, a panel a controller (Sanchez et al., Fig. 24).

    Each trial has a world of its own, so that paths begin at the origin and the first goal lies
    ahead.

    Args:
        trials: Rows with ``path`` [m], shape (k, 2), ``goal_xy`` [m] and ``outcome`` by controller.
        title: Title of the figure.
    """
    figure, places = _panels(len(trials), (4.6, 4.6), shared=True)
    for axes, (name, rows) in zip(places, trials.items(), strict=True):
        for row in rows:
            path = _ahead(np.array(row["path"], dtype=np.float64), row["goal_xy"])
            marker, colour = ENDS.get(row["outcome"], ("o", "#777777"))
            axes.plot(*path.T, color=colour, linewidth=0.9, alpha=0.7, label="_" + name)
            axes.plot(*path[-1], marker, color=colour, markersize=5)
        axes.plot(0, 0, "o", color="#222222", markersize=5)
        axes.set_aspect("equal")
        axes.set_title(name, fontsize=10)
        axes.set_xlabel("towards the first goal [m]")
        axes.grid(alpha=0.2)
    places[0].set_ylabel("to the left [m]")
    known = {row["outcome"] for rows in trials.values() for row in rows}
    handles = [
        Line2D([], [], marker=marker, color=colour, linestyle="", label=word(name))
        for name, (marker, colour) in ENDS.items()
        if name in known
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=9)
    figure.suptitle(title, fontsize=11)
    return figure


def barn_figure(runs: Mapping[str, Sequence[Row]]) -> Figure:
    """Return how long each run took over the optimal time, sorted, a line a navigator.

    Args:
        runs: Rows with ``ratio``, the time over the optimal time, None for a failure, by navigator.
    """
    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    axes = figure.add_subplot()
    for colour, (name, rows) in zip(_cycled(len(runs)), runs.items(), strict=True):
        ratios = np.sort([row["ratio"] for row in rows if row["ratio"] is not None])
        share = np.arange(1, len(ratios) + 1) / len(rows)
        axes.plot(ratios, share, color=colour, linewidth=1.6, label=name, drawstyle="steps-post")
    axes.axvline(2.0, color="#777777", linewidth=1.0, linestyle=":")
    axes.annotate("full official score", (2.0, 0.02), rotation=90, fontsize=8, color="#777777")
    axes.set_xlim(left=0.8)
    axes.set_ylim(0, 1.03)
    axes.set_xlabel("time / optimal time")
    axes.set_ylabel("share of runs at the goal")
    axes.grid(alpha=0.25)
    axes.legend(loc="lower right", fontsize=8)
    return figure


def scores_figure(rows: Sequence[Row]) -> Figure:
    """Return the scores of navigators with their 95 % intervals.

    Args:
        rows: Rows of ``andabata.evaluation.barn_table.BARN_TABLE``.
    """
    figure = Figure(figsize=(9.2, 0.36 * len(rows) + 1.4), layout="constrained")
    axes = figure.add_subplot()
    for tick, row in enumerate(rows):
        for kind, shift, colour in (("score", -0.13, COLOURS[1]), ("ot_over_t", 0.13, COLOURS[2])):
            low, high = (row[f"{kind}_{end}"] for end in ("low", "high"))
            label = {"score": "official score", "ot_over_t": "optimal time / time"}[kind]
            axes.plot(row[kind], tick + shift, "o", color=colour, label=None if tick else label)
            if low is not None:
                axes.plot([low, high], [tick + shift] * 2, color=colour, linewidth=2.2)
    axes.axvline(0.5, color="#777777", linewidth=1.0, linestyle=":")
    axes.set_yticks(range(len(rows)), [row["controller"] for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0, 1.15)
    axes.set_xlabel("score; 0.5 is the most that the official one gives")
    axes.grid(axis="x", alpha=0.25)
    axes.legend(fontsize=8)
    return figure


def fields_figure(runs: Mapping[str, tuple[Room, NDArray[np.float64], str]]) -> Figure:
    """Return runs in fields of cylinders, a panel each, with a marker where each ended.

    Args:
        runs: Room, path [m], shape (t, 3), and end of each run by its title.
    """
    figure, places = _panels(len(runs), (3.6, 5.4))
    for axes, (title, (room, path, end)) in zip(places, runs.items(), strict=True):
        draw_room(axes, room)
        marker, colour = ENDS.get(end, ("o", "#777777"))
        axes.plot(*path[:, :2].T, color=COLOURS[1], linewidth=1.4)
        axes.plot(*path[-1, :2], marker, color=colour, markersize=9, markeredgewidth=2)
        axes.plot(*path[0, :2], "o", color="#222222", markersize=5)
        for task in room.tasks:
            axes.plot(*task.goal, "*", color=COLOURS[3], markersize=11)
        axes.set_title(title, fontsize=8)
    return figure


def _ahead(path: NDArray[np.float64], goal: Sequence[float]) -> NDArray[np.float64]:
    """Return a path from the origin, turned so that its goal lies along x, shape (k, 2)."""
    to_goal = np.array(goal, dtype=np.float64) - path[0]
    c, s = to_goal / max(float(np.hypot(*to_goal)), 1e-9)
    return np.asarray((path - path[0]) @ np.array([[c, -s], [s, c]]))


def _intervals(
    axes: Axes, x: NDArray[np.float64], rows: Sequence[Row], colour: str, name: str
) -> None:
    """Draw success rates with their intervals."""
    for tick, row in zip(x.tolist(), rows, strict=True):
        ends = [row["wilson_low"], row["wilson_high"]]
        axes.plot([tick, tick], ends, color=colour, linewidth=2.0, alpha=0.6)
    rates = [row["success_rate"] for row in rows]
    axes.plot(x, rates, "o-", color=colour, linewidth=1.2, markersize=5, label=name)


def _aside(number: int, count: int) -> float:
    """Return a shift that keeps the intervals of one of several apart."""
    return 0.08 * (number - (count - 1) / 2)


def _panels(
    count: int, size: tuple[float, float], shared: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels, at most three in a row, and the panels that are used.

    With ``shared`` they show the same part of the plane.
    """
    columns = min(count, _PANELS)
    lines = -(-count // columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * lines + 0.5), layout="constrained")
    places = list(
        figure.subplots(lines, columns, squeeze=False, sharex=shared, sharey=shared).ravel()
    )
    for axes in places[count:]:
        axes.set_axis_off()
    return figure, places[:count]


def _cycled(count: int) -> list[str]:
    """Return a colour for each of several."""
    return [COLOURS[k % len(COLOURS)] for k in range(count)]
