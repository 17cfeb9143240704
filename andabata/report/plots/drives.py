"""Figures of worlds and drives, drawn without a screen."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LightSource, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray

from andabata.evaluation.offroad import Failure
from andabata.evaluation.trial import OffroadAttempt
from andabata.machine.pose import Pose
from andabata.report.class_colours import PATH_COLOUR, PLAN_COLOUR
from andabata.report.plots.axes import draw_ranges, png
from andabata.report.rendering.camera import Camera
from andabata.report.rendering.scenery import Scenery
from andabata.tasks.episode_monitor import Outcome
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan
from worlds.traversability_map import Reason
from worlds.world import Task, World

_REASON_COLOURS = {
    Reason.FREE: "#00000000",
    Reason.SOLID: "#3b2a20",
    Reason.VEGETATION: "#2f8f5b",
    Reason.SLOPE: "#e69f00",
    Reason.STEP: "#a0410d",
    Reason.BORDER: "#777777",
    Reason.WATER: "#0072b2",
    Reason.LOW: "#8c7ab8",
}
"""Colours of forbidden ground, which the colour-blind tell apart."""

_REASON_WORDS = {
    Reason.SOLID: "solid object",
    Reason.VEGETATION: "high vegetation",
    Reason.SLOPE: "too steep",
    Reason.STEP: "too high a step",
    Reason.BORDER: "border",
    Reason.WATER: "water",
    Reason.LOW: "low object",
}
"""Forbidden ground in words."""

_STAMP_BOX: dict[str, Any] = {"facecolor": "#ffffffcc", "edgecolor": "none", "pad": 1.0}
"""Background of texts on the map."""

_RELIEF = 2.0
"""Factor on heights in the shading of ground, which hides gentle slopes otherwise."""

_WALKER_COLOUR = "#7a2fb5"


def world_figure(world: World) -> Figure:
    """Return a world from above, with the legend of what is drawn, and in perspective."""
    figure = Figure(figsize=(14, 7.6), layout="constrained")
    above, aslant = figure.subplots(1, 2, width_ratios=(1, 1.15))
    _draw_ground(above, world)
    _draw_tasks(above, world.tasks)
    walkers = _draw_movers(above, world)
    above.set_title(f"{world.name} {world.seed} from above: where the robot must not drive")
    aslant.imshow(panorama(world, (900, 740)))
    aslant.set_axis_off()
    aslant.set_title("from the south-west")
    handles = _reason_handles(above, world)
    if world.tasks:
        handles += [
            Line2D([], [], linestyle="", marker="o", color="black", label="start"),
            Line2D([], [], linestyle="", marker="*", color=PLAN_COLOUR, markersize=9, label="goal"),
        ]
    if walkers:
        handles.append(Patch(color=_WALKER_COLOUR, label="walker"))
    figure.legend(handles=handles, loc="outside lower center", ncols=max(len(handles), 1))
    return figure


def _draw_movers(axes: Axes, world: World) -> bool:
    """Draw the walkers that are there at the begin, where they head and the tracks of vehicles.

    Returns:
        True if there are any.
    """
    limits = axes.axis()
    movers = [each for each in world.movers if each.plan.appears_at == 0.0]
    for mover in movers:
        # A person of 0.25 m would be a speck.
        axes.add_patch(Circle(mover.place, max(0.6, mover.plan.radius), color=_WALKER_COLOUR))
        axes.arrow(*mover.place, *(3.0 * np.array(mover.velocity)), color=_WALKER_COLOUR)
        if mover.behaviour is not None and mover.behaviour.track:
            axes.plot(*zip(*mover.behaviour.track, strict=True), ":", color=_WALKER_COLOUR)
    axes.axis(limits)
    return bool(movers)


def panorama(world: World, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the whole of a world in perspective, seen from the south-west.

    Args:
        world: World.
        size: Width and height of the picture [pixels].

    Returns:
        Red, green and blue, shape (height, width, 3).
    """
    reach = max(world.ground.width, world.ground.depth)
    middle = np.array([0.0, 0.0, float(np.median(world.ground.heights))])
    # What is near takes up more of the picture: its middle lies before the world's.
    target = middle + reach * np.array([-0.05, -0.07, 0.0])
    eye = target + reach * np.array([-0.63, -0.89, 0.84])
    camera = Camera.looking_at(eye, target, size)
    scenery = Scenery(world)
    canvas = scenery.view(camera.sampled(2)).canvas(in_haze=False)
    scenery.plants.draw(canvas, in_haze=False)
    return canvas.pixels(2)


def drive_figure(
    world: World,
    path: NDArray[np.float64],
    goals: Sequence[tuple[float, float]],
    title: str,
    others: Mapping[str, NDArray[np.float64]] | None = None,
    walkers: NDArray[np.float64] | None = None,
    stamps: Sequence[tuple[int, str]] = (),
    name: str = "driven",
) -> Figure:
    """Return a drive from above, on the true map.

    Args:
        world: World of the drive.
        path: Positions [m], shape (k, 2) or more columns.
        goals: Goals in order [m].
        title: Title of the picture.
        others: Other paths by name, for comparison.
        walkers: Rows of x, y, z, radius and height of each walker at each second [m], shape
            (t, m, 5).
        stamps: Indices of positions and texts beside them, see ``drive_traces.stamps_of``.
        name: Name of the path.
    """
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.add_subplot()
    _draw_ground(axes, world)
    if walkers is not None and walkers.size:
        _draw_walkers(axes, walkers)
    for other_name, other in (others or {}).items():
        axes.plot(other[:, 0], other[:, 1], linewidth=1.6, label=other_name)
    axes.plot(path[:, 0], path[:, 1], color=PATH_COLOUR, linewidth=2, label=name)
    axes.plot(*path[0, :2], "o", color="black", label="start")
    for number, goal in enumerate(goals, start=1):
        label = "goal" if number == 1 else None
        axes.plot(*goal, "*", color=PLAN_COLOUR, markersize=14, label=label, linestyle="")
        axes.annotate(str(number), goal, textcoords="offset points", xytext=(8, 8))
    around = np.vstack([path[:, :2], np.array(goals)])
    low, high = around.min(axis=0) - 8, around.max(axis=0) + 8
    half, middle = (high - low).max() / 2, (high + low) / 2
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    for step, text in stamps:
        axes.plot(*path[step, :2], "o", color=PATH_COLOUR, markersize=5, markeredgecolor="white")
        offset: dict[str, Any] = {"textcoords": "offset points", "xytext": (7, -3), "fontsize": 8}
        axes.annotate(text, (path[step, 0], path[step, 1]), bbox=_STAMP_BOX, **offset)
    axes.legend(loc="upper right")
    handles = _reason_handles(axes, world)
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)
    axes.set_title(title)
    return figure


def tests_figure(
    world: World, drives: Mapping[str, Sequence[OffroadAttempt]], title: str
) -> Figure:
    """Return drives in one world from above, on the true map, with a cross at each failure.

    Args:
        world: World of the drives.
        drives: Attempts by driver, one for each of the world's first tasks.
        title: Title of the picture.
    """
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.add_subplot()
    _draw_ground(axes, world)
    for name, attempts in drives.items():
        (line,) = axes.plot([], [], linewidth=1.8, label=name)
        for attempt in attempts:
            axes.plot(*attempt.path[:, :2].T, color=line.get_color(), linewidth=1.8)
            if attempt.outcome is not Outcome.GOAL:
                axes.plot(*attempt.path[-1, :2], "x", color=line.get_color(), markersize=11)
        _draw_tasks(axes, world.tasks[: len(attempts)])
    axes.legend(loc="upper right")
    axes.set_title(title)
    return figure


def sights_figure(sights: Mapping[str, tuple[World, Pose, VirtualScan]], grid: PolarGrid) -> Figure:
    """Return virtual scans side by side, each on the true map around its robot.

    Args:
        sights: World, true pose and virtual scan by name.
        grid: Polar grid of the scans.
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
    return figure


def failure_picture(failure: Failure) -> tuple[str, bytes]:
    """Return the picture of a failure, named after world, controller and goal."""
    attempt, detail = failure.attempt, failure.attempt.detail
    name = f"{attempt.scenario}_{detail.world_seed}_{attempt.contender}_goal{detail.goal}"
    title = f"{name}: {attempt.outcome}, {detail.cause}"
    return f"{name}.png", png(failure_figure(failure, title))


def failure_figure(failure: Failure, title: str) -> Figure:
    """Return the place of a failure on the true map, and the virtual scan at that place.

    Args:
        failure: Attempt, with the virtual scan at its end.
        title: Title of the picture.
    """
    figure = Figure(figsize=(16, 8), layout="constrained")
    left, right = figure.subplots(1, 2)
    here, goal, path = failure.pose.position[:2], failure.goal, failure.attempt.path
    for axes, reach in ((left, 1.2 * max(float(np.hypot(*(goal - here))), 15.0)), (right, 6.0)):
        _draw_ground(axes, failure.world)
        axes.plot(path[:, 0], path[:, 1], color=PATH_COLOUR, linewidth=2)
        axes.plot(*goal, "*", color=PLAN_COLOUR, markersize=14)
        if failure.walkers.size:
            _draw_walkers(axes, failure.walkers)
        axes.set_xlim(here[0] - reach, here[0] + reach)
        axes.set_ylim(here[1] - reach, here[1] + reach)
    _draw_sight(right, failure.pose, failure.scan, failure.grid)
    left.set_title(title)
    right.set_title("the last 6 m: forbidden ground in colours, the virtual scan in blue")
    return figure


def _draw_ground(axes: Axes, world: World) -> None:
    """Draw shaded relief and forbidden ground."""
    half_x, half_y = world.ground.width / 2, world.ground.depth / 2
    extent = (-half_x, half_x, -half_y, half_y)
    heights = world.ground.heights.T.astype(np.float64)
    if np.ptp(heights) > 0:
        cell = world.ground.cell
        shade = LightSource(315, 45).hillshade(heights, vert_exag=_RELIEF, dx=cell, dy=cell)
        axes.imshow(shade, origin="lower", extent=extent, cmap="gray", vmin=-0.3, vmax=1.1)
    shown = np.ma.masked_equal(world.truth.reason.T, Reason.FREE)
    colours = ListedColormap([_REASON_COLOURS[reason] for reason in Reason])
    most = len(_REASON_COLOURS) - 1
    axes.imshow(shown, origin="lower", extent=extent, cmap=colours, vmin=0, vmax=most, alpha=0.75)
    axes.set_aspect("equal")
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")


def _reason_handles(axes: Axes, world: World) -> list[Artist]:
    """Return the legend of forbidden ground, of the reasons that axes show."""
    size = np.array([world.ground.width, world.ground.depth])
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    cells = (limits / size[:, None] + 0.5) * np.array(world.truth.reason.shape)[:, None]
    (x0, x1), (y0, y1) = np.maximum(cells, 0).astype(int).tolist()
    shown = world.truth.reason[x0 : x1 + 1, y0 : y1 + 1]
    there = [Reason(value) for value in np.unique(shown)]
    return [
        Patch(color=_REASON_COLOURS[reason], alpha=0.75, label=_REASON_WORDS[reason])
        for reason in there
        if reason is not Reason.FREE
    ]


def _draw_walkers(axes: Axes, walkers: NDArray[np.float64]) -> None:
    """Draw the ways of walkers, and where those who are there at the last second stand then."""
    for number, rows in enumerate(np.moveaxis(walkers, 1, 0)):
        there = rows[:, 3] > 0.0
        x, y = np.where(there, rows[:, :2].T, np.nan)
        label = "walkers" if number == 0 else None
        axes.plot(x, y, color=_WALKER_COLOUR, linewidth=0.9, label=label)
        if there[-1]:
            axes.add_patch(Circle((x[-1], y[-1]), rows[-1, 3], color=_WALKER_COLOUR))


def _draw_tasks(axes: Axes, tasks: Sequence[Task]) -> None:
    """Draw starts and goals."""
    for task in tasks:
        places = np.array([(task.start.x, task.start.y), *task.goals])
        axes.plot(places[:, 0], places[:, 1], ":", color=PLAN_COLOUR, linewidth=0.6)
        axes.plot(*places[0], "o", color="black", markersize=4)
        axes.plot(places[1:, 0], places[1:, 1], "*", color=PLAN_COLOUR, markersize=8)


def _draw_sight(axes: Axes, pose: Pose, scan: VirtualScan, grid: PolarGrid) -> None:
    """Draw a robot and its virtual scan on a map."""
    here = pose.position[:2]
    draw_ranges(axes, scan.ranges, grid, here, pose.yaw)
    axes.plot(*here, marker=(3, 0, np.rad2deg(pose.yaw) - 90), color="black", markersize=14)
