"""Figures of motion over time, and stamps along a path."""

import numpy as np

from andabata.report.plots.drive_traces import headings_figure, motion_figure, stamps_of, trace_of


def trace(rows=4):
    """Return a trace that turns through the back."""
    names = ["time_s", "yaw_rad", "yaw_rate_rad_s", "speed_m_s", "pose_error_m"]
    yaw = (np.linspace(3.0, 3.6, rows) + np.pi) % (2 * np.pi) - np.pi
    data = [[0.5 * k, angle, 0.1, 0.3, 0.02] for k, angle in enumerate(yaw)]
    return trace_of({"columns": names, "rows": data})


def test_headings_go_on_through_the_back():
    """There is no jump at 180 degrees."""
    (axes,) = headings_figure({"a": trace(), "b": trace(2)}).axes
    x, y = axes.lines[0].get_data()
    np.testing.assert_allclose(x, [0, 0.5, 1, 1.5])
    np.testing.assert_allclose(y, np.rad2deg(np.linspace(3.0, 3.6, 4)))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a", "b"]


def test_motion_has_three_panels_with_units():
    """Yaw rate, speed and the error of the position."""
    places = motion_figure({"a": trace()}).axes
    units = [axes.get_ylabel().rpartition("[")[2] for axes in places]
    assert units == ["rad/s]", "m/s]", "m]"]
    assert [axes.lines[0].get_ydata()[0] for axes in places] == [0.1, 0.3, 0.02]


def test_stamps_tell_time_and_distance():
    """Each ten seconds; the last one keeps clear of the end of the path."""
    path = np.column_stack([0.03 * np.arange(250), np.zeros(250)])
    assert stamps_of(path, 0.1, 10.0) == [(100, "10 s, 3 m"), (200, "20 s, 6 m")]
    assert stamps_of(path[:120], 0.1, 10.0) == []
    assert stamps_of(path[:1], 0.1, 10.0) == []
