"""Pictures of training runs."""

import numpy as np

from andabata.report.plots import training


def test_stages_follow_each_other_with_a_mean_over_eight_updates():
    """Episodes go on from stage to stage; the mean is over the last eight updates at most."""
    rates = [1.0] + [0.0] * 9
    rows = [{"name": "A", "episodes": k + 1, "success_rate": r} for k, r in enumerate(rates)]
    rows.append({"name": "B", "episodes": 4, "success_rate": 0.5})
    figure = training.learning_figure(rows)
    (axes,) = figure.axes
    single, mean, later, _ = [np.array(line.get_data()) for line in axes.lines]
    np.testing.assert_allclose(single[1], rates)
    np.testing.assert_allclose(mean[1], [*(1 / np.arange(1, 9)), 0, 0])
    np.testing.assert_allclose(later, [[14], [0.5]])


def test_rewards_are_means_of_a_control_step():
    """The whole and each term are divided by the steps; a stage has axes of its own."""
    row = {"name": "A", "episodes": 2, "mean_steps": 4.0, "mean_return": 8.0}
    row["terms"] = {"attraction": 10.0, "repulsion": -2.0}
    other = row | {"name": "B", "mean_return": -4.0}
    figure = training.rewards_figure({"seed 0": [row, other], "seed 1": [row]})
    first, second = figure.axes
    assert (first.get_title(), second.get_title()) == ("A", "B")
    heights = [float(np.ravel(line.get_ydata())[0]) for line in first.lines[:3]]
    assert heights == [2.0, 2.5, -0.5]
    assert float(np.ravel(second.lines[0].get_ydata())[0]) == -1.0
    legend = [text.get_text() for text in first.get_legend().get_texts()]
    assert legend == ["whole", "attraction", "repulsion"]


def test_terms_of_other_rewards_are_drawn_in_their_own_runs():
    """Each with a colour of its own; a run has no line of a term that it has not."""
    row = {"name": "A", "episodes": 2, "mean_steps": 4.0, "mean_return": 8.0}
    paper = row | {"terms": {"attraction": 10.0, "repulsion": -2.0, "collision": -1.0}}
    own = row | {"terms": {"near": 4.0, "calm": -8.0}}
    (axes,) = training.rewards_figure({"a": [paper], "b": [own]}).axes
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["whole", "attraction", "repulsion", "near", "calm"]
    heights = [float(np.ravel(line.get_ydata())[0]) for line in axes.lines[:6]]
    assert heights == [2.0, 2.5, -0.5, 2.0, 1.0, -2.0]
    assert len({line.get_color() for line in axes.lines[:6]}) == 5
