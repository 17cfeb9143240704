"""Figure of what a robot believed: errors in their bands, health behind them, unused readings."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from andabata.localization.localizer import Health
from andabata.report.class_colours import HEALTH_COLOURS
from andabata.report.plots.drive_estimate import estimate_figure, has_estimate


def trace():
    """Return three seconds, the last two degraded, with an error of 0.3 m and -5 degrees."""
    ones = np.ones(6)
    return {
        "time_s": 0.5 * np.arange(6),
        "pose_error_m": 0.3 * ones,
        "position_sigma_m": 0.4 * ones,
        "yaw_error_rad": np.deg2rad(-5.0) * ones,
        "yaw_sigma_rad": np.deg2rad(4.0) * ones,
        "health": np.array([0, 0, 1, 1, 1, 1.0]),
        "unused compass: beyond the gate": np.array([0, 0, 1, 5, 9, 9.0]),
    }


def test_errors_stand_in_their_bands_of_two_sigma():
    """The position's band begins at zero, the heading's is symmetric, in degrees."""
    position, heading, _ = estimate_figure(trace()).axes
    assert position.lines[0].get_ydata()[0] == 0.3
    assert heading.lines[0].get_ydata()[0] == pytest.approx(-5.0)
    for axes, band in ((position, (0.0, 0.8)), (heading, (-8.0, 8.0))):
        heights = axes.collections[0].get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == pytest.approx(band)


def test_times_that_were_not_ok_are_coloured_and_named():
    """From the first row that was degraded to the end, in all panels."""
    figure = estimate_figure(trace())
    for axes in figure.axes:
        (span,) = axes.patches
        assert (span.get_x(), span.get_width()) == (1.0, 1.5)
        assert to_hex(span.get_facecolor()) == HEALTH_COLOURS[Health.DEGRADED]
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert names == ["2 sigma", "true error", "degraded"]


def test_unused_readings_have_a_line_for_each_reason():
    """Their name is that of sensor and reason."""
    unused = estimate_figure(trace()).axes[2]
    assert [line.get_label() for line in unused.lines] == ["compass: beyond the gate"]
    assert unused.lines[0].get_ydata()[-1] == 9


def test_a_trace_of_an_earlier_version_has_no_estimate():
    """Its report leaves the section out."""
    assert has_estimate(trace())
    old = {name: trace()[name] for name in ("time_s", "pose_error_m")}
    assert not has_estimate(old)
