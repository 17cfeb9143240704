"""Ranges in pictures: unknown sectors are drawn as unknown, never as free."""

import io

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from andabata.report.plots.axes import draw_ranges, png, range_legend
from traversability.grid import PolarGrid


def test_unknown_sectors_are_hatched_and_have_no_arc():
    """An unknown sector is a hatched wedge without an arc."""
    grid = PolarGrid(n_sectors=4)
    axes = Figure().add_subplot()
    ranges = np.array([np.nan, np.inf, 3.0, np.nan], dtype=np.float32)
    draw_ranges(axes, ranges, grid)
    assert [patch.get_hatch() for patch in axes.patches] == ["///", "///"]
    assert [(wedge.theta1, wedge.theta2) for wedge in axes.patches] == [(-180, -90), (90, 180)]
    reach = [np.hypot(*line.get_data()) for line in axes.lines]
    np.testing.assert_allclose([reach[0][0], reach[1][0]], [10.0, 3.0])


def test_any_name_is_drawn():
    """Lone surrogates, and letters that the font lacks, raise neither errors nor warnings."""
    figure = Figure(figsize=(2, 1), layout="constrained")
    figure.add_subplot().set_title("\udcf1 点")
    assert png(figure).startswith(b"\x89PNG")
    assert figure.axes[0].get_title() == "\ufffd 点"


def test_the_legend_names_what_is_drawn():
    """Ranges, and unknown sectors, where there are some."""
    known, unknown = "virtual scan: free up to here", "unknown sector: no cell could be classified"
    for ranges, texts in (
        ([1.0, np.inf], [known]),
        ([1.0, np.nan], [known, unknown]),
        ([np.nan, np.nan], [unknown]),
    ):
        entries = range_legend(np.array(ranges, dtype=np.float32))
        assert [entry.get_label() for entry in entries] == texts


def test_a_picture_has_the_resolution_that_is_asked_for():
    """Pixels are inches times the resolution."""
    for dpi in (80, 150):
        with Image.open(io.BytesIO(png(Figure(figsize=(2, 1)), dpi))) as picture:
            assert picture.size == (2 * dpi, dpi)
