"""Pictures of virtual scans and classifiers as PNG bytes, drawn without a screen."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from numpy.typing import NDArray

from andabata.app.plots.axes import draw_ranges, png, range_legend
from andabata.app.scanning import Scanned
from traversability.grid import PolarGrid
from traversability.labels import CellState

_STATE_COLOURS = {
    CellState.EMPTY: "#f4f4f0",
    CellState.TRAVERSABLE: "#58a55c",
    CellState.NON_TRAVERSABLE: "#d1483f",
}


def scan_picture(scanned: Scanned, title: str) -> bytes:
    """Return a cloud from above, its cells by state and the virtual scan on it."""
    figure = Figure(figsize=(14, 7.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    points, grid = scanned.cloud.points, scanned.grid
    near = (np.hypot(points[:, 0], points[:, 1]) < 1.05 * grid.outer_radius) & (
        points[:, 2] < grid.max_height
    )
    dots = left.scatter(
        *points[near, :2].T, c=points[near, 2], s=1.5, cmap="viridis", linewidths=0, vmin=-1, vmax=1
    )
    figure.colorbar(dots, ax=left, label="height above the base plane [m]", shrink=0.7)
    left.set_title(f"{title}: points lower than {grid.max_height} m")
    _draw_cells(right, scanned.cells, grid, alpha=0.75)
    right.scatter(*points[near, :2].T, s=0.3, color="black", alpha=0.35, linewidths=0)
    right.set_title("cells: green traversable, red not, white empty")
    for axes in (left, right):
        draw_ranges(axes, scanned.scan.ranges, grid)
        axes.plot(0, 0, marker=(3, 0, -90), color="black", markersize=10)
        axes.set_aspect("equal")
        axes.set_xlim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
        axes.set_ylim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
        axes.set_xlabel("x, forward [m]")
        axes.set_ylabel("y, left [m]")
    right.legend(handles=range_legend(), loc="upper right", fontsize=9)
    return png(figure)


def confusion_picture(scores: Mapping[str, Any]) -> bytes:
    """Return a confusion matrix of cells.

    Args:
        scores: ``confusion`` and ``balanced_accuracy`` of a classifier.
    """
    counts = scores["confusion"]
    matrix = np.array([[counts["tn"], counts["fp"]], [counts["fn"], counts["tp"]]])
    figure = Figure(figsize=(4.5, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(matrix / matrix.sum(axis=1, keepdims=True).clip(min=1), cmap="Greens", vmin=0)
    for (row, column), count in np.ndenumerate(matrix):
        axes.text(column, row, str(count), ha="center", va="center", fontsize=14)
    axes.set_xticks([0, 1], ["classified green", "classified red"])
    axes.set_yticks([0, 1], ["green", "red"])
    axes.set_title(f"balanced accuracy {scores['balanced_accuracy']:.3f}")
    return png(figure)


def importance_picture(importances: Mapping[str, float], most: int = 25) -> bytes:
    """Return the most important features of a forest.

    Args:
        importances: Importance by feature, see ``forest_training.importances``, the largest first.
        most: Number of features that are shown.
    """
    names = list(importances)[:most][::-1]
    figure = Figure(figsize=(7, 0.25 * len(names) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    axes.barh(names, [importances[name] for name in names], color="#58a55c")
    axes.set_xlabel("cross-entropy lost when the feature is shuffled [nats a cell]")
    return png(figure)


def _draw_cells(axes: Axes, cells: NDArray[np.uint8], grid: PolarGrid, alpha: float) -> None:
    """Draw the polar cells by state."""
    width = 360.0 / grid.n_sectors
    edges = grid.ring_edges
    for state, colour in _STATE_COLOURS.items():
        wedges = [
            Wedge(
                (0, 0),
                edges[ring + 1],
                -180 + sector * width,
                -180 + (sector + 1) * width,
                width=edges[ring + 1] - edges[ring],
            )
            for sector, ring in np.argwhere(cells == state)
        ]
        axes.add_collection(
            PatchCollection(wedges, facecolor=colour, edgecolor="white", linewidth=0.3, alpha=alpha)
        )
