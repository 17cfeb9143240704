"""Figures as SVG: whole files, and parts of a page that take its colours and tell their values."""

import io
import re
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from andabata.report.plots.axes import save

_DPI = 72
"""Number of SVG units in an inch."""

_IMAGE_DPI = 110
"""Resolution of images in a figure [1/inch]."""

_SETTINGS: dict[str, Any] = {
    # Text stays text: it is found by a search, and takes a tenth of the bytes.
    "svg.fonttype": "none",
    # Corners of a line that are nearer than half a unit to the straight one are left out.
    "path.simplify_threshold": 0.5,
}

_INK = ("#000000", "#222222", "#444444")
"""Colours that are the ink of the page, light on a dark one."""

_PAPER = "#ffffff"

_FEWEST = 2
"""Least number of corners of a line whose values are told."""


class InlineFigure(NamedTuple):
    """A figure for a page.

    Attributes:
        markup: SVG element without references to anything outside of the page.
        axes: Axes with their box in units of the SVG, limits, labels and lines, ready for JSON.
    """

    markup: str
    axes: list[dict[str, Any]]


def svg(figure: Figure, name: str) -> bytes:
    """Return a figure's SVG file; the same figure and name give the same bytes.

    Args:
        figure: Figure.
        name: Name of the figure, from which the ids of its parts are made.
    """
    stream = io.BytesIO()
    with matplotlib.rc_context(_SETTINGS | {"svg.hashsalt": name}):
        save(figure, stream, format="svg", dpi=_IMAGE_DPI, metadata={"Date": None})
    return stream.getvalue()


def inline_figure(figure: Figure, name: str, light: bool = False) -> InlineFigure:
    """Return a figure as a part of a page: ids of its own, and the page's ink and paper.

    Args:
        figure: Figure, whose lines get ids.
        name: Name of the figure, unique on the page: letters, digits and hyphens.
        light: True to keep its own colours, as those of a map are.
    """
    lines = [_named_lines(axes, number) for number, axes in enumerate(figure.axes)]
    text = svg(figure, name).decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = text.replace("xlink:href", "href")
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = text.replace("url(#", f"url(#{name}-").replace('href="#', f'href="#{name}-')
    if not light:
        for colour in _INK:
            text = text.replace(colour, "currentColor")
        text = text.replace(_PAPER, "var(--paper)")
    # The page gives the size.
    text = re.sub(r'(<svg[^>]*?)\swidth="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?)\sheight="[^"]*"', r"\1", text, count=1)
    return InlineFigure(text, _boxes(figure, lines, name))


def _named_lines(axes: Axes, number: int) -> list[dict[str, str]]:
    """Give the lines of axes ids, and return these with the labels."""
    found = []
    for k, line in enumerate(axes.lines):
        if len(np.ravel(line.get_xdata())) < _FEWEST:
            continue
        line.set_gid(f"line-{number}-{k}")
        label = str(line.get_label())
        found.append({"id": f"line-{number}-{k}", "label": "" if label[:1] == "_" else label})
    return found


def _boxes(figure: Figure, lines: list[list[dict[str, str]]], name: str) -> list[dict[str, Any]]:
    """Return the axes with linear scales: where they are in the SVG, and what they show.

    The figure has been drawn: places of its axes are final.
    """
    width, height = figure.get_figwidth() * _DPI, figure.get_figheight() * _DPI
    found = []
    for axes, named in zip(figure.axes, lines, strict=True):
        if axes.name != "rectilinear" or {axes.get_xscale(), axes.get_yscale()} != {"linear"}:
            continue
        extent = axes.get_position()
        box = (
            width * extent.x0,
            height * (1 - extent.y1),
            width * extent.x1,
            height * (1 - extent.y0),
        )
        found.append(
            {
                "box": [round(float(value), 2) for value in box],
                "x": [float(value) for value in axes.get_xlim()],
                "y": [float(value) for value in axes.get_ylim()],
                "xlabel": axes.get_xlabel(),
                "ylabel": axes.get_ylabel(),
                "lines": [one | {"id": f"{name}-{one['id']}"} for one in named],
            }
        )
    return found
