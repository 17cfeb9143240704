"""Diagram of the data flow: from readings to wheel speeds, off-road and on flat ground.

``python -m andabata.report.plots.data_flow FILE`` draws it; each box names the module of its step.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from andabata.report.plots.axes import png
from andabata.runs import atomic_io

_WIDTH, _HEIGHT = 1.92, 1.06
"""Size of a box [inches]."""

_COLUMN, _ROW = 2.16, 1.36
"""Distance of the centres of neighbouring boxes [inches]."""

_TOP, _LEFT = 0.34, 0.14
"""Margins around the boxes [inches]."""

_FILLS = {
    "andabata.machine": "#ece8df",
    "andabata.localization": "#d9e8f7",
    "traversability": "#dcefe3",
    "andabata.navigation": "#fcebcb",
}
"""Fill of a box by the package of its module."""

_INK = "#222222"


@dataclass(frozen=True)
class Step:
    """A box of the diagram: one step of the data flow.

    Attributes:
        name: Name of the step.
        text: Description of the step, in lines.
        module: Module that does it.
        column: Column of the box, from the left.
        row: Row of the box, from the top.
    """

    name: str
    text: str
    module: str
    column: int
    row: float

    @property
    def centre(self) -> tuple[float, float]:
        """Centre of the box in inches, from the figure's upper left corner, y upwards."""
        x = _LEFT + _WIDTH / 2 + _COLUMN * self.column
        return x, -(_TOP + _HEIGHT / 2 + _ROW * self.row)


@dataclass(frozen=True)
class Flow:
    """A data flow: steps, and what leads from one to another.

    Attributes:
        title: Line above the boxes.
        steps: Steps by a short key.
        arrows: Keys of the steps at the tail and the head of each arrow.
    """

    title: str
    steps: dict[str, Step]
    arrows: tuple[tuple[str, str], ...]


_PLANNING, _PLANAR = "andabata.navigation.planning", "andabata.navigation.planar"

OFF_ROAD = Flow(
    "Off-road: Navigator.step, once in a control period, for simulator, recording and ROS",
    {
        "robot": Step(
            "Robot", "simulated, recorded,\nor live through ROS", "andabata.machine.simulator", 0, 1
        ),
        "readings": Step(
            "Readings",
            "laser sweeps, IMU, compass,\nwheels, satellites",
            "andabata.machine.sensor_readings",
            0,
            0,
        ),
        "filter": Step(
            "Filter",
            "UKF: pose and track, in\nthe map and in odom",
            "andabata.localization.ukf_localizer",
            1,
            0,
        ),
        "cloud": Step(
            "Cloud",
            "each beam placed by the\npose of its own instant",
            "andabata.navigation.cloud_assembly",
            2,
            0,
        ),
        "cells": Step(
            "Polar cells",
            "32 sectors x 10 rings: a forest\ncalls them free or blocked",
            "traversability.scanner",
            3,
            0,
        ),
        "scan": Step(
            "Virtual scan",
            "free distance in each sector,\nto the first blocked cell",
            "traversability.virtual_scan",
            4,
            0,
        ),
        "ground": Step(
            "Ground cells",
            "0.2 m squares, by trees of\ntheir own; low obstacles",
            f"{_PLANNING}.cartesian_layers",
            2,
            1,
        ),
        "map": Step(
            "Map",
            "occupancy grid in odom:\nremembers what was seen",
            f"{_PLANNING}.occupancy_grid",
            4,
            2,
        ),
        "planner": Step(
            "Planner",
            "shortest path to the goal,\nsub-goal on the path",
            f"{_PLANNING}.grid_planner",
            3,
            2,
        ),
        "controller": Step(
            "Controller",
            "straight to the sub-goal,\nor a policy: a yaw rate",
            "andabata.navigation.policy_controller",
            2,
            2,
        ),
        "rollouts": Step(
            "Rollouts",
            "arcs and turns: the cheapest\nmay replace the command",
            f"{_PLANNING}.trajectory_rollouts",
            1,
            2,
        ),
        "wheels": Step(
            "Wheels",
            "limits, dead zone,\nwheel speeds left and right",
            "andabata.machine.kinematics",
            0,
            2,
        ),
    },
    (
        ("robot", "readings"),
        ("readings", "filter"),
        ("filter", "cloud"),
        ("cloud", "cells"),
        ("cells", "scan"),
        ("cloud", "ground"),
        ("ground", "map"),
        ("scan", "map"),
        ("map", "planner"),
        ("planner", "controller"),
        ("controller", "rollouts"),
        ("rollouts", "wheels"),
        ("wheels", "robot"),
    ),
)
"""The steps of ``Navigator.step`` with a controller that has the planner around it."""

FLAT_GROUND = Flow(
    "On flat ground, in rooms and BARN: PlanarNavigator.act, for a planar laser",
    {
        "readings": Step(
            "Readings",
            "ranges of a planar laser,\nodometry, speeds",
            "andabata.machine.planar.readings",
            0,
            3.3,
        ),
        "hits": Step(
            "Hits",
            "where beams met something;\nbeams that pass clear them",
            f"{_PLANAR}.hit_layer",
            1,
            3.3,
        ),
        "planner": Step(
            "Planner",
            "time to the goal from each\ncell, by the same search",
            f"{_PLANAR}.time_to_go",
            2,
            3.3,
        ),
        "controller": Step(
            "Controller",
            "sampling MPC: many command\nsequences, their best mean",
            f"{_PLANAR}.sampling_mpc",
            3,
            3.3,
        ),
        "vehicle": Step(
            "Wheels",
            "limits, delay, lag and slip of\na differential robot",
            "andabata.machine.planar.vehicle",
            4,
            3.3,
        ),
    },
    (
        ("readings", "hits"),
        ("hits", "planner"),
        ("planner", "controller"),
        ("controller", "vehicle"),
        ("vehicle", "readings"),
    ),
)
"""The steps of the navigator ``mpc``; the others of ``navigation.planar`` replace some of them."""

FLOWS = (OFF_ROAD, FLAT_GROUND)


def data_flow_figure(flows: Sequence[Flow] = FLOWS) -> Figure:
    """Return the diagram of data flows, one above the other.

    Args:
        flows: Flows whose boxes do not overlap.
    """
    steps = [step for flow in flows for step in flow.steps.values()]
    width = 2 * _LEFT + _WIDTH + _COLUMN * max(step.column for step in steps)
    height = 2 * _TOP + _HEIGHT + _ROW * max(step.row for step in steps)
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0, width)
    axes.set_ylim(-height, 0)
    axes.set_axis_off()
    for flow in flows:
        _draw_flow(axes, flow)
    return figure


def _draw_flow(axes: Axes, flow: Flow) -> None:
    """Draw the title, the boxes and the arrows of a flow."""
    top = max(step.centre[1] for step in flow.steps.values()) + _HEIGHT / 2
    axes.text(_LEFT, top + 0.1, flow.title, fontsize=11, weight="bold", color=_INK)
    for step in flow.steps.values():
        _draw_step(axes, step)
    for tail, head in flow.arrows:
        _draw_arrow(axes, flow.steps[tail], flow.steps[head])


def _draw_step(axes: Axes, step: Step) -> None:
    """Draw a box: name, what it does, and the module that does it."""
    x, y = step.centre
    corner = (x - _WIDTH / 2, y - _HEIGHT / 2)
    package = next(name for name in _FILLS if step.module.startswith(name))
    style: dict[str, Any] = {"facecolor": _FILLS[package], "edgecolor": "#777777", "linewidth": 0.9}
    round_ = "round,pad=0,rounding_size=0.08"
    axes.add_patch(FancyBboxPatch(corner, _WIDTH, _HEIGHT, boxstyle=round_, **style))
    centred: dict[str, Any] = {"ha": "center", "va": "center", "color": _INK}
    axes.text(x, y + 0.37, step.name, fontsize=10, weight="bold", **centred)
    axes.text(x, y + 0.10, step.text, fontsize=8, linespacing=1.15, **centred)
    # A long name breaks before its last part.
    lines = ".\n".join(step.module.rsplit(".", 1))
    axes.text(x, y - 0.29, lines, fontsize=7, family="monospace", linespacing=1.1, **centred)


def _draw_arrow(axes: Axes, tail: Step, head: Step) -> None:
    """Draw an arrow between the sides of two boxes.

    Boxes that are no neighbours in a row are joined below the row; those of different rows and
    columns around a corner.
    """
    (x0, y0), (x1, y1) = tail.centre, head.centre
    if tail.row == head.row and abs(tail.column - head.column) > 1:
        low = y0 - _HEIGHT / 2 - 0.18
        corners = [(x0, y0 - _HEIGHT / 2), (x0, low), (x1, low), (x1, y1 - _HEIGHT / 2)]
    elif tail.row == head.row:
        side = _WIDTH / 2 if x1 > x0 else -_WIDTH / 2
        corners = [(x0 + side, y0), (x1 - side, y1)]
    elif tail.column == head.column:
        side = _HEIGHT / 2 if y1 > y0 else -_HEIGHT / 2
        corners = [(x0, y0 + side), (x1, y1 - side)]
    else:
        # Beside the arrow that comes straight down.
        x = x1 - _WIDTH / 4
        corners = [(x0 + _WIDTH / 2, y0), (x, y0), (x, y1 + _HEIGHT / 2)]
    axes.plot(*zip(*corners[:-1], strict=True), color=_INK, linewidth=1.2)
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": _INK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", corners[-1], corners[-2], arrowprops=arrow | {"linewidth": 1.2})


def main(argv: Sequence[str] | None = None) -> None:
    """Write the diagram into the PNG file that the words after the program's name give."""
    parser = argparse.ArgumentParser(
        prog="python -m andabata.report.plots.data_flow", description=__doc__
    )
    parser.add_argument("file", type=Path, help="PNG file to write.")
    atomic_io.write(parser.parse_args(argv).file, png(data_flow_figure(), dpi=150))


if __name__ == "__main__":
    main()
