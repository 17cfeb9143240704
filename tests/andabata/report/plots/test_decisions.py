"""Pictures of decisions: what was seen, and prices of actions."""

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.navigation.map_crops import NEAR_BEHIND, NEAR_CELL, NEAR_CELLS
from andabata.navigation.map_observation import action_table, map_observations
from andabata.report.plots.axes import png
from andabata.report.plots.decisions import Decision, decisions_figure

ROBOT = RobotModel()
SPEC, TABLE = map_observations(ROBOT, has_subgoal=True), action_table(ROBOT)


def decision(best, taught):
    """Return a decision with a blocked cell ahead to the left, by its cheapest actions."""
    seen = np.zeros(SPEC.size, dtype=np.float32)
    near = np.zeros(SPEC.term("map_near").shape, dtype=np.float32)
    near[0, NEAR_CELLS - 1, NEAR_CELLS - 1] = 1.0
    seen[SPEC.slice_of("map_near")] = near.ravel()
    # 4 m to the left.
    seen[SPEC.slice_of("goal")] = 0.0, 1.0, 0.5
    prices = np.full((2, len(TABLE)), 3.0, dtype=np.float32)
    prices[0, best] = prices[1, taught] = 1.0
    return Decision(seen, prices[0], prices[1])


def test_left_is_left_and_ahead_is_up():
    """Crop, goal and arcs have the same sides."""
    left_arc, right_arc = 6, 0
    figure = decisions_figure([decision(left_arc, right_arc)], SPEC, TABLE, 6.0)
    far, given, wanted = figure.axes[:3]
    image = given.images[0]
    pixels = np.asarray(image.get_array())
    assert pixels[-1, 0, 0] > pixels[-1, 0, 2]
    left, right, bottom, top = image.get_extent()
    half = NEAR_CELLS * NEAR_CELL / 2
    assert (left, right, bottom) == (half, -half, -NEAR_BEHIND)
    assert given.get_xlim() == (half, -half)
    goal = far.lines[0]
    assert (goal.get_xdata()[0], goal.get_ydata()[0]) == pytest.approx((4.0, 0.0), abs=1e-5)
    for axes, side in ((given, 1.0), (wanted, -1.0)):
        thick = max(axes.lines, key=lambda line: line.get_linewidth() * (len(line.get_xdata()) > 1))
        assert thick.get_xdata()[-1] * side > 0.2
        assert thick.get_ydata()[-1] > 0.5
    assert "costs 2.0 s" in given.get_title()
    assert top > bottom


def test_a_turn_on_the_spot_is_marked_and_rows_are_decisions():
    """At its side of the robot; the picture is a file."""
    left_turn = int(np.flatnonzero((TABLE[:, 0] == 0.0) & (TABLE[:, 1] > 0.0))[0])
    figure = decisions_figure([decision(left_turn, 3), decision(3, 3)], SPEC, TABLE, 6.0)
    rings = [line for line in figure.axes[1].lines if line.get_fillstyle() == "none"]
    assert [line.get_xdata()[0] > 0.0 for line in rings] == [True]
    assert len(figure.axes) == 7
    assert png(figure).startswith(b"\x89PNG")
