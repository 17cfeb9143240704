"""Figures of evaluations: where rates, paths and scores are drawn."""

import numpy as np

from andabata.report.plots import evaluation


def row(goal, rate, controller="gap", world="hill"):
    """Return a row of a summary."""
    ends = {"wilson_low": rate - 0.1, "wilson_high": rate + 0.1}
    return {"controller": controller, "world": world, "goal": goal, "success_rate": rate} | ends


def test_goals_have_rates_with_intervals_and_the_papers_beside():
    """Controllers stand side by side; the row of all goals is left out."""
    rows = [row(1, 0.8), row(2, 0.5), row("all", 0.5), row(1, 0.9, "mpc"), row(2, 0.7, "mpc")]
    figure = evaluation.goals_figure(rows, {"hill": {"Actor NN": (0.98, 0.9)}})
    (axes,) = figure.axes
    lines = {line.get_label(): line.get_data() for line in axes.lines}
    np.testing.assert_allclose(lines["gap"], [[0.96, 1.96], [0.8, 0.5]])
    np.testing.assert_allclose(lines["mpc"], [[1.04, 2.04], [0.9, 0.7]])
    np.testing.assert_allclose(lines["paper: Actor NN"], [[1, 2], [0.98, 0.9]])
    intervals = [line.get_ydata().tolist() for line in axes.lines if len(line.get_xdata()) == 2]
    assert [0.7000000000000001, 0.9] in intervals


def test_success_is_counted_by_difficulty():
    """Five ranges up to the hardest world; a range without worlds has no point."""
    trials = [
        {"controller": "gap", "difficulty": difficulty, "success": success}
        for difficulty, success in ((0.0, True), (0.15, False), (0.5, True), (0.5, True))
    ]
    (axes,) = evaluation.difficulty_figure(trials, ["gap"]).axes
    (line,) = [line for line in axes.lines if line.get_label() == "gap"]
    np.testing.assert_allclose(line.get_xdata(), [0.05, 0.15, 0.45])
    np.testing.assert_allclose(line.get_ydata(), [1.0, 0.0, 1.0])


def test_paths_begin_at_the_origin_and_lead_ahead():
    """A goal in the north is ahead; the marker tells the end."""
    trial = {"path": [[5.0, 5.0], [4.0, 7.0]], "goal_xy": [5.0, 9.0], "outcome": "collision"}
    (axes,) = evaluation.paths_figure({"gap": [trial]}, "title").axes
    path, end, start = axes.lines
    np.testing.assert_allclose(path.get_data(), [[0, 2], [0, 1]], atol=1e-12)
    np.testing.assert_allclose(np.ravel(end.get_data()), [2, 1], atol=1e-12)
    assert end.get_marker() == evaluation.ENDS["collision"][0]
    assert np.ravel(start.get_data()).tolist() == [0, 0]


def test_times_rise_to_the_share_that_arrived():
    """Failures have no time, and keep the curve below one."""
    runs = {"gap": [{"ratio": 2.0}, {"ratio": None}, {"ratio": 1.5}, {"ratio": 4.0}]}
    line = evaluation.barn_figure(runs).axes[0].lines[0]
    np.testing.assert_allclose(line.get_data(), [[1.5, 2.0, 4.0], [0.25, 0.5, 0.75]])


def test_scores_stand_beside_the_ratio_of_times():
    """A navigator has two dots; one without an interval has no bar."""
    found = {"score": 0.4, "score_low": 0.35, "score_high": 0.45}
    found |= {"ot_over_t": 0.8, "ot_over_t_low": None, "ot_over_t_high": None}
    axes = evaluation.scores_figure([{"controller": "gap"} | found]).axes[0]
    shown = [np.ravel(line.get_xdata()).tolist() for line in axes.lines]
    assert shown[:3] == [[0.4], [0.35, 0.45], [0.8]]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["gap"]
