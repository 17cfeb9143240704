"""Movers of a drive in a room: where they went, for figures and moving pictures."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from numpy.typing import NDArray

MOVER_COLOUR = "#785ea0"
"""Colour of what moves."""

TRACK_LABEL = "mover, of the bold drive"
"""Text of a mover's track in a legend."""

Movers = NDArray[np.float64]
"""x, y and radius of each mover at each step of a drive [m], 0 for none, shape (steps, m, 3)."""

NO_MOVERS: Mapping[Any, Movers] = MappingProxyType({})
"""Movers of drives in rooms where nothing moves."""


def draw_tracks(axes: Axes, movers: Movers) -> None:
    """Draw the track of each mover, dotted, and the mover where it was last.

    Args:
        axes: Axes to draw on.
        movers: Movers of a drive.
    """
    for rows in np.moveaxis(movers, 1, 0):
        there = rows[:, 2] > 0.0
        if not there.any():
            continue
        x, y = np.where(there, rows[:, :2].T, np.nan)
        axes.plot(x, y, ":", color=MOVER_COLOUR, linewidth=1.4, zorder=2.5)
        last_x, last_y, radius = rows[there][-1].tolist()
        style: dict[str, Any] = {"facecolor": MOVER_COLOUR, "alpha": 0.75, "zorder": 3}
        axes.add_patch(Circle((last_x, last_y), radius, **style))


def track_legend() -> Line2D:
    """Return the legend of a drawn track."""
    style: dict[str, Any] = {"color": MOVER_COLOUR, "linestyle": ":", "marker": "o"}
    return Line2D([], [], markersize=8, label=TRACK_LABEL, **style)
