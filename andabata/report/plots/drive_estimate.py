"""Figure of what a robot believed of itself over a drive: errors, two sigma, health, readings."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from andabata.evaluation.drive_trace import UNUSED
from andabata.localization.estimator_status import SIGMAS
from andabata.localization.localizer import Health
from andabata.report.class_colours import HEALTH_COLOURS
from andabata.report.plots.drive_traces import COLOURS, Trace

_BAND = "#9ec5e8"
"""Colour of the band of two sigma."""

_ERROR = "#d0006f"
"""Colour of the true error."""

_NEEDED = ("position_sigma_m", "yaw_error_rad", "yaw_sigma_rad", "health")


def has_estimate(trace: Trace) -> bool:
    """Return true if a trace holds what the robot believed; those of earlier versions do not."""
    return all(name in trace for name in _NEEDED)


def estimate_figure(trace: Trace) -> Figure:
    """Return errors of position and heading within two sigma, and readings that were not used.

    The background has the colour of the health where it is not ok.

    Args:
        trace: Trace of a drive with what the robot believed.
    """
    figure = Figure(figsize=(9.6, 6.6), layout="constrained")
    position, heading, unused = figure.subplots(3, 1, sharex=True)
    time = trace["time_s"]
    sigma = SIGMAS * trace["position_sigma_m"]
    _draw_error(position, time, trace["pose_error_m"], np.zeros(len(time)), sigma)
    position.set_ylabel("error of the\nposition [m]")
    error, spread = np.rad2deg(trace["yaw_error_rad"]), np.rad2deg(SIGMAS * trace["yaw_sigma_rad"])
    _draw_error(heading, time, error, -spread, spread)
    heading.set_ylabel("error of the\nheading [degrees]")
    _draw_unused(unused, time, {name: trace[name] for name in trace if name.startswith(UNUSED)})
    unused.set_ylabel("readings\nnot used")
    unused.set_xlabel("time [s]")
    shown = _shade(figure.axes, time, trace["health"].astype(int))
    patches = [Patch(color=HEALTH_COLOURS[health], alpha=0.3, label=health) for health in shown]
    lines, _ = position.get_legend_handles_labels()
    position.legend(handles=[*lines, *patches], loc="upper left", ncols=2 + len(patches))
    return figure


def _draw_error(
    axes: Axes,
    time: NDArray[np.float64],
    error: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> None:
    """Draw an error over its band of two sigma, each of shape (k,)."""
    axes.fill_between(time, low, high, color=_BAND, linewidth=0, label=f"{SIGMAS:.0f} sigma")
    axes.plot(time, error, color=_ERROR, linewidth=1.2, label="true error")
    axes.grid(alpha=0.25)


def _draw_unused(
    axes: Axes, time: NDArray[np.float64], counts: Mapping[str, NDArray[np.float64]]
) -> None:
    """Draw numbers of readings so far, a line for each sensor and reason."""
    for k, (name, numbers) in enumerate(counts.items()):
        label, colour = name.removeprefix(UNUSED), COLOURS[k % len(COLOURS)]
        axes.step(time, numbers, where="post", color=colour, linewidth=1.2, label=label)
    axes.grid(alpha=0.25)
    axes.set_ylim(bottom=0)
    if counts:
        axes.legend(loc="upper left")


def _shade(
    places: list[Axes], time: NDArray[np.float64], numbers: NDArray[np.int64]
) -> list[Health]:
    """Shade the times at which the health was not ok; return which healths there were."""
    order, shown = list(Health), []
    edges = np.flatnonzero(np.diff(numbers)) + 1
    for first, last in zip([0, *edges], [*edges, len(numbers)], strict=True):
        health = order[numbers[first]] if len(numbers) else Health.OK
        if health is Health.OK:
            continue
        shown.append(health)
        end = time[min(last, len(time) - 1)]
        for axes in places:
            axes.axvspan(time[first], end, color=HEALTH_COLOURS[health], alpha=0.3, linewidth=0)
    return list(dict.fromkeys(shown))
