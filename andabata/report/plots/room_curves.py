"""Figures of learning in rooms and of studies of a laser, drawn without a screen."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

_ACROSS = 3
"""Largest number of panels side by side."""

_BETTER, _WORSE, _UNCLEAR = "#2f7d32", "#d1483f", "#777777"


class LearningCurves(NamedTuple):
    """Scores of tests during the training of several seeds.

    Attributes:
        steps: Number of control steps at each test, mean of the seeds, shape (t,).
        scores: Score of each seed, test and room, shape (seeds, t, rooms).
    """

    steps: NDArray[np.float64]
    scores: NDArray[np.float64]


def learning_curves_figure(
    curves: Mapping[str, LearningCurves], rooms: Sequence[str], tasks: Sequence[int]
) -> Figure:
    """Return scores over control steps, a panel a room and one for all together (Fig. 5).

    Lines are means over the seeds, areas reach from the lowest to the highest.

    Args:
        curves: Curves by the actor's name.
        rooms: Names of the rooms, in the order of the scores.
        tasks: Number of tasks of each room, the best score in each that no policy reaches.
    """
    count = len(rooms) + 1
    columns = min(count, _ACROSS)
    lines = -(-count // columns)
    figure = Figure(figsize=(3.4 * columns, 3.0 * lines + 0.6), layout="constrained")
    places = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes in places[count:]:
        axes.remove()
    for number, axes in enumerate(places[:count]):
        is_sum = number == len(rooms)
        for name, one in curves.items():
            scores = one.scores.sum(axis=2) if is_sum else one.scores[:, :, number]
            (line,) = axes.plot(one.steps / 1000, scores.mean(axis=0), linewidth=1.6, label=name)
            ends = scores.min(axis=0), scores.max(axis=0)
            axes.fill_between(one.steps / 1000, *ends, color=line.get_color(), alpha=0.2)
        most = sum(tasks) if is_sum else tasks[number]
        axes.axhline(most, color="black", linewidth=0.5, linestyle=":")
        axes.set_ylim(-most - 0.1 * most, 1.1 * most)
        axes.set_title("all rooms" if is_sum else rooms[number], fontsize=10)
        axes.set_xlabel("control steps [thousands]")
    places[0].set_ylabel("score of the test")
    figure.legend(*places[0].get_legend_handles_labels(), loc="outside lower center", ncols=7)
    return figure


class SuccessCurves(NamedTuple):
    """Success during the training of several seeds.

    Attributes:
        episodes: Number of episodes after each update, shape (t,).
        steps: Number of control steps then, mean of the seeds, shape (t,).
        rates: Share of the latest episodes, exploring, that reached their goals, shape (seeds, t).
    """

    episodes: NDArray[np.float64]
    steps: NDArray[np.float64]
    rates: NDArray[np.float64]


PAPER_SUCCESS = {0.9712: "improved TD3, 10,000 episodes", 0.8478: "GDAE, 10,000 episodes"}
"""Final success of the paper (Guo et al., Fig. 4a) and what it is of."""

_SHARE_BY_VALUE = ("axes fraction", "data")
"""Coordinates of a text: a share of the width, and a value."""

_SMALL: dict[str, Any] = {"fontsize": 7, "color": "#666666", "ha": "right", "va": "bottom"}
"""Style of texts on lines of the paper."""


def success_figure(curves: Mapping[str, SuccessCurves], title: str) -> Figure:
    """Return success over episodes, and over control steps beside (Guo et al., Fig. 4a).

    Lines are means over the seeds, areas reach from the lowest to the highest.

    Args:
        curves: Curves by the plan's name.
        title: Title of the picture.
    """
    figure = Figure(figsize=(9.6, 4.1), layout="constrained")
    by_episodes, by_steps = places = figure.subplots(1, 2, sharey=True)
    for name, one in curves.items():
        for axes, amounts in ((by_episodes, one.episodes), (by_steps, one.steps / 1000)):
            style: dict[str, Any] = {"linewidth": 1.6, "marker": "o" if len(amounts) == 1 else ""}
            (line,) = axes.plot(amounts, one.rates.mean(axis=0), label=name, **style)
            ends = one.rates.min(axis=0), one.rates.max(axis=0)
            axes.fill_between(amounts, *ends, color=line.get_color(), alpha=0.2)
    for rate, name in PAPER_SUCCESS.items():
        by_episodes.axhline(rate, color="#888888", linewidth=1.0, linestyle=":", label="_paper")
        by_episodes.annotate(f"paper: {name}", (0.98, rate), xycoords=_SHARE_BY_VALUE, **_SMALL)
    for axes, text in zip(places, ("episodes", "control steps [thousands]"), strict=True):
        axes.set_ylim(0, 1.02)
        axes.set_xlim(left=0)
        axes.set_xlabel(text)
    by_episodes.set_ylabel("goals reached while exploring")
    handles = by_episodes.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=3)
    figure.suptitle(title, fontsize=11)
    return figure


def study_figure(rows: Sequence[Mapping[str, Any]], title: str) -> Figure:
    """Return the differences of a study of a laser with their intervals.

    Args:
        rows: Rows of ``tabulate_study``: the laser as it is first.
        title: Title of the picture.
    """
    base, *changes = rows
    figure = Figure(figsize=(9, 0.34 * len(changes) + 1.7), layout="constrained")
    axes = figure.add_subplot()
    for tick, row in enumerate(changes):
        mean, low, high = (100 * row[f"difference{end}"] for end in ("", "_low", "_high"))
        colour = _BETTER if low > 0 else _WORSE if high < 0 else _UNCLEAR
        axes.plot([low, high], [tick, tick], color=colour, linewidth=2.5, solid_capstyle="butt")
        axes.plot(mean, tick, "o", color=colour, markersize=7)
    axes.axvline(0, color="black", linewidth=0.8)
    rates = [f"{row['text']}   {100 * row['success_rate']:.1f} %" for row in changes]
    axes.set_yticks(range(len(changes)), rates)
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel(
        f"points of success more than the laser as it is ({100 * base['success_rate']:.1f} %), "
        "with 95 % intervals of the pairs"
    )
    axes.set_title(title, fontsize=11)
    return figure
