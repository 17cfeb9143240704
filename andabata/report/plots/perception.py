"""Figures of virtual scans and classifiers, drawn without a screen."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Wedge
from numpy.typing import NDArray

from andabata.report.class_colours import BLOCKED_COLOUR, FREE_COLOUR, UNKNOWN_COLOUR
from andabata.report.plots.axes import draw_ranges, range_legend
from andabata.scanning.scan import Scanned
from traversability.grid import PolarGrid
from traversability.labels import CellState

if TYPE_CHECKING:  # Only named: it imports what makes clouds.
    from andabata.bench.fields import FieldClassification

_STATE_COLOURS = {
    CellState.TRAVERSABLE: FREE_COLOUR,
    CellState.NON_TRAVERSABLE: BLOCKED_COLOUR,
    CellState.EMPTY: UNKNOWN_COLOUR,
}

_STATE_WORDS = {
    CellState.TRAVERSABLE: "free",
    CellState.NON_TRAVERSABLE: "blocked",
    CellState.EMPTY: "unknown: too few points",
}
"""States of cells in the glossary's words."""

_ALPHA = 0.7
"""Opacity of cells under points."""


def scan_figure(scanned: Scanned, title: str) -> Figure:
    """Return a cloud from above, its cells by state and the virtual scan on it."""
    figure = Figure(figsize=(13, 6.3), layout="constrained")
    left, right = figure.subplots(1, 2)
    points, grid = scanned.cloud.points, scanned.grid
    near = (np.hypot(points[:, 0], points[:, 1]) < 1.05 * grid.outer_radius) & (
        points[:, 2] < grid.max_height
    )
    dots = left.scatter(
        *points[near, :2].T, c=points[near, 2], s=3, cmap="viridis", linewidths=0, vmin=-1, vmax=1
    )
    figure.colorbar(dots, ax=left, label="height above the base plane [m]", shrink=0.7)
    left.set_title(f"{title}: points below {grid.max_height} m", parse_math=False)
    _draw_cells(right, scanned.cells, grid, alpha=_ALPHA)
    right.scatter(*points[near, :2].T, s=0.6, color="black", alpha=0.5, linewidths=0)
    right.set_title("polar cells and virtual scan")
    for axes in (left, right):
        draw_ranges(axes, scanned.scan.ranges, grid)
        _frame_robot(axes, grid)
    handles = [*_state_legend(scanned.cells, _ALPHA), *range_legend(scanned.scan.ranges)]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=10)
    return figure


def importance_figure(importances: Mapping[str, float], most: int = 25) -> Figure:
    """Return the most important features of a forest.

    Args:
        importances: Importance by feature, see ``forest_training.importances``, the largest first.
        most: Number of features that are shown.
    """
    names = list(importances)[:most][::-1]
    figure = Figure(figsize=(7, 0.25 * len(names) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    axes.barh(names, [importances[name] for name in names], color=FREE_COLOUR)
    axes.set_xlabel("cross-entropy lost when the feature is shuffled [nats a cell]")
    return figure


def labelled_figure(
    points: NDArray[np.float32],
    blocked: NDArray[np.bool_],
    cells: NDArray[np.uint8],
    grid: PolarGrid,
    title: str,
) -> Figure:
    """Return a labelled cloud from above and its cells (Sanchez et al. 2023, Fig. 3).

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        blocked: True for points that are not traversable, shape (n,).
        cells: State of each cell by the labels, shape (n_sectors, n_rings).
        grid: Polar grid of the cells.
        title: Title of the figure.
    """
    figure = Figure(figsize=(12, 6.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    near = np.hypot(points[:, 0], points[:, 1]) < 1.05 * grid.outer_radius
    for chosen, state in (
        (~blocked, CellState.TRAVERSABLE),
        (blocked, CellState.NON_TRAVERSABLE),
    ):
        x, y = points[near & chosen, :2].T
        left.scatter(x, y, s=1.0, color=_STATE_COLOURS[state], linewidths=0)
    left.set_title(f"{title}: points by their labels", parse_math=False)
    _draw_cells(right, cells, grid, alpha=0.9)
    right.set_title("polar cells by their labels")
    for axes in (left, right):
        _frame_robot(axes, grid)
    handles = _state_legend(cells, 0.9)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=10)
    return figure


def fields_figure(examples: "Mapping[str, FieldClassification]", grid: PolarGrid) -> Figure:
    """Return one case of each kind of the field suite: from the side, by the labels, as called.

    Args:
        examples: Cells of the cases by kind.
        grid: Polar grid of the cells.
    """
    figure = Figure(figsize=(13, 3.0 * len(examples)), layout="constrained")
    for axes, (kind, example) in zip(
        figure.subplots(len(examples), 3), examples.items(), strict=True
    ):
        side, truth, called = axes
        # From the side: the sector pair that looks towards the middle of the field.
        bearing = grid.bearings[np.argmin(np.abs(example.bearings))]
        x, y, z = example.points.T
        along = x * np.cos(bearing) + y * np.sin(bearing)
        strip = (np.abs(y * np.cos(bearing) - x * np.sin(bearing)) < 0.5) & (along > 0)
        side.scatter(along[strip], z[strip], s=1.5, color="#444444", linewidths=0)
        side.set_xlim(0, grid.outer_radius)
        side.set_ylim(-1.0, 1.5)
        side.set_xlabel("ahead [m]")
        side.set_ylabel("height [m]")
        caption = f"{kind}, {example.case.sensor} at {example.case.height:.2f} m"
        field = example.case.field
        side.set_title(caption if field is None else f"{caption}, plants of {field.height:.2f} m")
        for panel, cells, title in (
            (truth, example.truth, "labels"),
            (called, example.called, "as called"),
        ):
            _draw_cells(panel, cells, grid, alpha=0.9)
            panel.set_title(title)
            panel.set_aspect("equal")
    return figure


def confusions_figure(confusions: Mapping[str, Mapping[str, int]]) -> Figure:
    """Return confusion matrices side by side.

    Args:
        confusions: Counts ``tp``, ``tn``, ``fp`` and ``fn`` by title.
    """
    figure = Figure(figsize=(4.2 * len(confusions), 3.6), layout="constrained")
    places = figure.subplots(1, len(confusions), squeeze=False)[0]
    for axes, (title, counts) in zip(places, confusions.items(), strict=True):
        _draw_confusion(axes, counts)
        axes.set_title(title)
    return figure


def bands_figure(bands: Mapping[str, Mapping[str, float]]) -> Figure:
    """Return scores of ground cells by distance.

    Args:
        bands: Scores by name of the band.
    """
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    axes = figure.add_subplot()
    scores = (
        ("balanced_accuracy", "balanced accuracy", "#1e78c8"),
        ("precision", "precision", "#e08a1e"),
        ("recall", "recall", "#d0006f"),
    )
    for name, text, colour in scores:
        axes.plot(
            list(bands), [band[name] for band in bands.values()], "o-", label=text, color=colour
        )
    axes.set_ylim(0, 1.03)
    axes.set_xlabel("distance from the robot")
    axes.grid(axis="y", alpha=0.25)
    axes.legend()
    return figure


def _frame_robot(axes: Axes, grid: PolarGrid) -> None:
    """Draw the robot in the middle, and show the polar grid around it with equal scales."""
    axes.plot(0, 0, marker=(3, 0, -90), color="black", markersize=10)
    axes.set_aspect("equal")
    axes.set_xlim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
    axes.set_ylim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
    axes.set_xlabel("x, forward [m]")
    axes.set_ylabel("y, left [m]")


def _state_legend(cells: NDArray[np.uint8], alpha: float) -> list[Artist]:
    """Return the legend of the states that cells have."""
    there = np.unique(cells)
    return [
        Patch(facecolor=colour, edgecolor="#999999", alpha=alpha, label=_STATE_WORDS[state])
        for state, colour in _STATE_COLOURS.items()
        if state in there
    ]


def _draw_confusion(axes: Axes, counts: Mapping[str, int]) -> None:
    """Draw a confusion matrix, the truth by row."""
    matrix = np.array([[counts["tn"], counts["fp"]], [counts["fn"], counts["tp"]]])
    shares = matrix / matrix.sum(axis=1, keepdims=True).clip(min=1)
    axes.imshow(shares, cmap="Greens", vmin=0, vmax=1.4)
    for (row, column), count in np.ndenumerate(matrix):
        axes.text(column, row, f"{count}\n{shares[row, column]:.0%}", ha="center", va="center")
    axes.set_xticks([0, 1], ["called free", "called blocked"])
    axes.set_yticks([0, 1], ["free", "blocked"])


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
