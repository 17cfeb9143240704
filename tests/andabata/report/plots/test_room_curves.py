"""Pictures of learning in rooms and of studies of a laser."""

import numpy as np
from matplotlib.colors import to_hex

from andabata.report.plots import room_curves
from andabata.report.plots.room_curves import LearningCurves, SuccessCurves


def test_curves_are_means_over_the_seeds_with_their_range():
    """A panel a room and one for the sum; the area reaches from the lowest to the highest seed."""
    scores = np.array([[[1.0, -2.0], [2.0, 2.0]], [[3.0, -4.0], [2.0, 3.0]]])
    curves = {"K = 20": LearningCurves(np.array([5000, 10000]), scores)}
    figure = room_curves.learning_curves_figure(curves, ["a", "b"], [4, 4])
    a, b, every = figure.axes
    assert [axes.get_title() for axes in (a, b, every)] == ["a", "b", "all rooms"]
    for axes, mean, low, high in (
        (a, [2, 2], [1, 2], [3, 2]),
        (b, [-3, 2.5], [-4, 2], [-2, 3]),
        (every, [-1, 4.5], [-1, 4], [-1, 5]),
    ):
        np.testing.assert_allclose(axes.lines[0].get_data(), [[5, 10], mean])
        (area,) = axes.collections
        corners = area.get_paths()[0].vertices
        for x, bottom, top in zip((5, 10), low, high, strict=True):
            there = corners[np.isclose(corners[:, 0], x), 1]
            assert (there.min(), there.max()) == (bottom, top)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["K = 20"]


def test_success_is_shown_over_episodes_and_over_steps():
    """The same means stand on both axes, which begin with the training."""
    rates = np.array([[0.2, 0.8], [0.4, 1.0]])
    curves = {"td3": SuccessCurves(np.array([100.0, 200.0]), np.array([5e3, 9e3]), rates)}
    figure = room_curves.success_figure(curves, "title")
    for axes, amounts in zip(figure.axes, ([100, 200], [5, 9]), strict=True):
        np.testing.assert_allclose(axes.lines[0].get_data(), [amounts, [0.3, 0.9]])
        assert axes.get_xlim()[0] == 0
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["td3"]
    papers = [line.get_ydata()[0] for line in figure.axes[0].lines[1:]]
    assert papers == [0.9712, 0.8478]  # Fig. 4a: the improved TD3's and GDAE's.


def change(text, mean, low, high):
    found = {"difference": mean, "difference_low": low, "difference_high": high}
    return {"text": text, "success_rate": 0.8, **found}


def test_differences_are_coloured_by_their_intervals():
    """Green and red where the interval leaves zero out, grey where it holds it; in points."""
    rows = [
        change("as it is", None, None, None),
        change("up", 0.05, 0.01, 0.09),
        change("down", -0.05, -0.09, -0.01),
        change("same", 0.0, -0.02, 0.02),
    ]
    figure = room_curves.study_figure(rows, "title")
    (axes,) = figure.axes
    bars, dots = axes.lines[0:6:2], axes.lines[1:6:2]
    colours = [to_hex(bar.get_color()) for bar in bars]
    assert colours == [room_curves._BETTER, room_curves._WORSE, room_curves._UNCLEAR]
    np.testing.assert_allclose([dot.get_xdata()[0] for dot in dots], [5, -5, 0])
    np.testing.assert_allclose(bars[0].get_xdata(), [1, 9])
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels == ["up   80.0 %", "down   80.0 %", "same   80.0 %"]
