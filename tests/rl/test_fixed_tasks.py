"""Tests on fixed tasks: scores by hand, seeds of no run."""

import numpy as np
import pytest

from rl.fixed_tasks import fixed_task_figures, fixed_tasks
from rl.training import Episode


def episode(is_success, steps):
    nothing = np.zeros((1, 1), np.float32)
    return Episode(nothing, nothing, np.zeros(1), nothing[0], True, "x", is_success, steps)


def test_the_score_is_equation_5():
    """A success scores 1 - 0.001 T, any failure -1, and the score is their sum."""
    figures = fixed_task_figures([episode(True, 40), episode(False, 400), episode(True, 100)])
    assert figures.score == pytest.approx(0.96 - 1 + 0.9)
    assert (figures.successes, figures.mean_steps) == (2, 70)
    assert figures.steps == (40, None, 100)
    nothing = fixed_task_figures([episode(False, 9)])
    assert (nothing.score, nothing.successes, nothing.mean_steps) == (-1.0, 0, None)


def test_each_task_has_a_seed_of_its_own():
    """Seeds differ from task to task, and are none of training's or validation's."""
    tasks = fixed_tasks(4, 16)
    assert [one.task for one in tasks] == list(range(16))
    states = {np.random.default_rng(one.seed).bytes(8) for one in tasks}
    assert len(states) == 16
    for seed in ((0, 0, 3), (0, 0, 3, 0, 0, 3)):
        assert np.random.default_rng(seed).bytes(8) not in states
