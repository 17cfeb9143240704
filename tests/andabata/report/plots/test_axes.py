"""Ranges in pictures: unknown sectors are drawn as unknown, never as free."""

import numpy as np
from matplotlib.figure import Figure

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


def test_the_legend_names_ranges_and_unknown_sectors():
    """The legend has ranges and unknown sectors."""
    assert [entry.get_label() for entry in range_legend()] == [
        "range of the virtual scan",
        "unknown: no cell could be classified",
    ]
