"""Pictures as PNG bytes, drawn without a screen."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.colors import LightSource, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Wedge
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from andabata.app.scanning import Scanned
from andabata.machine.pose import Pose
from andabata.tasks.judge import Outcome
from andabata.tasks.trial import Leg
from terrain.classes import SemanticClass
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.virtual_scan import VirtualScan
from worlds.truth import Reason
from worlds.world import Task, World

_STATE_COLOURS = {
    CellState.EMPTY: "#f4f4f0",
    CellState.TRAVERSABLE: "#58a55c",
    CellState.NON_TRAVERSABLE: "#d1483f",
}
_REASON_COLOURS = {
    Reason.FREE: "#00000000",
    Reason.SOLID: "#3b2a20",
    Reason.VEGETATION: "#4c7f3c",
    Reason.SLOPE: "#d98e32",
    Reason.STEP: "#c9551f",
    Reason.BORDER: "#777777",
    Reason.WATER: "#3f7fc4",
    Reason.LOW: "#7a5a48",
}
_RANGE_COLOUR = "#1540c4"
_UNKNOWN_STYLE: dict[str, Any] = {
    "facecolor": "#9a9a9a30",
    "edgecolor": "#777777",
    "hatch": "///",
    "linewidth": 0,
}
_TERM_COLOURS = {"whole": "black", "attraction": "#2f7d32", "repulsion": "#d1483f"}
"""Of the parts of the reward; ``whole`` is no term, but their sum."""

_CLASS_COLOURS = {
    SemanticClass.TRUNK: "#6b4a2b",
    SemanticClass.FOLIAGE: "#4f8f46",
    SemanticClass.BUSH: "#3f6f38",
    SemanticClass.ROCK: "#7d7d7d",
    SemanticClass.HIGH_GRASS: "#a8bf4f",
    SemanticClass.WALL: "#9a5b45",
    SemanticClass.LAMP: "#c9a227",
    SemanticClass.BENCH: "#b5651d",
    SemanticClass.TABLE: "#b58b5d",
    SemanticClass.BIN: "#37474f",
}


def world_picture(world: World) -> bytes:
    """Return a world from above and in 3D."""
    figure = Figure(figsize=(14, 7), layout="constrained")
    above = figure.add_subplot(1, 2, 1)
    _draw_ground(above, world)
    _draw_tasks(above, world.tasks)
    above.set_title(f"{world.name} {world.seed}: forbidden ground by reason, starts and goals")
    solid = figure.add_subplot(1, 2, 2, projection="3d")
    _draw_solid(solid, world)
    return _png(figure)


def drive_picture(
    world: World,
    path: NDArray[np.float64],
    goals: Sequence[tuple[float, float]],
    title: str,
    others: Mapping[str, NDArray[np.float64]] | None = None,
) -> bytes:
    """Return a drive from above, on the true map.

    Args:
        world: Where.
        path: Positions [m], shape (k, 2) or more columns.
        goals: Goals in order [m].
        title: Above the picture.
        others: Other paths by name, for comparison.
    """
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.add_subplot()
    _draw_ground(axes, world)
    for name, other in (others or {}).items():
        axes.plot(other[:, 0], other[:, 1], linewidth=1.2, linestyle="--", label=name)
    axes.plot(path[:, 0], path[:, 1], color="#d0006f", linewidth=2, label="driven")
    axes.plot(*path[0, :2], "o", color="black")
    for number, goal in enumerate(goals, start=1):
        axes.plot(*goal, "*", color="#0047c8", markersize=14)
        axes.annotate(str(number), goal, textcoords="offset points", xytext=(8, 8))
    around = np.vstack([path[:, :2], np.array(goals)])
    low, high = around.min(axis=0) - 8, around.max(axis=0) + 8
    half, middle = (high - low).max() / 2, (high + low) / 2
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.legend(loc="upper right")
    axes.set_title(title)
    return _png(figure)


def tests_picture(world: World, drives: Mapping[str, Sequence[Leg]], title: str) -> bytes:
    """Return drives in one world from above, on the true map; a cross where one came to grief.

    Args:
        world: Where.
        drives: By who drove, one for each of the world's first tasks.
        title: Above the picture.
    """
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.add_subplot()
    _draw_ground(axes, world)
    for name, legs in drives.items():
        (line,) = axes.plot([], [], linewidth=1.8, label=name)
        for leg in legs:
            axes.plot(*leg.path[:, :2].T, color=line.get_color(), linewidth=1.8)
            if leg.outcome is not Outcome.GOAL:
                axes.plot(*leg.path[-1, :2], "x", color=line.get_color(), markersize=11)
        _draw_tasks(axes, world.tasks[: len(legs)])
    axes.legend(loc="upper right")
    axes.set_title(title)
    return _png(figure)


def sights_picture(sights: Mapping[str, tuple[World, Pose, VirtualScan]], grid: PolarGrid) -> bytes:
    """Return virtual scans side by side, each on the true map around its robot.

    Args:
        sights: Where, the true pose and the scan, by name.
        grid: Of the scans.
    """
    figure = Figure(figsize=(7 * len(sights), 7.4), layout="constrained")
    reach = 1.1 * grid.outer_radius
    places = np.atleast_1d(figure.subplots(1, len(sights)))
    for axes, (name, (world, pose, scan)) in zip(places, sights.items(), strict=True):
        _draw_ground(axes, world)
        _draw_sight(axes, pose, scan, grid)
        axes.set_xlim(pose.position[0] - reach, pose.position[0] + reach)
        axes.set_ylim(pose.position[1] - reach, pose.position[1] + reach)
        axes.set_title(name)
    return _png(figure)


def failure_picture(
    world: World,
    path: NDArray[np.float64],
    goal: NDArray[np.float64],
    pose: Pose,
    scan: VirtualScan,
    grid: PolarGrid,
    title: str,
) -> bytes:
    """Return where a drive failed: what was true, and what the virtual scan showed there.

    Args:
        world: Where.
        path: Positions [m], shape (k, 2) or more columns.
        goal: Where to [m], shape (2,).
        pose: The true pose at the end.
        scan: The last virtual scan.
        grid: Its cells.
        title: Above the picture.
    """
    figure = Figure(figsize=(16, 8), layout="constrained")
    left, right = figure.subplots(1, 2)
    here = pose.position[:2]
    for axes, reach in ((left, 1.2 * max(float(np.hypot(*(goal - here))), 15.0)), (right, 6.0)):
        _draw_ground(axes, world)
        axes.plot(path[:, 0], path[:, 1], color="#d0006f", linewidth=2)
        axes.plot(*goal, "*", color="#0047c8", markersize=14)
        axes.set_xlim(here[0] - reach, here[0] + reach)
        axes.set_ylim(here[1] - reach, here[1] + reach)
    _draw_sight(right, pose, scan, grid)
    left.set_title(title)
    right.set_title("the last 6 m: forbidden ground in colours, the virtual scan in blue")
    return _png(figure)


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
        _draw_ranges(axes, scanned.scan.ranges, grid)
        axes.plot(0, 0, marker=(3, 0, -90), color="black", markersize=10)
        axes.set_aspect("equal")
        axes.set_xlim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
        axes.set_ylim(-grid.outer_radius * 1.05, grid.outer_radius * 1.05)
        axes.set_xlabel("x, forward [m]")
        axes.set_ylabel("y, left [m]")
    right.legend(handles=_range_legend(), loc="upper right", fontsize=9)
    return _png(figure)


def confusion_picture(scores: Mapping[str, Any]) -> bytes:
    """Return a confusion matrix."""
    counts = scores["confusion"]
    matrix = np.array([[counts["tn"], counts["fp"]], [counts["fn"], counts["tp"]]])
    figure = Figure(figsize=(4.5, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(matrix / matrix.sum(axis=1, keepdims=True).clip(min=1), cmap="Greens", vmin=0)
    for (row, column), count in np.ndenumerate(matrix):
        axes.text(column, row, str(count), ha="center", va="center", fontsize=14)
    axes.set_xticks([0, 1], ["called green", "called red"])
    axes.set_yticks([0, 1], ["green", "red"])
    axes.set_title(f"balanced accuracy {scores['balanced_accuracy']:.3f}")
    return _png(figure)


def importance_picture(worth: Mapping[str, float], most: int = 25) -> bytes:
    """Return the features that a forest leans on most; see ``growing.importances``."""
    names = list(worth)[:most][::-1]
    figure = Figure(figsize=(7, 0.25 * len(names) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    axes.barh(names, [worth[name] for name in names], color="#58a55c")
    axes.set_xlabel("cross-entropy lost when the feature is shuffled [nats a cell]")
    return _png(figure)


def learning_picture(history: Sequence[Mapping[str, Any]]) -> bytes:
    """Return success over episodes, stage after stage, and its mean over eight generations.

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
    return _png(figure)


def rewards_picture(histories: Mapping[str, Sequence[Mapping[str, Any]]]) -> bytes:
    """Return the mean reward of a control step over each stage, whole and by term.

    Args:
        histories: Of runs of the same stages, by name: rows with ``name``, ``episodes``,
            ``mean_steps``, ``mean_return`` and ``terms``.
    """
    stages = list(dict.fromkeys(row["name"] for rows in histories.values() for row in rows))
    figure = Figure(figsize=(4.6 * len(stages), 4.2), layout="constrained")
    places = np.atleast_1d(figure.subplots(1, len(stages), sharey=True))
    for axes, stage in zip(places, stages, strict=True):
        for number, history in enumerate(histories.values()):
            rows = [row for row in history if row["name"] == stage]
            episodes = [row["episodes"] for row in rows]
            for term, colour in _TERM_COLOURS.items():
                sums = [row["terms"].get(term, row["mean_return"]) for row in rows]
                means = [sum_ / row["mean_steps"] for sum_, row in zip(sums, rows, strict=True)]
                label = None if number else term
                axes.plot(episodes, means, color=colour, alpha=0.7, linewidth=1.2, label=label)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.set_title(stage)
        axes.set_xlabel("episodes")
    places[0].set_ylabel("mean reward of a control step")
    places[0].legend()
    return _png(figure)


def vehicle_picture(found: Mapping[str, Any]) -> bytes:
    """Return a body's turning and its behaviour on slopes.

    Args:
        found: ``turning`` and ``slopes`` as the vehicle bench gives them, and the ``robot``'s name.
    """
    figure = Figure(figsize=(12, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ground in dict.fromkeys(row["ground"] for row in found["turning"]):
        rows = [row for row in found["turning"] if row["ground"] == ground]
        left.plot([r["rate"] for r in rows], [r["ratio"] for r in rows], "o-", label=ground)
    left.axhspan(0.95, 1.05, color="#58a55c", alpha=0.15)
    left.set_xlabel("commanded yaw rate [rad/s]")
    left.set_ylabel("achieved over commanded")
    left.set_title(f"{found['robot']}: turning")
    left.legend()
    angles = [row["slope_deg"] for row in found["slopes"]]
    for key, name in (
        ("climb_m_s", "climbing"),
        ("slip_m_s", "slipping aside, straight"),
        ("slip_turning_m_s", "slipping aside, turning"),
    ):
        right.plot(angles, [row[key] for row in found["slopes"]], "o-", label=name)
    right.set_xlabel("slope [degrees]")
    right.set_ylabel("speed [m/s]")
    right.set_title("slopes")
    right.legend()
    return _png(figure)


def speed_picture(rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Return PNG bytes of ``bench``: a bar for each runner, on a logarithmic scale.

    Args:
        rows: Of ``andabata.app.speed_bench.race``, those of a kind of work together.
    """
    names = list(dict.fromkeys(row["name"] for row in rows))
    counts = [sum(row["name"] == name for row in rows) for name in names]
    figure = Figure(figsize=(9, 0.42 * len(rows) + 0.75 * len(names)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(names), 1, height_ratios=[c + 0.6 for c in counts]))
    for place, name in zip(axes, names, strict=True):
        group = [row for row in rows if row["name"] == name][::-1]
        values = [row["value"] for row in group]
        colours = ["tab:green" if "andabata" in row["subject"] else "tab:grey" for row in group]
        spread = [[v - row["low"] for v, row in zip(values, group, strict=True)]]
        spread.append([row["high"] - v for v, row in zip(values, group, strict=True)])
        place.barh([row["subject"] for row in group], values, color=colours, xerr=spread)
        place.set_xscale("log")
        place.xaxis.set_minor_formatter(NullFormatter())
        place.set_xlim(min(values) / 3, max(values) * 8)
        for k, row in enumerate(group):
            place.text(row["high"] * 1.1, k, f"{row['value']:.3g}", va="center", fontsize=8)
        place.set_title(f"{name} [{group[0]['unit']}]", fontsize=9, loc="left")
        place.tick_params(labelsize=8)
    return _png(figure)


def _draw_ground(axes: Axes, world: World) -> None:
    """Draw shaded relief and forbidden ground."""
    half_x, half_y = world.ground.width / 2, world.ground.depth / 2
    extent = (-half_x, half_x, -half_y, half_y)
    heights = world.ground.heights.T.astype(np.float64)
    if np.ptp(heights) > 0:
        shade = LightSource(315, 45).hillshade(heights, dx=world.ground.cell, dy=world.ground.cell)
        axes.imshow(shade, origin="lower", extent=extent, cmap="gray", vmin=-0.6, vmax=1.2)
    shown = np.ma.masked_equal(world.truth.reason.T, Reason.FREE)
    colours = ListedColormap([_REASON_COLOURS[reason] for reason in Reason])
    most = len(_REASON_COLOURS) - 1
    axes.imshow(shown, origin="lower", extent=extent, cmap=colours, vmin=0, vmax=most, alpha=0.75)
    axes.set_aspect("equal")
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")


def _draw_tasks(axes: Axes, tasks: Sequence[Task]) -> None:
    """Draw starts and goals."""
    for task in tasks:
        places = np.array([(task.start.x, task.start.y), *task.goals])
        axes.plot(places[:, 0], places[:, 1], ":", color="#0047c8", linewidth=0.6)
        axes.plot(*places[0], "o", color="black", markersize=4)
        axes.plot(places[1:, 0], places[1:, 1], "*", color="#0047c8", markersize=8)


def _draw_solid(axes: Any, world: World) -> None:  # noqa: ANN401 - 3D axes have no types.
    """Draw ground and objects in 3D."""
    stride = max(1, world.ground.heights.shape[0] // 120)
    x, y = np.meshgrid(world.ground.x[::stride], world.ground.y[::stride], indexing="ij")
    axes.plot_surface(
        x, y, world.ground.heights[::stride, ::stride], cmap="gist_earth", alpha=0.7, linewidth=0
    )
    for semantic, colour in _CLASS_COLOURS.items():
        meshes = [thing for thing in world.objects if thing.semantic == semantic]
        if meshes:
            corners = np.concatenate([thing.vertices for thing in meshes])
            axes.scatter(*corners.T, s=0.6, color=colour, label=semantic.name.lower())
    axes.legend(loc="upper left", markerscale=8)
    axes.set_box_aspect((1, world.ground.depth / world.ground.width, 0.3))
    axes.view_init(elev=40, azim=-60)


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


def _draw_ranges(
    axes: Axes,
    ranges: NDArray[np.float32],
    grid: PolarGrid,
    here: Sequence[float] | NDArray[np.float64] = (0.0, 0.0),
    yaw: float = 0.0,
) -> None:
    """Draw the virtual scan of a robot that stands somewhere [m] and looks along ``yaw`` [rad].

    Args:
        axes: Where to draw.
        ranges: Of the virtual scan: infinite ones are free to the last ring, NaN is hatched.
        grid: Cells of the scan.
        here: Position of the robot [m].
        yaw: Heading of the robot [rad].
    """
    half = np.pi / grid.n_sectors
    for bearing, range_ in zip(grid.bearings, ranges, strict=True):
        ends = yaw + bearing - half, yaw + bearing + half
        if np.isnan(range_):
            degrees = np.rad2deg(ends)
            place = (float(here[0]), float(here[1]))
            axes.add_patch(Wedge(place, grid.outer_radius, *degrees, **_UNKNOWN_STYLE))
            continue
        angles, reach = np.linspace(*ends, 6), min(float(range_), grid.outer_radius)
        x, y = here[0] + reach * np.cos(angles), here[1] + reach * np.sin(angles)
        axes.plot(x, y, color=_RANGE_COLOUR, linewidth=2)


def _range_legend() -> list[Artist]:
    """Return the legend of a drawn virtual scan."""
    return [
        Line2D([], [], color=_RANGE_COLOUR, linewidth=2, label="range of the virtual scan"),
        Patch(**_UNKNOWN_STYLE, label="unknown: no cell could be judged"),
    ]


def _draw_sight(axes: Axes, pose: Pose, scan: VirtualScan, grid: PolarGrid) -> None:
    """Draw a robot and its virtual scan on a map."""
    here = pose.position[:2]
    _draw_ranges(axes, scan.ranges, grid, here, pose.yaw)
    axes.plot(*here, marker=(3, 0, np.rad2deg(pose.yaw) - 90), color="black", markersize=14)


def _png(figure: Figure) -> bytes:
    """Return a figure's PNG file."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=80)
    return stream.getvalue()
