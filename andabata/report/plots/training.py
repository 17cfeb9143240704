"""Figures of training runs, drawn without a screen."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.figure import Figure

_TERM_COLOURS = {"whole": "black", "attraction": "#2f7d32", "repulsion": "#d1483f"}
"""Colour of each term of the paper's reward, and of their sum, ``whole``."""

_OWN_COLOURS = ("#1f77b4", "#ff7f0e", "#9467bd", "#e377c2", "#17becf", "#bcbd22")
"""Colours of the terms of other rewards, in turn."""

_FINAL_TERMS = ("collision", "tipover")
"""Terms of the paper's reward that are not drawn: one step of a drive has them."""


def learning_figure(history: Sequence[Mapping[str, Any]]) -> Figure:
    """Return success over episodes, stage after stage, and its mean over eight updates.

    Args:
        history: Rows with ``name``, ``episodes`` and ``success_rate``.
    """
    figure = Figure(figsize=(9, 4), layout="constrained")
    axes = figure.add_subplot()
    begin = 0
    for name in dict.fromkeys(row["name"] for row in history):
        rows = [row for row in history if row["name"] == name]
        episodes = np.array([row["episodes"] for row in rows]) + begin
        rates = np.array([row["success_rate"] for row in rows])
        line = axes.plot(episodes, rates, alpha=0.3)[0]
        mean = [rates[max(0, k - 7) : k + 1].mean() for k in range(len(rates))]
        axes.plot(episodes, mean, color=line.get_color(), label=name)
        begin = int(episodes[-1])
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("episodes")
    axes.set_ylabel("goals reached while exploring")
    axes.legend()
    return figure


def _colours_of(histories: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, str]:
    """Return the terms that are drawn of histories, each with its colour; the sum comes first."""
    found = dict.fromkeys(
        name for rows in histories.values() for row in rows for name in row["terms"]
    )
    own = [name for name in found if name not in (*_TERM_COLOURS, *_FINAL_TERMS)]
    ours = {name: colour for name, colour in _TERM_COLOURS.items() if name in ("whole", *found)}
    return ours | dict(zip(own, cycle(_OWN_COLOURS)))


def rewards_figure(histories: Mapping[str, Sequence[Mapping[str, Any]]]) -> Figure:
    """Return the mean reward of a control step over each stage, whole and by term.

    Args:
        histories: Histories of runs of the same stages, by name: rows with ``name``, ``episodes``,
            ``mean_steps``, ``mean_return`` and ``terms``.
    """
    stages = list(dict.fromkeys(row["name"] for rows in histories.values() for row in rows))
    figure = Figure(figsize=(4.6 * len(stages), 4.2), layout="constrained")
    places = np.atleast_1d(figure.subplots(1, len(stages), sharey=True))
    colours = _colours_of(histories)
    for axes, stage in zip(places, stages, strict=True):
        named: set[str] = set()
        for history in histories.values():
            rows = [row for row in history if row["name"] == stage]
            episodes = [row["episodes"] for row in rows]
            for term, colour in colours.items():
                sums = [row["terms"].get(term, row["mean_return"]) for row in rows]
                if term != "whole" and not any(term in row["terms"] for row in rows):
                    continue  # Another run's reward has it.
                means = [sum_ / row["mean_steps"] for sum_, row in zip(sums, rows, strict=True)]
                label = None if term in named else term
                named.add(term)
                axes.plot(episodes, means, color=colour, alpha=0.7, linewidth=1.2, label=label)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.set_title(stage)
        axes.set_xlabel("episodes")
    places[0].set_ylabel("mean reward of a control step")
    places[0].legend()
    return figure
