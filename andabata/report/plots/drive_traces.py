"""Figures of motion over time: headings of drives side by side, steering, speed, pose error."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

Trace = Mapping[str, NDArray[np.float64]]
"""Columns of a drive's trace by name, see ``andabata.evaluation.drive_trace``."""

COLOURS = ("#d0006f", "#1e78c8", "#e08a1e", "#2f9a50", "#8a5cc4", "#8c6d46")
"""Colours of drives side by side, told apart on light and on dark paper."""


def trace_of(data: Mapping[str, Any]) -> Trace:
    """Return a trace from its JSON: columns by name."""
    rows = np.array(data["rows"], dtype=np.float64).reshape(-1, len(data["columns"]))
    return dict(zip(data["columns"], rows.T, strict=True))


def headings_figure(traces: Mapping[str, Trace]) -> Figure:
    """Return headings over time, a line a drive (Sanchez et al. 2023, Fig. 23).

    Args:
        traces: Traces by the drive's name.
    """
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    axes = figure.add_subplot()
    for colour, (name, trace) in zip(_colours(len(traces)), traces.items(), strict=True):
        degrees = np.rad2deg(np.unwrap(trace["yaw_rad"]))
        axes.plot(trace["time_s"], degrees, color=colour, linewidth=1.4, label=name)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("heading [deg]")
    axes.grid(alpha=0.25)
    if len(traces) > 1:
        axes.legend()
    return figure


def motion_figure(traces: Mapping[str, Trace]) -> Figure:
    """Return yaw rate, speed and error of the estimated position over time, a line a drive.

    Args:
        traces: Traces by the drive's name.
    """
    figure = Figure(figsize=(9.6, 6.0), layout="constrained")
    places = figure.subplots(3, 1, sharex=True)
    parts = (
        ("yaw_rate_rad_s", "yaw rate [rad/s]"),
        ("speed_m_s", "speed [m/s]"),
        ("pose_error_m", "error of the\nposition [m]"),
    )
    for axes, (key, text) in zip(places, parts, strict=True):
        for colour, (name, trace) in zip(_colours(len(traces)), traces.items(), strict=True):
            axes.plot(trace["time_s"], trace[key], color=colour, linewidth=1.1, label=name)
        axes.set_ylabel(text)
        axes.grid(alpha=0.25)
    places[-1].set_xlabel("time [s]")
    if len(traces) > 1:
        places[0].legend(loc="upper right")
    return figure


def stamps_of(path: NDArray[np.float64], period: float, every: float) -> list[tuple[int, str]]:
    """Return places along a path with the elapsed time and the distance driven (Fig. 18, 21).

    Args:
        path: Positions [m], one a control step, shape (k, 2) or more columns.
        period: Time from one position to the next [s].
        every: Time from stamp to stamp [s].

    Returns:
        Indices of positions and texts, such as ``60 s, 17 m``.
    """
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T) if len(path) > 1 else np.zeros(0)
    driven = np.concatenate([[0.0], np.cumsum(steps)])
    stride = max(round(every / period), 1)
    return [
        (k, f"{k * period:.0f} s, {driven[k]:.0f} m")
        for k in range(stride, len(path) - stride // 3, stride)
    ]


def _colours(count: int) -> Sequence[str]:
    """Return a colour for each drive."""
    return [COLOURS[k % len(COLOURS)] for k in range(count)]
