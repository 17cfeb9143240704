"""Tasks and starts of a world."""

import numpy as np
import pytest

from worlds.world import Start, Task, choose_task, jittered

TASKS = tuple(Task(Start(float(k), 0.0, 0.0), ((1.0, 2.0),)) for k in range(3))


def test_a_task_is_chosen_by_its_number():
    """Numbers count from 0, and there are no negative ones."""
    assert choose_task(TASKS, 2) is TASKS[2]
    for number in (-1, 3):
        with pytest.raises(ValueError, match=f"expected task {number} with a goal, got 3 tasks"):
            choose_task(TASKS, number)


def test_a_random_task_is_any_of_them():
    """Every task is drawn, and a world without tasks is refused."""
    rng = np.random.default_rng(0)
    assert {choose_task(TASKS, rng).start.x for _ in range(50)} == {0.0, 1.0, 2.0}
    with pytest.raises(ValueError, match="got 0 tasks"):
        choose_task((), rng)


def test_a_task_without_goals_is_refused():
    """A drive needs a goal."""
    with pytest.raises(ValueError, match="add goals"):
        choose_task((Task(Start(0.0, 0.0, 0.0), ()),), 0)


def test_jitter_fills_its_bounds_evenly():
    """Offsets are uniform in x, y and yaw, to both sides, up to the stated bounds."""
    rng = np.random.default_rng(1)
    starts = [jittered(Start(5.0, -3.0, 1.0), rng, 0.2, 0.3) for _ in range(2000)]
    offsets = np.array([[s.x - 5.0, s.y + 3.0, s.yaw - 1.0] for s in starts]) / [0.2, 0.2, 0.3]
    assert (np.abs(offsets) <= 1 + 1e-9).all()
    np.testing.assert_allclose(offsets.min(axis=0), -1.0, atol=0.01)
    np.testing.assert_allclose(offsets.max(axis=0), 1.0, atol=0.01)
    np.testing.assert_allclose(offsets.mean(axis=0), 0.0, atol=0.05)


def test_no_jitter_changes_nothing():
    """Bounds of 0 return the start."""
    start = Start(5.0, -3.0, 1.0)
    assert jittered(start, np.random.default_rng(0), 0.0, 0.0) == start
