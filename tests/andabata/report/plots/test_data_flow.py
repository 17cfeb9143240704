"""Diagram of the data flow: modules that exist, arrows that close the loop, text inside its box."""

from importlib.util import find_spec
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import FancyBboxPatch
from PIL import Image

from andabata.navigation.navigator import Navigator
from andabata.report.plots.data_flow import FLAT_GROUND, FLOWS, OFF_ROAD, data_flow_figure, main

STEPS = [step for flow in FLOWS for step in flow.steps.values()]


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.module)
def test_each_box_names_a_module_that_exists(step):
    """A module that was moved or renamed is found out here."""
    assert find_spec(step.module) is not None


def test_titles_name_methods_that_exist():
    """The method that runs each flow."""
    from andabata.machine.planar.readings import PlanarNavigator

    assert "Navigator.step," in OFF_ROAD.title
    assert callable(Navigator.step)
    assert "PlanarNavigator.act," in FLAT_GROUND.title
    assert callable(PlanarNavigator.act)


@pytest.mark.parametrize("flow", FLOWS, ids=lambda flow: flow.title)
def test_a_flow_is_a_loop_through_all_steps(flow):
    """From the readings every step is reached, and from every step the readings again."""
    for arrows in (flow.arrows, [(head, tail) for tail, head in flow.arrows]):
        reached = {"readings"}
        for _ in flow.steps:
            reached |= {head for tail, head in arrows if tail in reached}
        assert reached == set(flow.steps)


@pytest.mark.parametrize("flow", FLOWS, ids=lambda flow: flow.title)
def test_boxes_are_as_many_as_steps_and_say_what_the_steps_say(flow):
    """A box and three texts a step, an arrow a link, and the title."""
    (axes,) = data_flow_figure([flow]).axes
    texts = {text.get_text().replace("\n", "") for text in axes.texts}
    assert sum(isinstance(patch, FancyBboxPatch) for patch in axes.patches) == len(flow.steps)
    assert flow.title in texts
    for step in flow.steps.values():
        assert {step.name, step.text.replace("\n", ""), step.module} <= texts
    assert sum(hasattr(text, "arrow_patch") for text in axes.texts) == len(flow.arrows)


def test_every_text_lies_inside_its_box_or_the_figure():
    """Nothing is cut, and no box covers another."""
    figure = data_flow_figure()
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    boxes = [patch.get_window_extent() for patch in axes.patches]
    for number, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:number])
    for text in (each for each in axes.texts if each.get_text()):
        extent = text.get_window_extent()
        middle = extent.get_points().mean(axis=0)
        (around,) = [box for box in boxes if box.contains(*middle)] or [figure.bbox]
        for corner in extent.get_points():
            assert around.contains(*corner), text.get_text()


def test_arrows_join_the_sides_of_their_boxes():
    """Each begins and ends at a side of its boxes, and passes through none."""
    (axes,) = data_flow_figure().axes
    boxes = [patch.get_bbox() for patch in axes.patches]
    heads = [text.xy for text in axes.texts if hasattr(text, "arrow_patch")]
    tails = [line.get_xydata() for line in axes.lines]
    lines = [np.vstack([tail, head]) for tail, head in zip(tails, heads, strict=True)]
    assert len(lines) == sum(len(flow.arrows) for flow in FLOWS)
    arrows = [(flow.steps[tail], flow.steps[head]) for flow in FLOWS for tail, head in flow.arrows]
    centres = np.array([step.centre for step in STEPS])
    for line, (tail, head) in zip(lines, arrows, strict=True):
        for end, step in ((line[0], tail), (line[-1], head)):
            box = boxes[np.argmin(np.hypot(*(centres - step.centre).T))]
            gap = np.abs(np.abs(end - step.centre) - np.array([box.width, box.height]) / 2)
            assert gap.min() < 1e-9
        for begin, stop in pairwise(line):
            inner = begin + np.linspace(0.01, 0.99, 99)[:, None] * (stop - begin)
            assert not any(box.contains(*place) for box in boxes for place in inner)


def test_the_command_writes_a_png(tmp_path):
    """At 150 pixels an inch."""
    main([str(tmp_path / "flow.png")])
    with Image.open(tmp_path / "flow.png") as picture:
        assert picture.size == pytest.approx(150 * data_flow_figure().get_size_inches(), abs=1)
